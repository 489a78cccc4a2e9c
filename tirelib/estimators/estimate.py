"""What is said of one quantity: value, standard deviation, and whether it may be trusted."""

from dataclasses import dataclass, replace

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray

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
