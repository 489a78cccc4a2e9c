"""What the links of a chain are fitted to, and what they leave behind."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray, IntArray
from tirelib.estimators.ends import outermost
from tirelib.estimators.fit import Fit, bands_of, levels_of

VARIES = {
    "contact_angle": 0.02,
    "traction": 0.08,
    "camber": 0.02,
    "slip_ratio": 0.02,
    "slip_angle": np.deg2rad(1.0),
    "side": 300.0,
    "load": 300.0,
    "pressure": 1e4,
    "speed_squared": 60.0,
    "cp1_slope": 0.02,
    "cp2_slope": 0.02,
    "angle_slope": 0.002,
    "tp_slope": 0.02,
    "angle_bow": 0.005,
    "tp_bow": 0.02,
    "cp1_bow": 0.01,
    "cp2_bow": 0.01,
    "fullness": 0.02,
    "skew": 0.0005,
    "steepness": 0.1,
    "steepness_change": 0.1,
    "lead_bend": 0.01,
    "trail_bend": 0.01,
}
"""Range (SI) that a regressor must cover in the data to enter a regression."""
BETWEEN = ("load", "slip_angle", "slip_ratio")
"""What a wheel does between the conditions of a plan."""


@dataclass(frozen=True, slots=True)
class Links:
    """What the fits of one chain leave behind for reports.

    Rows are independent measurements (runs, or turns of sweeps). `held_out` are predictions by fits
    that had not seen the row's condition; `refused` says why a quantity has no model.
    """

    unit: IntArray
    groups: IntArray
    values: dict[str, FloatArray]
    truth: dict[str, FloatArray]
    nominal: dict[str, FloatArray]
    held_out: dict[str, FloatArray]
    candidates: dict[str, tuple[tuple[int, float], ...]]
    refused: dict[str, str]

    def load_level(self) -> IntArray | None:
        """Return the levels at which the load was held; None if it was not held at some."""
        return levels_of(self.truth["Fz"])

    def between(self) -> list[IntArray]:
        """Return levels, or bands, of load, slip angle and slip ratio, as far as varied."""
        varied = self._varied()
        return [bands_of(varied[name]) for name in BETWEEN if name in varied]

    def outermost(self) -> list[BoolArray]:
        """Return the rows at either end of every condition that was varied."""
        return list(outermost(self._varied()))

    def _varied(self) -> dict[str, FloatArray]:
        varied = {
            "load": self.truth["Fz"],
            "side": np.abs(self.truth["Fy"]),
            "slip_angle": np.abs(self.truth["slip_angle"]),
            "slip_ratio": self.truth["slip_ratio"],
            "camber": np.abs(self.values["camber"]),
            "pressure": self.values["pressure"],
            "speed_squared": self.values["speed_squared"],
        }
        return {name: x for name, x in varied.items() if np.ptp(x) > VARIES[name]}


def varying_of(values: dict[str, FloatArray], names: Sequence[str]) -> set[str]:
    """Return the regressors that cover a range worth fitting."""
    return {
        name
        for name in names
        if name in values
        and np.isfinite(values[name]).all()
        and np.ptp(values[name]) > VARIES[name]
    }


def frozen_with_slip(links: Links, varying: set[str]) -> set[str]:
    """Return the conditions that stand still wherever there is lateral force."""
    cornering = np.abs(links.truth["Fy"]) > 0.2 * np.abs(links.truth["Fy"]).max()
    part = {name: x[cornering] for name, x in links.values.items()}
    return varying - varying_of(part, sorted(varying))


def keep(links: Links, quantity: str, fit: Fit, held_out: FloatArray) -> None:
    """Keep what a fit says of conditions that it had not seen, and its candidates."""
    links.held_out[quantity] = held_out
    links.candidates[quantity] = fit.candidates
