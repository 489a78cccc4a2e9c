"""Points at which forces are compared: means over passes through cells of conditions.

A steady run is one point. A sweep's samples are cut into passes: stretches in which load, pressure,
camber, slips, speed and tread temperature stay in one cell. Passes through the same cell, and runs
at the same set point, are the repeats that the noise is from.
"""

from dataclasses import dataclass, fields

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray, IntArray
from tirelib.effects.brush_state import BrushConditions
from tirelib.inference.identify.error_bands import MOST_LEVELS, numbered
from tirelib.inference.identify.force_data import ForceData

CELL_ANGLE, CELL_RATIO = float(np.deg2rad(0.5)), 0.01
"""Size of a cell in slip angle and camber [rad], and in slip ratio."""
CELL_TEMPERATURE = 5.0
"""Size of a cell in tread temperature, [K]."""
CELL_SHARE = 0.1
"""Largest size of a cell in load, pressure and speed, relative."""
_SAME = 0.04
"""Relative gap at which set points part."""
_AWAY = 0.5
"""Time after which a sweep that comes back to a cell makes another pass, [s]."""


@dataclass(frozen=True, slots=True, eq=False)
class ForcePoints:
    """Points; arrays of shape (n,).

    Attributes
    ----------
    data : ForceData
        Means over the points' samples.
    slip_rate : [rad/s]
        Rate of the slip angle; zero in steady runs.
    cell : int
        Number of the cell of conditions.
    sweep : bool
        Whether the point is part of a sweep.
    """

    data: ForceData
    slip_rate: FloatArray
    samples: IntArray
    cell: IntArray
    sweep: BoolArray

    def __len__(self) -> int:
        return len(self.data)

    def take(self, chosen: IntArray | BoolArray) -> "ForcePoints":
        """Return some of the points."""
        arrays = (getattr(self, f.name)[chosen] for f in fields(self)[1:])
        return ForcePoints(self.data.take(chosen), *arrays)

    @property
    def conditions(self) -> BrushConditions:
        """The operating points as effects see them."""
        d = self.data
        place = np.arange(len(d)) if not np.isfinite(d.time).all() else d.time
        rank = np.argsort(np.argsort(place, kind="stable"), kind="stable")
        sense = np.where(d.omega < 0.0, -1.0, 1.0)
        speed = np.where(d.speed < 0.0, d.speed, sense * d.speed)
        return BrushConditions(
            d.load,
            d.pressure,
            d.slip_angle,
            d.slip_ratio,
            d.camber,
            speed,
            d.temperature,
            self.slip_rate,
            rank / max(len(d) - 1, 1),
        )


def force_points(data: ForceData) -> ForcePoints:
    """Return the points of samples: one per steady run, one per pass of a sweep."""
    cell = _cells(data)
    swept = np.bincount(data.block)[data.block] > 1
    rate = _slip_rate(data, swept)
    point = _passes(data, cell, swept)
    samples = np.bincount(point)

    def mean(values: FloatArray) -> FloatArray:
        return np.asarray(np.bincount(point, values) / samples)

    out = {f.name: mean(getattr(data, f.name).astype(float)) for f in fields(data)}
    # the block of a point is that of its middle
    block = np.round(out.pop("block")).astype(np.int64)
    first = np.zeros(samples.size, dtype=np.int64)
    first[point] = np.arange(point.size)
    return ForcePoints(
        ForceData(**out, block=block),
        mean(rate),
        samples.astype(np.int64),
        cell[first],
        swept[first],
    )


def noise_of(difference: FloatArray, cell: IntArray) -> tuple[float, int, int]:
    """Return the noise of a point from repeats, its degrees of freedom, and repeated cells.

    Parameters
    ----------
    difference : shape (n,)
        Model less measured, so that conditions that differ a little within a cell do not count.
    cell : shape (n,)
    """
    count = np.bincount(cell)
    mean = np.bincount(cell, difference) / np.maximum(count, 1)
    freedom = int(np.maximum(count - 1, 0).sum())
    square = float(np.sum((difference - mean[cell]) ** 2))
    noise = float(np.sqrt(square / freedom)) if freedom else float("nan")
    return noise, freedom, int((count > 1).sum())


