"""Magic Formula, versions 6.0 to 6.2 and 5 (MF-Tyre 5.x, PAC2002), steady state: Fx, Fy, Mz.

Numbers in parentheses are the equations of Pacejka, Tire and Vehicle Dynamics, 3rd ed. (2012),
section 4.3.2, which are those of version 6. Forward rolling without turn slip (all zeta = 1) on a
road of friction scaling LMUX, LMUY; no slip-speed dependence (4.E7). Small differences to other
programs, on purpose: no trail factor LFZO beyond (4.E42), and curvature factors above 1 are
flagged, not clamped. 6.2 is evaluated as 6.1: what it adds concerns the vertical load, overturning
and rolling moments.

Version 5 is the forerunner of each line. Where it differs: the slip angle itself stands where 6 has
its tangent, camber itself (scaled by LGAX, LGAY, LGAZ) where 6 has its sine, camber shifts the
curve by PHY3 alone, shifts scale with the friction itself, the trail belongs to the force with
camber, and trail and arm refer to the unscaled nominal load. Coefficients that came with version 6
(`NEW`) and the pressure terms do not act in it.
"""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.core.errors import ParameterError
from tirelib.physics.brush.magic_formula import magic_angle, sine_curve
from tirelib.physics.brush.mf_tire import Coefficients, Inputs, MagicForces, MagicTire, check_inputs

FIVE, SIX = (5, 6, 52), (60, 61, 62)
"""Fit types of the two versions."""
NEW = frozenset(
    {
        "PKY4",
        "PKY5",
        "PKY6",
        "PKY7",
        "PEY5",
        "RBX3",
        "RBY4",
        "QBZ6",
        "QDZ10",
        "QDZ11",
        "LKYC",
        "LKZC",
    }
)
"""Coefficients that version 5 does not have."""
DEGRESSIVE = 10.0
"""A_mu of (4.E8): keeps the shifts alive on slippery ground."""
TINY = 1e-9


def magic_forces(
    tire: MagicTire,
    load: npt.ArrayLike,
    slip_angle: npt.ArrayLike,
    slip_ratio: npt.ArrayLike = 0.0,
    camber: npt.ArrayLike = 0.0,
    pressure: npt.ArrayLike | None = None,
    *,
    combined: bool = True,
) -> MagicForces:
    """Evaluate the Magic Formula of the version that the property file has.

    Parameters
    ----------
    tire : MagicTire
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
        If the fit type is another, an input is out of range, or a tire of version 5 is given a
        pressure or has pressure coefficients (an extension of PAC2002 that is not evaluated here).
    """
    _check(tire, pressure)
    at = check_inputs(tire, load, slip_angle, slip_ratio, camber, pressure)
    point = _point(tire, at)
    along, across = _longitudinal(point), _lateral(point)
    # the trail of version 6 belongs to the force without camber
    upright = point if point.five else replace(point, gamma=0.0 * at.gamma, gamma_y=0.0 * at.gamma)
    Fx, Fy, trail_force = along.F, across.F, _lateral(upright).F
    well: BoolArray = (along.E <= 1.0) & (across.E <= 1.0)
    if combined:
        weight_x, E_x = _weight_x(point)
        weight_y, E_y = _weight_y(point)
        Fx = weight_x * Fx  # (4.E50)
        Fy = weight_y * Fy + _force_of_kappa(point, across.mu)  # (4.E58)
        trail_force = _weight_y(upright)[0] * trail_force  # (4.E74)
        well = well & (E_x <= 1.0) & (E_y <= 1.0)
    long_slip = along.K / _safe(across.K) * at.kappa * float(combined)
    Mz, E_t = _moment(tire, point, across, long_slip, trail_force)
    if combined:
        Mz = Mz + _arm(tire, point, Fy) * Fx  # (4.E71)
    well = well & (E_t <= 1.0)
    return MagicForces(Fx, Fy, Mz, across.K, along.K, along.mu, across.mu, at.in_range, well)


