"""From a campaign's waveforms to what a fit needs, with every reason why it cannot be done."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tirelib.campaign import Tolerance
from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.core.errors import CalibrationError
from tirelib.effects.state import Operating
from tirelib.inference.identify.noise import RepeatNoise, measured_tangents, repeat_noise
from tirelib.inference.identify.strain_notes import (
    LEAST_LOAD_RATIO,
    LEAST_RUNS,
    MOST_STRAIN,
    WEAK_GAGE,
    gage_sizes,
    named,
    some_gage_works,
)
from tirelib.measured.signal import LowPass
from tirelib.measured.waveforms import GRID, Waveforms
from tirelib.model.base import operating_points

TYPICAL_TOLERANCE = Tolerance(0.005, 0.002, 0.001, 0.003)
"""Tolerance of set points, where a campaign does not say its own."""

STRUCTURE = 0.016
"""White part of the structural misfit, relative to the rms strain."""
MIDDLE = 0.05
"""Half of the angle below the axle over which the sign of the strain is looked at, [rad]."""
LEAST_DEFLECTIONS = 3
"""Measured deflections below which none takes part in a fit: zero, slope and one to check them."""
FIRST_RUNS = 15
"""Runs with which a fit may begin: the others only make it more accurate. To diagnose two campaigns
of 66 runs takes 87 and 194 s of CPU with it, 91 and 185 with half, 94 and 143 with double, 110 and
176 with all of them, on a machine that others used as well; the verdicts are the same. On seven
plain tires of three families with 66 runs, 16 and 33 of them say alike from which start
identification ends lower, and so do 8 on six; all 66 agree on the four where both starts were
fitted to the end."""
GEOMETRY_ERROR = 1e-3
"""By which lengths of a tire may contradict each other, [m]: as a tape measure does."""


def begins_with(count: int) -> BoolArray:
    """Return with which runs (count,) a fit begins: a quarter at random; all if they are few."""
    if count < 2 * FIRST_RUNS:
        return np.ones(count, dtype=bool)
    chosen = np.zeros(count, dtype=bool)
    chosen[np.random.default_rng(0).permutation(count)[: max(FIRST_RUNS, count // 4)]] = True
    return chosen


@dataclass(frozen=True, slots=True)
class Data:
    """What is fitted: the waveforms of one gage and, where measured, the deflections.

    Attributes
    ----------
    strain : shape (n_runs, n_phi), [-]
    angle_std : shape (n_runs,), [rad]
    noise : float, [-]
    deflection : shape (n_runs,), [m]
        Free radius less measured loaded radius; NaN where not measured.
    deflection_std : float, [m]
        Random part of it.
    """

    strain: FloatArray
    points: Operating
    angle_std: FloatArray
    tolerance: Tolerance
    noise: float
    low_pass: LowPass
    deflection: FloatArray
    deflection_std: float = 1e-4

    @property
    def with_deflection(self) -> bool:
        """Whether enough deflections are known."""
        return int(np.isfinite(self.deflection).sum()) >= LEAST_DEFLECTIONS

    def take(self, index: Any) -> "Data":
        """Return the data of some runs."""
        return replace(
            self,
            strain=self.strain[index],
            points=self.points.take(index),
            angle_std=self.angle_std[index],
            deflection=self.deflection[index],
        )


@dataclass(frozen=True, slots=True)
class StraightRuns:
    """Straight, freely rolling runs of a campaign.

    Attributes
    ----------
    waves : Waveforms
        Waveforms of these runs.
    strain : shape (n_runs, n_phi), [-]
        Mean over the gages in use: the ring is as wide as the belt, and so is this mean.
    gages : tuple of int
        Indices of the gages in use.
    deflection : shape (n_runs,), [m]
        Free radius less measured loaded radius; NaN where not measured.
    """

    waves: Waveforms
    strain: FloatArray
    gages: tuple[int, ...]
    noise: RepeatNoise
    deflection: FloatArray

    @property
    def tolerance(self) -> Tolerance:
        """Tolerance of the set points: the campaign's, else the typical one."""
        return self.waves.header.tolerance or TYPICAL_TOLERANCE

    def data(self, *, with_deflection: bool = True) -> Data:
        """Return the runs as data of a fit."""
        typical = float(np.sqrt(np.mean(self.strain**2)))
        noise = self.noise.std if self.noise.known else 0.0
        return Data(
            strain=self.strain,
            points=operating_points(self.waves),
            angle_std=self.waves.angle_std,
            tolerance=self.tolerance,
            noise=float(np.hypot(noise, STRUCTURE * typical)),
            low_pass=self.waves.low_pass,
            deflection=self.deflection if with_deflection else np.full(len(self.waves), np.nan),
        )


