"""How much room a recording has left, and how fast it takes it."""

import shutil
import time
from collections import deque
from pathlib import Path

EVERY = 1.0
"""Time between two looks at the disk, [s]."""
LOOKS_FOR_A_RATE = 30
"""Looks that the rate is taken over."""


def free_at(path: Path) -> float:
    """Return the free space where a file is or will be, [bytes]; NaN if unknown."""
    place = path.absolute()
    while not place.exists() and place != place.parent:
        place = place.parent
    try:
        return float(shutil.disk_usage(place).free)
    except OSError:
        return float("nan")


class Space:
    """Room and rate, looked up once a second."""

    def __init__(self) -> None:
        self._path: Path | None = None
        self._next = 0.0
        self._seen: deque[tuple[float, int]] = deque(maxlen=LOOKS_FOR_A_RATE)
        self._found = float("nan"), float("nan")

    def look(self, path: Path | None, size: int) -> tuple[float, float]:
        """Return room [bytes] and rate [bytes/s] of a recording of this size; NaN if unknown."""
        now = time.monotonic()
        if path is None:
            self._seen.clear()
            self._found, self._next = (float("nan"), float("nan")), 0.0
        elif now >= self._next:
            self._next = now + EVERY
            if self._seen and size < self._seen[-1][1]:
                self._seen.clear()
            self._seen.append((now, size))
            (start, before), rate = self._seen[0], float("nan")
            if now > start:
                rate = (size - before) / (now - start)
            self._found = free_at(path), rate
        return self._found
