"""Where bristles stick and where they slide: the sign changes of demand against friction.

Nothing here assumes one border between adhesion and sliding. The state is read at every node of the
pressure profile; each change between two nodes is located to rounding, so the integrals over the
pieces are as exact as the profile's own.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray, IntArray
from tirelib.physics.contact.profiles import PressureProfile

MOST_STEPS = 80

Excess = Callable[[FloatArray, FloatArray, IntArray], FloatArray]
"""(u, pressure, index of the operating point) -> demand minus friction."""


@dataclass(frozen=True, slots=True, eq=False)
class Grid:
    """Places at which the state is read.

    Attributes
    ----------
    profile : PressureProfile
    row : array of int, shape (n_points,)
        Operating point of the profile, for each of the brush.
    u, pressure : arrays, shape (n_points, n), [-], [N/m]
        From 0 (leading edge) to 1, and the pressure there.
    whole : pair of arrays, shape (n_points,), [N]
        The curve's `cumulative` over the whole contact.
    """

    profile: PressureProfile
    row: IntArray
    u: FloatArray
    pressure: FloatArray
    whole: tuple[FloatArray, FloatArray]

    def take(self, keep: BoolArray) -> "Grid":
        """Return some of the operating points."""
        load, moment = self.whole
        rest = self.row[keep], self.u[keep], self.pressure[keep], (load[keep], moment[keep])
        return Grid(self.profile, *rest)


@dataclass(frozen=True, slots=True, eq=False)
class Split:
    """Borders between adhesion and sliding.

    Attributes
    ----------
    first, last : arrays, shape (n_points,)
        Does the bristle stick at the leading edge, and at the trailing edge?
    point, place : arrays, shape (n_borders,)
        Operating point and u of each border.
    sign : array, shape (n_borders,)
        +1 where adhesion ends, -1 where it begins again, going back from the leading edge.
    """

    first: BoolArray
    last: BoolArray
    point: IntArray
    place: FloatArray
    sign: FloatArray

    def total(
        self, stick: FloatArray, slide: FloatArray, stick_at: FloatArray, slide_at: FloatArray
    ) -> FloatArray:
        """Join two antiderivatives, both zero at the leading edge, along the pieces.

        Parameters
        ----------
        stick, slide : arrays, shape (n_points,)
            Their values at the trailing edge.
        stick_at, slide_at : arrays, shape (n_borders,)
            Their values at the borders.
        """
        jump = np.bincount(
            self.point, weights=self.sign * (stick_at - slide_at), minlength=self.first.size
        )
        return np.asarray(np.where(self.last, stick, slide) + jump, dtype=np.float64)


def make_grid(profile: PressureProfile, row: IntArray) -> Grid:
    """Return the profile's nodes and both edges, for operating points `row` of the profile."""
    flat = (-1, profile.x.shape[-1])
    u = (profile.leading[..., None] - profile.x) / profile.length[..., None]
    u, pressure = u.reshape(flat)[:, ::-1], profile.pressure.reshape(flat)[:, ::-1]
    inner = np.all((u > 0.0) & (u < 1.0), axis=0)
    u, pressure = u[:, inner], pressure[:, inner]
    ends, rows = np.zeros(u.shape[0]), np.arange(u.shape[0])
    front, back = profile.curve.pressure(ends, rows), profile.curve.pressure(ends + 1.0, rows)
    u = np.column_stack([ends, u, ends + 1.0])
    load, moment = profile.curve.cumulative(ends + 1.0, rows)
    whole = load[row], moment[row]
    return Grid(profile, row, u[row], np.column_stack([front, pressure, back])[row], whole)


def split(grid: Grid, excess: Excess) -> Split:
    """Find every border between adhesion and sliding.

    Parameters
    ----------
    grid : Grid
    excess : callable
        Demand minus friction; a bristle sticks where it is not positive.
    """
    point = np.arange(grid.row.size)
    value = excess(grid.u, grid.pressure, point[:, None])
    sticks = value <= 0.0
    # Both are zero at an edge without pressure: there the state is the neighbour's.
    sticks[:, 0] = np.where(grid.pressure[:, 0] > 0.0, True, sticks[:, 1])
    panel_point, panel = np.nonzero(sticks[:, 1:] != sticks[:, :-1])

    def at(u: FloatArray) -> FloatArray:
        pressure = grid.profile.curve.pressure(u, grid.row[panel_point])
        return excess(u, pressure, panel_point)

    place = _roots(
        at,
        grid.u[panel_point, panel],
        grid.u[panel_point, panel + 1],
        value[panel_point, panel],
        value[panel_point, panel + 1],
    )
    sign = np.where(sticks[panel_point, panel], 1.0, -1.0)
    return Split(sticks[:, 0], sticks[:, -1], panel_point, place, sign)


def _roots(
    f: Callable[[FloatArray], FloatArray],
    a: FloatArray,
    b: FloatArray,
    fa: FloatArray,
    fb: FloatArray,
) -> FloatArray:
    """Return one root in each bracket: false position (Illinois), to rounding."""
    if a.size == 0:
        return a
    for _ in range(MOST_STEPS):
        rise = fb - fa
        step = np.divide(fb * (b - a), rise, out=np.zeros_like(b), where=rise != 0.0)
        c = b - step
        fc = f(c)
        crossed = fc * fb <= 0.0
        a, fa = np.where(crossed, b, a), np.where(crossed, fb, 0.5 * fa)
        moved = np.abs(c - b)
        b, fb = c, fc
        if np.all((fc == 0.0) | (moved <= 1e-15) | (np.abs(b - a) <= 1e-15)):
            break
    return b
