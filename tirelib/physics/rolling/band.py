"""The derivative of the rolling ring's residual as a band matrix with a border."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from scipy.linalg import lapack

from tirelib.core.arrays import BoolArray, FloatArray

WIDTH = 4
"""Unknowns of a node."""
LOCAL = 16
"""Unknowns of an element."""
BORDER = WIDTH + 2
BAND = LOCAL - 1
"""Diagonals on either side."""


def gathered(local: FloatArray) -> FloatArray:
    """Return nodal sums (n_points, n_nodes, ...) of values (n_points, n_elements, 4, ...)."""
    n_points, n_elements = local.shape[:2]
    out = local[:, :, :3].copy()
    out[:, :, 0] += np.roll(local[:, :, 3], 1, axis=1)
    return out.reshape(n_points, 3 * n_elements, *local.shape[3:])


@dataclass(frozen=True, slots=True, eq=False)
class Matrix:
    """The derivative of the residual: a band with a border.

    Attributes
    ----------
    band : shape (n_points, n_inner, 3 BAND + 1)
        LAPACK's band storage, transposed; unknowns of all nodes but the first.
    right, lower : shape (n_points, n_inner, BORDER), (n_points, BORDER, n_inner)
    corner : shape (n_points, BORDER, BORDER)
    """

    band: FloatArray
    right: FloatArray
    lower: FloatArray
    corner: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Factors:
    """A matrix whose bands are factored.

    Attributes
    ----------
    lu : list of (factors, pivots), n_points
        LAPACK's.
    across : shape (n_points, n_inner, BORDER)
        Solutions of the bands for the right sides of the border.
    lower, corner : shape (n_points, BORDER, n_inner), (n_points, BORDER, BORDER)
        Lines below, and what the border's unknowns leave of them.
    """

    lu: list[tuple[FloatArray, Any]]
    across: FloatArray
    lower: FloatArray
    corner: FloatArray

    @classmethod
    def of(cls, m: Matrix) -> "Factors":
        """Factor a matrix, whose band is overwritten."""
        lu = [lapack.dgbtrf(one.T, BAND, BAND, overwrite_ab=1)[:2] for one in m.band]
        across = _band_solved(lu, m.right)
        return cls(lu, across, m.lower, m.corner - m.lower @ across)

    def take(self, chosen: BoolArray) -> "Factors":
        """Return those of some points."""
        lu = [pair for pair, wanted in zip(self.lu, chosen, strict=True) if wanted]
        return Factors(lu, self.across[chosen], self.lower[chosen], self.corner[chosen])

    def solve(self, right: FloatArray) -> FloatArray:
        """Return the solutions (n_points, n_unknowns, n_right)."""
        inner = self.across.shape[1]
        out = np.empty_like(right)
        own = _band_solved(self.lu, right[:, :inner])
        rest = right[:, inner:] - self.lower @ own
        try:
            edge = np.linalg.solve(self.corner, rest)
        except np.linalg.LinAlgError:
            edge = np.full_like(rest, np.nan)
        out[:, inner:] = edge
        out[:, :inner] = own - self.across @ edge
        return out


def _band_solved(lu: list[tuple[FloatArray, Any]], right: FloatArray) -> FloatArray:
    """Return the solutions of the bands alone."""
    # transposed, so that LAPACK finds every right side in one piece
    turned = right.swapaxes(1, 2).copy()
    for (factors, pivots), sides in zip(lu, turned, strict=True):
        lapack.dgbtrs(factors, BAND, BAND, sides.T, pivots, overwrite_b=1)
    return turned.swapaxes(1, 2)


@cache
def _places(n_elements: int) -> tuple[Any, ...]:
    """Return where element entries go: (chosen, target) of band, right side and lower side."""
    node = (3 * np.arange(n_elements)[:, None] + np.arange(4)) % (3 * n_elements)
    unknown = (WIDTH * (node[..., None] - 1) + np.arange(WIDTH)).reshape(n_elements, LOCAL)
    row, column = np.broadcast_arrays(unknown[:, :, None], unknown[:, None, :])
    # the last node's own block is added to the next element's first beforehand
    last = np.arange(LOCAL) >= LOCAL - WIDTH
    own = np.broadcast_to(last[:, None] & last[None, :], row.shape)
    inner = (row >= 0) & (column >= 0) & ~own
    band = column * (3 * BAND + 1) + 2 * BAND + row - column
    right = (row >= 0) & (column < 0) & ~own
    lower = (row < 0) & (column >= 0) & ~own
    n_inner = WIDTH * (3 * n_elements - 1)
    return (
        np.flatnonzero(inner),
        band[inner],
        np.flatnonzero(right),
        (row * BORDER + column + WIDTH)[right],
        np.flatnonzero(lower),
        ((row + WIDTH) * n_inner + column)[lower],
        n_inner,
    )


def banded(element: FloatArray, sides: FloatArray, rows: FloatArray, corner: FloatArray) -> Matrix:
    """Return the matrix of element matrices, their sides, the lines below and the corner."""
    n, n_elements = element.shape[:2]
    own = element[:, :, 3, :, 3, :].copy()
    element[:, :, 0, :, 0, :] += np.roll(own, 1, axis=1)
    flat = element.reshape(n, -1)
    chosen, to_band, from_right, to_right, from_lower, to_lower, n_inner = _places(n_elements)
    band = np.zeros((n, n_inner * (3 * BAND + 1)))
    band[:, to_band] = flat[:, chosen]
    right = np.zeros((n, n_inner * BORDER))
    right[:, to_right] = flat[:, from_right]
    lower = np.zeros((n, BORDER * n_inner))
    lower[:, to_lower] = flat[:, from_lower]
    corner[:, :WIDTH, :WIDTH] = element[:, 0, 0, :, 0, :]
    right = right.reshape(n, n_inner, BORDER)
    lower = lower.reshape(n, BORDER, n_inner)
    column = gathered(sides)  # (n, n_nodes, WIDTH, 2)
    right[:, :, WIDTH:] = column[:, 1:].reshape(n, n_inner, 2)
    corner[:, :WIDTH, WIDTH:] = column[:, 0]
    line = gathered(np.moveaxis(rows, 1, -1))
    lower[:, WIDTH:] = np.moveaxis(line[:, 1:].reshape(n, n_inner, 2), 1, 2)
    corner[:, WIDTH:, :WIDTH] = np.moveaxis(line[:, 0], 1, 2)
    return Matrix(band.reshape(n, n_inner, 3 * BAND + 1), right, lower, corner)
