"""Magic Formula 6.0, 6.1 and 6.2, steady state: Fx, Fy, Mz, pure and combined, with pressure.

Numbers in parentheses are the equations of Pacejka, Tire and Vehicle Dynamics, 3rd ed. (2012),
section 4.3.2. Forward rolling without turn slip (all zeta = 1) on a road of friction scaling LMUX,
LMUY; no slip-speed dependence (4.E7). Small differences to other programs, on purpose: no trail
factor LFZO beyond (4.E42), and curvature factors above 1 are flagged, not clamped. 6.2 is evaluated
as 6.1: what it adds concerns the vertical load, overturning and rolling moments.
"""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from tirelib.arrays import FloatArray
from tirelib.brush.mf_tire import Inputs, MagicForces, MagicTire, check_inputs
from tirelib.errors import ParameterError

DEGRESSIVE = 10.0
"""A_mu of (4.E8): keeps the shifts alive on slippery ground."""
TINY = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class _Long:
    Fxo: FloatArray
    K: FloatArray
    mu: FloatArray
    E: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class _Lat:
    Fyo: FloatArray
    K: FloatArray
    mu: FloatArray
    E: FloatArray
    BC: FloatArray
    SH: FloatArray
    SV: FloatArray


def magic_forces_6(
    tire: MagicTire,
    load: npt.ArrayLike,
    slip_angle: npt.ArrayLike,
    slip_ratio: npt.ArrayLike = 0.0,
    camber: npt.ArrayLike = 0.0,
    pressure: npt.ArrayLike | None = None,
    *,
    combined: bool = True,
) -> MagicForces:
    """Evaluate the Magic Formula 6.1.

    Parameters
    ----------
    tire : MagicTire
        Tire of fit type 60, 61 or 62.
    load : array_like, [N]
        > 0.
    slip_angle, camber : array_like, [rad]
    slip_ratio : array_like
    pressure : array_like, [Pa], optional
        By default the file's INFLPRES, else NOMPRES.
    combined : bool
        False leaves out the influence of each slip on the other's force.

    Raises
    ------
    ParameterError, ShapeError
        If the fit type is another, or an input is out of range.
    """
    if tire.fit_type not in (60, 61, 62):
        raise ParameterError(
            f"fit type {tire.fit_type}; magic_forces_6 takes 60, 61 and 62; use magic_forces"
        )
    at = check_inputs(tire, load, slip_angle, slip_ratio, camber, pressure)
    c = tire.coefficients
    nominal = c.LFZO * tire.nominal_load  # (4.E1)
    dfz = (at.Fz - nominal) / nominal  # (4.E2a)
    along, across = _longitudinal(tire, at, dfz), _lateral(tire, at, dfz)
    upright = _lateral(tire, replace(at, gamma=np.zeros_like(at.gamma)), dfz)
    Fx, Fy, trail_force, well = along.Fxo, across.Fyo, upright.Fyo, np.ones(at.Fz.shape, np.bool_)
    kappa = at.kappa if combined else np.zeros_like(at.kappa)
    if combined:
        Fx, E_x = _combined_x(tire, at, dfz, along.Fxo)
        G, shift, E_y = _combined_y(tire, at, dfz, across.mu)
        G_upright, _, _ = _combined_y(tire, replace(at, gamma=0.0 * at.gamma), dfz, across.mu)
        Fy = G * across.Fyo + shift  # (4.E58)
        trail_force = G_upright * upright.Fyo  # (4.E74)
        well = (E_x <= 1.0) & (E_y <= 1.0)
    Mz, E_t = _moment(
        tire, at, dfz, across, (along.K, kappa), (Fx if combined else None, Fy), trail_force
    )
    well = well & (along.E <= 1.0) & (across.E <= 1.0) & (E_t <= 1.0)
    return MagicForces(Fx, Fy, Mz, across.K, along.K, along.mu, across.mu, at.in_range, well)


def _magic(B: FloatArray, x: FloatArray, E: FloatArray) -> FloatArray:
    """Return the angle under the sine or cosine, over C."""
    return np.asarray(np.arctan(B * x - E * (B * x - np.arctan(B * x))))


def _safe(value: FloatArray) -> FloatArray:
    """Return the value moved away from zero by a hair, keeping its sign."""
    return np.asarray(value + np.where(value < 0.0, -TINY, TINY))


def _degressive(scale: float) -> float:
    return DEGRESSIVE * scale / (1.0 + (DEGRESSIVE - 1.0) * scale)  # (4.E8)


