"""Noise of the waveforms of straight runs, from repeats, as a diagnosis needs it."""

from dataclasses import dataclass

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.diagnose.refit import Refit
from tirelib.identify.campaign_data import StraightRuns
from tirelib.identify.noise import independent
from tirelib.identify.span import span

UNKNOWN_NOISE = 3e-6
"""Noise that variants get where no runs were repeated, [-]."""


@dataclass(frozen=True, slots=True)
class WhiteNoise:
    """Standard deviations of whitened noise.

    Attributes
    ----------
    sample : float, [-]
        Of a sample.
    smooth : float, [-]
        Of white noise that meets a smooth shape as the noise does, which is smooth itself: n_e
        independent samples in a turn of n meet it with n / n_e times the variance of a sample.
        Without repeats it is that of a sample.
    """

    sample: float
    smooth: float


def noise_in(runs: StraightRuns) -> float:
    """Return the standard deviation of a sample of a run's waveform, [-]."""
    return runs.noise.std if np.isfinite(runs.noise.std) else UNKNOWN_NOISE


def white_noise(runs: StraightRuns, model: Refit, strain: FloatArray) -> WhiteNoise:
    """Return the whitened noise of the repeats.

    What set points, the angle's zero or other numbers of the tire explain of the repeats'
    differences is no noise: a tire that warms up or wears between them is not noisy.

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
        return WhiteNoise(*[UNKNOWN_NOISE / model.whiten.noise] * 2)
    every = np.concatenate(rows)
    sample = float(np.sqrt(square / free)) / model.whiten.noise
    smooth = every.shape[1] / max(independent(every), 2.0)
    return WhiteNoise(sample, sample * float(np.sqrt(smooth)))
