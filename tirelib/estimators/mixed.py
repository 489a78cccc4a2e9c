"""Campaigns of one calibration that do not look like the same tire."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.estimators.calibrate import fit_sliding_of, laws_of
from tirelib.estimators.likeness import SHARE_UNLIKE
from tirelib.estimators.likeness_fit import fit_likeness
from tirelib.estimators.links import VARIES, varying_of
from tirelib.estimators.regressors import EVEN, ODD, compute_regressors
from tirelib.estimators.sliding import SlidingCurve
from tirelib.measured.observations import Observations, mean_by

BEYOND = {"camber": np.deg2rad(0.5), "slip_angle": np.deg2rad(0.5), "slip_ratio": 0.005}
"""How far (SI) beyond the conditions of a campaign another can still be compared with it."""
FEWEST_UNLIKE = 3
"""Measurements, besides the share `SHARE_UNLIKE`, that must look like another tire's: fifty times
chance of sixty runs. Between campaigns of one tire on the rig and in a laboratory at most two do;
half would suspect one pair of them, double would miss the rig's `soft` at other pressures."""


@dataclass(frozen=True, slots=True)
class Stranger:
    """A campaign with strain that the tire of another does not show.

    `unlike` of the `judged` independent measurements (runs, or turns of sweeps); `name` and `of`
    are the campaigns.
    """

    name: str
    of: str
    unlike: int
    judged: int


def strangers(observations: Observations) -> tuple[Stranger, ...]:
    """Hold every campaign against every other; a pair that differs is named once."""
    features, campaign = observations.features, observations.campaign
    turns = compute_regressors(features, range(features.lateral.size))
    turns["speed_squared"] = turns["speed"] ** 2
    rows = observations.usable
    for name in (*EVEN, *ODD):
        rows = rows & np.isfinite(turns[name])
    found: dict[frozenset[int], Stranger] = {}
    numbers = [int(number) for number in np.unique(campaign[rows])]
    for of in numbers if len(numbers) > 1 else []:
        apart, limit = _apart(observations, turns, rows & (campaign == of))
        for other in numbers:
            judged = rows & (campaign == other) & np.isfinite(apart)
            if other == of or not judged.any():
                continue
            # the turns of one run are of one condition, and alike whatever the tire
            unlike = mean_by(observations.unit, (apart > limit).astype(np.float64), judged) > 0.5
            if unlike.sum() >= FEWEST_UNLIKE and unlike.mean() > SHARE_UNLIKE:
                name, known = (observations.headers[number].name for number in (other, of))
                stranger = Stranger(name, known, int(unlike.sum()), unlike.size)
                found.setdefault(frozenset((other, of)), stranger)
    return tuple(found.values())


def _apart(
    observations: Observations, turns: Mapping[str, FloatArray], own: BoolArray
) -> tuple[FloatArray, float]:
    """Return how far every turn lies from what those of one campaign look like, and its limit."""
    unit = observations.unit
    values = {name: mean_by(unit, x, own) for name, x in turns.items()}
    groups = mean_by(unit, observations.group.astype(np.float64), own).astype(np.int64)
    known = fit_likeness(values, groups, varying_of(values, list(VARIES)), turns, unit, own)
    if known is None:
        return np.full(own.shape, np.nan), np.inf
    truth = {name: mean_by(unit, x, own) for name, x in observations.truth.items()}
    sliding = _sliding(fit_sliding_of(truth, values), turns, observations.truth)
    apart = known.apart(turns, laws_of(observations, values), sliding=sliding)
    seen = np.ones(own.shape, dtype=np.bool_)
    held = {"camber": turns["camber"], **observations.truth}
    for name, slack in BEYOND.items():
        x = held[name]
        low, high = np.nanmin(x[own], initial=0.0), np.nanmax(x[own], initial=0.0)
        seen &= ~(x < low - slack) & ~(x > high + slack)
    return np.where(seen, apart, np.nan), known.limit


def _sliding(
    curve: SlidingCurve | None, turns: Mapping[str, FloatArray], truth: Mapping[str, FloatArray]
) -> FloatArray | None:
    """Return how much more of the tread may slide on each turn's road, with the slip's sign."""
    friction = turns["friction"]
    if curve is None or np.isnan(friction).all():
        return None
    load = np.maximum(truth["Fz"], 1.0)
    road = np.where(np.isnan(friction), curve.friction, friction)
    told = curve.at(np.abs(truth["Fy"]) / load, load, road, truth["slip_ratio"])
    return np.where(truth["slip_angle"] < 0.0, -1.0, 1.0) * np.nan_to_num(told.sliding)
