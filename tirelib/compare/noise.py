"""How sure a mean over some angles and runs is, from repeats: noise by order of the wheel turn."""

from dataclasses import dataclass

import numpy as np

from tirelib.arrays import FloatArray, IntArray
from tirelib.compare.set_points import LEAST_NOISE, independent

SMOOTH = 5
"""Neighbouring orders over which the spectrum is averaged."""


@dataclass(frozen=True, slots=True)
class RepeatNoise:
    """Noise of a run's waveform and its spectrum.

    Attributes
    ----------
    std : float, [-]
        NaN without repeats.
    repeats : int
        Set points that were measured more than once.
    power : shape (n_phi // 2 + 1,), [-]
        Share of each order in the variance, times std^2; empty without repeats.
    freedom : float
        Degrees of freedom of std: independent samples of all repeats.
    local_freedom : float
        Of a smoothed order.
    """

    std: float
    repeats: int
    power: FloatArray
    freedom: float
    local_freedom: float

    @property
    def known(self) -> bool:
        """Whether there are repeats."""
        return bool(np.isfinite(self.std))

    def variance(self, weights: FloatArray) -> FloatArray:
        """Return the variance of weighted sums over the turn, weights (n, n_phi)."""
        gain = np.abs(np.fft.rfft(weights, axis=1)) ** 2
        return np.asarray(gain @ self.power)


def repeat_noise(strain: FloatArray, group: IntArray, tangent: FloatArray) -> RepeatNoise:
    """Return the noise of repeats with its spectrum.

    Parameters
    ----------
    strain : shape (n_runs, n_phi), [-]
    group : shape (n_runs,)
        Equal for equal set points.
    tangent : shape (n_runs, n_phi, k), [-]
        Slopes by the set points: what they explain of the repeats' differences is no noise.
    """
    rows, more, groups, square = [], 0, 0, 0.0
    size, slopes = strain.shape[1], tangent.shape[2]
    for number in np.unique(group):
        member = np.flatnonzero(group == number)
        if member.size < 2:
            continue
        basis = np.linalg.qr(tangent[member].mean(axis=0))[0]
        rest = strain[member] - strain[member].mean(axis=0)
        rest = rest - (rest @ basis) @ basis.T
        rows.append(rest * np.sqrt(member.size / (member.size - 1)))
        square += float(np.sum(rest**2))
        groups += 1
        more += member.size - 1
    if not rows:
        return RepeatNoise(np.nan, 0, np.zeros(0), 0.0, 0.0)
    std = max(float(np.sqrt(square / (more * (size - slopes)))), LEAST_NOISE)
    every = np.concatenate(rows)
    power = np.mean(np.abs(np.fft.rfft(every, axis=1)) ** 2, axis=0)
    power[0] = 0.0
    padded = np.pad(power[1:], SMOOTH // 2, mode="reflect")
    smooth = np.convolve(padded, np.full(SMOOTH, 1.0 / SMOOTH), mode="valid")
    smooth = np.concatenate([[0.0], smooth])
    twice = np.full(power.size, 2.0)
    twice[-1] = 2.0 if strain.shape[1] % 2 else 1.0
    total = float(np.sum(twice * smooth))
    if total <= 0.0:
        smooth, total = np.ones_like(smooth), float(twice.sum())
    return RepeatNoise(
        std, groups, std**2 * twice * smooth / total,
        more * independent(every), 2.0 * SMOOTH * more,
    )  # fmt: skip
