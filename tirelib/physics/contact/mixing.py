"""Anderson's mixing: a fixed-point iteration that learns from its last steps, point by point."""

import numpy as np

from tirelib.core.arrays import FloatArray, IntArray
from tirelib.physics.ring.ring import ComplexArray

HISTORY = 6
"""Earlier iterations that help to guess the next one."""


class Mixer:
    """History of a fixed-point iteration; one small least-squares problem a point.

    Source: Anderson 1965; Walker and Ni 2011 (type II, full step).
    """

    def __init__(self) -> None:
        self.used: list[FloatArray] = []
        self.rest: list[FloatArray] = []

    def take(self, rows: IntArray) -> "Mixer":
        """Return the history of some points."""
        other = Mixer()
        other.used = [x[rows] for x in self.used]
        other.rest = [x[rows] for x in self.rest]
        return other

    def next(self, used: ComplexArray, wanted: ComplexArray) -> ComplexArray:
        """Return the next value, shape (n_points, n), from a used one and its answer."""
        n, columns = used.shape
        x = np.concatenate([used.real, used.imag], axis=1)
        self.used.append(x)
        self.rest.append(np.concatenate([wanted.real, wanted.imag], axis=1) - x)
        del self.used[: -HISTORY - 1], self.rest[: -HISTORY - 1]
        step = self.rest[-1]
        if len(self.rest) > 1:
            moves = np.diff(np.stack(self.used, axis=1), axis=1)
            falls = np.diff(np.stack(self.rest, axis=1), axis=1)
            gram = falls @ falls.swapaxes(1, 2)
            size = np.trace(gram, axis1=1, axis2=2)[:, None, None]
            gram = gram + (1e-12 * size + 1e-30) * np.eye(gram.shape[1])
            share = np.linalg.solve(gram, falls @ step[..., None])
            step = step - ((moves + falls) * share).sum(axis=1)
        new = x + step
        out: ComplexArray = new[:, :columns] + 1j * new[:, columns:]
        return out.reshape(n, columns)
