"""Harmonics over the wheel angle: f(phi) = Re sum_n F_n exp(i n phi), n >= 0."""

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.physics.ring.ring import ComplexArray

_BLOCK = 32


def waves(phi: FloatArray, n_modes: int) -> tuple[FloatArray, FloatArray]:
    """Return cos(n phi) and sin(n phi), n = 0 ... n_modes in a last axis.

    The known powers of exp(i phi) are multiplied by the highest, which doubles their number: some
    twelve roundings for n = 60, at a sixth of what a sine and a cosine of each would cost.
    """
    power = np.empty((*phi.shape, n_modes + 1), dtype=complex)
    power[..., 0] = 1.0
    first = np.exp(1j * phi)
    known = 1
    while known <= n_modes:
        new = min(known, n_modes + 1 - known)
        step = power[..., known - 1 : known] * first[..., None]
        np.multiply(power[..., :new], step, out=power[..., known : known + new])
        known += new
    return power.real.copy(), power.imag.copy()


def load_harmonics(phi: FloatArray, force: FloatArray, n_modes: int) -> ComplexArray:
    """Return F_n of point loads [N/m rad] at `phi`, (n_points, n_modes + 1) or (..., n_loads).

    Parameters
    ----------
    phi : shape (n_points, n_nodes), [rad]
    force : shape (n_points, n_nodes) or (n_points, n_nodes, n_loads)
    n_modes : int
    """
    several = force.ndim == 3
    rows = force.swapaxes(1, 2) if several else force[:, None, :]
    out = np.empty((*rows.shape[:2], n_modes + 1), dtype=complex)
    for part in _blocks(phi.shape[0]):
        cos, sin = waves(phi[part], n_modes)
        out.real[part] = rows[part] @ cos / np.pi
        out.imag[part] = rows[part] @ sin / -np.pi
    out[..., 0] *= 0.5
    return out.swapaxes(1, 2) if several else out[:, 0]


def evaluate(harmonics: ComplexArray, phi: FloatArray, derivative: int = 0) -> FloatArray:
    """Return Re sum F_n (i n)^derivative exp(i n phi) at (n_phi,) or (n_points, n_phi) angles."""
    terms = harmonics
    if derivative:
        terms = harmonics * (1j * np.arange(harmonics.shape[-1], dtype=float)) ** derivative
    if phi.ndim == 1 or terms.ndim != 2 or phi.ndim != 2 or len(phi) != len(terms):
        return _evaluate(terms, phi)
    out = np.empty(phi.shape)
    for part in _blocks(len(phi)):
        out[part] = _evaluate(terms[part], phi[part])
    return out


def evaluate_fields(harmonics: ComplexArray, phi: FloatArray) -> FloatArray:
    """Return several fields at angles (n_phi,) or (n_points, n_phi).

    Parameters
    ----------
    harmonics : shape (n_points, n_modes + 1, n_fields)
    phi : [rad]

    Returns
    -------
    shape (n_points, n_phi, n_fields)
    """
    cos, sin = waves(phi, harmonics.shape[-2] - 1)
    out: FloatArray = cos @ harmonics.real - sin @ harmonics.imag
    return out


def _evaluate(terms: ComplexArray, phi: FloatArray) -> FloatArray:
    cos, sin = waves(phi, terms.shape[-1] - 1)
    # real arithmetic: half the work of the complex product
    value: FloatArray = (cos @ terms.real[..., None] - sin @ terms.imag[..., None])[..., 0]
    return value


def _blocks(n_points: int) -> list[slice]:
    """Return points in blocks whose waves fit into the processor's cache."""
    return [slice(first, first + _BLOCK) for first in range(0, n_points, _BLOCK)]
