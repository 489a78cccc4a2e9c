"""Slips that a further run of a force passes through at one set point, as the campaign's runs do.

A run on a flat belt is a sweep of the slip at one load, pressure and camber, or a block of steady
points there. A campaign of such runs is continued by one of the same kind, and not by one point.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import FloatArray, IntArray
from tirelib.core.errors import ParameterError
from tirelib.inference.identify.error_bands import numbered
from tirelib.inference.identify.force_points import CELL_ANGLE, CELL_RATIO, ForcePoints, set_points

FEWEST_SLIPS = 4
"""Different slips that make a run one of several points."""
SERIES_SHARE = 0.5
"""Share of a campaign's points in such runs from which on they are its kind of run."""
_LEVEL = 1000
"""Cells of one set point, in the numbers of `set_points`."""


@dataclass(frozen=True, slots=True, eq=False)
class Sweep:
    """Slips of one run, from the lowest to the highest.

    Attributes
    ----------
    name : str
        slip_angle or slip_ratio.
    values : shape (m,), [rad] or [-]
    rates : shape (m,), [rad/s]
        Rate of the slip angle there; zero in steady points.
    """

    name: str
    values: FloatArray
    rates: FloatArray

    def __len__(self) -> int:
        return int(self.values.size)

    def over(self, low: float, high: float) -> "Sweep":
        """Return the sweep stretched to another range, each side of zero by itself.

        A side that the range does not reach is left out.

        Raises
        ------
        ParameterError
            If the range holds none of the slips.

        Examples
        --------
        >>> small = Sweep("slip_ratio", np.array([-0.1, 0.05, 0.1]), np.zeros(3))
        >>> small.over(-0.05, 0.2).values.tolist()
        [-0.05, 0.1, 0.2]
        """
        factor = np.ones(len(self))
        for side, end in ((self.values < 0.0, low), (self.values > 0.0, high)):
            if side.any():
                factor[side] = max(end / self.values[side][np.abs(self.values[side]).argmax()], 0.0)
        values, rates = factor * self.values, factor * self.rates
        inside = (factor > 0.0) & (values >= low - 1e-12) & (values <= high + 1e-12)
        if not inside.any():
            raise ParameterError(
                f"envelope: no slip of the campaign's sweeps is in the declared range {low:.4g} to "
                f"{high:.4g} (SI); declare a range on the same side of zero, or give --no-sweep"
            )
        return Sweep(self.name, values[inside], rates[inside])


def campaign_sweep(points: ForcePoints, name: str, wanted: bool | None = None) -> Sweep | None:
    """Return the slips of a campaign's runs, None if its runs are single points.

    A run is a stretch of points that follow each other at one load, pressure, camber and speed. It
    is one of several points if it has `FEWEST_SLIPS` slips. Where most points are in such runs,
    the one with the most different slips is returned, each slip once in each direction. If `wanted`
    is False, the return is always None; if it is True, all slips of the campaign where its runs are
    single points.
    """
    if wanted is False:
        return None
    slip = np.asarray(getattr(points.data, name))
    cell = np.round(slip / (CELL_ANGLE if name == "slip_angle" else CELL_RATIO)).astype(np.int64)
    run = _runs(points)
    several = [
        index
        for index in (np.flatnonzero(run == k) for k in range(int(run.max()) + 1))
        if np.unique(cell[index]).size >= FEWEST_SLIPS
    ]
    if sum(index.size for index in several) > SERIES_SHARE * len(points):
        chosen = max(several, key=lambda index: np.unique(cell[index]).size)
        return _once(name, slip[chosen], cell[chosen], points.slip_rate[chosen])
    if not wanted:
        return None
    return _once(name, slip, cell, np.zeros(len(points)))


def _runs(points: ForcePoints) -> IntArray:
    """Return the number of each point's run."""
    data = points.data
    known: Sequence[IntArray] = [
        set_points(data.load) // _LEVEL,
        set_points(data.pressure) // _LEVEL,
        set_points(np.abs(data.speed)) // _LEVEL,
        np.round(data.camber / CELL_ANGLE).astype(np.int64),
    ]
    order = np.argsort(points.conditions.order, kind="stable")
    new = np.zeros(len(points), dtype=bool)
    for level in known:
        new[1:] |= np.diff(level[order]) != 0
    run = np.empty(len(points), dtype=np.int64)
    run[order] = np.cumsum(new)
    return run


def _once(name: str, slip: FloatArray, cell: IntArray, rate: FloatArray) -> Sweep:
    """Return every slip once in each direction, means over a run's visits."""
    number = numbered(cell, np.sign(rate))
    count = np.bincount(number)
    return Sweep(name, np.bincount(number, slip) / count, np.bincount(number, rate) / count)
