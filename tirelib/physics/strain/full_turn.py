"""Radial deformation of the belt from the strain of a full turn, Eq. (35).

Harmonics 2, 3, ... of u follow from it. The first is the rigid shift of the belt, which causes no
strain, and the mean goes with the gages' offset: both are unknown. Signs and validity are those of
`tirelib.physics.strain.deformation`, where the road supplies what is missing here.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ParameterError, ShapeError
from tirelib.physics.strain.deformation import check_belt


@dataclass(frozen=True, slots=True)
class RingDeformation:
    """Radial deformation as far as the strain of a full turn determines it.

    Attributes
    ----------
    determined : array, shape (..., n), [m]
        Sum of the harmonics 2, 3, ... of u on the grid of the strain.
    cosine, sine : array, shape (..., n // 2 + 1), [m]
        Coefficients of u by order, from the first sample's angle; NaN for the orders 0 and 1.
    contradiction : array, shape (...)
        Amplitude of the strain's first harmonic: Eq. (35) allows none, so it measures what the
        equation lacks (stretch, drift, a grid that is not one turn).
    """

    determined: FloatArray
    cosine: FloatArray
    sine: FloatArray
    contradiction: FloatArray


def full_ring_deformation(
    strain: npt.ArrayLike, *, ring_radius: float, liner_offset: float
) -> RingDeformation:
    """Invert Eq. (35) on a full turn: u_n = R^2 eps_n / [y (n^2 - 1)] for n >= 2.

    Parameters
    ----------
    strain : array, shape (..., n)
        Uniform samples over one turn, end not repeated.
    ring_radius, liner_offset : float, [m]
        R > 0 and y < 0.

    Returns
    -------
    RingDeformation
        Orders 0 and 1 are NaN: the mean goes with the offset, the shift strains nothing.

    Raises
    ------
    ParameterError
        If R or y is out of range or a sample is not finite.
    ShapeError
        If there are fewer than 8 samples.
    """
    eps = np.asarray(strain, dtype=np.float64)
    check_belt(ring_radius, np.inf, liner_offset)
    spectrum = _turn_spectrum("full-ring deformation", eps)
    count = eps.shape[-1]
    n = np.arange(spectrum.shape[-1], dtype=np.float64)
    factor = np.zeros(n.size)
    factor[2:] = ring_radius**2 / liner_offset / (n[2:] ** 2 - 1.0)
    bent = factor * spectrum
    scale = np.where((n == 0) | (2 * n == count), 1.0, 2.0) / count
    coefficients = scale * bent
    coefficients[..., :2] = complex(np.nan, np.nan)
    return RingDeformation(
        np.fft.irfft(bent, n=count),
        np.real(coefficients),
        -np.imag(coefficients),
        2.0 / count * np.abs(spectrum[..., 1]),
    )


def undetermined_part(radial: npt.ArrayLike) -> FloatArray:
    """Return the part of a full-turn deformation that causes no strain: mean and first harmonic.

    Parameters
    ----------
    radial : array, shape (..., n), [m]
        u on a uniform grid over one turn, 8 samples or more.

    Returns
    -------
    array, shape (..., n), [m]

    Raises
    ------
    ParameterError, ShapeError
        As in `full_ring_deformation`.
    """
    u = np.asarray(radial, dtype=np.float64)
    spectrum = _turn_spectrum("undetermined part", u)
    spectrum[..., 2:] = 0.0
    return np.fft.irfft(spectrum, n=u.shape[-1])


def _turn_spectrum(where: str, samples: FloatArray) -> npt.NDArray[np.complex128]:
    """Return the spectrum of one turn of finite samples."""
    if samples.ndim == 0 or samples.shape[-1] < 8:
        raise ShapeError(f"{where}: samples have shape {samples.shape}; one turn needs 8 or more")
    if not np.isfinite(samples).all():
        raise ParameterError(f"{where}: a sample is not finite; fill or drop the turn")
    return np.fft.rfft(samples)
