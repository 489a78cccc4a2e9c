"""What utilisation, aligning moment and traction tell of the slip angle on an unknown road.

The form is that of `tirelib.estimators.sliding`; friction and lateral slip are spread evenly.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.estimators.polynomial import Polynomial
from tirelib.estimators.sliding import (
    CURVE_DOUBT,
    FREE,
    MOMENT_DOUBT,
    TINY,
    SlidingCurve,
    Told,
    angle_of,
    lost_slip,
)
from tirelib.estimators.unknowns import FRICTION, Road

ROUGHER = 1.15
"""The roughest road has this friction at least, over that of the calibration."""
HIDDEN, HIDDEN_DOUBT = 0.6, 0.3
"""Share of what sliding takes from the moment that a regression of one road does not show on
others, and its standard deviation over tires."""
NODES = 64
WHOLE = 6
"""Slip angles that stand for those beyond full sliding."""
LEAST_UTILISATION = 1e-3
_X, _W = np.polynomial.legendre.leggauss(NODES)


@dataclass(frozen=True, slots=True)
class Seen:
    """What the strain shows of n turns; arrays of shape (n,).

    Attributes
    ----------
    used : Size of Fy / Fz.
    load : [N]
    slip_ratio, slip_std : NaN: not known.
    moment, moment_std : Mz / (Fz q0), positive where it aligns; infinite std: not known.
    pull, pull_std : -Fx / Fz; infinite std: not known.
    unseen : Share of the frictions that no data of the calibration cover, 0 to 1.
    """

    used: FloatArray
    load: FloatArray
    slip_ratio: FloatArray
    slip_std: FloatArray
    moment: FloatArray
    moment_std: FloatArray
    pull: FloatArray
    pull_std: FloatArray
    unseen: float


def tell(curve: SlidingCurve, seen: Seen, widest: float) -> Told:
    """Return what the readings tell where the friction is not known.

    Parameters
    ----------
    curve : SlidingCurve
    seen : Seen
    widest : float, [rad]
        Largest slip angle that is looked for.
    """
    n, load = curve.sharpness, seen.load[:, None]
    used = np.maximum(seen.used, LEAST_UTILISATION)[:, None]
    rolls = seen.slip_ratio[:, None]
    free = np.arctan(curve.lateral(used, curve.friction, load)[0])
    along = curve.along(free, rolls, load)
    c, pulled = curve.cornering(load), np.abs(along)
    ends = np.array([max(FRICTION[1], ROUGHER * curve.friction), FRICTION[0], curve.friction])
    share = curve.share(used, ends, load, along)
    low, high = share[:, :1], share[:, 1:2]
    t = low + 0.5 * (high - low) * (_X + 1.0)
    slip = curve.across(used, t, load)
    filled = np.maximum(1.0 - (1.0 - t) ** n, TINY)
    weight = n * used / (c * filled**2) * 0.5 * (high - low) * _W
    # beyond full sliding friction falls from the roughest road's to the most slippery one's
    rough, slippery = (lost_slip(used, curve.grip * end, pulled) for end in ends[:2])
    begin = np.maximum(n * used / c, rough)
    room = np.maximum(np.minimum(np.tan(widest), slippery) - begin, 0.0)
    room = np.where(np.isfinite(begin), room, 0.0)
    beyond = np.where(room > 0.0, begin, 0.0) + room * (np.arange(WHOLE) + 0.5) / WHOLE
    across = curve.lateral_at(share[:, 2:], used, curve.friction, load, along)  # calibrated road
    slip = np.concatenate((slip, np.maximum(beyond, TINY), across), axis=1)
    t = np.concatenate((t, np.ones_like(beyond), share[:, 2:]), axis=1)
    weight = np.concatenate((weight, room / WHOLE + 0.0 * beyond, 0.0 * used), axis=1)
    angle = angle_of(slip, rolls)
    weight = weight * np.hypot(pulled / slip, 1.0) * (angle <= widest)
    # a regression that knows one road shows a part only of what another takes from the moment
    aligned, dry = (used * (1.0 - x) ** curve.fading for x in (t, share[:, 2:]))
    taken = seen.unseen * (dry - aligned)
    apart = seen.moment[:, None] - aligned - HIDDEN * taken
    surprise = _surprise(apart, np.hypot(seen.moment_std[:, None], HIDDEN_DOUBT * taken))
    expected, unsure = used * along / slip, used * curve.stiffer(load) / slip
    with np.errstate(invalid="ignore"):
        slanted = np.hypot(curve.slant * expected, unsure * seen.slip_std[:, None])
        spread = np.hypot(seen.pull_std[:, None], slanted)
    surprise = surprise + _surprise(seen.pull[:, None] - expected, spread)
    likely = np.exp(surprise.min(axis=1, keepdims=True) - surprise)
    middle, variance = _moments(angle, weight * likely)
    usual = angle[:, -1]
    # the angle stays that of the calibrated road as far as the readings are those of that road
    learnt = 1.0 - likely[:, -1]
    change = learnt * (middle - usual)
    rest = middle - usual - change
    std = np.sqrt(variance + rest**2 + (CURVE_DOUBT * change) ** 2)
    at, scatter = _moments(t, weight * likely)
    sliding = np.sqrt(scatter + (at - share[:, 2]) ** 2)
    # at a share that is known the angle grows with u in proportion
    steep = curve.slope_at(used, at[:, None], across, load, along)[:, 0]
    slope = learnt * middle / used[:, 0] + (1.0 - learnt) * steep
    return Told(usual + change, std, change, slope, sliding)


def slid(
    curve: SlidingCurve,
    road: Road,
    models: tuple[Polynomial | None, Polynomial | None],
    values: Mapping[str, FloatArray],
    force: FloatArray,
    load: FloatArray,
    widest: float,
) -> Told:
    """Return what is known of a tread that slides more than it was calibrated.

    Parameters
    ----------
    curve : SlidingCurve
    road : Road
        Friction and tread of the calibration.
    models : (Polynomial or None, Polynomial or None)
        Aligning moment and longitudinal force, where they were calibrated.
    values : mapping of name to array, shape (n,)
        Regressors.
    force, load : arrays, shape (n,), [N]
    widest : float, [rad]
        Largest slip angle that is looked for.
    """
    camber, friction = np.nan_to_num(values["camber"]), road.said(values, "friction")
    load, slip = np.maximum(load, 1.0), values["slip_ratio"]
    used = -force / load - curve.camber[0] * camber
    side = np.where(used < 0.0, -1.0, 1.0)
    unseen = road.unseen_friction(curve.friction)
    known = np.isfinite(friction)
    told: Told | None = None
    if known.any():
        told = curve.at(np.abs(used), load, np.where(known, friction, curve.friction), slip)
    if told is None or not known.all():
        aligning, drag = models
        moment, std = np.zeros_like(used), np.full_like(used, np.inf)
        pull, pull_std = moment, std
        if aligning is not None:
            moment, std = aligning.predict(values)
            moment = (moment - curve.camber[1] * camber) * side
            free = np.abs(slip) <= FREE  # not where it is unknown
            doubt = np.hypot(curve.misfit, MOMENT_DOUBT * unseen)
            std = np.where(free, np.hypot(std, doubt), np.inf)
        if drag is not None:
            pull, pull_std = drag.predict(values)
            pull_std = np.where(np.isfinite(slip), pull_std, np.inf)
        slip_std = values.get("slip_std", 0.0 * used)
        seen = Seen(np.abs(used), load, slip, slip_std, moment, std, pull, pull_std, unseen)
        open_ = tell(curve, seen, widest)
        told = open_ if told is None else told.where(known, open_)
    return replace(told, change=side * told.change, sliding=unseen * told.sliding)


def _surprise(apart: FloatArray, std: FloatArray) -> FloatArray:
    """Return minus the logarithm of a normal likelihood; 0 where nothing is known."""
    known = np.isfinite(std) & np.isfinite(apart)
    size = np.where(known, std, 1.0)
    found = 0.5 * (np.where(known, apart, 0.0) / size) ** 2 + np.log(size)
    return np.asarray(np.where(known, found, 0.0))


def _moments(x: FloatArray, weight: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return mean and variance, shape (n,); NaN where nothing has a weight."""
    with np.errstate(invalid="ignore"):
        share = weight / weight.sum(axis=1, keepdims=True)
    mean = (share * x).sum(axis=1)
    return mean, (share * (x - mean[:, None]) ** 2).sum(axis=1)
