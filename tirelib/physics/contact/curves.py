"""Pressure between the nodes of a profile: power laws and straight lines between samples.

Places are u, the distance from the leading edge in contact lengths, so 0 is the leading edge and 1
the trailing one. Every curve holds one row per operating point.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from tirelib.core.arrays import FloatArray, IntArray


def stretched_rule(count: int) -> tuple[FloatArray, FloatArray]:
    """Return nodes and weights on (0, 1), crowded at both ends.

    Gauss-Legendre in t with u = I_t(5, 5), the fifth-order smooth step: an end power u^p becomes
    t^(5p), smooth enough for Gauss, and 1 - u is as exact at the far end as u is at the near one.
    """
    t, w = np.polynomial.legendre.leggauss(count)
    t, w = 0.5 * (t + 1.0), 0.5 * w
    u = t**5 * (126.0 - 420.0 * t + 540.0 * t**2 - 315.0 * t**3 + 70.0 * t**4)
    return u, 630.0 * (t * (1.0 - t)) ** 4 * w


_PIECE = stretched_rule(40)


class Curve(Protocol):
    """A pressure over u, the distance from the leading edge in contact lengths (0 .. 1).

    `rows` names the operating point of each u, as an index of the same shape.
    """

    def pressure(self, u: FloatArray, rows: IntArray) -> FloatArray:
        """Return the pressure, [N/m]."""
        ...

    def cumulative(self, u: FloatArray, rows: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return the load between the leading edge and u, [N], and the integral of u over it."""
        ...


@dataclass(frozen=True, eq=False)
class PowerCurve:
    r"""q = q0 (1 + s xi) (1 - xi^2)^p (f + xi^2)^r over xi = 1 - 2u; one row per operating point.

    The parabola (p = 1, r = 0), Eq. (28) (p = 1/n, r = 0) and Eq. (53) (p = r = 1/n_p) are cases
    of it. All fields are arrays of shape (n_points,); `scale` is q0 per contact length, [N].
    """

    scale: FloatArray
    length: FloatArray
    skew: FloatArray
    fill: FloatArray
    edge_power: FloatArray
    fill_power: FloatArray

    def pressure(self, u: FloatArray, rows: IntArray) -> FloatArray:
        """See `Curve`."""
        return np.asarray(self._shape(u, rows) * self.scale[rows] / self.length[rows])

    def cumulative(self, u: FloatArray, rows: IntArray) -> tuple[FloatArray, FloatArray]:
        """See `Curve`."""
        rear = u > 0.5
        load, moment = self._piece(np.where(rear, 0.5, 0.0), u, rows)
        front, front_moment = self._front
        return load + np.where(rear, front[rows], 0.0), moment + np.where(
            rear, front_moment[rows], 0.0
        )

    @cached_property
    def _front(self) -> tuple[FloatArray, FloatArray]:
        """Load and moment of the front half, shape (n_points,)."""
        zero = np.zeros(self.scale.size)
        return self._piece(zero, zero + 0.5, np.arange(zero.size))

    def _shape(self, u: FloatArray, rows: IntArray) -> FloatArray:
        xi = 1.0 - 2.0 * u
        edge: FloatArray = (4.0 * u * (1.0 - u)) ** self.edge_power[rows]
        fill: FloatArray = (self.fill[rows] + xi**2) ** self.fill_power[rows]
        return (1.0 + self.skew[rows] * xi) * edge * fill

    def _piece(
        self, start: FloatArray, stop: FloatArray, rows: IntArray
    ) -> tuple[FloatArray, FloatArray]:
        """Integrate between two places on the same side of the middle."""
        node, weight = _PIECE
        width = (stop - start)[..., None]
        u = start[..., None] + width * node
        part = self._shape(u, rows[..., None]) * weight * width * self.scale[rows][..., None]
        return part.sum(axis=-1), (part * u).sum(axis=-1)


@dataclass(frozen=True, eq=False)
class SampledCurve:
    """Straight lines between samples; one row per operating point.

    `u` ascends from 0 to 1, shape (n_points, n_samples); `value` is the pressure there, [N/m];
    `length` the contact length, shape (n_points,), [m].
    """

    u: FloatArray
    value: FloatArray
    length: FloatArray

    def pressure(self, u: FloatArray, rows: IntArray) -> FloatArray:
        """See `Curve`."""
        left, step = self._segment(u, rows)
        low, high = self.value[rows, left], self.value[rows, left + 1]
        return np.asarray(low + (high - low) * (u - self.u[rows, left]) / step)

    def cumulative(self, u: FloatArray, rows: IntArray) -> tuple[FloatArray, FloatArray]:
        """See `Curve`."""
        before, before_moment = self._before
        left, _ = self._segment(u, rows)
        start = self.u[rows, left]
        area, moment = _trapezoid(start, u - start, self.value[rows, left], self.pressure(u, rows))
        load, moment = before[rows, left] + area, before_moment[rows, left] + moment
        return load * self.length[rows], moment * self.length[rows]

    @cached_property
    def _before(self) -> tuple[FloatArray, FloatArray]:
        """Area and moment up to each sample, shape (n_points, n_samples)."""
        step = np.diff(self.u, axis=-1)
        low, high = self.value[:, :-1], self.value[:, 1:]
        whole, whole_moment = _trapezoid(self.u[:, :-1], step, low, high)
        before = np.pad(np.cumsum(whole, axis=-1), ((0, 0), (1, 0)))
        return before, np.pad(np.cumsum(whole_moment, axis=-1), ((0, 0), (1, 0)))

    @cached_property
    def _knots(self) -> FloatArray:
        """All samples in one ascending list: row r lives in [2r, 2r + 1]."""
        return np.ravel(self.u + 2.0 * np.arange(self.u.shape[0])[:, None])

    def _segment(self, u: FloatArray, rows: IntArray) -> tuple[IntArray, FloatArray]:
        """Return the segment of each u, and that segment's width."""
        count = self.u.shape[1]
        found = np.searchsorted(self._knots, u + 2.0 * rows, side="right") - 1 - count * rows
        left = np.clip(found, 0, count - 2)  # u = 1 belongs to the last segment
        return left, self.u[rows, left + 1] - self.u[rows, left]


def _trapezoid(
    start: FloatArray, step: FloatArray, low: FloatArray, high: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return area and first moment of straight pieces from `start` to `start + step`."""
    area = 0.5 * step * (low + high)
    return area, start * area + step**2 * (low + 2.0 * high) / 6.0
