"""From a campaign's waveforms to what a fit needs, with every reason why it cannot be done."""

from dataclasses import dataclass

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.campaign import Tolerance
from tirelib.errors import CalibrationError
from tirelib.identify.fit_cost import Data
from tirelib.identify.noise import RepeatNoise, measured_tangents, repeat_noise
from tirelib.model.base import operating_points
from tirelib.waveforms import Waveforms

LEAST_RUNS = 4
LEAST_LOAD_RATIO = 1.25
WEAK_GAGE = 0.3
STRUCTURE = 0.016
"""White part of the structural misfit, relative to the rms strain."""


@dataclass(frozen=True, slots=True)
class StraightRuns:
    """Straight, freely rolling runs of a campaign.

    Attributes
    ----------
    waves : Waveforms
        Of these runs.
    strain : shape (n_runs, n_phi), [-]
        Mean over the gages in use: the ring is as wide as the belt, and so is this mean.
    gages : tuple of int
        Indices of the gages in use.
    noise : RepeatNoise
    deflection : shape (n_runs,), [m]
        Free radius less measured loaded radius; NaN where not measured.
    """

    waves: Waveforms
    strain: FloatArray
    gages: tuple[int, ...]
    noise: RepeatNoise
    deflection: FloatArray

    def data(self, *, with_deflection: bool = True) -> Data:
        """Return the runs as data of a fit."""
        typical = float(np.sqrt(np.mean(self.strain**2)))
        noise = self.noise.std if self.noise.known else 0.0
        return Data(
            strain=self.strain,
            points=operating_points(self.waves),
            angle_std=self.waves.angle_std,
            tolerance=self.waves.header.tolerance or Tolerance(0.005, 0.002, 0.001, 0.003),
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
    chosen = waves.take(waves.straight & np.isfinite(waves.conditions["Fz"]))
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
            "told apart; add a run at another load"
        )
    gages = working_gages(chosen)
    strain = chosen.strain[:, gages].mean(axis=1)
    radius = chosen.header.tire.free_radius
    deflection = radius - chosen.conditions["loaded_radius"]
    wrong = np.flatnonzero(
        np.isfinite(deflection) & ((deflection <= 0) | (deflection > 0.3 * radius))
    )
    if wrong.size:
        first = wrong[0]
        raise CalibrationError(
            f"{name}, run {chosen.run[first]}: loaded radius "
            f"{1e3 * chosen.conditions['loaded_radius'][first]:.1f} mm with a free radius of "
            f"{1e3 * radius:.1f} mm; it has to be smaller, by less than 30 %; correct "
            "tire.free_radius_m or the channel"
        )
    noise = repeat_noise(strain, chosen.group, measured_tangents(chosen, strain))
    return StraightRuns(chosen, strain, gages, noise, deflection)


def working_gages(waves: Waveforms) -> tuple[int, ...]:
    """Return the gages whose waveforms are as large as the others', in symmetric pairs.

    Raises
    ------
    CalibrationError
        If none works; naming run and gage.
    """
    size = np.sqrt(np.mean(waves.strain**2, axis=2))
    typical = np.nanmedian(size, axis=1, keepdims=True)
    good = np.isfinite(size) & (size > WEAK_GAGE * typical)
    works = good.all(axis=0)
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