def _cells(data: ForceData) -> IntArray:
    rows = [
        set_points(data.load),
        set_points(data.pressure),
        set_points(np.abs(data.speed)),
        np.round(data.slip_angle / CELL_ANGLE),
        np.round(data.camber / CELL_ANGLE),
        np.round(data.slip_ratio / CELL_RATIO),
        np.nan_to_num(np.sign(data.omega)),
    ]
    if np.isfinite(data.temperature).all():
        rows.append(np.round(data.temperature / CELL_TEMPERATURE))
    return numbered(*rows)


def set_points(values: FloatArray) -> IntArray:
    """Return numbers of the set points behind positive values, -1 where not finite.

    Values are cut where neighbours are 4 % apart; a set point that is wider than a tenth, as in a
    sweep of load, is cut into tenths.
    """
    number = np.full(values.shape, -1, dtype=np.int64)
    known = np.isfinite(values)
    if not known.any():
        return number
    size = np.log(np.maximum(values[known], 1e-9))
    ordered = np.sort(size)
    cuts = 0.5 * (ordered[1:] + ordered[:-1])[np.diff(ordered) > _SAME]
    if cuts.size >= 4 * MOST_LEVELS:
        cuts = cuts[:0]
    level = np.searchsorted(cuts, size)
    low = np.full(int(level.max()) + 1, np.inf)
    np.minimum.at(low, level, size)
    high = np.full(low.size, -np.inf)
    np.maximum.at(high, level, size)
    parts = np.maximum(np.ceil((high - low) / CELL_SHARE - 1e-9), 1.0)
    share = (size - low[level]) / np.maximum(high - low, 1e-12)[level]
    inside = np.minimum(np.floor(share * parts[level]), parts[level] - 1.0)
    number[known] = level * 1000 + inside.astype(np.int64)
    return number


def _slip_rate(data: ForceData, swept: BoolArray) -> FloatArray:
    """Return the rate of the slip angle at each sample: mean of the steps beside it."""
    step, rise = np.diff(data.time), np.diff(data.slip_angle)
    usual = float(np.median(step[step > 0.0])) if (step > 0.0).any() else np.nan
    good = (step > 0.0) & (step < 5.0 * usual) & swept[1:] & swept[:-1]
    rate = np.where(good, rise / np.where(good, step, 1.0), 0.0)
    both = np.zeros((2, len(data)))
    both[0, 1:], both[1, :-1] = rate, rate
    known = np.zeros((2, len(data)))
    known[0, 1:], known[1, :-1] = good, good
    return np.asarray(both.sum(axis=0) / np.maximum(known.sum(axis=0), 1.0))


def _passes(data: ForceData, cell: IntArray, swept: BoolArray) -> IntArray:
    """Return the number of each sample's pass; steady runs are one pass each."""
    time = np.where(np.isfinite(data.time), data.time, np.arange(len(data), dtype=float))
    key = np.where(swept, 0, data.block + 1)
    order = np.lexsort((time, data.block, cell, key))
    gap = np.diff(time[order])
    new = (np.diff(cell[order]) != 0) | (np.diff(key[order]) != 0)
    new |= (key[order][1:] == 0) & ((gap > _AWAY) | (gap < 0.0))
    new |= (key[order][1:] == 0) & (np.diff(data.block[order]) > 1)
    number = np.empty(len(data), dtype=np.int64)
    number[order] = np.concatenate(([0], np.cumsum(new)))
    # points stand in the order of measurement
    first = np.full(int(number.max()) + 1, np.inf)
    np.minimum.at(first, number, np.arange(len(data), dtype=float))
    place = np.argsort(np.argsort(first))
    return np.asarray(place[number], dtype=np.int64)
