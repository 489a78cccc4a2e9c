"""What load, pressure, gain and angle zero of each run were beside their recorded values.

The waveform of run i is m_i + T_i b_i + z_i + e_i (`tirelib.identify.random_effects`), b_i normal
with the rig's tolerance S, z_i the zero of the strain, which is free: neither gages nor a waveform
without its mean have one. The best linear prediction is

    b = (n_e/n T' V^-1 T + S^-1)^-1  n_e/n T' V^-1 r

with V the variance of what is left at each wheel angle: noise and the model's own misfit. V is
found with b by expectation and maximisation, so that a misfit in the contact is not taken for a
load error which the rest of the turn does not show. n_e is the number of independent samples in a
turn of n, from the spectrum of what is left.
"""

from dataclasses import dataclass

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.campaign import Tolerance
from tirelib.compare.model import Prediction
from tirelib.identify.random_effects import SMALLEST_TOLERANCE, Whitening, angle_slope

NAMES = ("load", "pressure", "gain", "angle")
ROUNDS = 60
SETTLED = 0.02
"""Relative change of V from which the set points no longer move by what can be seen."""
LEAST_NOISE = 1e-7
WINDOW = 9
"""Samples over which V is averaged."""


@dataclass(frozen=True, slots=True)
class SetPoints:
    """Best linear prediction of the set points' random part.

    Attributes
    ----------
    value : shape (n_runs, 4)
        Relative load, relative pressure, relative gain, angle zero [rad]; measured beside recorded.
    tolerance : shape (n_runs, 4)
        Their standard deviations by the rig.
    covariance : shape (n_runs, 5, 5)
        Of the prediction, the zero last.
    tangent : shape (n_runs, n_phi, 5), [-]
        Slopes of the waveform by them and by the zero.
    shift : shape (n_runs, n_phi), [-]
        What they and the zero add to the waveforms.
    spread : shape (n_phi,), [-]
        Standard deviation of what is left at each angle.
    independent : float
        n_e, independent samples in a turn of what is left.
    """

    value: FloatArray
    tolerance: FloatArray
    covariance: FloatArray
    tangent: FloatArray
    shift: FloatArray
    spread: FloatArray
    independent: float

    @property
    def scaled(self) -> FloatArray:
        """Return the predictions in units of the tolerance, shape (n_runs, 4)."""
        return np.asarray(self.value / self.tolerance)


def tangents(prediction: Prediction) -> FloatArray:
    """Return slopes by load, pressure, gain (relative), angle and zero, (n_runs, n_phi, 5)."""
    strain = prediction.strain
    slope = angle_slope(strain)
    zero = np.ones_like(strain)
    return np.stack([prediction.by_load, prediction.by_pressure, strain, slope, zero], axis=2)


def scales(tolerance: Tolerance, angle_std: FloatArray) -> FloatArray:
    """Return the standard deviations of the set points, shape (n_runs, 4)."""
    relative = [tolerance.load, tolerance.pressure, tolerance.gain]
    rows = [np.full(angle_std.size, max(value, SMALLEST_TOLERANCE)) for value in relative]
    return np.stack([*rows, np.minimum(angle_std, 1.0)], axis=1)


def whitening_of(tangent: FloatArray, scale: FloatArray, noise: float) -> Whitening:
    """Return the whitening by noise and set points at a model's tangents, the zero left out."""
    basis, triangle = np.linalg.qr(tangent[..., :4] * scale[:, None, :])
    inside = noise**2 * np.eye(4) + triangle @ triangle.swapaxes(1, 2)
    return Whitening(basis, np.linalg.inv(np.linalg.cholesky(inside)), noise)


def predict_set_points(
    rest: FloatArray, tangent: FloatArray, scale: FloatArray, noise: float
) -> SetPoints:
    """Return the best linear prediction of the set points' random part.

    Parameters
    ----------
    rest : shape (n_runs, n_phi), [-]
        Measured less model.
    tangent : shape (n_runs, n_phi, 5)
    scale : shape (n_runs, 4)
    noise : float, [-]
        Of the repeats, the least that s can be; NaN where unknown.
    """
    n = rest.shape[1]
    least = LEAST_NOISE if np.isnan(noise) else max(noise, LEAST_NOISE)
    prior = np.zeros((len(rest), 5, 5))
    prior[:, range(4), range(4)] = 1.0 / scale**2
    variance, left, change = np.full(n, least**2), rest, np.inf
    for _ in range(ROUNDS):
        count = independent(left / np.sqrt(variance))
        weighed = tangent * (count / n / variance)[None, :, None]
        turned = weighed.swapaxes(1, 2)
        covariance = np.linalg.inv(turned @ tangent + prior)
        value = covariance @ (turned @ rest[:, :, None])
        shift = (tangent @ value)[:, :, 0]
        left = rest - shift
        unknown = np.einsum("rnk,rnk->n", tangent @ covariance, tangent) / len(rest)
        new = np.maximum(_averaged(np.mean(left**2, axis=0) + unknown), least**2)
        change = float(np.max(np.abs(np.log(new / variance))))
        variance = new
        if change < SETTLED:
            break
    return SetPoints(value[:, :4, 0], scale, covariance, tangent, shift, np.sqrt(variance), count)


def _averaged(values: FloatArray) -> FloatArray:
    """Return the running mean around the turn."""
    padded = np.pad(values, WINDOW // 2, mode="wrap")
    return np.convolve(padded, np.full(WINDOW, 1.0 / WINDOW), mode="valid")


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
