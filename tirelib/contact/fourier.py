"""Harmonics over the wheel angle: f(phi) = Re sum_n F_n exp(i n phi), n >= 0."""

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.ring.ring import ComplexArray


def load_harmonics(phi: FloatArray, force: FloatArray, n_modes: int) -> ComplexArray:
    """Return F_n of point loads `force` [N/m rad] at `phi`, both (n_points, n_nodes)."""
    n = np.arange(n_modes + 1.0)
    waves = np.exp(-1j * phi[:, :, None] * n)
    out: ComplexArray = (force[:, None, :].astype(complex) @ waves)[:, 0, :] / np.pi
    out[:, 0] *= 0.5
    return out


def evaluate(harmonics: ComplexArray, phi: FloatArray, derivative: int = 0) -> FloatArray:
    """Return Re sum F_n (i n)^derivative exp(i n phi) at (n_phi,) or (n_points, n_phi) angles."""
    n = np.arange(harmonics.shape[-1], dtype=float)
    terms = harmonics * (1j * n) ** derivative if derivative else harmonics
    angle = phi[..., None, :] * n[:, None]
    # real arithmetic: half the work of the complex product
    value: FloatArray = (
        terms.real[..., None, :] @ np.cos(angle) - terms.imag[..., None, :] @ np.sin(angle)
    )[..., 0, :]
    return value