def straight_runs(waves: Waveforms) -> StraightRuns:
    """Return the straight runs of a campaign.

    Raises
    ------
    CalibrationError
        If there are too few of them, or too few loads, or no gage works; with the runs and the
        numbers.
    """
    name = waves.header.name
    works = some_gage_works(waves)
    chosen = waves.take(waves.straight & usable(waves))
    if len(chosen) < LEAST_RUNS and (waves.straight & ~works).any():
        finder = int(np.argmin(np.abs(waves.header.gage_lateral)))
        raise CalibrationError(
            f"{name}, {named(waves.run[waves.straight & ~works])}: no gage gives a whole waveform; "
            f"{len(chosen)} straight runs are left, at least {LEAST_RUNS} are needed; look for "
            f"noise in gage {finder + 1} at {1e3 * waves.header.gage_lateral[finder]:+.0f} mm, "
            "which finds the contacts, or for samples that are no numbers"
        )
    if len(chosen) < LEAST_RUNS:
        raise CalibrationError(
            f"{name}: {len(chosen)} straight runs with strain and load; at least {LEAST_RUNS} are "
            f"needed; the campaign has {len(waves)} runs with strain, the others have a slip "
            "angle, camber or slip ratio; measure straight runs at several loads"
        )
    loads = chosen.conditions["Fz"]
    if loads.max() < LEAST_LOAD_RATIO * loads.min():
        raise CalibrationError(
            f"{name}: loads from {loads.min():.0f} to {loads.max():.0f} N; the largest has to be "
            f"{LEAST_LOAD_RATIO} times the smallest or more, else stiffness and tread cannot be "
            "separated; add a run at another load"
        )
    _refuse_geometry(chosen)
    _refuse(chosen, _conditions(chosen))
    gages = working_gages(chosen)
    strain = chosen.strain[:, gages].mean(axis=1)
    deflection = chosen.header.tire.free_radius - chosen.conditions["loaded_radius"]
    _refuse(chosen, _shapes(chosen, strain, deflection))
    return StraightRuns(chosen, strain, gages, straight_noise(chosen, strain), deflection)


def usable(waves: Waveforms) -> BoolArray:
    """Return which runs a model can be held against: load and pressure known, a gage that works."""
    known = np.isfinite(waves.conditions["Fz"]) & np.isfinite(waves.conditions["pressure"])
    return np.asarray(known & some_gage_works(waves))


def straight_noise(waves: Waveforms, strain: FloatArray) -> RepeatNoise:
    """Return the noise of straight runs from their repeats: of the data alone, whatever the model.

    The strain (n_runs, n_phi), [-], is the mean over the gages in use.
    """
    return repeat_noise(strain, waves.group, measured_tangents(waves, strain))


