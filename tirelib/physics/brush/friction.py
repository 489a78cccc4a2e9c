r"""Friction coefficient from measured forces, by the parabolic brush (Eq. 3 to 5 and 8, corrected).

Three ways, by what is known besides Fy and Fz:

- the aligning moment: the trail -Mz/Fy alone shows how much of the contact slides;
- the bristle stiffness and the slip angle;
- a second force at another slip angle.

At small slip all three vanish: force and moment follow from stiffness alone and say nothing about
friction. Each estimate therefore has a standard deviation, propagated to first order from those of
its inputs (all independent), and `determined` is False, with a NaN for the friction, where the
inputs lie outside what the model can produce or where the deviation exceeds `most_std` of the
value. Real tires are not parabolic: the deviation covers noise, not the model's own error.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.core.errors import ParameterError

MOST_STD = 0.25
"""Largest relative standard deviation of an estimate that is still called one."""
WIDTH = 2.0
"""Standard deviations within which an input counts as on the border of the model's range."""


@dataclass(frozen=True, slots=True, eq=False)
class FrictionEstimate:
    """Friction coefficient with its standard deviation, one per operating point.

    Attributes
    ----------
    friction : array
        NaN where `determined` is False.
    std : array
        First-order standard deviation, also where it is too large; inf where there is no estimate.
    sliding : array
        t = abs(tan alpha / tan alpha_sl), 0 .. 1; 1 where the whole contact slides.
    determined : array of bool
    """

    friction: FloatArray
    std: FloatArray
    sliding: FloatArray
    determined: BoolArray


def friction_from_moment(
    Fy: npt.ArrayLike,
    Mz: npt.ArrayLike,
    load: npt.ArrayLike,
    half_length: npt.ArrayLike,
    *,
    Fy_std: npt.ArrayLike,
    Mz_std: npt.ArrayLike,
    load_std: npt.ArrayLike = 0.0,
    half_length_std: npt.ArrayLike = 0.0,
    most_std: float = MOST_STD,
) -> FrictionEstimate:
    r"""Return mu from lateral force and aligning moment, without slip angle and stiffness.

    With w = 1 - t the trail is -Mz/Fy = a w^3 / (1 + w + w^2), from a/3 at no slip to 0 when all
    slides; then mu = abs(Fy) / Fz / (1 - w^3).

    Parameters
    ----------
    Fy, Mz, load, half_length : array_like, [N], [N m], [N], [m]
        ISO 8855: Fy and Mz have opposite signs.
    Fy_std, Mz_std, load_std, half_length_std : array_like
        Standard deviations, in the same units.
    most_std : float
        Largest relative standard deviation of a usable estimate.

    Raises
    ------
    ParameterError
        If a load, half length or standard deviation is out of range.

    Examples
    --------
    >>> found = friction_from_moment(-2317.79, 22.398, 4000.0, 0.06, Fy_std=20.0, Mz_std=1.0)
    >>> bool(found.determined), round(float(found.friction), 3)
    (True, 0.9)
    """
    force, moment, Fz, a, s_force, s_moment, s_load, s_a = _inputs(
        Fy=Fy,
        Mz=Mz,
        load=load,
        half_length=half_length,
        Fy_std=Fy_std,
        Mz_std=Mz_std,
        load_std=load_std,
        half_length_std=half_length_std,
    )
    _check(most_std, (s_force, s_moment, s_load, s_a), load=Fz, half_length=a)
    some = force != 0.0
    size = np.where(some, np.abs(force), 1.0)
    trail = np.where(some, -moment * np.sign(force), 0.0) / (a * size)
    r = np.clip(trail, 0.0, 1.0 / 3.0)
    w = _trail_root(r)
    bracket = 1.0 - w**3
    # dmu/dr = 3 mu (1 + w + w^2)^2 / ((1 - w^3)(3 + 2 w + w^2)), finite when all slides (w = 0).
    with np.errstate(divide="ignore", invalid="ignore"):
        mu = size / Fz / bracket
        by_r = 3.0 * mu * (1.0 + w + w**2) ** 2 / (bracket * (3.0 + 2.0 * w + w**2))
        std = np.sqrt(
            ((mu / size - by_r * r / size) * s_force) ** 2
            + (by_r / (a * size) * s_moment) ** 2
            + (mu / Fz * s_load) ** 2
            + (by_r * r / a * s_a) ** 2
        )
    s_r = np.hypot(s_moment / (a * size), np.hypot(trail * s_force / size, trail * s_a / a))
    possible = some & (trail >= -WIDTH * s_r) & (trail < 1.0 / 3.0 - WIDTH * s_r)
    return _estimate(mu, std, 1.0 - w, possible, most_std)


