"""What differs from block to block of forces unintentionally, as a covariance.

    C_b = N^2 + T_b S T_b' + m m' * K

N is the noise of a point, T_b the slopes by load, pressure and slips, whose measured values are off
alike in all points of a block (a steady run, or some seconds of a sweep). The last part is a misfit
of this block alone, smooth over the slip (Matern's function of order 3/2).
"""

from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import FloatArray, IntArray

LENGTH = 0.7
"""Length over which a block's own misfit is correlated, in arcsinh of C slip / (mu Fz)."""


@dataclass(frozen=True, slots=True)
class PointWhitener:
    """Turns forces (..., n) into rows of unit covariance.

    Attributes
    ----------
    parts : tuple of (index, lower, inverse)
        Points of each block, and the Cholesky factor of their covariance with its inverse.
    log_volume : float
        Logarithm of the determinant of all inverses together.
    """

    parts: tuple[tuple[IntArray, FloatArray, FloatArray], ...]
    log_volume: float

    @classmethod
    def of(
        cls,
        block: IntArray,
        tangent: FloatArray,
        place: FloatArray,
        amount: FloatArray,
        *,
        noise: FloatArray,
    ) -> "PointWhitener":
        """Return the whitening.

        Parameters
        ----------
        block : shape (n,)
        tangent : shape (n, k), [N] or [N m]
            Change by one standard deviation of each condition, which is off alike in a block.
        place : shape (n,)
            Where over the slip a point stands.
        amount : shape (n,), [N] or [N m]
            Standard deviation of a block's own misfit.
        noise : shape (n,), [N] or [N m]
        """
        order = np.argsort(block, kind="stable")
        cuts = np.flatnonzero(np.diff(block[order])) + 1
        parts, volume = [], 0.0
        for index in np.split(order, cuts):
            near = np.sqrt(3.0) * np.abs(place[index][:, None] - place[index]) / LENGTH
            own = np.outer(amount[index], amount[index]) * (1.0 + near) * np.exp(-near)
            inside = np.diag(noise[index] ** 2) + tangent[index] @ tangent[index].T + own
            lower = np.asarray(np.linalg.cholesky(inside))
            volume -= float(np.sum(np.log(np.diag(lower))))
            parts.append((index, lower, np.asarray(np.linalg.inv(lower))))
        return cls(tuple(parts), volume)

    def reduced(self, rows: FloatArray) -> FloatArray:
        """Return rows as they are: every number of a force counts."""
        return rows

    def white(self, rows: FloatArray) -> FloatArray:
        """Return whitened rows (..., n)."""
        out = np.empty_like(rows)
        for index, _, inverse in self.parts:
            out[..., index] = rows[..., index] @ inverse.T
        return out

    __call__ = white

    def coloured(self, white: FloatArray) -> FloatArray:
        """Return forces (k, n) whose whitened rows are these."""
        out = np.empty_like(white)
        for index, lower, _ in self.parts:
            out[..., index] = white[..., index] @ lower.T
        return out
