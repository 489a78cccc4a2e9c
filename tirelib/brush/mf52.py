"""Magic Formula 5 (MF-Tyre 5.x, PAC2002 without pressure terms), steady state: Fx, Fy, Mz.

Numbers in parentheses are the equations of Pacejka, Tire and Vehicle Dynamics, 3rd ed. (2012),
section 4.3.2, that each line is the forerunner of. Where version 5 differs: the slip angle itself
stands where 6 has its tangent, camber itself (scaled by LGAX, LGAY, LGAZ) where 6 has its sine,
camber shifts the curve by PHY3 alone, and trail and arm refer to the unscaled nominal load.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tirelib.arrays import FloatArray
from tirelib.brush.mf_tire import Inputs, MagicForces, MagicTire, check_inputs
from tirelib.errors import ParameterError

TINY = 1e-9


def magic_forces_5(
    tire: MagicTire,
    load: npt.ArrayLike,
    slip_angle: npt.ArrayLike,
    slip_ratio: npt.ArrayLike = 0.0,
    camber: npt.ArrayLike = 0.0,
    *,
    combined: bool = True,
) -> MagicForces:
    """Evaluate the Magic Formula 5.2; arguments and result as `magic_forces_6`.

    Raises
    ------
    ParameterError, ShapeError
        If the fit type is another, the file has pressure coefficients (an extension of PAC2002 that
        is not evaluated here), or an input is out of range.
    """
    _check(tire)
    at = check_inputs(tire, load, slip_angle, slip_ratio, camber, None)
    nominal = tire.coefficients.LFZO * tire.nominal_load  # (4.E1)
    dfz = (at.Fz - nominal) / nominal  # (4.E2a)
    along, across = _longitudinal(tire, at, dfz), _lateral(tire, at, dfz)
    Fx, Fy, trail_force = along.F, across.F, across.F
    well = (along.E <= 1.0) & (across.E <= 1.0)
    if combined:
        Fx, E_x = _combined_x(tire, at, dfz, along.F)
        trail_force, Fy, E_y = _combined_y(tire, at, dfz, across)
        well = well & (E_x <= 1.0) & (E_y <= 1.0)
    long_slip = along.K / _safe(across.K) * at.kappa if combined else np.zeros_like(at.kappa)
    Mz, E_t = _moment(tire, at, dfz, across, long_slip, trail_force)
    if combined:
        c, share = tire.coefficients, Fy / tire.nominal_load
        arm = c.SSZ1 + c.SSZ2 * share + (c.SSZ3 + c.SSZ4 * dfz) * at.gamma
        Mz = Mz + arm * tire.radius * c.LS * Fx  # (4.E76), (4.E71)
    well = well & (E_t <= 1.0)
    return MagicForces(Fx, Fy, Mz, across.K, along.K, along.mu, across.mu, at.in_range, well)


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


def _longitudinal(tire: MagicTire, at: Inputs, dfz: FloatArray) -> _Pure:
    c, Fz = tire.coefficients, at.Fz
    SH = (c.PHX1 + c.PHX2 * dfz) * c.LHX  # (4.E17)
    SV = Fz * (c.PVX1 + c.PVX2 * dfz) * c.LVX * c.LMUX  # (4.E18)
    kappa_x = at.kappa + SH  # (4.E10)
    C = c.PCX1 * c.LCX  # (4.E11)
    mu = (c.PDX1 + c.PDX2 * dfz) * (1.0 - c.PDX3 * (at.gamma * c.LGAX) ** 2) * c.LMUX  # (4.E13)
    D = mu * Fz  # (4.E12)
    E = c.PEX1 + c.PEX2 * dfz + c.PEX3 * dfz**2
    E = E * (1.0 - c.PEX4 * np.sign(kappa_x)) * c.LEX  # (4.E14)
    K = Fz * (c.PKX1 + c.PKX2 * dfz) * np.exp(c.PKX3 * dfz) * c.LKX  # (4.E15)
    B = K / _safe(C * D)  # (4.E16)
    return _Pure(D * np.sin(C * _magic(B, kappa_x, E)) + SV, K, mu, E, B * C, SH, SV)  # (4.E9)


def _lateral(tire: MagicTire, at: Inputs, dfz: FloatArray) -> _Pure:
    c, Fz, gamma = tire.coefficients, at.Fz, at.gamma * tire.coefficients.LGAY
    nominal = c.LFZO * tire.nominal_load  # (4.E1)
    SH = (c.PHY1 + c.PHY2 * dfz) * c.LHY + c.PHY3 * gamma  # (4.E27)
    SV_base = (c.PVY1 + c.PVY2 * dfz) * c.LVY  # (4.E29)
    SV = Fz * (SV_base + (c.PVY3 + c.PVY4 * dfz) * gamma) * c.LMUY  # (4.E28)
    alpha_y = at.alpha + SH  # (4.E20)
    C = c.PCY1 * c.LCY  # (4.E21)
    mu = (c.PDY1 + c.PDY2 * dfz) * (1.0 - c.PDY3 * gamma**2) * c.LMUY  # (4.E23)
    D = mu * Fz  # (4.E22)
    E = (c.PEY1 + c.PEY2 * dfz) * c.LEY
    E = E * (1.0 - (c.PEY3 + c.PEY4 * gamma) * np.sign(alpha_y))  # (4.E24)
    K = c.PKY1 * nominal * np.sin(2.0 * np.arctan(Fz / (c.PKY2 * nominal)))
    K = K * (1.0 - c.PKY3 * np.abs(gamma)) * c.LKY  # (4.E25)
    B = K / _safe(C * D)  # (4.E26)
    return _Pure(D * np.sin(C * _magic(B, alpha_y, E)) + SV, K, mu, E, B * C, SH, SV)  # (4.E19)


def _combined_x(
    tire: MagicTire, at: Inputs, dfz: FloatArray, Fxo: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return Fx and its curvature factor."""
    c = tire.coefficients
    E = c.REX1 + c.REX2 * dfz  # (4.E56)
    B = c.RBX1 * np.cos(np.arctan(c.RBX2 * at.kappa)) * c.LXAL  # (4.E54)
    none = np.cos(c.RCX1 * _magic(B, np.asarray(c.RHX1), E))  # (4.E52)
    weight = np.cos(c.RCX1 * _magic(B, at.alpha + c.RHX1, E)) / none
    return np.asarray(weight * Fxo), E  # (4.E50), (4.E51)