@dataclass(frozen=True, slots=True, eq=False)
class _Point:
    """Coefficients and inputs as the formula of the version takes them, inputs of one shape.

    Attributes
    ----------
    five : bool
        Version 5.
    alpha, gamma : tan and sin (4.E3), (4.E4) of slip angle and camber; in version 5 these angles
    gamma_x, gamma_y, gamma_z : camber in the equations of pure Fx, pure Fy and Mz
    low_x, low_y : scaling of the shifts of Fx and Fy (4.E8)
    nominal : nominal load that trail and arm refer to, [N]
    """

    c: Coefficients
    five: bool
    Fz: FloatArray
    dfz: FloatArray
    dpi: FloatArray
    kappa: FloatArray
    alpha: FloatArray
    cos_alpha: FloatArray
    gamma: FloatArray
    gamma_x: FloatArray
    gamma_y: FloatArray
    gamma_z: FloatArray
    low_x: float
    low_y: float
    scaled: float
    nominal: float


@dataclass(frozen=True, slots=True, eq=False)
class _Pure:
    """One force under its own slip alone: force, slip stiffness, friction, curvature, B C."""

    F: FloatArray
    K: FloatArray
    mu: FloatArray
    E: FloatArray
    BC: FloatArray
    SH: FloatArray
    SV: FloatArray


def _check(tire: MagicTire, pressure: npt.ArrayLike | None) -> None:
    kind = tire.fit_type
    if kind in SIX:
        return
    if kind not in FIVE:
        raise ParameterError(
            f"fit type {kind}; allowed are {', '.join(map(str, FIVE + SIX))}; no other version is "
            "evaluated"
        )
    if pressure is not None:
        raise ParameterError(
            f"fit type {kind} has no pressure terms; leave the pressure out or use an MF 6.1 file"
        )
    values = tire.coefficients.values
    wrong = sorted(k for k, v in values.items() if k[:2] in ("PP", "QP") and v != 0.0)
    if wrong:
        raise ParameterError(
            f"pressure coefficients {', '.join(wrong)} in a file of fit type {kind}; version 5 has "
            "none; set them to zero or give the tire as MF 6.1"
        )


def _point(tire: MagicTire, at: Inputs) -> _Point:
    c, five, gamma = tire.coefficients, tire.fit_type in FIVE, at.gamma
    nominal = c.LFZO * tire.nominal_load  # (4.E1)
    dfz = (at.Fz - nominal) / nominal  # (4.E2a)
    common = (at.Fz, dfz, at.dpi, at.kappa)
    if five:
        c = Coefficients({name: x for name, x in c.values.items() if name not in NEW})
        cambers = (gamma, gamma * c.LGAX, gamma * c.LGAY, gamma * c.LGAZ)
        ends = (c.LMUX, c.LMUY, nominal, tire.nominal_load)
        return _Point(c, five, *common, at.alpha, np.cos(at.alpha), *cambers, *ends)
    sine = np.sin(gamma)
    ends = (_degressive(c.LMUX), _degressive(c.LMUY), nominal, nominal)
    alphas = (np.tan(at.alpha), np.cos(at.alpha))  # (4.E3), (4.E6)
    return _Point(c, five, *common, *alphas, sine, gamma, sine, sine, *ends)


def _degressive(scale: float) -> float:
    return DEGRESSIVE * scale / (1.0 + (DEGRESSIVE - 1.0) * scale)  # (4.E8)


def _longitudinal(p: _Point) -> _Pure:
    c, Fz, dfz, dpi = p.c, p.Fz, p.dfz, p.dpi
    SH = (c.PHX1 + c.PHX2 * dfz) * c.LHX  # (4.E17)
    SV = Fz * (c.PVX1 + c.PVX2 * dfz) * c.LVX * p.low_x  # (4.E18)
    kappa_x = p.kappa + SH  # (4.E10)
    C = c.PCX1 * c.LCX  # (4.E11)
    mu = (c.PDX1 + c.PDX2 * dfz) * (1.0 + c.PPX3 * dpi + c.PPX4 * dpi**2)
    mu = mu * (1.0 - c.PDX3 * p.gamma_x**2) * c.LMUX  # (4.E13)
    D = mu * Fz  # (4.E12)
    E = c.PEX1 + c.PEX2 * dfz + c.PEX3 * dfz**2
    E = E * (1.0 - c.PEX4 * np.sign(kappa_x)) * c.LEX  # (4.E14)
    K = Fz * (c.PKX1 + c.PKX2 * dfz) * np.exp(c.PKX3 * dfz)
    K = K * (1.0 + c.PPX1 * dpi + c.PPX2 * dpi**2) * c.LKX  # (4.E15)
    B = K / _safe(C * D)  # (4.E16)
    return _Pure(sine_curve(kappa_x, B, C, D, E) + SV, K, mu, E, B * C, SH, SV)  # (4.E9)