def _longitudinal(tire: MagicTire, at: Inputs, dfz: FloatArray) -> _Long:
    c, Fz, dpi = tire.coefficients, at.Fz, at.dpi
    SH = (c.PHX1 + c.PHX2 * dfz) * c.LHX  # (4.E17)
    SV = Fz * (c.PVX1 + c.PVX2 * dfz) * c.LVX * _degressive(c.LMUX)  # (4.E18)
    kappa_x = at.kappa + SH  # (4.E10)
    C = c.PCX1 * c.LCX  # (4.E11)
    mu = (
        (c.PDX1 + c.PDX2 * dfz)
        * (1.0 + c.PPX3 * dpi + c.PPX4 * dpi**2)
        * (1.0 - c.PDX3 * at.gamma**2)
        * c.LMUX
    )  # (4.E13)
    D = mu * Fz  # (4.E12)
    E = (
        (c.PEX1 + c.PEX2 * dfz + c.PEX3 * dfz**2) * (1.0 - c.PEX4 * np.sign(kappa_x)) * c.LEX
    )  # (4.E14)
    K = (
        Fz
        * (c.PKX1 + c.PKX2 * dfz)
        * np.exp(c.PKX3 * dfz)
        * (1.0 + c.PPX1 * dpi + c.PPX2 * dpi**2)
        * c.LKX
    )  # (4.E15)
    B = K / _safe(C * D)  # (4.E16)
    return _Long(D * np.sin(C * _magic(B, kappa_x, E)) + SV, K, mu, E)  # (4.E9)


def _lateral(tire: MagicTire, at: Inputs, dfz: FloatArray) -> _Lat:
    c, Fz, dpi = tire.coefficients, at.Fz, at.dpi
    nominal = c.LFZO * tire.nominal_load  # (4.E1)
    alpha, gamma = np.tan(at.alpha), np.sin(at.gamma)  # (4.E3), (4.E4)
    K = (
        c.PKY1
        * nominal
        * (1.0 + c.PPY1 * dpi)
        * (1.0 - c.PKY3 * np.abs(gamma))
        * np.sin(
            c.PKY4
            * np.arctan((Fz / nominal) / ((c.PKY2 + c.PKY5 * gamma**2) * (1.0 + c.PPY2 * dpi)))
        )
        * c.LKY
    )  # (4.E25)
    K_gamma = Fz * (c.PKY6 + c.PKY7 * dfz) * (1.0 + c.PPY5 * dpi) * c.LKYC  # (4.E30)
    low = _degressive(c.LMUY)
    SV_gamma = Fz * (c.PVY3 + c.PVY4 * dfz) * gamma * c.LKYC * low  # (4.E28)
    SV = Fz * (c.PVY1 + c.PVY2 * dfz) * c.LVY * low + SV_gamma  # (4.E29)
    SH = (c.PHY1 + c.PHY2 * dfz) * c.LHY + (K_gamma * gamma - SV_gamma) / _safe(K)  # (4.E27)
    alpha_y = alpha + SH  # (4.E20)
    C = c.PCY1 * c.LCY  # (4.E21)
    mu = (
        (c.PDY1 + c.PDY2 * dfz)
        * (1.0 + c.PPY3 * dpi + c.PPY4 * dpi**2)
        * (1.0 - c.PDY3 * gamma**2)
        * c.LMUY
    )  # (4.E23)
    D = mu * Fz  # (4.E22)
    E = (
        (c.PEY1 + c.PEY2 * dfz)
        * (1.0 + c.PEY5 * gamma**2 - (c.PEY3 + c.PEY4 * gamma) * np.sign(alpha_y))
        * c.LEY
    )  # (4.E24)
    B = K / _safe(C * D)  # (4.E26)
    Fyo = D * np.sin(C * _magic(B, alpha_y, E)) + SV  # (4.E19)
    return _Lat(Fyo, K, mu, E, B * C, SH, SV)


