"""Samples that cannot end a turn are kept and evaluated together: most samples of a turn are such.

A turn ends after a pulse of the centre gage. While that gage stays between levels that its contact
finder knows, nothing can be found, so short frames need no work of their own. What is found later
does not change: neither finder nor cutter depend on how samples are cut into frames.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.measured.signal.contacts import JUMP, ContactFinder
from tirelib.measured.signal.turns import TurnCutter

MOST_SAMPLES = 512
"""Samples that are kept at most."""
_MEDIAN = 2
"""Samples by which the finder lags."""
_NEARLY = 1.0 - 1e-9
"""Share of a jump's required swing that round-off cannot reach."""


class Backlog:
    """Frames of one stream that wait.

    Parameters
    ----------
    cutter : TurnCutter
        Which is asked what it would do with the next samples; whoever gives it samples calls
        `forget_range`.
    """

    def __init__(self, cutter: TurnCutter) -> None:
        self._cutter = cutter
        self._gages = cutter.lateral.size
        self._centre = int(np.argmin(np.abs(cutter.lateral)))
        self.clear()

    def clear(self) -> None:
        """Forget everything."""
        self._values: list[float] = []
        self._counts: list[int] = []
        self._held: list[Sequence[float]] = []
        self.count = 0
        self.forget_range()

    def forget_range(self) -> None:
        """Ask the cutter again after new samples."""
        self._range: tuple[float, float, int] | None = None
        self._asked = False

    def keep(self, values: list[float], n: int, held: Sequence[float]) -> bool:
        """Keep a frame if it cannot end a turn; return whether it was kept.

        Parameters
        ----------
        values : list of float, length n x gages
            Strain, sample by sample.
        n : int
        held : sequence of float
            What held during the frame, in the order of `HELD`.
        """
        if not self._asked:
            self._range, self._asked = quiet_range(self._cutter), True
        if self._range is None or not n:
            return False
        low, high, room = self._range
        centre = values[self._centre :: self._gages]
        total = sum(centre)
        numbers = total - total == 0.0  # all of them finite
        if not numbers or min(centre) < low or max(centre) > high or self.count + n > room:
            return False
        self._values += values
        self._counts.append(n)
        self._held.append(held)
        self.count += n
        return True

    def drained(self) -> tuple[FloatArray, FloatArray]:
        """Return strain, shape (n_gages, n), and held conditions, shape (k, n), and clear both."""
        strain = np.array(self._values).reshape(-1, self._gages).T
        held = np.repeat(np.array(self._held).T, self._counts, axis=1)
        self.clear()
        return strain, held


def quiet_range(cutter: TurnCutter) -> tuple[float, float, int] | None:
    """Return between which strains of the centre gage, and for how many samples, no turn can end.

    None where that is unknown: before the first contact.
    """
    inside: dict[str, Any] = vars(cutter)
    finder: ContactFinder = inside["_finder"]
    known = vars(finder)
    level, tail = known["_level"], known["_tail"]
    if level is None or tail.size < _MEDIAN:
        return None
    jump = JUMP * known["_swing"] * _NEARLY
    lowest, highest = known["_lowest"], known["_highest"]
    if known["_pulse"] is None:
        high = min(level, lowest + jump)
        low = max(highest, high) - jump
    else:
        low = max(known["_low_level"], highest - jump)
        high = min(lowest, low) + jump
    lacking = cutter.lacking
    room = min(
        MOST_SAMPLES,
        finder._room() - _MEDIAN - 1,
        (MOST_SAMPLES if lacking is None else lacking) - 1,
    )
    if room < 1 or not (low <= float(tail.min()) and float(tail.max()) <= high):
        return None
    return low, high, room