def _lateral(p: _Point) -> _Pure:
    c, Fz, dfz, dpi, gamma = p.c, p.Fz, p.dfz, p.dpi, p.gamma_y
    soft = (c.PKY2 + c.PKY5 * gamma**2) * (1.0 + c.PPY2 * dpi)
    K = c.PKY1 * p.scaled * (1.0 + c.PPY1 * dpi) * (1.0 - c.PKY3 * np.abs(gamma))
    K = K * np.sin(c.PKY4 * np.arctan((Fz / p.scaled) / soft)) * c.LKY  # (4.E25)
    SV_gamma = Fz * (c.PVY3 + c.PVY4 * dfz) * gamma * c.LKYC * p.low_y  # (4.E28)
    SV = Fz * (c.PVY1 + c.PVY2 * dfz) * c.LVY * p.low_y + SV_gamma  # (4.E29)
    K_gamma = Fz * (c.PKY6 + c.PKY7 * dfz) * (1.0 + c.PPY5 * dpi) * c.LKYC  # (4.E30)
    lean = c.PHY3 * gamma if p.five else (K_gamma * gamma - SV_gamma) / _safe(K)
    SH = (c.PHY1 + c.PHY2 * dfz) * c.LHY + lean  # (4.E27)
    alpha_y = p.alpha + SH  # (4.E20)
    C = c.PCY1 * c.LCY  # (4.E21)
    mu = (c.PDY1 + c.PDY2 * dfz) * (1.0 + c.PPY3 * dpi + c.PPY4 * dpi**2)
    mu = mu * (1.0 - c.PDY3 * gamma**2) * c.LMUY  # (4.E23)
    D = mu * Fz  # (4.E22)
    side = (c.PEY3 + c.PEY4 * gamma) * np.sign(alpha_y)
    E = (c.PEY1 + c.PEY2 * dfz) * (1.0 + c.PEY5 * gamma**2 - side) * c.LEY  # (4.E24)
    B = K / _safe(C * D)  # (4.E26)
    return _Pure(sine_curve(alpha_y, B, C, D, E) + SV, K, mu, E, B * C, SH, SV)  # (4.E19)


def _weight_x(p: _Point) -> tuple[FloatArray, FloatArray]:
    """Return the weight of the pure Fx (4.E51) and its curvature factor."""
    c = p.c
    E = c.REX1 + c.REX2 * p.dfz  # (4.E56)
    B = (c.RBX1 + c.RBX3 * p.gamma**2) * np.cos(np.arctan(c.RBX2 * p.kappa)) * c.LXAL  # (4.E54)
    return _share(p.alpha, c.RHX1, B, c.RCX1, E), E  # (4.E52), (4.E53), (4.E55), (4.E57)


def _weight_y(p: _Point) -> tuple[FloatArray, FloatArray]:
    """Return the weight of the pure Fy (4.E59) and its curvature factor."""
    c = p.c
    B = (c.RBY1 + c.RBY4 * p.gamma**2) * np.cos(np.arctan(c.RBY2 * (p.alpha - c.RBY3)))
    E = c.REY1 + c.REY2 * p.dfz  # (4.E64)
    SH = c.RHY1 + c.RHY2 * p.dfz  # (4.E65)
    return _share(p.kappa, SH, B * c.LYKA, c.RCY1, E), E  # (4.E60) to (4.E63)


def _share(
    slip: FloatArray, shift: FloatArray | float, B: FloatArray, C: float, E: FloatArray
) -> FloatArray:
    """Return the cosine curve at a shifted slip over that without slip."""
    none = np.cos(C * magic_angle(np.asarray(shift), B, E))
    return np.asarray(np.cos(C * magic_angle(slip + shift, B, E)) / none)


