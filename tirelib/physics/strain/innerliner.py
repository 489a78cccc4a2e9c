"""Strain at the innerliner of the modelled ring, Eq. (32)-(35).

With the belt's displacements u, v and the rotation beta of its cross-section the strain at the
offset y from the neutral line (inward is negative) is, to first order,

    eps = (u + v') / R + y beta' / R.

For the inextensible Bernoulli-Euler ring this is Eq. (35), -(y / R^2)(u + u''). A belt that can
stretch adds its membrane strain, one that can shear bends by beta instead of the slope of u.
"""

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.physics.contact.fourier import evaluate
from tirelib.physics.ring.ring import ComplexArray


def strain_harmonics(
    displacement: ComplexArray, radius: float | FloatArray, offset: float | FloatArray
) -> ComplexArray:
    """Return harmonics of the strain at the innerliner.

    Parameters
    ----------
    displacement : shape (..., n_modes + 1, 3)
        Harmonics of u [m], v [m], beta [rad].
    radius : [m]
        Radius of the neutral line; scalar or shape (...).
    offset : [m]
        y of the gage from the neutral line, negative toward the inside; scalar or shape (...).

    Returns
    -------
    shape (..., n_modes + 1)
        Strain; the mean (harmonic 0) is what a gage loses with its offset.
    """
    n = np.arange(displacement.shape[-2], dtype=float)
    r = np.asarray(radius, dtype=float)[..., None]
    y = np.asarray(offset, dtype=float)[..., None]
    u, v, beta = (displacement[..., i] for i in range(3))
    out: ComplexArray = (u + 1j * n * v) / r + y * 1j * n * beta / r
    return out


def strain_at(
    displacement: ComplexArray,
    radius: float | FloatArray,
    offset: float | FloatArray,
    phi: FloatArray,
    derivative: int = 0,
) -> FloatArray:
    """Return the strain (or its derivative by angle) at wheel angles, shape (..., n_phi).

    Parameters
    ----------
    displacement, radius, offset
        As for `strain_harmonics`.
    phi : shape (n_phi,) or (..., n_phi), [rad]
    derivative : int
        0 for strain, 1 for the strain rate per radian.
    """
    return evaluate(strain_harmonics(displacement, radius, offset), phi, derivative)
