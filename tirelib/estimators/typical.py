"""Choose the turn that stands for a calibration."""

from collections.abc import Iterator, Sequence

import numpy as np

from tirelib.campaign import Campaign
from tirelib.core.arrays import FloatArray
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.reference_turn import ReferenceTurn, folded
from tirelib.measured.observations import Observations

MOST_TRIED = 20
"""Turns that are looked at in the recordings."""


def typical_turn(
    campaigns: Sequence[Campaign], observations: Observations, calibration: Calibration
) -> ReferenceTurn | None:
    """Return the valid turn nearest to the middle of what was calibrated; None without one.

    Parameters
    ----------
    campaigns : sequence of Campaign
        Those of the observations, in their order.
    observations : Observations
    calibration : Calibration
        Made of them.
    """
    features = observations.features
    for row in _by_distance(observations, calibration)[:MOST_TRIED]:
        campaign = campaigns[int(observations.campaign[row])]
        number = int(observations.run[row])
        run = campaign.load(next(plan for plan in campaign.plans if plan.run == number))
        if run.strain is None:
            continue
        middle = (float(features.time[row]) - run.start_time) * run.rate
        turn = folded(run.strain, middle, float(features.period[row]) * run.rate)
        if turn is not None:
            return ReferenceTurn(
                turn,
                speed=float(features.speed[row]),
                pressure=float(features.pressure[row]),
                camber=float(features.camber[row]),
                omega=float(features.omega[row]),
                run=f"{campaign.header.name}, run {number}",
            )
    return None


def _by_distance(observations: Observations, calibration: Calibration) -> list[int]:
    """Return the numbers of the valid turns, the one nearest to the middle first."""
    found = calibration.estimate(observations.features)
    rows = np.flatnonzero(found.turn_valid & (found.flags == 0))
    if not rows.size:
        return []
    apart = np.zeros(rows.size)
    for values in _wanted(observations, calibration, found.value):
        x = values[rows]
        reach = float(np.ptp(x))
        if reach > 0.0:
            apart = np.maximum(apart, np.abs(x - 0.5 * (x.min() + x.max())) / reach)
    return [int(row) for row in rows[np.argsort(apart, kind="stable")]]


def _wanted(
    observations: Observations, calibration: Calibration, value: dict[str, FloatArray]
) -> Iterator[FloatArray]:
    """Yield what should lie in the middle: the estimates, and the conditions that were measured."""
    features = observations.features
    yield from (x for name, x in value.items() if calibration.chains[-1].has(name))
    for held in (features.speed, features.pressure, features.camber):
        if np.isfinite(held).all():
            yield held
