"""Cubic elements round the belt: fine where it meets the road, coarse elsewhere.

Angles run from -pi to pi, the road lies at zero. An element has four evenly spaced nodes; three
Gauss points carry the belt's energy (reduced integration, so that a belt that cannot shear does not
lock) and more of them the road's pressure, which ends within an element.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.interpolate import CubicSpline

from tirelib.core.arrays import FloatArray

ORDER = 3
PATCH = 0.6
"""Half-angle of the fine part; the contact has to end within, [rad]."""
FINE = 20
"""Elements of the fine part."""
COARSE = 7
"""Elements of each side of the rest, growing away from the contact."""
DENSE = 1440
"""Angles of a turn on which the belt's harmonics are taken."""
N_BELT, N_ROAD = 3, 8
"""Gauss points of an element for the belt and for the road."""


@dataclass(frozen=True, slots=True, eq=False)
class Mesh:
    """The elements and their basis functions.

    Attributes
    ----------
    ends : shape (n_elements + 1,), [rad]
    fine : slice
        Elements that can touch the road.
    node : shape (n_nodes,), [rad]
        Nodes of all elements but the last's end, which is the first's start.
    belt, road : Points
        Integration points of all elements, and of the fine ones.
    at_nodes : shape (n_fine, 4, 4), [1/rad]
        Slopes of the basis at the fine elements' nodes.
    """

    ends: FloatArray
    fine: slice
    node: FloatArray
    belt: "Points"
    road: "Points"
    at_nodes: FloatArray

    @property
    def n_elements(self) -> int:
        """Number of elements."""
        return self.ends.size - 1

    @property
    def node_angles(self) -> FloatArray:
        """Angles of the fine elements' nodes, (n_fine, 4), [rad]."""
        start, end = self.ends[:-1][self.fine], self.ends[1:][self.fine]
        out: FloatArray = start[:, None] + (end - start)[:, None] * np.arange(4) / ORDER
        return out


@dataclass(frozen=True, slots=True, eq=False)
class Points:
    """Integration points of some elements.

    Attributes
    ----------
    phi : shape (n_elements, n_points), [rad]
    weight : shape (n_elements, n_points), [rad]
    value : shape (n_points, 4)
        Basis functions.
    slope : shape (n_elements, n_points, 4), [1/rad]
        Their derivatives by the angle.
    linear : shape (n_points, 4)
        Interpolation along straight lines between the nodes.
    """

    phi: FloatArray
    weight: FloatArray
    value: FloatArray
    slope: FloatArray
    linear: FloatArray


@cache
def mesh(fine: int = FINE, coarse: int = COARSE) -> Mesh:
    """Return the mesh with so many elements in the fine part and on each side of the rest."""
    step = 2.0 * PATCH / fine
    rest = np.pi - PATCH
    # sides grow from the fine step by a constant factor
    growth = _growth(rest / step, coarse)
    sides = step * growth ** np.arange(1.0, coarse + 1.0)
    outer = PATCH + np.cumsum(sides) * rest / sides.sum()
    inner = np.linspace(-PATCH, PATCH, fine + 1)
    ends = np.concatenate([-outer[::-1], inner, outer])
    at = np.arange(ORDER) / ORDER
    node = (ends[:-1, None] + np.diff(ends)[:, None] * at).ravel()
    patch = slice(coarse, coarse + fine)
    return Mesh(
        ends,
        patch,
        node,
        _points(ends, slice(0, ends.size - 1), N_BELT),
        _points(ends, patch, N_ROAD),
        _lagrange(np.arange(4.0) / ORDER)[1] / np.diff(ends)[patch, None, None],
    )


def _growth(total: float, n: int) -> float:
    """Return g for which g + g^2 + ... + g^n is the total."""
    low, high = 0.5, 10.0
    for _ in range(60):
        g = 0.5 * (low + high)
        low, high = (g, high) if np.sum(g ** np.arange(1.0, n + 1.0)) < total else (low, g)
    return g


def _points(ends: FloatArray, which: slice, n: int) -> Points:
    x, w = np.polynomial.legendre.leggauss(n)
    x, w = 0.5 * (x + 1.0), 0.5 * w
    start, size = ends[:-1][which], np.diff(ends)[which]
    value, slope = _lagrange(x)
    return Points(
        start[:, None] + size[:, None] * x,
        size[:, None] * w,
        value,
        slope / size[:, None, None],
        np.array([np.interp(x, np.arange(4.0) / ORDER, row) for row in np.eye(4)]).T,
    )


def _lagrange(x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the four cubic basis functions at 0 <= x <= 1 and their derivatives."""
    at = np.arange(ORDER + 1.0) / ORDER
    coefficients = np.linalg.inv(np.vander(at, increasing=True))
    powers = np.vander(x, ORDER + 1, increasing=True)
    slopes = np.zeros_like(powers)
    slopes[:, 1:] = powers[:, :-1] * np.arange(1.0, ORDER + 1.0)
    return powers @ coefficients, slopes @ coefficients


@cache
def to_grid(fine: int, coarse: int, n: int) -> FloatArray:
    """Return the matrix from values at the belt's points to n even angles from -pi.

    A periodic cubic spline without the harmonics that n angles do not resolve; shape
    (n, n_belt_points).
    """
    at = mesh(fine, coarse).belt.phi.ravel()
    closed = np.append(at, at[0] + 2.0 * np.pi)
    unit = np.vstack([np.eye(at.size), np.eye(at.size)[:1]])
    many = max(n, DENSE)
    grid = -np.pi + 2.0 * np.pi * np.arange(many) / many
    spline = CubicSpline(closed, unit, bc_type="periodic")
    dense = spline(np.where(grid < at[0], grid + 2.0 * np.pi, grid))
    if n == many:
        return np.asarray(dense)
    kept = np.fft.rfft(dense, axis=0)[: (n + 1) // 2]
    return np.asarray(np.fft.irfft(kept, n=n, axis=0) * (n / many))


@cache
def to_grid_slope(fine: int, coarse: int, n: int) -> FloatArray:
    """Return the matrix from values at the belt's points to slopes by the angle on `to_grid`."""
    dense = to_grid(fine, coarse, n)
    order = 1j * np.arange(n // 2 + 1)
    if n % 2 == 0:
        order[-1] = 0.0
    return np.asarray(np.fft.irfft(np.fft.rfft(dense, axis=0) * order[:, None], n=n, axis=0))
