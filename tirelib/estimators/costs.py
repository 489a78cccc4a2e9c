"""What it costs that a condition is not given: standard deviations with and without it.

Turns are estimated as they are, and again with one of the conditions that nobody gave held at the
middle of its calibrated values; the features of the strain stay the same.
"""

from dataclasses import dataclass, replace

import numpy as np

from tirelib.estimators.calibration import Calibration
from tirelib.estimators.chain import Chain
from tirelib.estimators.estimate import QUANTITIES, Estimates
from tirelib.measured.features.extract import Features

COLUMN = {
    "camber": "camber_deg",
    "pressure": "pressure_bar",
    "friction": "friction",
    "tread_depth": "tread_depth_mm",
    "tread_temperature": "tread_temperature_degC",
}
"""Conditions that need not be given, with the column of ``runs.csv`` that gives each."""


@dataclass(frozen=True, slots=True)
class Cost:
    """What one unknown condition does to one quantity, over the turns that were measured well, SI.

    Attributes
    ----------
    unknown, quantity : str
    std, std_if_given : float
        Median standard deviation as it is, and if the condition were given; NaN: there is none.
    valid, valid_if_given : float, [1]
        Share of the turns that are valid for this quantity.
    """

    unknown: str
    quantity: str
    std: float
    std_if_given: float
    valid: float
    valid_if_given: float

    @property
    def ratio(self) -> float:
        """How many times larger the standard deviation is; infinite where there is none."""
        return self.std / self.std_if_given if np.isfinite(self.std) else np.inf


def costs_of(calibration: Calibration, features: Features, found: Estimates) -> tuple[Cost, ...]:
    """Return what every condition that no turn gives costs, the dearest first.

    Parameters
    ----------
    calibration : Calibration
    features : Features
    found : Estimates
        What the calibration says of these turns.
    """
    costs: list[Cost] = []
    chain = calibration.chains[-1]
    for unknown in COLUMN:
        given = getattr(features, unknown)
        if np.isfinite(given).any():
            continue
        usual = _usual(chain, unknown)
        if not np.isfinite(usual):
            continue
        other = calibration.estimate(replace(features, **{unknown: np.full(len(features), usual)}))
        for quantity in QUANTITIES:
            cost = _cost(unknown, quantity, found, other)
            if cost.ratio > 1.0:
                costs.append(cost)
    return tuple(sorted(costs, key=lambda cost: -cost.ratio))


def _cost(unknown: str, quantity: str, found: Estimates, other: Estimates) -> Cost:
    rows = np.isfinite(other.std[quantity])
    if not rows.any():
        return Cost(unknown, quantity, 0.0, np.inf, 0.0, 0.0)
    std = found.std[quantity][rows]
    return Cost(
        unknown,
        quantity,
        float(np.median(std)) if np.isfinite(std).all() else np.nan,
        float(np.median(other.std[quantity][rows])),
        float(found.valid[quantity][rows].mean()),
        float(other.valid[quantity][rows].mean()),
    )


def _usual(chain: Chain, unknown: str) -> float:
    """Return the middle of the calibrated values of a condition, SI; NaN where nobody knows."""
    if unknown == "camber":
        ends = [guard for guard in chain.guards["Fy"] if guard.name == "camber"]
        return 0.5 * (ends[0].low + ends[0].high) if ends else 0.0
    if unknown == "pressure":
        return chain.laws.reference_pressure
    if unknown == "tread_depth":
        return float(np.mean(chain.road.depth))
    if unknown == "friction":
        known = float(np.mean(chain.road.friction))
        fitted = np.nan if chain.sliding is None else chain.sliding.friction
        return known if np.isfinite(known) else fitted
    return float(np.mean(chain.road.tread_temperature))
