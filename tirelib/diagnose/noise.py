"""Noise of the waveforms of straight runs, from repeats, as a diagnosis needs it."""

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.diagnose.refit import Refit
from tirelib.identify.campaign_data import StraightRuns
from tirelib.identify.noise import independent
from tirelib.identify.span import span

UNKNOWN_NOISE = 3e-6
"""Noise that variants get where no runs were repeated, [-]."""


def noise_in(runs: StraightRuns) -> float:
    """Return the standard deviation of a sample of a run's waveform, [-]."""
    return runs.noise.std if np.isfinite(runs.noise.std) else UNKNOWN_NOISE


def white_level(runs: StraightRuns, model: Refit, strain: FloatArray) -> float:
    """Return the standard deviation of whitened white noise as strong as the repeats' is.

    What set points, the angle's zero or other numbers of the tire explain of the repeats'
    differences is no noise: a tire that warms up or wears between them is not noisy. Repeats
    differ by smooth noise, n_e independent samples in a turn of n: a shape that is smooth as well
    meets n / n_e times the variance of a sample.

    Parameters
    ----------
    runs : StraightRuns
    model : Refit
    strain : shape (n_runs, n_phi), [-]
        Measured.
    """
    basis, square, free, rows = model.whiten.basis, 0.0, 0.0, []
    for group in np.unique(runs.waves.group):
        member = np.flatnonzero(runs.waves.group == group)
        if member.size < 2:
            continue
        rest = strain[member] - strain[member].mean(axis=0)
        # neighbours of equal set points have nearly equal slopes
        both = np.concatenate([basis[member[0]], model.slopes[:, member[0]].T], axis=1)
        slopes = span(both)
        rest = rest - (rest @ slopes) @ slopes.T
        rows.append(rest)
        square += float(np.sum(rest**2))
        free += (member.size - 1) * (rest.shape[1] - slopes.shape[1])
    if not rows:
        return UNKNOWN_NOISE / model.whiten.noise
    every = np.concatenate(rows)
    smooth = every.shape[1] / max(independent(every), 2.0)
    return float(np.sqrt(square / free * smooth)) / model.whiten.noise
