"""Levels of a condition that was set a few times: loads, cambers, slip angles."""

from dataclasses import dataclass, replace

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.core.errors import CalibrationError
from tirelib.estimators.dissertation import Means
from tirelib.report.style import signed_degrees


@dataclass(frozen=True, slots=True)
class Level:
    """One level of a condition.

    `value` is the mean of its rows, `rows` marks the rows that belong to it, `text` is the value
    with its unit.
    """

    value: float
    rows: BoolArray
    text: str


def find_levels(values: FloatArray, gap: float, text: str, digits: int = 0) -> list[Level]:
    """Split values where neighbours lie further apart than `gap`, in rising order.

    Parameters
    ----------
    values : array, shape (n,)
        NaN belongs to no level.
    gap : float, unit of `values`
    text : str
        How to say a level, for example ``"{} N"``.
    digits : int
        As in `round`: -2 is to the hundred.

    Examples
    --------
    >>> [x.text for x in find_levels(np.array([5.0, 1.0, 5.2, np.nan]), 1.0, "{} N")]
    ['1 N', '5 N']
    """
    known = np.flatnonzero(np.isfinite(values))
    order = known[np.argsort(values[known], kind="stable")]
    if order.size == 0:
        return []
    cuts = np.flatnonzero(np.diff(values[order]) > gap) + 1
    found = []
    for part in np.split(order, cuts):
        rows = np.zeros(values.shape, dtype=np.bool_)
        rows[part] = True
        mean = float(values[part].mean())
        shown = round(mean, digits) + 0.0
        found.append(Level(mean, rows, text.format(f"{shown:.{max(digits, 0)}f}")))
    return found


def load_levels(load: FloatArray) -> list[Level]:
    """Return the loads of a campaign, [N], named to the nearest hundred.

    One level holds every row where no load was measured.
    """
    known = load[np.isfinite(load)]
    if known.size == 0:
        return [Level(float("nan"), np.ones(load.shape, dtype=np.bool_), "load not measured")]
    gap = 0.06 * float(np.abs(known).mean())
    return find_levels(load, gap, "{} N", -2)


def camber_levels(camber: FloatArray) -> list[Level]:
    """Return the camber angles of a campaign, [deg]."""
    return [
        replace(level, text=f"camber {signed_degrees(level.value)}")
        for level in find_levels(camber, 0.5, "{}")
    ]


def angle_levels(angle: FloatArray) -> list[Level]:
    """Return the slip angles of a campaign, [deg]."""
    return [
        replace(level, text=signed_degrees(level.value)) for level in find_levels(angle, 0.4, "{}")
    ]


def upright(means: Means) -> BoolArray:
    """Return which rows have no camber, or an unknown one."""
    return ~(np.abs(means.camber) > 0.5)


def reference_level(levels: list[Level]) -> Level:
    """Return the load with the most rows; among equals the middle one.

    Raises
    ------
    CalibrationError
        If there is no level.
    """
    if not levels:
        raise CalibrationError(
            "no run without camber and traction whose load was measured; the figure needs some"
        )
    most = max(int(level.rows.sum()) for level in levels)
    full = [level for level in levels if level.rows.sum() >= 0.8 * most]
    return full[len(full) // 2]
