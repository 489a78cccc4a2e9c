"""Contact length, deflection, entry and exit of every run, measured and by the model."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tirelib.campaign import Tolerance
from tirelib.core.arrays import BoolArray, FloatArray, IntArray
from tirelib.inference.compare.model import Prediction
from tirelib.inference.identify.random_effects import angle_slope
from tirelib.measured.waveforms import GRID, Waveforms

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
        Noise of the measured number, from repeats; NaN without.
    freedom : int
        Degrees of freedom of the noise.
    constant : bool
        Whether the measured number may hold a constant error of the rig.
    """

    name: str
    unit: str
    scale: float
    measured: FloatArray
    model: FloatArray
    model_std: FloatArray
    noise: float
    freedom: int
    constant: bool = False

    def in_noise(self, rms: float) -> float:
        """Return an rms in units of the noise; NaN where repeats are the same to the last digit."""
        return rms / self.noise if self.noise > 0.0 else float("nan")

    @property
    def difference(self) -> FloatArray:
        """Model less measured, SI."""
        return np.asarray(self.model - self.measured)

    @property
    def known(self) -> BoolArray:
        """Runs in which both are known."""
        return np.asarray(np.isfinite(self.measured) & np.isfinite(self.model))


def contact_edges(strain: FloatArray) -> FloatArray:
    """Return the angles of the steepest rise and of the steepest fall of strain, (n_runs, 2).

    Measurement and model are read in the same way; the contact's own edges differ a little.
    """
    slope = angle_slope(strain)
    entry = _peak(slope, (GRID < 0.0) & (GRID > -REACH))
    leaving = _peak(-slope, (GRID > 0.0) & (GRID < REACH))
    return np.stack([entry, leaving], axis=1)


def contact_angle(strain: FloatArray) -> FloatArray:
    """Return the angle from the steepest rise of strain to its steepest fall, (n_runs,), [rad]."""
    edges = contact_edges(strain)
    return np.asarray(edges[:, 1] - edges[:, 0])


def tracks(
    waves: Waveforms, strain: FloatArray, prediction: Prediction, tolerance: Tolerance
) -> tuple[Track, ...]:
    """Return contact length, deflection (where the loaded radius is known), entry and exit."""
    c, group = waves.conditions, waves.group
    radius = np.asarray(c["speed"] / np.where(c["omega"] > 0.0, c["omega"], np.nan))
    measured, model = contact_edges(strain), contact_edges(prediction.strain)
    moved = [
        contact_edges(prediction.strain + size * slope) - model
        for slope, size in (
            (prediction.by_load, tolerance.load),
            (prediction.by_pressure, tolerance.pressure),
        )
    ]
    lengths = [np.diff(edges, axis=1)[:, 0] for edges in (measured, model)]
    spread = np.hypot(*(np.diff(part, axis=1)[:, 0] for part in moved))
    per_angle, unit, scale = np.ones(len(strain)), "deg", float(np.rad2deg(1.0))
    if np.isfinite(radius).all():
        per_angle, unit, scale = radius, "mm", 1e3
    length = [per_angle * part for part in (*lengths, spread)]
    out = [_track("contact length", unit, scale, length, group)]
    deflection = waves.header.tire.free_radius - c["loaded_radius"]
    if np.isfinite(deflection).any():
        by_load = np.abs(prediction.deflection_by_load) * tolerance.load
        depth = [deflection, prediction.deflection, by_load]
        out.append(_track("deflection", "mm", 1e3, depth, group, constant=True))
    zero = np.minimum(waves.angle_std, 1.0)
    for side, name in enumerate(("contact entry", "contact exit")):
        std = np.sqrt(moved[0][:, side] ** 2 + moved[1][:, side] ** 2 + zero**2)
        angle = [measured[:, side], model[:, side], std]
        out.append(_track(name, "deg", float(np.rad2deg(1.0)), angle, group))
    return tuple(out)


def _track(
    name: str,
    unit: str,
    scale: float,
    numbers: Sequence[FloatArray],
    group: IntArray,
    *,
    constant: bool = False,
) -> Track:
    measured, model, std = numbers
    noise, freedom = pooled(measured - model, group)
    return Track(name, unit, scale, measured, model, std, noise, freedom, constant)


def pooled(values: FloatArray, group: IntArray) -> tuple[float, int]:
    """Return the standard deviation within groups and its degrees of freedom.

    NaN and 0 if no group has two known values.
    """
    square, freedom = 0.0, 0
    for number in np.unique(group):
        part = values[(group == number) & np.isfinite(values)]
        if part.size > 1:
            square += float(np.sum((part - part.mean()) ** 2))
            freedom += part.size - 1
    return float(np.sqrt(square / freedom)) if freedom else float("nan"), freedom


def _peak(values: FloatArray, inside: BoolArray) -> FloatArray:
    """Return the angle of each row's largest value inside, by a parabola through three samples."""
    index = np.argmax(np.where(inside, values, -np.inf), axis=1)
    row = np.arange(len(values))
    before, top, after = (values[row, (index + k) % GRID.size] for k in (-1, 0, 1))
    bend = before - 2.0 * top + after
    shift = np.where(bend < 0.0, 0.5 * (before - after) / np.where(bend < 0.0, bend, -1.0), 0.0)
    step = GRID[1] - GRID[0]
    return np.asarray(GRID[index] + np.clip(shift, -0.5, 0.5) * step)
