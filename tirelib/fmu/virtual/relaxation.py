"""Relaxation: the slip that acts on the tire follows the given slip over the distance travelled."""

import math
from typing import Any

import numpy as np

from tirelib.core.arrays import FloatArray

SETTLED = 1e-10
"""Rest of a relaxation that is dropped [rad], [1]."""
FOLLOWED = (0.5 * math.pi, 100.0)
"""Magnitudes of slip angle [rad] and slip ratio [1] up to which slip is followed."""


class Relaxation:
    """Slip angle and slip ratio, each d s / d x = (s_given - s) / length.

    Parameters
    ----------
    lengths : tuple of two floats, [m]
        0: slip is felt at once.
    """

    def __init__(self, lengths: tuple[float, float]) -> None:
        self._lengths = lengths
        self.slip: list[float] | None = None
        """The slip that acts now; None until the first finite value."""
        self._goal = [math.nan, math.nan]
        self._rest = [0.0, 0.0]
        self._rates = [0.0, 0.0]

    def aim(self, given: list[float], speed: float) -> bool:
        """Take the slip that is given from now on; return whether it acts already.

        What is no number, or beyond `FOLLOWED`, leaves the slip as it is; without a speed none
        changes.
        """
        good = [abs(value) <= most for value, most in zip(given, FOLLOWED, strict=True)]
        if self.slip is None:
            if not all(good):
                self._goal = [math.nan, math.nan]
                return True
            self.slip = list(given)
        goal = [a if fine else b for a, b, fine in zip(given, self.slip, good, strict=True)]
        rest = [b - a for a, b in zip(goal, self.slip, strict=True)]
        self._rest = [x if abs(x) >= SETTLED else 0.0 for x in rest]
        self._goal = goal
        if not any(self._rest):
            self.slip = goal
            return True
        way = abs(speed) if math.isfinite(speed) else 0.0
        self._rates = [-way / length if length > 0.0 else -math.inf for length in self._lengths]
        return False

    def at(self, time: float) -> list[float]:
        """Return slip a time [s] from now, above zero."""
        return self._felt(time, math)

    def course(self, times: FloatArray) -> FloatArray:
        """Return slip at times from now, shape (n, 2)."""
        return np.stack(self._felt(times, np), axis=1)

    def _felt(self, time: Any, by: Any) -> list[Any]:
        return [
            goal + rest * by.exp(rate * time)
            for goal, rest, rate in zip(self._goal, self._rest, self._rates, strict=True)
        ]

    def go_on(self, step: float) -> None:
        """Let a time [s] go by in which slip was not settled."""
        self.slip = self.at(step)
