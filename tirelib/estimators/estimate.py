"""What is said of one quantity: value, standard deviation, and whether it may be trusted."""

from dataclasses import dataclass, replace

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray, IntArray

QUANTITIES = ("Fz", "alpha", "kappa", "Fy")


@dataclass(frozen=True, slots=True)
class Estimate:
    """One quantity for n turns: value, standard deviation (SI), and whether it may be trusted.

    `by_camber` is the part of the standard deviation that a camber leaves which nobody gave;
    `sliding` how far the sliding share may be from that at the calibrated friction, NaN where no
    slip angle fits. Both belong to the lateral force.
    """

    value: FloatArray
    std: FloatArray
    valid: BoolArray
    by_camber: FloatArray | None = None
    sliding: FloatArray | None = None

    @property
    def camber_decides(self) -> BoolArray:
        """Which turns owe more than half their variance to a camber that nobody gave."""
        if self.by_camber is None:
            return np.zeros(self.value.shape, dtype=np.bool_)
        return np.asarray(self.by_camber**2 > 0.5 * self.std**2, dtype=np.bool_)

    def widened(self, more: FloatArray) -> "Estimate":
        """Return it with a further standard deviation; valid only where that is a number."""
        return replace(self, std=np.hypot(self.std, more), valid=self.valid & np.isfinite(more))


@dataclass(frozen=True, slots=True)
class Estimates:
    """Estimates of n turns, SI, ISO 8855.

    Attributes
    ----------
    value, std : dict of arrays, shape (n,)
        For each of Fz, alpha, kappa, Fy; NaN where not calibrated or not to be had.
    valid : dict of bool arrays, shape (n,)
        Whether each quantity may be used.
    turn_valid : bool array, shape (n,)
        The turn was measured well and every calibrated quantity lies in its calibrated range.
    flags : int array, shape (n,)
        `TurnFlag` bits.
    notes : tuple of n tuples of str
        Which quantity is out of range or saturated, which condition was not calibrated, cannot be,
        or decides on the standard deviation because nobody gave it.
    rolling : tuple of str, length n
        ``free``, ``braking``, ``driving`` or ``unknown``, from CP1 against CP2.
    radius : array, shape (n,), [m]
        Effective rolling radius.
    contact_length, contact_length_std : arrays, shape (n, n_gages), [m]
        Corrected for the bias of the reading; what is read is `Features.contact_angle` times the
        radius.
    """

    value: dict[str, FloatArray]
    std: dict[str, FloatArray]
    valid: dict[str, BoolArray]
    turn_valid: BoolArray
    flags: IntArray
    notes: tuple[tuple[str, ...], ...]
    rolling: tuple[str, ...]
    radius: FloatArray
    contact_length: FloatArray
    contact_length_std: FloatArray
