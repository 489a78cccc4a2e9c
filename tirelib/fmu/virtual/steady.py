"""Samples of a condition that stays, found many at a time, so that short steps cost little."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from tirelib.core.arrays import FloatArray

BLOCK = 256
"""Samples that are found at a time."""


def wrapped(angle: float) -> float:
    """Return an angle within -pi .. pi."""
    return (angle + math.pi) % (2.0 * math.pi) - math.pi


class SteadyRun:
    """A wheel that turns on at one rate under one condition.

    Parameters
    ----------
    find : callable
        Returns what the gages show, shape (n, g), at wheel angles, shape (n,) [rad], of samples
        with numbers from a first one on.
    inputs : list of float
        The condition.
    omega, rate : float, [rad/s], [Hz]
    angle : float, [rad]
        Wheel angle at the beginning.
    due : float
        Samples that had gone by since the last one.
    count : int
        Number of the first sample.
    time : float, [s]
        Since the beginning.
    """

    def __init__(
        self,
        find: Callable[[FloatArray, int], FloatArray],
        inputs: list[float],
        omega: float,
        rate: float,
        *,
        angle: float,
        due: float,
        count: int,
        time: float = 0.0,
    ) -> None:
        self._find, self.inputs = find, inputs
        self._omega, self._rate = omega, rate
        self._angle, self._due, self._first, self.time = angle, due, count, time
        self._block = -1
        self._rows: FloatArray = np.empty((0, 0))

    def go_on(self, step: float) -> float:
        """Let time [s] go by; return the wheel angle."""
        self.time += step
        return wrapped(self._angle + self._omega * self.time)

    def samples(self, number: int, n: int) -> FloatArray:
        """Return n samples from a number on, shape (n, g)."""
        at = number - self._first
        parts: list[FloatArray] = []
        while n > 0:
            block, offset = divmod(at, BLOCK)
            if block != self._block:
                self._block, self._rows = block, self._found(block)
            parts.append(self._rows[offset : offset + n])
            at, n = at + len(parts[-1]), n - len(parts[-1])
        return parts[0] if len(parts) == 1 else np.concatenate(parts)

    def _found(self, block: int) -> FloatArray:
        first = block * BLOCK
        numbers = np.arange(first + 1, first + BLOCK + 1, dtype=np.float64)
        times: FloatArray = (numbers - self._due) / self._rate
        return self._find(self._angle + self._omega * times, self._first + first)

    def state(self) -> dict[str, Any]:
        """Return what `SteadyRun` needs beside the condition to go on bit by bit."""
        reals = {"angle": self._angle, "due": self._due, "time": self.time}
        return {"count": self._first, **{name: value.hex() for name, value in reals.items()}}
