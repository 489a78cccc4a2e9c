r"""Low-pass without phase shift, and the way from time to wheel angle, in one step.

The filter is a symmetric finite Gaussian, evaluated at the wheel angles that are wanted:

.. math:: \bar\varepsilon(\varphi) = \sum_i w_i\,\varepsilon_i, \qquad
          w_i \propto \exp\left(-\frac{(\varphi_i - \varphi)^2}{2\sigma^2}\right),
          \quad |\varphi_i - \varphi| \le 4\sigma

with the rate :math:`d\bar\varepsilon / d\varphi` as the slope of the straight line fitted with the
same weights (and the strain as its value there: where the support ends between two samples, the
weights are not quite symmetric). Its gain has fallen to one half of the power at the cut-off
:math:`f_c = \sqrt{\ln 2}\,\Omega / (2\pi\sigma)`.

A tire's contact is fixed in wheel angle, not in time: 300 Hz at 65 km/h keep harmonics up to the
32nd of the wheel's turn, at 10 km/h up to the 207th (noise), at 150 km/h up to the 14th (the edges
are smeared). The cut-off is therefore chosen as an **order** of the turn rate and stated in Hz.
The dissertation's 200 to 400 Hz at 65 km/h (section 3.4) are orders 21 to 42; the default is 24.
"""

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ParameterError

HALF_POWER = float(np.sqrt(np.log(2.0)))
"""Product of cut-off (rad per rad) and sigma (rad) at half power."""
SUPPORT = 4.0
"""Half-width of the filter, in sigma."""
DEFAULT_ORDER = 24.0
"""Cut-off of the default filter, in cycles per turn."""
SUITABLE_ORDERS = (8.0, 120.0)
"""Below, contact edges are smeared into each other; above, noise makes the edges."""
NYQUIST_SHARE = 0.5
"""Highest cut-off, as a share of half the sample rate."""


@dataclass(frozen=True, slots=True)
class LowPass:
    """Choice of the cut-off: by order of the turn rate, or fixed in Hz.

    Attributes
    ----------
    order : float, [1]
        Cut-off in cycles per turn; used where `cut_off` is None.
    cut_off : float or None, [Hz]
        Fixed cut-off at half power.
    """

    order: float = DEFAULT_ORDER
    cut_off: float | None = None

    def __post_init__(self) -> None:
        low, high = SUITABLE_ORDERS
        if not low <= self.order <= high:
            raise ParameterError(
                f"filter order = {self.order}; allowed are {low:g} .. {high:g} cycles per turn"
            )
        if self.cut_off is not None and not 0.0 < self.cut_off < float("inf"):
            raise ParameterError(f"filter cut-off = {self.cut_off} Hz; must be above 0 and finite")

    def frequency(self, turn_rate: float) -> float:
        """Return the cut-off at half power, [Hz], at a turn rate in turns per second."""
        return self.order * turn_rate if self.cut_off is None else self.cut_off

    def sigma(self, turn_rate: float) -> float:
        """Return the filter's standard deviation in wheel angle, [rad]."""
        return HALF_POWER * turn_rate / self.frequency(turn_rate)

    def suits(self, turn_rate: float, rate: float) -> bool:
        """Tell whether the cut-off suits the turn rate [1/s] and the sample rate [Hz]."""
        frequency = self.frequency(turn_rate)
        low, high = SUITABLE_ORDERS
        return (
            low * turn_rate <= frequency <= high * turn_rate
            and frequency <= NYQUIST_SHARE * rate / 2.0
        )


def half_width(sigma: float) -> float:
    """Return how far, [rad], the filter reaches to each side."""
    return SUPPORT * sigma


def smooth_to_angle(
    samples: FloatArray, angle: FloatArray, phi: FloatArray, sigma: float
) -> tuple[FloatArray, FloatArray]:
    """Filter samples in time and evaluate strain and rate at given wheel angles.

    Parameters
    ----------
    samples : array, shape (n_gages, n), [-]
        Strain.
    angle : array, shape (n,), [rad]
        Wheel angle of each sample, growing.
    phi : array, shape (n_phi,), [rad]
        Wanted wheel angles; the filter must not reach beyond `samples`.
    sigma : float, [rad]
        Standard deviation of the filter.

    Returns
    -------
    strain : array, shape (n_gages, n_phi), [-]
    rate : array, shape (n_gages, n_phi), [1/rad]

    Raises
    ------
    ParameterError
        If the filter would reach beyond the samples.

    Examples
    --------
    A straight line passes unchanged, and its rate is its slope per radian.

    >>> angle = 0.01 * np.arange(-50, 50)
    >>> strain, rate = smooth_to_angle(50.0 + 100.0 * angle[None], angle, np.zeros(1), 0.05)
    >>> float(strain[0, 0]), float(rate[0, 0])
    (50.0, 100.0)
    """
    place = np.clip(np.searchsorted(angle, phi), 1, angle.size - 1)
    nearest = place - (phi - angle[place - 1] <= angle[place] - phi)
    reach = max(1, int(half_width(sigma) / np.median(np.diff(angle))))
    room = int(min(nearest[0], samples.shape[1] - 1 - nearest[-1]))
    first, last = phi[0] - half_width(sigma), phi[-1] + half_width(sigma)
    if room < reach and not (angle[0] <= first and angle[-1] >= last):
        raise ParameterError(
            f"filter needs samples {nearest[0] - reach} .. {nearest[-1] + reach}; "
            f"given are 0 .. {samples.shape[1] - 1}"
        )
    reach = min(reach, room)  # fewer samples are as wide where the wheel is fastest
    distance = sliding_window_view(angle, 2 * reach + 1)[nearest - reach] - phi[:, None]
    weight = distance * distance
    weight *= -0.5 / sigma**2
    np.exp(weight, out=weight)
    moment = weight * distance
    total, first = weight.sum(axis=1), moment.sum(axis=1)
    second = np.einsum("ij,ij->i", moment, distance)
    windows = sliding_window_view(samples, 2 * reach + 1, axis=1)[:, nearest - reach]
    plain = np.einsum("gij,ij->gi", windows, weight)
    moments = np.einsum("gij,ij->gi", windows, moment)
    mean = first / total  # of the distance: the weights are not quite symmetric
    rate = (moments - mean * plain) / (second - mean * first)
    return plain / total - mean * rate, rate