def _force_of_kappa(p: _Point, mu: FloatArray) -> FloatArray:
    """Return the side force that a slip ratio brings (4.E66)."""
    c = p.c
    D = mu * p.Fz * (c.RVY1 + c.RVY2 * p.dfz + c.RVY3 * p.gamma)
    D = D * np.cos(np.arctan(c.RVY4 * p.alpha))  # (4.E67)
    return np.asarray(D * np.sin(c.RVY5 * np.arctan(c.RVY6 * p.kappa)) * c.LVYKA)


def _moment(
    tire: MagicTire, p: _Point, across: _Pure, long_slip: FloatArray, trail_force: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return Mz without the arm of Fx (4.E72), and its curvature factor."""
    c, Fz, dfz, dpi, gamma, R0 = p.c, p.Fz, p.dfz, p.dpi, p.gamma_z, tire.radius
    alpha_t = p.alpha + c.QHZ1 + c.QHZ2 * dfz + (c.QHZ3 + c.QHZ4 * dfz) * gamma  # (4.E34, 35)
    alpha_r = p.alpha + across.SH + across.SV / _safe(across.K)  # (4.E37) to (4.E39)
    B = (c.QBZ1 + c.QBZ2 * dfz + c.QBZ3 * dfz**2) * c.LKY / c.LMUY
    # (4.E40); files write QBZ4 and QBZ5, the book QBZ5 and QBZ6
    B = B * (1.0 + c.QBZ4 * gamma + c.QBZ5 * np.abs(gamma) + c.QBZ6 * gamma**2)
    D = Fz * (R0 / p.nominal) * (c.QDZ1 + c.QDZ2 * dfz) * (1.0 - c.PPZ1 * dpi) * c.LTR  # (4.E42)
    lean = gamma if p.five else np.abs(gamma)
    D = D * (1.0 + c.QDZ3 * lean + c.QDZ4 * gamma**2)  # (4.E43)
    E = (c.QEZ1 + c.QEZ2 * dfz + c.QEZ3 * dfz**2) * (
        1.0 + (c.QEZ4 + c.QEZ5 * gamma) * (2.0 / np.pi) * np.arctan(B * c.QCZ1 * alpha_t)
    )  # (4.E44), (4.E41)
    B_r = c.QBZ9 * c.LKY / c.LMUY + c.QBZ10 * across.BC  # (4.E45)
    D_r = (c.QDZ6 + c.QDZ7 * dfz) * c.LRES
    D_r = D_r + (c.QDZ8 + c.QDZ9 * dfz) * (1.0 + c.PPZ2 * dpi) * gamma * c.LKZC
    D_r = D_r + (c.QDZ10 + c.QDZ11 * dfz) * gamma * np.abs(gamma) * c.LKZC
    D_r = Fz * R0 * D_r * p.cos_alpha * c.LMUY  # (4.E47)
    t_eq, r_eq = (_together(angle, long_slip, p.five) for angle in (alpha_t, alpha_r))
    trail = D * np.cos(c.QCZ1 * magic_angle(t_eq, B, E)) * p.cos_alpha  # (4.E73), pure (4.E33)
    residual = D_r * np.cos(np.arctan(B_r * r_eq))  # (4.E75), pure (4.E36); C_r = 1 (4.E46)
    return np.asarray(-trail * trail_force + residual), E


def _together(angle: FloatArray, long_slip: FloatArray, five: bool) -> FloatArray:
    """Return slip angle and longitudinal slip as one (4.E77), (4.E78)."""
    if five:
        return np.asarray(np.arctan(np.hypot(np.tan(angle), long_slip)) * np.sign(angle))
    return np.asarray(np.hypot(angle, long_slip) * np.sign(angle))


def _arm(tire: MagicTire, p: _Point, Fy: FloatArray) -> FloatArray:
    """Return the arm of Fx about the vertical axis (4.E76), [m]."""
    c = p.c
    arm = c.SSZ1 + c.SSZ2 * Fy / p.nominal + (c.SSZ3 + c.SSZ4 * p.dfz) * p.gamma
    return np.asarray(tire.radius * arm * c.LS)


def _safe(value: FloatArray) -> FloatArray:
    """Return the value moved away from zero by a hair, keeping its sign."""
    return np.asarray(value + np.where(value < 0.0, -TINY, TINY))