def working_gages(waves: Waveforms) -> tuple[int, ...]:
    """Return the gages whose waveforms are as large as the others', in symmetric pairs.

    Raises
    ------
    CalibrationError
        If none works; naming run and gage.
    """
    size, typical = gage_sizes(waves.strain)
    good = np.isfinite(size) & (size > WEAK_GAGE * typical)
    works = np.asarray(good.all(axis=0))
    lateral = np.array(waves.header.gage_lateral)
    pairs = []
    for i, y in enumerate(lateral):
        twin = int(np.argmin(np.abs(lateral + y)))
        if works[i] and works[twin] and abs(lateral[twin] + y) < 2e-3:
            pairs.append(i)
    if not pairs:
        run, gage = np.argwhere(~good)[0]
        raise CalibrationError(
            f"{waves.header.name}, run {waves.run[run]}: gage {gage + 1} at "
            f"{1e3 * lateral[gage]:+.0f} mm shows {1e6 * size[run, gage]:.0f} microstrain rms "
            f"where the others show {1e6 * typical[run, 0]:.0f}; no symmetric pair of gages works "
            "in every run; leave out that run or mend the gage"
        )
    return tuple(pairs)


def _refuse_geometry(waves: Waveforms) -> None:
    """Raise where the lengths of the campaign's tire contradict each other."""
    tire = waves.header.tire
    if tire.tread_thickness is None or tire.ring_radius is None:
        return
    room = tire.free_radius - tire.ring_radius
    if tire.tread_thickness > room + GEOMETRY_ERROR:
        raise CalibrationError(
            f"{waves.header.name}: tire.tread_thickness_m = {tire.tread_thickness:g} m does not "
            f"fit between tire.ring_radius_m = {tire.ring_radius:g} m and tire.free_radius_m = "
            f"{tire.free_radius:g} m, which leave {room:.4g} m; the tread lies outside the belt's "
            "neutral line; correct one of the three"
        )


Checks = Iterator[tuple[BoolArray, FloatArray, str]]
"""Which runs are wrong, a value of each, and the words with the place of the value."""


def _refuse(waves: Waveforms, checks: Checks) -> None:
    """Raise for the first run that is wrong by the first check that finds one."""
    for wrong, value, words in checks:
        if wrong.any():
            first = int(np.argmax(wrong))
            raise CalibrationError(
                f"{waves.header.name}, run {waves.run[first]}: {words.format(value[first])}"
            )


def _conditions(waves: Waveforms) -> Checks:
    """Tell runs whose load, inflation pressure or turn rate no rolling ring has."""
    for name, least, unit, factor, words in (
        ("Fz", 10.0, "N", 1.0, "the sign or the unit"),
        ("pressure", 1e4, "bar", 1e-5, "the channel or its unit"),
        ("omega", 0.1, "rad/s", 1.0, "the channel or its unit"),
    ):
        value = waves.conditions[name]
        yield (
            value < least,
            factor * value,
            f"{name} is {{:.4g}} {unit}; at least {factor * least:g} {unit} is allowed for a "
            f"rolling, inflated tire; correct {words}, or leave the run out",
        )


def _shapes(waves: Waveforms, strain: FloatArray, deflection: FloatArray) -> Checks:
    """Tell runs whose innerliner is torn or not stretched in the contact, or that stand too low."""
    size = np.sqrt(np.mean(strain**2, axis=1))
    yield (
        size > MOST_STRAIN,
        1e6 * size,
        f"{{:.3g}} microstrain rms; at most {1e6 * MOST_STRAIN:.0f} is allowed; correct the unit "
        "of the gages",
    )
    middle = strain[:, np.abs(GRID) < MIDDLE].mean(axis=1)
    yield (
        middle <= 0.0,
        1e6 * middle,
        "{:.0f} microstrain below the axle, against the mean of the turn; the belt is bent flat "
        "there and its inside stretched, tension is positive; correct the sign of the gages",
    )
    radius = waves.header.tire.free_radius
    yield (
        np.isfinite(deflection) & ((deflection <= 0) | (deflection > 0.3 * radius)),
        1e3 * waves.conditions["loaded_radius"],
        f"loaded radius {{:.1f}} mm with a free radius of {1e3 * radius:.1f} mm; it has to be "
        "smaller, by less than 30 %; correct tire.free_radius_m or the channel",
    )
