r"""Natural frequencies of the standing ring and the stiffness behind them, Eq. (108)-(112).

.. math:: \omega_n^2 = \frac{\left[\frac{EI}{R^4} (1 - n^2) - \frac{p_0 b}{R}\right] n^2 (1 - n^2)
          + k_v + k_u n^2}{\rho A (1 + n^2)}

The divisor belongs to all terms (the print of Eq. (109) divides the first only). Three modes
give EI by Eq. (110), exactly and uselessly: an error of 1 % in one frequency moves EI by up to
several hundred percent. Many modes hold it: `tirelib.physics.ring.frequency_fit`.

Validity: inextensible ring, fixed axle, no rotation, belt tension p0 b R from inflation alone.
Frequencies are angular, in rad/s.
"""

import numpy as np
import numpy.typing as npt

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ParameterError, ShapeError
from tirelib.physics.ring.green import positive, whole_orders


def natural_frequency(
    order: npt.ArrayLike,
    *,
    ring_radius: npt.ArrayLike,
    bending_stiffness: npt.ArrayLike,
    radial_stiffness: npt.ArrayLike,
    tangential_stiffness: npt.ArrayLike,
    inflation: npt.ArrayLike,
    mass: npt.ArrayLike,
) -> FloatArray:
    """Natural angular frequency of order n of the ring on a fixed axle, corrected Eq. (109).

    Parameters
    ----------
    order : array of int
        n >= 0; n = 0 is the torsional mode, omega^2 = k_v / rho A.
    ring_radius, bending_stiffness : array, [m], [N m2]
        R and EI.
    radial_stiffness, tangential_stiffness : array, [N/m2]
        k_u and k_v.
    inflation : array, [N/m]
        p0 b, gauge pressure times belt width, >= 0.
    mass : array, [kg/m]
        rho A per length of circumference. All arguments broadcast.

    Returns
    -------
    array, [rad/s]

    Raises
    ------
    ParameterError
        If a parameter is not finite and positive (inflation: not negative), or an order is not a
        whole number >= 0.

    Examples
    --------
    >>> omega = natural_frequency(
    ...     [0, 1, 2], ring_radius=0.3, bending_stiffness=1.144, radial_stiffness=6.24e5,
    ...     tangential_stiffness=2.18e5, inflation=1.32e5 * 0.165, mass=3.16)
    >>> [round(float(f), 2) for f in omega / (2 * np.pi)]
    [41.8, 58.09, 75.87]
    """
    where = "natural frequency"
    n = whole_orders(where, order)
    R, EI, k_u, k_v, m = positive(
        where,
        ring_radius=ring_radius,
        bending_stiffness=bending_stiffness,
        radial_stiffness=radial_stiffness,
        tangential_stiffness=tangential_stiffness,
        mass=mass,
    )
    pb = not_negative(where, inflation)
    stiffness = (EI / R**4 * (1.0 - n**2) - pb / R) * n**2 * (1.0 - n**2) + k_v + k_u * n**2
    omega: FloatArray = np.sqrt(stiffness / (m * (1.0 + n**2)))
    return omega


def three_mode_bending_stiffness(
    frequency: npt.ArrayLike,
    *,
    ring_radius: npt.ArrayLike,
    inflation: npt.ArrayLike,
    mass: npt.ArrayLike,
) -> FloatArray:
    """EI from the frequencies of orders 1, 2, 3, Eq. (110). Never use it without its sensitivity.

    EI = R^3 [R rho A (w1^2 - 4 w2^2 + 3 w3^2) - 12 p0 b] / 144. The result may be negative: that is
    noise, and is not repaired.

    Parameters
    ----------
    frequency : array, shape (..., 3), [rad/s]
        Frequencies of orders 1, 2, 3.
    ring_radius, inflation, mass : array, shape (...), [m], [N/m], [kg/m]
        R, p0 b, rho A.

    Returns
    -------
    array, shape (...), [N m2]

    Raises
    ------
    ParameterError, ShapeError
        If a value is out of range, or there are not three frequencies.
    """
    R, m, pb, w = _three_modes(frequency, ring_radius, inflation, mass)
    ei: FloatArray = R**3 * (R * m * (w**2 @ np.array([1.0, -4.0, 3.0])) - 12.0 * pb) / 144.0
    return ei


