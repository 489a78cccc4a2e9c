"""Noise of a run's waveform by order of the wheel turn, from runs that were repeated."""

from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import FloatArray, IntArray
from tirelib.inference.identify.random_effects import tangents
from tirelib.inference.identify.span import span
from tirelib.measured.waveforms import Waveforms

SMOOTH = 5
"""Neighbouring orders over which the spectrum is averaged."""
LEAST_NOISE = 1e-7
"""Standard deviation that equal repeats still have, [-]."""
NEIGHBOUR = 0.03
"""Relative spread within which two runs have the same condition."""
ALIKE_FAR = 1.05
"""Distance over that of the nearest run, up to which a slope takes runs together: those repeated,
and those to either side."""
LEAST_CHANGE = 0.02
"""Relative difference of a condition that shows a slope."""


@dataclass(frozen=True, slots=True)
class RepeatNoise:
    """Noise of a run's waveform and its spectrum.

    Attributes
    ----------
    std : float, [-]
        Standard deviation of a sample of a run's mean waveform; NaN without repeats.
    repeats : int
        Set points that were measured more than once.
    power : shape (n_phi // 2 + 1,), [-]
        Share of each order in the variance, times std^2; empty without repeats.
    freedom : float
        Degrees of freedom of std: independent samples of all repeats.
    local_freedom : float
        Degrees of freedom of a smoothed order.
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
    rows, more, groups, square, free = [], 0, 0, 0.0, 0
    size = strain.shape[1]
    for number in np.unique(group):
        member = np.flatnonzero(group == number)
        if member.size < 2:
            continue
        basis = span(tangent[member].mean(axis=0))
        rest = strain[member] - strain[member].mean(axis=0)
        rest = rest - (rest @ basis) @ basis.T
        rows.append(rest * np.sqrt(member.size / (member.size - 1)))
        square += float(np.sum(rest**2))
        groups += 1
        more += member.size - 1
        free += (member.size - 1) * (size - basis.shape[1])
    if not rows:
        return RepeatNoise(np.nan, 0, np.zeros(0), 0.0, 0.0)
    std = max(float(np.sqrt(square / free)), LEAST_NOISE)
    every = np.concatenate(rows)
    power = np.mean(np.abs(np.fft.rfft(every, axis=1)) ** 2, axis=0)
    power[0] = 0.0
    padded = np.pad(power[1:], SMOOTH // 2, mode="reflect")
    smooth = np.convolve(padded, np.full(SMOOTH, 1.0 / SMOOTH), mode="valid")
    smooth = np.concatenate([[0.0], smooth])
    twice = np.full(power.size, 2.0)
    twice[-1] = 2.0 if size % 2 else 1.0
    total = float(np.sum(twice * smooth))
    if total <= 0.0:
        smooth, total = np.ones_like(smooth), float(twice.sum())
    return RepeatNoise(
        std,
        groups,
        std**2 * twice * smooth / total,
        more * independent(every),
        2.0 * SMOOTH * more,
    )


def measured_tangents(waves: Waveforms, strain: FloatArray) -> FloatArray:
    """Return slopes by the set points that the campaign itself shows, no model needed.

    Parameters
    ----------
    strain : shape (n_runs, n_phi), [-]

    Returns
    -------
    shape (n_runs, n_phi, 4)
        By relative load, relative pressure (to the nearest runs that differ in nothing else; zero
        without any), gain and angle zero.
    """
    by_load = _neighbour_slopes(waves, strain, "Fz", ("pressure", "speed"))
    by_pressure = _neighbour_slopes(waves, strain, "pressure", ("Fz", "speed"))
    return tangents(strain, by_load, by_pressure)


def _neighbour_slopes(
    waves: Waveforms, strain: FloatArray, name: str, others: tuple[str, ...]
) -> FloatArray:
    """Return the change of waveform per relative change of a condition, (n_runs, n_phi)."""
    given = waves.conditions[name]
    size = np.log(np.where(given > 0.0, given, np.nan))
    apart = size[None, :] - size[:, None]
    usable = np.abs(apart) > LEAST_CHANGE
    for other in others:
        held = waves.conditions[other]
        usable &= np.isclose(held[None, :], held[:, None], rtol=NEIGHBOUR, equal_nan=True)
    far = np.where(usable, np.abs(apart), np.inf)
    chosen = usable & (far <= ALIKE_FAR * far.min(axis=1, keepdims=True))
    share = chosen / np.maximum(chosen.sum(axis=1, keepdims=True), 1)
    weight = np.divide(share, apart, out=np.zeros_like(apart), where=chosen)
    slope: FloatArray = weight @ strain - weight.sum(axis=1)[:, None] * strain
    return slope


def independent(waves: FloatArray) -> float:
    """Return how many independent samples periodic waveforms (n, n_phi) of a common spectrum have.

    Examples
    --------
    >>> wave = np.cos(3 * np.linspace(0, 2 * np.pi, 90, endpoint=False))
    >>> independent(wave[None])
    2.0
    """
    power = np.sum(np.abs(np.fft.rfft(waves, axis=1)) ** 2, axis=0)[1:]
    total = float(power.sum())
    if total <= 0.0:
        return float(waves.shape[1])
    return float(2.0 * total**2 / np.sum(power**2))