def friction_from_stiffness(
    Fy: npt.ArrayLike,
    slip_angle: npt.ArrayLike,
    load: npt.ArrayLike,
    cornering_stiffness: npt.ArrayLike,
    *,
    Fy_std: npt.ArrayLike,
    slip_angle_std: npt.ArrayLike = 0.0,
    load_std: npt.ArrayLike = 0.0,
    cornering_stiffness_std: npt.ArrayLike = 0.0,
    most_std: float = MOST_STD,
) -> FrictionEstimate:
    r"""Return mu from one lateral force where the cornering stiffness 2 c_py a^2 is known.

    y = abs(Fy) / (C_alpha tan abs(alpha)) = 1 - t + t^2/3 falls from 1 at no slip to 1/3 when all
    slides; mu = C_alpha tan abs(alpha) / (3 Fz t). Below 1/3 all slides and mu = abs(Fy) / Fz.

    Parameters
    ----------
    Fy, slip_angle, load, cornering_stiffness : array_like, [N], [rad], [N], [N/rad]
    Fy_std, slip_angle_std, load_std, cornering_stiffness_std : array_like
        Standard deviations, in the same units.
    most_std : float
        Largest relative standard deviation of a usable estimate.

    Raises
    ------
    ParameterError
        If a load, stiffness or standard deviation is out of range.
    """
    force, alpha, Fz, C, s_force, s_alpha, s_load, s_C = _inputs(
        Fy=Fy,
        slip_angle=slip_angle,
        load=load,
        cornering_stiffness=cornering_stiffness,
        Fy_std=Fy_std,
        slip_angle_std=slip_angle_std,
        load_std=load_std,
        cornering_stiffness_std=cornering_stiffness_std,
    )
    _check(most_std, (s_force, s_alpha, s_load, s_C), load=Fz, cornering_stiffness=C)
    some = (force != 0.0) & (alpha != 0.0)
    tangent = np.where(some, np.tan(np.abs(alpha)), 1.0)
    line = C * tangent
    y = np.where(some, -force * np.sign(alpha), line) / line
    all_slides = y <= 1.0 / 3.0
    t = np.where(all_slides, 1.0, 1.5 - np.sqrt(np.maximum(3.0 * np.minimum(y, 1.0) - 0.75, 0.0)))
    s_tangent = (1.0 + tangent**2) * s_alpha
    with np.errstate(divide="ignore", invalid="ignore"):
        mu = np.where(all_slides, np.abs(force) / Fz, line / (3.0 * Fz * t))
        by_y = -mu / (t * (2.0 * t / 3.0 - 1.0))  # dmu/dy at a fixed line
        by_force = np.where(all_slides, 1.0 / Fz, by_y / line)
        by_line = np.where(all_slides, 0.0, (mu - by_y * y) / line)
        std = np.sqrt(
            (by_force * s_force) ** 2
            + (by_line * C * s_tangent) ** 2
            + (by_line * tangent * s_C) ** 2
            + (mu / Fz * s_load) ** 2
        )
    s_y = np.hypot(s_force / line, y * np.hypot(s_tangent / tangent, s_C / C))
    possible = some & (y > 0.0) & (y < 1.0 - WIDTH * s_y)
    return _estimate(mu, std, t, possible, most_std)