def three_mode_sensitivity(
    frequency: npt.ArrayLike,
    *,
    ring_radius: npt.ArrayLike,
    inflation: npt.ArrayLike,
    mass: npt.ArrayLike,
) -> FloatArray:
    """Relative change of EI of Eq. (110) per relative change of what goes in.

    Parameters, errors as in `three_mode_bending_stiffness`.

    Returns
    -------
    array, shape (..., 4)
        d ln EI / d ln of w1, w2, w3 and p0 b. About 42, -284, 330, -43 for the tire of Table 6-1:
        1 % in w3 is 330 % in EI.
    """
    R, m, pb, w = _three_modes(frequency, ring_radius, inflation, mass)
    by_mode = (R**4 * m / 72.0)[..., None] * w**2 * np.array([1.0, -4.0, 3.0])
    by_inflation = np.broadcast_to((-(R**3) * pb / 12.0)[..., None], (*by_mode.shape[:-1], 1))
    ei = 0.5 * by_mode.sum(axis=-1, keepdims=True) + by_inflation
    changes: FloatArray = np.concatenate((by_mode, by_inflation), axis=-1) / ei
    return changes


def tread_stiffness(
    modulus: npt.ArrayLike, belt_width: npt.ArrayLike, thickness: npt.ArrayLike
) -> FloatArray:
    """Radial tread stiffness per length, k_t = E b / tau, Eq. (111), [N/m2].

    From Young's modulus [Pa], belt width [m] and tread thickness [m], all > 0; they broadcast.
    A rubber block whose sides are free; ParameterError if a value is not positive.
    """
    E, b, tau = positive(
        "tread stiffness", modulus=modulus, belt_width=belt_width, thickness=thickness
    )
    return E * b / tau


def belt_mass(ring_mass: npt.ArrayLike, ring_radius: npt.ArrayLike) -> FloatArray:
    """Mass per length of circumference, rho A = m_t / (2 pi R), Eq. (108), [kg/m].

    From the mass of the whole tread ring [kg] and R [m], both > 0, else ParameterError.
    """
    m, R = positive("belt mass", ring_mass=ring_mass, ring_radius=ring_radius)
    return m / (2.0 * np.pi * R)


def rim_stiffness(
    ring_radius: npt.ArrayLike,
    radial_stiffness: npt.ArrayLike,
    tangential_stiffness: npt.ArrayLike,
) -> tuple[FloatArray, FloatArray]:
    """Stiffness of the rim against the held tread, corrected Eq. (112).

    S_v = pi R (k_u + k_v): a shift d of the rim moves it by d cos phi along and d sin phi across
    the radius (the print has 2 pi). S_theta = 2 pi R^3 k_v.

    Parameters
    ----------
    ring_radius, radial_stiffness, tangential_stiffness : array, [m], [N/m2], [N/m2]
        R, k_u, k_v > 0; they broadcast.

    Returns
    -------
    shift, turn : array, [N/m], [N m/rad]
        S_v and S_theta.

    Raises
    ------
    ParameterError
        If a value is not positive.
    """
    R, k_u, k_v = positive(
        "rim stiffness",
        ring_radius=ring_radius,
        radial_stiffness=radial_stiffness,
        tangential_stiffness=tangential_stiffness,
    )
    return np.pi * R * (k_u + k_v), 2.0 * np.pi * R**3 * k_v


def sidewall_stiffness(
    ring_radius: npt.ArrayLike, shift: npt.ArrayLike, turn: npt.ArrayLike
) -> tuple[FloatArray, FloatArray]:
    """Return k_u, k_v [N/m2] from the rim test, the inverse of `rim_stiffness`.

    Raises ParameterError if a value is not positive, or if the turn alone asks for more k_v than
    the shift allows (k_u would not be positive).
    """
    R, s_v, s_theta = positive(
        "sidewall stiffness", ring_radius=ring_radius, shift=shift, turn=turn
    )
    k_v = s_theta / (2.0 * np.pi * R**3)
    k_u = s_v / (np.pi * R) - k_v
    if np.any(k_u <= 0.0):
        raise ParameterError(
            f"sidewall stiffness: k_u = {k_u.min():g} N/m2; the shift must exceed turn / (2 R^2); "
            "check the units of both tests"
        )
    return k_u, k_v


def _three_modes(
    frequency: npt.ArrayLike, ring_radius: npt.ArrayLike, inflation: npt.ArrayLike, mass: object
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    where = "bending stiffness from three modes"
    w = np.asarray(frequency, dtype=np.float64)
    if w.shape[-1:] != (3,):
        raise ShapeError(
            f"{where}: frequency has shape {w.shape}; the last dimension must hold orders 1, 2, 3"
        )
    R, m, w = positive(where, ring_radius=ring_radius, mass=np.asarray(mass), frequency=w)
    return R, m, not_negative(where, inflation), w


def not_negative(where: str, inflation: npt.ArrayLike) -> FloatArray:
    """Return the inflation as an array; ParameterError if a value is not finite and >= 0."""
    pb = np.asarray(inflation, dtype=np.float64)
    if not (np.isfinite(pb) & (pb >= 0.0)).all():
        raise ParameterError(
            f"{where}: inflation = {pb.min():g} N/m; must be finite and >= 0: gauge pressure times "
            "belt width"
        )
    return pb
