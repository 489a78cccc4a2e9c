"""Magic Formula 5 (MF-Tyre 5.x, PAC2002 without pressure terms), steady state: Fx, Fy, Mz.

Numbers in parentheses are the equations of Pacejka, Tire and Vehicle Dynamics, 3rd ed. (2012),
section 4.3.2, that each line is the forerunner of. Where version 5 differs: the slip angle itself
stands where 6 has its tangent, camber itself (scaled by LGAX, LGAY, LGAZ) where 6 has its sine,
camber shifts the curve by PHY3 alone, and trail and arm refer to the unscaled nominal load.
"""

import numpy as np
import numpy.typing as npt

from tirelib.arrays import FloatArray
from tirelib.brush.mf_tire import MagicForces, MagicTire, check_inputs
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
    c, Fz, alpha, kappa, gamma = tire.coefficients, at.Fz, at.alpha, at.kappa, at.gamma
    nominal = c.LFZO * tire.nominal_load  # (4.E1)
    dfz = (Fz - nominal) / nominal  # (4.E2a)

    SHx = (c.PHX1 + c.PHX2 * dfz) * c.LHX  # (4.E17)
    SVx = Fz * (c.PVX1 + c.PVX2 * dfz) * c.LVX * c.LMUX  # (4.E18)
    kappa_x = kappa + SHx  # (4.E10)
    Cx = c.PCX1 * c.LCX  # (4.E11)
    mu_x = (c.PDX1 + c.PDX2 * dfz) * (1.0 - c.PDX3 * (gamma * c.LGAX) ** 2) * c.LMUX  # (4.E13)
    Dx = mu_x * Fz  # (4.E12)
    Ex = c.PEX1 + c.PEX2 * dfz + c.PEX3 * dfz**2
    Ex = Ex * (1.0 - c.PEX4 * np.sign(kappa_x)) * c.LEX  # (4.E14)
    Kx = Fz * (c.PKX1 + c.PKX2 * dfz) * np.exp(c.PKX3 * dfz) * c.LKX  # (4.E15)
    Bx = Kx / _safe(Cx * Dx)  # (4.E16)
    Fx = Dx * np.sin(Cx * _magic(Bx, kappa_x, Ex)) + SVx  # (4.E9)

    gamma_y = gamma * c.LGAY
    SHy = (c.PHY1 + c.PHY2 * dfz) * c.LHY + c.PHY3 * gamma_y  # (4.E27)
    SVy_base = (c.PVY1 + c.PVY2 * dfz) * c.LVY  # (4.E29)
    SVy = Fz * (SVy_base + (c.PVY3 + c.PVY4 * dfz) * gamma_y) * c.LMUY  # (4.E28)
    alpha_y = alpha + SHy  # (4.E20)
    Cy = c.PCY1 * c.LCY  # (4.E21)
    mu_y = (c.PDY1 + c.PDY2 * dfz) * (1.0 - c.PDY3 * gamma_y**2) * c.LMUY  # (4.E23)
    Dy = mu_y * Fz  # (4.E22)
    Ey = (c.PEY1 + c.PEY2 * dfz) * c.LEY
    Ey = Ey * (1.0 - (c.PEY3 + c.PEY4 * gamma_y) * np.sign(alpha_y))  # (4.E24)
    Ky = (
        c.PKY1
        * nominal
        * np.sin(2.0 * np.arctan(Fz / (c.PKY2 * nominal)))
        * (1.0 - c.PKY3 * np.abs(gamma_y))
        * c.LKY
    )  # (4.E25)
    By = Ky / _safe(Cy * Dy)  # (4.E26)
    Fy = Dy * np.sin(Cy * _magic(By, alpha_y, Ey)) + SVy  # (4.E19)
    trail_force, well = Fy, (Ex <= 1.0) & (Ey <= 1.0)

    if combined:
        Ex_a = c.REX1 + c.REX2 * dfz  # (4.E56)
        Bx_a = c.RBX1 * np.cos(np.arctan(c.RBX2 * kappa)) * c.LXAL  # (4.E54)
        none = np.cos(c.RCX1 * _magic(Bx_a, np.asarray(c.RHX1), Ex_a))  # (4.E52)
        Fx = np.cos(c.RCX1 * _magic(Bx_a, alpha + c.RHX1, Ex_a)) / none * Fx  # (4.E50), (4.E51)
        Ey_k = c.REY1 + c.REY2 * dfz  # (4.E64)
        SHy_k = c.RHY1 + c.RHY2 * dfz  # (4.E65)
        By_k = c.RBY1 * np.cos(np.arctan(c.RBY2 * (alpha - c.RBY3))) * c.LYKA  # (4.E62)
        none = np.cos(c.RCY1 * _magic(By_k, SHy_k, Ey_k))  # (4.E60)
        trail_force = np.cos(c.RCY1 * _magic(By_k, kappa + SHy_k, Ey_k)) / none * Fy  # (4.E59)
        Dv = mu_y * Fz * (c.RVY1 + c.RVY2 * dfz + c.RVY3 * gamma)
        Dv = Dv * np.cos(np.arctan(c.RVY4 * alpha))  # (4.E67)
        Fy = trail_force + Dv * np.sin(c.RVY5 * np.arctan(c.RVY6 * kappa)) * c.LVYKA  # (4.E58)
        well = well & (Ex_a <= 1.0) & (Ey_k <= 1.0)

    gamma_z, R0 = gamma * c.LGAZ, tire.radius
    alpha_t = alpha + c.QHZ1 + c.QHZ2 * dfz + (c.QHZ3 + c.QHZ4 * dfz) * gamma_z  # (4.E34)
    alpha_r = alpha + SHy + SVy / _safe(Ky)  # (4.E37), (4.E38)
    Bt = (c.QBZ1 + c.QBZ2 * dfz + c.QBZ3 * dfz**2) * c.LKY / c.LMUY
    Bt = Bt * (1.0 + c.QBZ4 * gamma_z + c.QBZ5 * np.abs(gamma_z))  # (4.E40)
    Dt = Fz * (c.QDZ1 + c.QDZ2 * dfz) * (R0 / tire.nominal_load) * c.LTR  # (4.E42)
    Dt = Dt * (1.0 + c.QDZ3 * gamma_z + c.QDZ4 * gamma_z**2)  # (4.E43)
    Et = (c.QEZ1 + c.QEZ2 * dfz + c.QEZ3 * dfz**2) * (
        1.0 + (c.QEZ4 + c.QEZ5 * gamma_z) * (2.0 / np.pi) * np.arctan(Bt * c.QCZ1 * alpha_t)
    )  # (4.E44)
    Br = c.QBZ9 * c.LKY / c.LMUY + c.QBZ10 * By * Cy  # (4.E45)
    Dr = (c.QDZ6 + c.QDZ7 * dfz) * c.LRES + (c.QDZ8 + c.QDZ9 * dfz) * gamma_z
    Dr = Fz * Dr * R0 * c.LMUY  # (4.E47)
    long_slip = Kx / _safe(Ky) * kappa if combined else np.zeros_like(kappa)
    t_eq = np.arctan(np.hypot(np.tan(alpha_t), long_slip)) * np.sign(alpha_t)  # (4.E77)
    r_eq = np.arctan(np.hypot(np.tan(alpha_r), long_slip)) * np.sign(alpha_r)  # (4.E78)
    trail = Dt * np.cos(c.QCZ1 * _magic(Bt, t_eq, Et)) * np.cos(alpha)  # (4.E73)
    residual = Dr * np.cos(np.arctan(Br * r_eq)) * np.cos(alpha)  # (4.E75)
    Mz = -trail * trail_force + residual  # (4.E72)
    if combined:
        arm = c.SSZ1 + c.SSZ2 * Fy / tire.nominal_load + (c.SSZ3 + c.SSZ4 * dfz) * gamma
        Mz = Mz + arm * R0 * c.LS * Fx  # (4.E76), (4.E71)
    well = well & (Et <= 1.0)
    return MagicForces(Fx, Fy, Mz, Ky, Kx, mu_x, mu_y, at.in_range, well)


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
