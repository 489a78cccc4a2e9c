"""Contact length and deflection of every run, measured and by the model, with bands."""

from dataclasses import dataclass

import numpy as np

from tirelib.arrays import BoolArray, FloatArray, IntArray
from tirelib.campaign import Tolerance
from tirelib.compare.model import Prediction
from tirelib.identify.random_effects import angle_slope
from tirelib.waveforms import GRID, Waveforms

REACH = 0.8
"""Angle within which the contact's ends are looked for, [rad]."""


@dataclass(frozen=True, slots=True)
class Track:
    """One number per run, measured and by the model.

    Attributes
    ----------
    name, unit : str
        What it is; unit of plots and tables.
    scale : float
        SI to that unit.
    measured, model : shape (n_runs,), SI
        NaN where not known.
    model_std : shape (n_runs,), SI
        By the tolerance of the set points.
    noise : float, SI
        Of the measured number, from repeats; NaN without.
    """

    name: str
    unit: str
    scale: float
    measured: FloatArray
    model: FloatArray
    model_std: FloatArray
    noise: float

    @property
    def known(self) -> BoolArray:
        """Runs in which both are known."""
        return np.asarray(np.isfinite(self.measured) & np.isfinite(self.model))


def contact_angle(strain: FloatArray) -> FloatArray:
    """Return the angle from the steepest rise of strain to its steepest fall, (n_runs,), [rad].

    Measurement and model are read in the same way; the contact's own edges differ a little.
    """
    slope = angle_slope(strain)
    entry = _peak(slope, (GRID < 0.0) & (GRID > -REACH))
    leaving = _peak(-slope, (GRID > 0.0) & (GRID < REACH))
    return np.asarray(leaving - entry)


def tracks(
    waves: Waveforms, strain: FloatArray, prediction: Prediction, tolerance: Tolerance
) -> tuple[Track, ...]:
    """Return contact length and deflection; without a loaded radius only the first."""
    c = waves.conditions
    radius = np.asarray(c["speed"] / np.where(c["omega"] > 0.0, c["omega"], np.nan))
    measured = contact_angle(strain)
    model = contact_angle(prediction.strain)
    moved = [
        contact_angle(prediction.strain + size * slope) - model
        for slope, size in (
            (prediction.by_load, tolerance.load), (prediction.by_pressure, tolerance.pressure),
        )
    ]  # fmt: skip
    std = np.hypot(*moved)
    group = waves.group
    name = "contact length"
    if np.isfinite(radius).all():
        length = (name, "mm", 1e3, measured * radius, model * radius, std * radius)
    else:
        length = (name, "deg", float(np.rad2deg(1.0)), measured, model, std)
    out = [_track(*length, group)]
    deflection = waves.header.tire.free_radius - c["loaded_radius"]
    if np.isfinite(deflection).any():
        spread = np.abs(prediction.deflection_by_load) * tolerance.load
        out.append(
            _track("deflection", "mm", 1e3, deflection, prediction.deflection, spread, group)
        )
    return tuple(out)


def _track(
    name: str, unit: str, scale: float, measured: FloatArray, model: FloatArray,
    std: FloatArray, group: IntArray,
) -> Track:  # fmt: skip
    return Track(name, unit, scale, measured, model, std, pooled(measured - model, group))


def pooled(values: FloatArray, group: IntArray) -> float:
    """Return the standard deviation within groups, NaN if none has two known values."""
    square, freedom = 0.0, 0
    for number in np.unique(group):
        part = values[(group == number) & np.isfinite(values)]
        if part.size > 1:
            square += float(np.sum((part - part.mean()) ** 2))
            freedom += part.size - 1
    return float(np.sqrt(square / freedom)) if freedom else float("nan")


def _peak(values: FloatArray, inside: BoolArray) -> FloatArray:
    """Return the angle of each row's largest value inside, by a parabola through three samples."""
    index = np.argmax(np.where(inside, values, -np.inf), axis=1)
    row = np.arange(len(values))
    before, top, after = (values[row, (index + k) % GRID.size] for k in (-1, 0, 1))
    bend = before - 2.0 * top + after
    shift = np.where(bend < 0.0, 0.5 * (before - after) / np.where(bend < 0.0, bend, -1.0), 0.0)
    step = GRID[1] - GRID[0]
    return np.asarray(GRID[index] + np.clip(shift, -0.5, 0.5) * step)
