"""Campaigns of one calibration that do not look like the same tire."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tirelib.arrays import BoolArray, FloatArray
from tirelib.estimators.calibrate import VARIES, laws_of, varying_of
from tirelib.estimators.likeness import suspected
from tirelib.estimators.likeness_fit import fit_likeness
from tirelib.estimators.regressors import EVEN, ODD, compute_regressors
from tirelib.observations import Observations, mean_by

BEYOND = {"camber": np.deg2rad(0.5), "slip_angle": np.deg2rad(0.5), "slip_ratio": 0.005}
"""How far (SI) beyond the conditions of a campaign another can still be compared with it."""


@dataclass(frozen=True, slots=True)
class Stranger:
    """A campaign with strain that the tire of another does not show.

    `turns` of the `judged` ones; `name` and `of` are the campaigns.
    """

    name: str
    of: str
    turns: int
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
            unlike = int((judged & (apart > limit)).sum())
            if other != of and suspected(unlike, int(judged.sum())):
                name, known = (observations.headers[number].name for number in (other, of))
                stranger = Stranger(name, known, unlike, int(judged.sum()))
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
    apart = known.apart(turns, laws_of(observations, values))
    seen = np.ones(own.shape, dtype=np.bool_)
    held = {"camber": turns["camber"], **observations.truth}
    for name, slack in BEYOND.items():
        x = held[name]
        low, high = np.nanmin(x[own], initial=0.0), np.nanmax(x[own], initial=0.0)
        seen &= ~(x < low - slack) & ~(x > high + slack)
    return np.where(seen, apart, np.nan), known.limit
