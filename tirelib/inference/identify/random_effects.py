"""What differs from run to run unintentionally: set points, gain, angle zero, noise.

The waveform of run i is m_i + sum_k b_ik t_ik + e_ik, where t_ik are the tangents of the model by
load, pressure, gain and angle zero, b_ik is normal with the tolerance of the rig, and e is noise.
Its covariance is noise plus rank four, so whitening costs a thin QR a run.
"""

from dataclasses import dataclass

import numpy as np

from tirelib.campaign import Tolerance
from tirelib.core.arrays import FloatArray

SMALLEST_TOLERANCE = 1e-4


@dataclass(frozen=True, slots=True)
class Whitening:
    """Turns residual waveforms into independent numbers of unit variance.

    Attributes
    ----------
    basis : shape (n_runs, n_phi, 4)
        Orthonormal, spans the tangents of each run.
    inverse : shape (n_runs, 4, 4)
        Inverse square root of the covariance within it.
    noise : float, [-]
    """

    basis: FloatArray
    inverse: FloatArray
    noise: float

    def __call__(self, residual: FloatArray) -> FloatArray:
        """Return whitened residuals of shape (..., n_runs, n_phi)."""
        inside = np.einsum("rnk,...rn->...rk", self.basis, residual, optimize=True)
        outside = residual - np.einsum("rnk,...rk->...rn", self.basis, inside, optimize=True)
        scaled = np.einsum("rkl,...rl->...rk", self.inverse, inside, optimize=True)
        white: FloatArray = outside / self.noise + np.einsum(
            "rnk,...rk->...rn", self.basis, scaled, optimize=True
        )
        return white


def whitening_of(tangent: FloatArray, scale: FloatArray, noise: float) -> Whitening:
    """Return the whitening by noise and set points at a model's tangents.

    Tangents (n_runs, n_phi, 4 or more) are by load, pressure, gain and angle, of which `scale`
    (n_runs, 4) holds the standard deviations; what comes after them is left out.
    """
    basis, triangle = np.linalg.qr(tangent[..., :4] * scale[:, None, :])
    inside = noise**2 * np.eye(4) + triangle @ triangle.swapaxes(1, 2)
    return Whitening(basis, np.linalg.inv(np.linalg.cholesky(inside)), noise)


def scales(tolerance: Tolerance, angle_std: FloatArray) -> FloatArray:
    """Return the standard deviations of load, pressure, gain and angle, shape (n_runs, 4)."""
    relative = [tolerance.load, tolerance.pressure, tolerance.gain]
    rows = [np.full(angle_std.size, max(value, SMALLEST_TOLERANCE)) for value in relative]
    return np.stack([*rows, np.minimum(angle_std, 1.0)], axis=1)


def tangents(waveform: FloatArray, by_load: FloatArray, by_pressure: FloatArray) -> FloatArray:
    """Return slopes by relative load, relative pressure, gain and angle, (n_runs, n_phi, 4)."""
    return np.stack([by_load, by_pressure, waveform, angle_slope(waveform)], axis=2)


def angle_slope(waveform: FloatArray) -> FloatArray:
    """Return the derivative by wheel angle of periodic waveforms (..., n_phi)."""
    n = waveform.shape[-1]
    order = 1j * np.fft.rfftfreq(n, 1.0 / n)
    if n % 2 == 0:
        order[-1] = 0.0
    slope: FloatArray = np.fft.irfft(np.fft.rfft(waveform, axis=-1) * order, n=n, axis=-1)
    return slope