def _combined_y(
    tire: MagicTire, at: Inputs, dfz: FloatArray, across: _Pure
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return Fy without and with the force that kappa brings, and the curvature factor."""
    c, alpha, kappa = tire.coefficients, at.alpha, at.kappa
    E = c.REY1 + c.REY2 * dfz  # (4.E64)
    SH = c.RHY1 + c.RHY2 * dfz  # (4.E65)
    B = c.RBY1 * np.cos(np.arctan(c.RBY2 * (alpha - c.RBY3))) * c.LYKA  # (4.E62)
    none = np.cos(c.RCY1 * _magic(B, SH, E))  # (4.E60)
    weighed = np.cos(c.RCY1 * _magic(B, kappa + SH, E)) / none * across.F  # (4.E59)
    D = across.mu * at.Fz * (c.RVY1 + c.RVY2 * dfz + c.RVY3 * at.gamma)
    D = D * np.cos(np.arctan(c.RVY4 * alpha))  # (4.E67)
    Fy = weighed + D * np.sin(c.RVY5 * np.arctan(c.RVY6 * kappa)) * c.LVYKA  # (4.E58)
    return weighed, Fy, E


def _moment(
    tire: MagicTire,
    at: Inputs,
    dfz: FloatArray,
    across: _Pure,
    long_slip: FloatArray,
    trail_force: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Return Mz without the arm of Fx, and its curvature factor."""
    c, Fz, alpha, R0 = tire.coefficients, at.Fz, at.alpha, tire.radius
    gamma = at.gamma * c.LGAZ
    alpha_t = alpha + c.QHZ1 + c.QHZ2 * dfz + (c.QHZ3 + c.QHZ4 * dfz) * gamma  # (4.E34)
    alpha_r = alpha + across.SH + across.SV / _safe(across.K)  # (4.E37), (4.E38)
    B = (c.QBZ1 + c.QBZ2 * dfz + c.QBZ3 * dfz**2) * c.LKY / c.LMUY
    B = B * (1.0 + c.QBZ4 * gamma + c.QBZ5 * np.abs(gamma))  # (4.E40)
    D = Fz * (c.QDZ1 + c.QDZ2 * dfz) * (R0 / tire.nominal_load) * c.LTR  # (4.E42)
    D = D * (1.0 + c.QDZ3 * gamma + c.QDZ4 * gamma**2)  # (4.E43)
    E = (c.QEZ1 + c.QEZ2 * dfz + c.QEZ3 * dfz**2) * (
        1.0 + (c.QEZ4 + c.QEZ5 * gamma) * (2.0 / np.pi) * np.arctan(B * c.QCZ1 * alpha_t)
    )  # (4.E44)
    B_r = c.QBZ9 * c.LKY / c.LMUY + c.QBZ10 * across.BC  # (4.E45)
    D_r = (c.QDZ6 + c.QDZ7 * dfz) * c.LRES + (c.QDZ8 + c.QDZ9 * dfz) * gamma
    D_r = Fz * D_r * R0 * c.LMUY  # (4.E47)
    t_eq = np.arctan(np.hypot(np.tan(alpha_t), long_slip)) * np.sign(alpha_t)  # (4.E77)
    r_eq = np.arctan(np.hypot(np.tan(alpha_r), long_slip)) * np.sign(alpha_r)  # (4.E78)
    trail = D * np.cos(c.QCZ1 * _magic(B, t_eq, E)) * np.cos(alpha)  # (4.E73)
    residual = D_r * np.cos(np.arctan(B_r * r_eq)) * np.cos(alpha)  # (4.E75)
    return np.asarray(-trail * trail_force + residual), E  # (4.E72)


def _check(tire: MagicTire) -> None:
    if tire.fit_type not in (5, 6, 52):
        raise ParameterError(
            f"fit type {tire.fit_type}; magic_forces_5 takes 5, 6 and 52; use magic_forces"
        )
    values = tire.coefficients.values
    pressure = sorted(k for k, v in values.items() if k[:2] in ("PP", "QP") and v != 0.0)
    if pressure:
        raise ParameterError(
            f"pressure coefficients {', '.join(pressure)} in a file of fit type {tire.fit_type}; "
            "version 5 has none; set them to zero or give the tire as MF 6.1"
        )


def _magic(B: FloatArray, x: FloatArray, E: FloatArray) -> FloatArray:
    """Return the angle under the sine or cosine, over C."""
    return np.asarray(np.arctan(B * x - E * (B * x - np.arctan(B * x))))


def _safe(value: FloatArray) -> FloatArray:
    """Return the value moved away from zero by a hair, keeping its sign."""
    return np.asarray(value + np.where(value < 0.0, -TINY, TINY))