def friction_from_two_angles(
    Fy: npt.ArrayLike,
    slip_angle: npt.ArrayLike,
    load: npt.ArrayLike,
    *,
    Fy_std: npt.ArrayLike,
    load_std: npt.ArrayLike = 0.0,
    most_std: float = MOST_STD,
) -> FrictionEstimate:
    r"""Return mu from the forces at two slip angles: Eq. (8), corrected, twice.

    alpha_sl is taken to be the same in both, so load and contact length must be too. The ratio of
    the two utilisations lies between tan alpha_1 / tan alpha_2 (no sliding) and 1 (all slides).

    Parameters
    ----------
    Fy, slip_angle, load : array_like, shape (2, ...), [N], [rad], [N]
        abs(slip_angle[0]) < abs(slip_angle[1]), neither zero.
    Fy_std, load_std : array_like, broadcast with Fy, [N]
    most_std : float
        Largest relative standard deviation of a usable estimate.

    Raises
    ------
    ParameterError
        If the first axis is not 2, the angles are not in order, or a load is out of range.
    """
    force, alpha, Fz, s_force, s_load = _inputs(
        Fy=Fy, slip_angle=slip_angle, load=load, Fy_std=Fy_std, load_std=load_std
    )
    _check(most_std, (s_force, s_load), load=Fz)
    if force.ndim == 0 or force.shape[0] != 2:
        raise ParameterError(f"Fy has shape {force.shape}; two forces are needed: (2, ...)")
    tangent = np.tan(np.abs(alpha))
    if not np.all((tangent[0] > 0.0) & (tangent[0] < tangent[1])):
        raise ParameterError("the first slip angle must be the smaller one, and not zero")
    use = -force * np.sign(alpha) / Fz
    s_use = np.hypot(s_force / Fz, use * s_load / Fz)
    share = tangent[0] / tangent[1]
    usable = np.all(use > 0.0, axis=0)
    ratio = np.where(usable, use[0] / np.where(use[1] == 0.0, 1.0, use[1]), share)
    low, high = np.zeros_like(ratio), 1.0 / share
    for _ in range(80):  # bisection for t_2: the ratio grows with it; t_1 = share * t_2
        middle = 0.5 * (low + high)
        above = _bracket(share * middle) > ratio * _bracket(middle)
        low, high = np.where(above, low, middle), np.where(above, middle, high)
    t2 = 0.5 * (low + high)
    b1, b2 = _bracket(share * t2), _bracket(t2)
    d1, d2 = share * _slope(share * t2), _slope(t2)
    with np.errstate(divide="ignore", invalid="ignore"):
        mu = use[1] / b2
        # use_i = mu b_i(t_2): invert the 2 x 2 Jacobian for dmu/duse_i.
        det = b1 * d2 - b2 * d1
        both = np.hypot(d2 / det * s_use[0], d1 / det * s_use[1])
        std = np.where(t2 >= 1.0, s_use[1], both)  # the second force is mu Fz itself
        s_ratio = ratio * np.hypot(s_use[0] / use[0], s_use[1] / use[1])
    possible = usable & (ratio > share + WIDTH * s_ratio) & (ratio < 1.0 + WIDTH * s_ratio)
    return _estimate(mu, std, np.minimum(t2, 1.0), possible, most_std)


def _trail_root(r: FloatArray) -> FloatArray:
    """Return w with w^3 = r (1 + w + w^2), 0 <= r <= 1/3: Newton from w = 1, always from above."""
    w = np.ones_like(r)
    for _ in range(60):
        value = w**3 - r * (1.0 + w + w**2)
        w = w - value / np.maximum(3.0 * w**2 - r * (1.0 + 2.0 * w), 1e-300)
    return np.asarray(np.where(r > 0.0, w, 0.0))


def _bracket(t: FloatArray) -> FloatArray:
    return np.asarray(1.0 - (1.0 - np.minimum(t, 1.0)) ** 3)


def _slope(t: FloatArray) -> FloatArray:
    return np.asarray(3.0 * (1.0 - np.minimum(t, 1.0)) ** 2)


def _estimate(
    mu: FloatArray, std: FloatArray, sliding: FloatArray, possible: BoolArray, most_std: float
) -> FrictionEstimate:
    spread = np.where(np.isfinite(std) & np.isfinite(mu), std, np.inf)
    with np.errstate(invalid="ignore"):
        determined = np.asarray(possible & (spread <= most_std * mu), dtype=np.bool_)
    return FrictionEstimate(
        np.where(determined, mu, np.nan), spread, np.asarray(sliding), determined
    )


def _inputs(**given: npt.ArrayLike) -> tuple[FloatArray, ...]:
    arrays = [np.asarray(value, dtype=np.float64) for value in given.values()]
    try:
        return tuple(np.broadcast_arrays(*arrays))
    except ValueError:
        shapes = ", ".join(f"{name} {a.shape}" for name, a in zip(given, arrays, strict=True))
        raise ParameterError(f"shapes {shapes} do not broadcast") from None


def _check(most_std: float, deviations: tuple[FloatArray, ...], **positive: FloatArray) -> None:
    if not 0.0 < most_std < np.inf:
        raise ParameterError(f"most_std = {most_std}; it must be > 0, 0.25 is usual")
    for name, value in positive.items():
        if not np.all(np.isfinite(value) & (value > 0.0)):
            raise ParameterError(f"{name} = {float(value.min()):.6g}; it must be finite and > 0")
    if not all(np.all(np.isfinite(s) & (s >= 0.0)) for s in deviations):
        raise ParameterError("a standard deviation is negative or not finite")
