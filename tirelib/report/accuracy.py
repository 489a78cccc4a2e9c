"""Estimates held against what the rig measured.

Errors are judged on the mean of a run's valid turns (on each turn in a sweep); the coverage of the
95 % intervals is counted over turns.
"""

from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray, IntArray, r_squared, rms
from tirelib.core.quantities import Quantity
from tirelib.estimators.estimate import Estimates
from tirelib.estimators.result import TRUTH
from tirelib.measured.observations import Observations, mean_by

SAID = {
    "Fz": Quantity("vertical load Fz", "force", "N"),
    "alpha": Quantity("slip angle", "angle", "deg", signed=True),
    "kappa": Quantity("slip ratio", "ratio", "%", signed=True),
    "Fy": Quantity("lateral force Fy", "force", "N", signed=True),
}
"""How reports say what is estimated."""
QUANTITIES = tuple(SAID)
LEAST_RANGE = {"Fz": 200.0, "alpha": 0.5, "kappa": 1.0, "Fy": 200.0}
"""Range of the truth, in the report's unit, below which a share of it or an R2 says nothing."""
WIDTH = 1.959964
"""Half-width of a 95 % interval, in standard deviations."""


@dataclass(frozen=True, slots=True)
class Compared:
    """Valid turns of one quantity whose truth is known, in the unit of the report.

    `measured`, `estimated`, `std`, `load` [N] and `unit` (the number of the independent
    measurement) have shape (n,); `turns` counts the turns that were measured well, valid or not.
    """

    quantity: str
    measured: FloatArray
    estimated: FloatArray
    std: FloatArray
    load: FloatArray
    unit: IntArray
    turns: int

    @property
    def inside(self) -> BoolArray:
        """Return which turns have the true value in their 95 % interval."""
        return np.abs(self.estimated - self.measured) <= WIDTH * self.std

    def means(self, values: FloatArray) -> FloatArray:
        """Return the mean over each independent measurement."""
        return mean_by(self.unit, values, np.ones(self.unit.shape, dtype=np.bool_))


@dataclass(frozen=True, slots=True)
class Accuracy:
    """One row of an accuracy table; `rmse` in `unit`, NaN where it is undefined."""

    quantity: str
    title: str
    unit: str
    runs: int
    turns: int
    turns_measured: int
    rmse: float
    percent_of_range: float
    r2: float
    coverage: float


def compare(observations: Observations, estimates: Estimates, quantity: str) -> Compared:
    """Pick the valid turns of a quantity whose truth is known."""
    truth, value, std = (
        SAID[quantity].told(x)
        for x in (
            observations.truth[TRUTH[quantity]],
            estimates.value[quantity],
            estimates.std[quantity],
        )
    )
    rows = estimates.valid[quantity] & np.isfinite(truth) & np.isfinite(value)
    return Compared(
        quantity,
        truth[rows],
        value[rows],
        std[rows],
        observations.truth["Fz"][rows],
        observations.unit[rows],
        int((observations.usable & np.isfinite(truth)).sum()),
    )


def accuracy(compared: Compared) -> Accuracy:
    """Return the row of the accuracy table."""
    measured = compared.means(compared.measured)
    error = compared.means(compared.estimated) - measured
    n = measured.size
    rmse = rms(error)
    spread = float(np.ptp(measured)) if n else 0.0
    varied = spread >= LEAST_RANGE[compared.quantity]
    return Accuracy(
        quantity=compared.quantity,
        title=SAID[compared.quantity].title,
        unit=SAID[compared.quantity].unit,
        runs=n,
        turns=compared.measured.size,
        turns_measured=compared.turns,
        rmse=rmse,
        percent_of_range=100.0 * rmse / spread if varied else np.nan,
        r2=r_squared(measured, error) if varied else np.nan,
        coverage=float(np.mean(compared.inside)) if n else np.nan,
    )


def accuracies(observations: Observations, estimates: Estimates) -> list[Accuracy]:
    """Return the accuracy table; a quantity without a single comparable turn is left out."""
    rows = [accuracy(compare(observations, estimates, quantity)) for quantity in QUANTITIES]
    return [row for row in rows if row.turns]