def _combined_x(
    tire: MagicTire, at: Inputs, dfz: FloatArray, Fxo: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return Fx and its curvature factor."""
    c, alpha, gamma = tire.coefficients, np.tan(at.alpha), np.sin(at.gamma)
    SH = np.asarray(c.RHX1)  # (4.E57)
    E = c.REX1 + c.REX2 * dfz  # (4.E56)
    B = (c.RBX1 + c.RBX3 * gamma**2) * np.cos(np.arctan(c.RBX2 * at.kappa)) * c.LXAL  # (4.E54)
    alpha_s = alpha + SH  # (4.E53)
    none = np.cos(c.RCX1 * _magic(B, SH, E))  # (4.E52), (4.E55)
    return np.cos(c.RCX1 * _magic(B, alpha_s, E)) / none * Fxo, E  # (4.E51), (4.E50)


def _combined_y(
    tire: MagicTire, at: Inputs, dfz: FloatArray, mu: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the weight of Fyo, the force that kappa brings, and the curvature factor."""
    c, alpha, gamma, kappa = tire.coefficients, np.tan(at.alpha), np.sin(at.gamma), at.kappa
    B = (c.RBY1 + c.RBY4 * gamma**2) * np.cos(np.arctan(c.RBY2 * (alpha - c.RBY3)))
    B = B * c.LYKA  # (4.E62)
    E = c.REY1 + c.REY2 * dfz  # (4.E64)
    SH = c.RHY1 + c.RHY2 * dfz  # (4.E65)
    kappa_s = kappa + SH  # (4.E61)
    none = np.cos(c.RCY1 * _magic(B, SH, E))  # (4.E60), (4.E63)
    G = np.cos(c.RCY1 * _magic(B, kappa_s, E)) / none  # (4.E59)
    D = (
        mu * at.Fz * (c.RVY1 + c.RVY2 * dfz + c.RVY3 * gamma) * np.cos(np.arctan(c.RVY4 * alpha))
    )  # (4.E67)
    SV = D * np.sin(c.RVY5 * np.arctan(c.RVY6 * kappa)) * c.LVYKA  # (4.E66)
    return G, SV, E


def _moment(
    tire: MagicTire,
    at: Inputs,
    dfz: FloatArray,
    across: _Lat,
    slip: tuple[FloatArray, FloatArray],
    forces: tuple[FloatArray | None, FloatArray],
    trail_force: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Return Mz and its curvature factor; Fx is None for pure side slip."""
    c, Fz, dpi, R0 = tire.coefficients, at.Fz, at.dpi, tire.radius
    nominal = c.LFZO * tire.nominal_load
    alpha, gamma, cos_alpha = np.tan(at.alpha), np.sin(at.gamma), np.cos(at.alpha)  # (4.E6)
    K = _safe(across.K)  # (4.E39)
    SHt = c.QHZ1 + c.QHZ2 * dfz + (c.QHZ3 + c.QHZ4 * dfz) * gamma  # (4.E35)
    alpha_t = alpha + SHt  # (4.E34)
    alpha_r = alpha + across.SH + across.SV / K  # (4.E37), (4.E38)
    B = (
        (c.QBZ1 + c.QBZ2 * dfz + c.QBZ3 * dfz**2)
        * (1.0 + c.QBZ4 * gamma + c.QBZ5 * np.abs(gamma) + c.QBZ6 * gamma**2)
        * c.LKY
        / c.LMUY
    )  # (4.E40); files write QBZ4 and QBZ5, the book QBZ5 and QBZ6
    D_o = Fz * (R0 / nominal) * (c.QDZ1 + c.QDZ2 * dfz) * (1.0 - c.PPZ1 * dpi) * c.LTR  # (4.E42)
    D = D_o * (1.0 + c.QDZ3 * np.abs(gamma) + c.QDZ4 * gamma**2)  # (4.E43)
    E = (c.QEZ1 + c.QEZ2 * dfz + c.QEZ3 * dfz**2) * (
        1.0 + (c.QEZ4 + c.QEZ5 * gamma) * (2.0 / np.pi) * np.arctan(B * c.QCZ1 * alpha_t)
    )  # (4.E44), (4.E41)
    B_r = c.QBZ9 * c.LKY / c.LMUY + c.QBZ10 * across.BC  # (4.E45)
    D_r = (
        Fz
        * R0
        * (
            (c.QDZ6 + c.QDZ7 * dfz) * c.LRES
            + (c.QDZ8 + c.QDZ9 * dfz) * (1.0 + c.PPZ2 * dpi) * gamma * c.LKZC
            + (c.QDZ10 + c.QDZ11 * dfz) * gamma * np.abs(gamma) * c.LKZC
        )
        * cos_alpha
        * c.LMUY
    )  # (4.E47)
    long_slip = slip[0] / K * slip[1]
    t_eq = np.hypot(alpha_t, long_slip) * np.sign(alpha_t)  # (4.E77)
    r_eq = np.hypot(alpha_r, long_slip) * np.sign(alpha_r)  # (4.E78)
    trail = D * np.cos(c.QCZ1 * _magic(B, t_eq, E)) * cos_alpha  # (4.E73), pure (4.E33)
    residual = D_r * np.cos(np.arctan(B_r * r_eq))  # (4.E75), pure (4.E36); C_r = 1 (4.E46)
    Mz = -trail * trail_force + residual  # (4.E72), pure (4.E32)
    Fx, Fy = forces
    if Fx is not None:
        arm = R0 * (c.SSZ1 + c.SSZ2 * Fy / nominal + (c.SSZ3 + c.SSZ4 * dfz) * gamma) * c.LS
        Mz = Mz + arm * Fx  # (4.E76), (4.E71)
    return Mz, E
