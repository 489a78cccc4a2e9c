"""Delay of the gages against the trigger: a number of the day, fitted along with the tire's.

Every chain has one, of some part of a sample, and it is the same in all runs: the waveform comes
later by an angle that goes with the speed. Left alone it is most of what a good ring leaves.
"""

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.inference.identify.random_effects import angle_slope

STD = 6e-5
"""Standard deviation of the delay, [s]: uniform to a sample at 10 kHz."""
UNIT = 1e-4
"""Unit of the delay in slopes and coordinates, [s]."""


def earlier(waveform: FloatArray, omega: FloatArray, delay: float) -> FloatArray:
    """Return waveforms (n_runs, n_phi) without a delay that they have."""
    n = waveform.shape[-1]
    angle = delay * np.asarray(omega)[:, None] * np.arange(n // 2 + 1)
    out: FloatArray = np.fft.irfft(np.fft.rfft(waveform) * np.exp(1j * angle), n=n)
    return out


def by_delay(waveform: FloatArray, omega: FloatArray) -> FloatArray:
    """Return the slope of waveforms (n_runs, n_phi) by the delay, for one `UNIT`."""
    return np.asarray(-UNIT * angle_slope(waveform) * np.asarray(omega)[:, None])
