"""Noise of a run's waveform, from runs that were repeated."""

from dataclasses import dataclass

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.identify.random_effects import angle_slope
from tirelib.waveforms import Waveforms

FLOOR = 1e-7


@dataclass(frozen=True, slots=True)
class Noise:
    """Noise of the centre gage's run waveforms.

    Attributes
    ----------
    std : float, [-]
        Standard deviation of a sample of a run's mean waveform; NaN without repeats.
    repeats : int
        Groups of equal set points with more than one run.
    raw : float, [-]
        The same with the set points' differences left in.
    """

    std: float
    repeats: int
    raw: float


def noise_of(waves: Waveforms, strain: FloatArray) -> Noise:
    """Return the noise of waveforms (n_runs, n_phi) from repeats.

    Repeats differ in load, pressure, gain and angle zero as well; what such differences can
    explain (a gain, a shift, and the change with load between neighbouring groups) is taken out.
    """
    left, raw, freedom = 0.0, 0.0, 0.0
    groups = 0
    size = strain.shape[1]
    loads = waves.conditions["Fz"]
    for group in np.unique(waves.group):
        member = np.flatnonzero(waves.group == group)
        if member.size < 2:
            continue
        groups += 1
        mean = strain[member].mean(axis=0)
        shapes = [mean, angle_slope(mean), _load_slope(strain, loads, waves, member)]
        basis = np.linalg.qr(np.stack([s for s in shapes if s is not None], axis=1))[0]
        rest = strain[member] - mean
        raw += float(np.sum(rest**2))
        rest = rest - (rest @ basis) @ basis.T
        left += float(np.sum(rest**2))
        freedom += (member.size - 1) * (size - basis.shape[1])
    if groups == 0:
        return Noise(np.nan, 0, np.nan)
    return Noise(max(float(np.sqrt(left / freedom)), FLOOR), groups, float(np.sqrt(raw / freedom)))


def _load_slope(
    strain: FloatArray, loads: FloatArray, waves: Waveforms, member: np.ndarray
) -> FloatArray | None:
    """Return the change of waveform with load next to a group, from runs at like conditions."""
    c = waves.conditions
    like = np.isclose(c["pressure"], c["pressure"][member].mean(), rtol=0.03) & np.isclose(
        c["speed"], c["speed"][member].mean(), rtol=0.03
    )
    like[member] = False
    other = np.flatnonzero(like & (np.abs(loads - loads[member].mean()) > 1.0))
    if other.size == 0:
        return None
    near = other[np.argmin(np.abs(loads[other] - loads[member].mean()))]
    slope: FloatArray = strain[near] - strain[member].mean(axis=0)
    return slope
