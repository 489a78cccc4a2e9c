"""Which gages stand still while the others of their wheel turn."""

from collections import Counter
from collections.abc import Iterable, Sequence

import numpy as np

from tirebench.estimator.standing import LARGEST_STANDING_RANGE, Level
from tirelib.campaign.check_gages import DEAD

FLAT_BLOCKS = 2
"""Blocks in a row in which a dead gage is flat."""


class DeadGages:
    """Names each dead gage once.

    Parameters
    ----------
    lateral : sequence of float, [m]
        Positions of the gages, ISO; empty where they are not known.

    Attributes
    ----------
    said : list of str
        A sentence on each dead gage so far.
    """

    def __init__(self, lateral: Sequence[float] = ()) -> None:
        self.said: list[str] = []
        self._lateral = lateral
        self._flat: Counter[tuple[int, int]] = Counter()

    def take(self, levels: Iterable[Level]) -> list[str]:
        """Take what the gages show; return a sentence on each gage that is newly found dead."""
        found = []
        for level in levels:
            swing = level.high - level.low
            known = swing[np.isfinite(swing)]
            usual = float(np.median(known)) if known.size else 0.0
            if usual <= LARGEST_STANDING_RANGE:
                continue  # the wheel stands
            for gage, one in enumerate(swing.tolist()):
                flat = self._flat[level.wheel, gage] + 1 if one < DEAD * usual else 0
                self._flat[level.wheel, gage] = flat
                text = f"wheel {level.wheel}: gage {gage + 1}{self._place(gage)} is dead"
                if flat == FLAT_BLOCKS and text not in self.said:
                    found.append(text)
                    self.said.append(text)
        return found

    def _place(self, gage: int) -> str:
        known = gage < len(self._lateral)
        return f" (y {1e3 * self._lateral[gage]:+.0f} mm)" if known else ""
