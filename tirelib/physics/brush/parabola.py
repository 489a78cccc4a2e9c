r"""Closed forms of the brush under a parabolic pressure: dissertation Eq. (3) to (5), (8), (26).

With a half the contact length and t = abs(tan alpha / tan alpha_sl), t <= 1,

.. math:: F_y = \mp \mu F_z [1 - (1 - t)^3], \qquad M_z = \pm \mu F_z\, a\, t (1 - t)^3

with the upper signs for a positive slip angle (ISO 8855). From t = 1 on the whole contact slides.
Corrected: (4) lacks the cube and writes alpha for a; (5) calls a the contact length, it is half of
it; (8) multiplies by the bracket where it must divide.
"""

import numpy as np
import numpy.typing as npt

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ParameterError


def bristle_stiffness(cornering_stiffness: npt.ArrayLike, half_length: npt.ArrayLike) -> FloatArray:
    """Return c = C / (2 a^2), Eq. (26), [N/m^2]; for c_px give the slip stiffness dFx/dkappa.

    Parameters
    ----------
    cornering_stiffness : array_like, [N/rad]
        C_alpha = -dFy/dalpha at zero slip, > 0.
    half_length : array_like, [m]
        Half the contact length, > 0.

    Raises
    ------
    ParameterError
        If one is not positive.

    Examples
    --------
    >>> float(bristle_stiffness(6e4, 0.06))
    8333333.33333
    """
    stiffness = _positive("cornering_stiffness", cornering_stiffness, "N/rad")
    a = _positive("half_length", half_length, "m")
    return np.asarray(stiffness / (2.0 * a**2))


def sliding_angle(
    stiffness: npt.ArrayLike,
    friction: npt.ArrayLike,
    load: npt.ArrayLike,
    half_length: npt.ArrayLike,
) -> FloatArray:
    """Return the slip angle alpha_sl from which the whole contact slides, Eq. (5) solved for it.

    Parameters
    ----------
    stiffness : array_like, [N/m^2]
        c_py.
    friction, load, half_length : array_like, [-], [N], [m]

    Returns
    -------
    angle : array, [rad]
    """
    c = _positive("stiffness", stiffness, "N/m^2")
    mu = _positive("friction", friction, "")
    Fz, a = _positive("load", load, "N"), _positive("half_length", half_length, "m")
    return np.asarray(np.arctan(3.0 * mu * Fz / (2.0 * c * a**2)))


def friction_at_sliding(
    stiffness: npt.ArrayLike,
    angle: npt.ArrayLike,
    load: npt.ArrayLike,
    half_length: npt.ArrayLike,
) -> FloatArray:
    """Return mu from the slip angle alpha_sl at which all slides, Eq. (5).

    Parameters
    ----------
    stiffness : array_like, [N/m^2]
        c_py.
    angle : array_like, [rad]
        alpha_sl, > 0.
    load, half_length : array_like, [N], [m]
    """
    c, angle = _positive("stiffness", stiffness, "N/m^2"), _positive("angle", angle, "rad")
    Fz, a = _positive("load", load, "N"), _positive("half_length", half_length, "m")
    return np.asarray(2.0 * c * a**2 * np.tan(angle) / (3.0 * Fz))


def lateral_force(
    slip_angle: npt.ArrayLike,
    stiffness: npt.ArrayLike,
    friction: npt.ArrayLike,
    load: npt.ArrayLike,
    half_length: npt.ArrayLike,
) -> FloatArray:
    """Return Fy, Eq. (3) and -mu Fz beyond alpha_sl, [N]; arguments as `sliding_angle`, [rad]."""
    share, sign = _share(slip_angle, sliding_angle(stiffness, friction, load, half_length))
    return np.asarray(-sign * np.asarray(friction) * np.asarray(load) * (1.0 - (1.0 - share) ** 3))


def aligning_moment(
    slip_angle: npt.ArrayLike,
    stiffness: npt.ArrayLike,
    friction: npt.ArrayLike,
    load: npt.ArrayLike,
    half_length: npt.ArrayLike,
) -> FloatArray:
    """Return Mz, Eq. (4) corrected, [N m], zero beyond alpha_sl; arguments as `lateral_force`."""
    share, sign = _share(slip_angle, sliding_angle(stiffness, friction, load, half_length))
    scale = np.asarray(friction) * np.asarray(load) * np.asarray(half_length)
    return np.asarray(sign * scale * share * (1.0 - share) ** 3)


def friction_at_angle(
    Fy: npt.ArrayLike, load: npt.ArrayLike, slip_angle: npt.ArrayLike, angle: npt.ArrayLike
) -> FloatArray:
    r"""Return mu from one lateral force and a known alpha_sl, Eq. (8) corrected.

    .. math:: \mu = \frac{|F_y| / F_z}{1 - (1 - t)^3}

    Parameters
    ----------
    Fy, load : array_like, [N]
    slip_angle : array_like, [rad]
        Not zero.
    angle : array_like, [rad]
        alpha_sl.

    Raises
    ------
    ParameterError
        If a slip angle is zero, where the force does not depend on friction.
    """
    share, _ = _share(slip_angle, _positive("angle", angle, "rad"))
    if np.any(share == 0.0):
        raise ParameterError("slip_angle = 0; Eq. (8) needs a slip angle that is not zero")
    ratio = np.abs(np.asarray(Fy, dtype=np.float64)) / _positive("load", load, "N")
    return np.asarray(ratio / (1.0 - (1.0 - share) ** 3))


def _share(slip_angle: npt.ArrayLike, limit: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return t, at most 1 (all slides), and the sign of the slip angle."""
    alpha = np.asarray(slip_angle, dtype=np.float64)
    if not np.all(np.abs(alpha) < 0.5 * np.pi):
        raise ParameterError("a slip angle is not between -pi/2 and pi/2 rad; give it in radians")
    share = np.minimum(np.abs(np.tan(alpha)) / np.tan(limit), 1.0)
    return share, np.sign(alpha)


def _positive(name: str, value: npt.ArrayLike, unit: str) -> FloatArray:
    array = np.asarray(value, dtype=np.float64)
    if not np.all(np.isfinite(array) & (array > 0.0)):
        raise ParameterError(f"{name} = {float(array.min()):.6g} {unit}; it must be finite and > 0")
    return array
