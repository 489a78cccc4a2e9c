"""Errors by load, inflation pressure and slip angle."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray, IntArray
from tirelib.inference.identify.force_data import ForceData

ANGLES = np.deg2rad([0.0, 1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 90.0])
"""Edges of the bands of abs(slip angle), [rad]."""
MOST_LEVELS = 8
_GAP = 0.07


@dataclass(frozen=True, slots=True)
class Band:
    """Points that share a range of one condition.

    Attributes
    ----------
    by : str
        load, pressure, slip_angle (its size) or all.
    low, high : float
        Range, in the unit of the condition; the extremes present for load and pressure.
    member : array of bool, shape (n,)
    """

    by: str
    low: float
    high: float
    member: BoolArray


@dataclass(frozen=True, slots=True)
class BandError:
    """Error of a force over one band: root mean square, and mean (prediction less measured)."""

    by: str
    low: float
    high: float
    points: int
    rmse: float
    bias: float


def bands(data: ForceData) -> tuple[Band, ...]:
    """Return all points, then the bands of load, pressure and slip angle that hold any."""
    everywhere = np.ones(len(data), dtype=np.bool_)
    out = [Band("all", np.nan, np.nan, everywhere)]
    for by in ("load", "pressure"):
        value = getattr(data, by)
        number = levels(value)
        for level in range(int(number.max()) + 1):
            member: BoolArray = number == level
            if member.any():
                low, high = float(value[member].min()), float(value[member].max())
                out.append(Band(by, low, high, member))
    size = np.abs(data.slip_angle)
    # the band of set point 4 deg must hold 4.01 deg as well: edges lie midway in the noise
    for start, stop in pairwise(ANGLES):
        member = (size >= start + _slack(start)) & (size < stop + _slack(stop))
        if member.any():
            out.append(Band("slip_angle", float(start), float(stop), member))
    return tuple(out)


def levels(values: FloatArray) -> IntArray:
    """Return numbers of the set points behind measured values, -1 where not finite.

    Values are cut where neighbours are 7 % of the larger apart; a range without such gaps, or with
    more than eight levels, is cut into quarters of its points.
    """
    number = np.full(values.shape, -1, dtype=np.int64)
    known = np.isfinite(values)
    if not known.any():
        return number
    ordered = np.sort(values[known])
    cuts = 0.5 * (ordered[1:] + ordered[:-1])[np.diff(ordered) > _GAP * np.abs(ordered[1:])]
    one_wide = cuts.size == 0 and ordered[-1] - ordered[0] > 3.0 * _GAP * abs(ordered[-1])
    if cuts.size + 1 > MOST_LEVELS or one_wide:
        cuts = np.unique(np.quantile(ordered, [0.25, 0.5, 0.75]))
    number[known] = np.searchsorted(cuts, values[known], side="right")
    return number


def numbered(*rows: FloatArray | IntArray) -> IntArray:
    """Return the number of each point's combination of values, rows of shape (n,), from 0."""
    number = np.unique(np.stack(rows), axis=1, return_inverse=True)[1]
    return np.asarray(number, dtype=np.int64).ravel()


def cells_of_load(data: ForceData) -> IntArray:
    """Return the number of each point's load and pressure, from 0."""
    return numbered(levels(data.load), levels(data.pressure))


def band_errors(data: ForceData, error: FloatArray) -> tuple[BandError, ...]:
    """Return the error of a force by band; points without a measurement are NaN in `error`."""
    out = []
    for band in bands(data):
        part = error[band.member & np.isfinite(error)]
        if part.size:
            rms = float(np.sqrt(np.mean(part**2)))
            bias = float(part.mean())
            out.append(BandError(band.by, band.low, band.high, part.size, rms, bias))
    return tuple(out)


def _slack(edge: float) -> float:
    """Return 0.1 deg, but none at the ends."""
    return float(np.deg2rad(0.1)) if 0.0 < edge < ANGLES[-1] else 0.0
