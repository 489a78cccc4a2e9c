"""Periodic cubic B-splines round the wheel, refined about the contact.

All fields of the belt are C^2 splines of the wheel angle, so that strain and its rate are smooth
functions and carry no mesh noise. Two Gauss points per element suffice for C^2 cubics
(Hughes, Reali, Sangalli 2010, half-point rule).
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

Array = NDArray[np.float64]
DEGREE = 3
GAUSS = 2


@dataclass(frozen=True, eq=False)
class Mesh:
    """A periodic spline mesh.

    Attributes
    ----------
    knots : array, shape (n + 1,)
        Element boundaries from -pi to pi [rad].
    phi, weight : array, shape (n_gauss,)
        Gauss points and their weights [rad], in order of angle.
    value, slope : array, shape (n_gauss, 4)
        The four spline functions that live at each Gauss point, and their derivatives.
    control : int array, shape (n_gauss, 4)
        Numbers of the control points that these belong to.
    contact : int array
        Gauss points that may touch the road.
    """

    knots: Array
    phi: Array
    weight: Array
    value: Array
    slope: Array
    control: NDArray[np.intp]
    contact: NDArray[np.intp]

    @property
    def n(self) -> int:
        """Number of elements, and of control points."""
        return len(self.knots) - 1

    def field(self, control: Array, phi: Array) -> tuple[Array, Array]:
        """Return values and first derivatives of fields at any angles.

        Parameters
        ----------
        control : array, shape (n, n_fields)
            Control values.
        phi : array
            Angles [rad], taken modulo 2 pi.
        """
        spline = BSpline(_extended(self.knots), np.vstack([control, control[:DEGREE]]), DEGREE)
        inside = np.mod(phi + np.pi, 2.0 * np.pi) - np.pi
        return np.asarray(spline(inside)), np.asarray(spline.derivative()(inside))


def _extended(knots: Array) -> Array:
    turn = 2.0 * np.pi
    return np.concatenate([knots[-1 - DEGREE : -1] - turn, knots, knots[1 : 1 + DEGREE] + turn])


def _boundaries(fine: float, coarse: float, zone: float) -> Array:
    """Element boundaries: `fine` within +-zone, growing by a fifth per element up to `coarse`."""
    half = int(np.ceil(zone / fine))
    right = [i * zone / half for i in range(half + 1)]
    step = zone / half
    while right[-1] < np.pi:
        step = min(1.2 * step, coarse)
        right.append(right[-1] + step)
    graded = np.array(right)
    outer = graded[half:]
    graded[half:] = zone + (outer - zone) * (np.pi - zone) / (outer[-1] - zone)
    return np.concatenate([-graded[:0:-1], graded])


@lru_cache(maxsize=8)
def mesh(fine: float = 0.009, coarse: float = 0.09, zone: float = 0.42) -> Mesh:
    """Make a mesh.

    Parameters
    ----------
    fine, coarse : float
        Element size in the contact and at the top of the wheel [rad].
    zone : float
        Half angle of the refined part, where contact is looked for [rad].
    """
    knots = _boundaries(fine, coarse, zone)
    n = len(knots) - 1
    points, weights = np.polynomial.legendre.leggauss(GAUSS)
    half = 0.5 * np.diff(knots)
    phi = (0.5 * (knots[1:] + knots[:-1])[:, None] + half[:, None] * points).ravel()
    weight = (half[:, None] * weights).ravel()
    element = np.repeat(np.arange(n), GAUSS)
    basis = BSpline(_extended(knots), np.eye(n + DEGREE), DEGREE)
    local = element[:, None] + np.arange(DEGREE + 1)
    rows = np.arange(len(phi))[:, None]
    return Mesh(
        knots=knots,
        phi=phi,
        weight=weight,
        value=np.asarray(basis(phi))[rows, local],
        slope=np.asarray(basis.derivative()(phi))[rows, local],
        control=local % n,
        contact=np.flatnonzero(np.abs(phi) < zone),
    )
