"""Contact length, deflection, entry and exit of every run: measured, by the model, in words."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import special

from tirelib.campaign import Tolerance
from tirelib.core.arrays import BoolArray, FloatArray, IntArray, rms
from tirelib.inference.compare.model import Prediction
from tirelib.inference.compare.regions import LEAST_SHARE, LEVEL, SLIPS, subsets
from tirelib.inference.compare.runs import Factor
from tirelib.inference.compare.sentences import conditions
from tirelib.inference.identify.random_effects import angle_slope
from tirelib.measured.features.peaks import peak
from tirelib.measured.waveforms import GRID, Waveforms

REACH = 0.8
"""Angle within which the contact's ends are looked for, [rad]."""
WORDS = {
    "contact length": ("long", "short"),
    "deflection": ("large", "small"),
    "contact entry": ("late", "early"),
    "contact exit": ("late", "early"),
}
"""What a positive and a negative difference, model less measured, is called."""


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
    """

    name: str
    unit: str
    scale: float
    measured: FloatArray
    model: FloatArray
    model_std: FloatArray
    noise: float
    freedom: int

    @property
    def constant(self) -> bool:
        """Whether the measured number may hold a constant error of the rig."""
        return self.name == "deflection"

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
    start, step = float(GRID[0]), 2.0 * np.pi / GRID.size
    entry, _, _ = peak(slope, (GRID < 0.0) & (GRID > -REACH), start, step)
    leaving, _, _ = peak(-slope, (GRID > 0.0) & (GRID < REACH), start, step)
    return np.stack([entry, leaving], axis=1)


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
    degree = float(np.rad2deg(1.0))
    per_angle, unit, scale = np.ones(len(strain)), "deg", degree
    if np.isfinite(radius).all():
        per_angle, unit, scale = radius, "mm", 1e3
    found = {"contact length": (unit, scale, [per_angle * part for part in (*lengths, spread)])}
    deflection = waves.header.tire.free_radius - c["loaded_radius"]
    if np.isfinite(deflection).any():
        by_load = np.abs(prediction.deflection_by_load) * tolerance.load
        found["deflection"] = "mm", 1e3, [deflection, prediction.deflection, by_load]
    zero = np.minimum(waves.angle_std, 1.0)
    for side, name in enumerate(("contact entry", "contact exit")):
        std = np.sqrt(moved[0][:, side] ** 2 + moved[1][:, side] ** 2 + zero**2)
        found[name] = "deg", degree, [measured[:, side], model[:, side], std]
    return tuple(
        Track(name, unit, scale, seen, said, std, *pooled(seen - said, group))
        for name, (unit, scale, (seen, said, std)) in found.items()
    )


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


@dataclass(frozen=True, slots=True)
class TrackFit:
    """A track over the counted runs, SI; NaN where nothing is known.

    Attributes
    ----------
    mean, std : float
        Mean of model less measured, and its standard deviation by noise and set points.
    rms : float
        Rms of model less measured.
    rms_beside : float
        The same with the mean, a constant offset, taken out.
    """

    runs: int
    mean: float
    std: float
    rms: float
    rms_beside: float


def track_fit(track: Track, counted: BoolArray) -> TrackFit:
    """Return how far model and measurement are apart."""
    shown = track.known & counted
    d = track.difference[shown]
    if not d.size:
        return TrackFit(0, *(4 * [float("nan")]))
    return TrackFit(d.size, float(d.mean()), _std(track, shown), rms(d), float(d.std()))


def track_sentences(
    found: Sequence[Track], counted: BoolArray, factors: Sequence[Factor]
) -> tuple[str, ...]:
    """Say for every track the runs in which it is off most, if more than by noise and set points.

    The level is divided by all candidates. A constant offset that the rig's zero could explain is
    taken out before, and told.
    """
    plain = [factor for factor in factors if factor.name not in SLIPS]
    groups = subsets(counted, plain)
    out = []
    for track in found:
        shown = track.known & counted
        if not track.freedom or not shown.any():
            continue
        offset = float(track.difference[shown].mean()) if track.constant else 0.0
        rest = track.difference - offset
        total = float(np.sum(rest[shown] ** 2))
        best, most = "", LEAST_SHARE * total
        for group in groups:
            member = group.member & shown
            if not member.any() or (track.constant and group.by == "all"):
                continue
            mean, std = float(rest[member].mean()), _std(track, member)
            t = abs(mean) / std if std > 0.0 else 0.0
            p = 2.0 * special.stdtr(track.freedom, -t) * len(groups) * len(found)
            size = int(member.sum()) * mean**2
            if p < LEVEL and size > most:
                limit = conditions(group.by, group.side, group.value) or "in all runs"
                best, most = _say(track, limit, mean, std, int(member.sum()), offset), size
        if best:
            out.append(best)
    return tuple(out)


def _std(track: Track, member: BoolArray) -> float:
    """Return the standard deviation of a mean over runs, by noise and set points."""
    square = np.nan_to_num(track.noise) ** 2 + np.nan_to_num(track.model_std[member]) ** 2
    return float(np.sqrt(square.sum()) / member.sum()) if track.freedom else float("nan")


def _say(track: Track, limit: str, mean: float, std: float, runs: int, offset: float) -> str:
    word = WORDS[track.name][0 if mean > 0.0 else 1]
    text = f"{track.name.capitalize()}, {limit}: the model's is "
    text += f"{_short(track.scale * abs(mean))} {track.unit} too {word} (95 % "
    text += f"\N{PLUS-MINUS SIGN} {_short(1.96 * track.scale * std)}, {runs} runs)"
    if track.constant:
        text += (
            f", apart from a constant {_short(track.scale * offset)} {track.unit} in all runs, "
            "which may be the zero of the rig's loaded radius"
        )
    return text + "."


def _short(value: float) -> str:
    return f"{value:.2g}"
