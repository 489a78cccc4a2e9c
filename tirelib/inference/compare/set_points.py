"""What load, pressure, gain and angle zero of each run were beside their recorded values.

The waveform of run i is m_i + T_i b_i + z_i + e_i (`tirelib.inference.identify.random_effects`),
b_i normal with the rig's tolerance S, z_i the zero of the strain, which is free: neither gages nor
a waveform without its mean have one. The best linear prediction is

    b = (n_e/n T' V^-1 T + S^-1)^-1  n_e/n T' V^-1 r

with V the variance of what is left at each wheel angle: noise and the model's own misfit. V is
found with b by expectation and maximisation, so that a misfit in the contact is not taken for a
load error which the rest of the turn does not show. n_e is the number of independent samples in a
turn of n, from the spectrum of what is left.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.ndimage import uniform_filter1d

from tirelib.core.arrays import FloatArray, IntArray, rms
from tirelib.inference.compare.model import Prediction
from tirelib.inference.identify import random_effects
from tirelib.inference.identify.noise import LEAST_NOISE, independent

SAID = {
    "load": ("load", "%", 100.0),
    "pressure": ("pressure", "%", 100.0),
    "gain": ("gain", "%", 100.0),
    "angle": ("angle zero", "mrad", 1e3),
}
"""What is predicted of each run: in words, its unit, and the factor to it from a ratio or [rad]."""
ROUNDS = 60
SETTLED = 0.02
"""Relative change of V from which the set points no longer move by what can be seen."""
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
        Covariance of the prediction, the zero last.
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

    def told(self, run: IntArray) -> list[dict[str, Any]]:
        """Return a row for each set point; the largest has its sign."""
        worst = np.argmax(np.abs(self.scaled), axis=0)
        return [
            {
                "name": name,
                "unit": unit,
                "tolerance": factor * float(np.median(self.tolerance[:, k])),
                "rms_in_tolerances": rms(self.scaled[:, k]),
                "largest_in_tolerances": float(self.scaled[worst[k], k]),
                "largest_run": int(run[worst[k]]),
            }
            for k, (name, (_, unit, factor)) in enumerate(SAID.items())
        ]

    @property
    def scaled(self) -> FloatArray:
        """Return the predictions in units of the tolerance, shape (n_runs, 4)."""
        return np.asarray(self.value / self.tolerance)


def tangents(prediction: Prediction) -> FloatArray:
    """Return slopes by load, pressure, gain (relative), angle and zero, (n_runs, n_phi, 5)."""
    strain = prediction.strain
    four = random_effects.tangents(strain, prediction.by_load, prediction.by_pressure)
    return np.concatenate([four, np.ones_like(strain)[:, :, None]], axis=2)


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
        Noise of the repeats, the least that s can be; NaN where unknown.
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
        new = np.maximum(
            uniform_filter1d(np.mean(left**2, axis=0) + unknown, WINDOW, mode="wrap"), least**2
        )
        change = float(np.max(np.abs(np.log(new / variance))))
        variance = new
        if change < SETTLED:
            break
    return SetPoints(value[:, :4, 0], scale, covariance, tangent, shift, np.sqrt(variance), count)
