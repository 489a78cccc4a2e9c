"""Levels of a condition that was set a few times: loads, cambers, slip angles."""

from collections.abc import Callable
from dataclasses import dataclass

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


def find_levels(values: FloatArray, gap: float, say: Callable[[float], str]) -> list[Level]:
    """Split values where neighbours lie further apart than `gap`, in rising order.

    Parameters
    ----------
    values : array, shape (n,)
        NaN belongs to no level.
    gap : float, unit of `values`
    say : callable
        The text of a level, from its mean.

    Examples
    --------
    >>> [x.text for x in find_levels(np.array([5.0, 1.0, 5.2, np.nan]), 1.0, "{:.0f} N".format)]
    ['1 N', '5 N']
    """
    order = np.argsort(values, kind="stable")[: np.isfinite(values).sum()]  # NaN comes last
    found = []
    for part in np.split(order, np.flatnonzero(np.diff(values[order]) > gap) + 1):
        if part.size:
            rows = np.isin(np.arange(values.size), part)
            mean = float(values[part].mean())
            found.append(Level(mean, rows, say(mean)))
    return found


def load_levels(load: FloatArray) -> list[Level]:
    """Return the loads of a campaign, [N], named to the nearest hundred.

    One level holds every row where no load was measured.
    """
    known = load[np.isfinite(load)]
    if known.size == 0:
        return [Level(float("nan"), np.ones(load.shape, dtype=np.bool_), "load not measured")]
    gap = 0.06 * float(np.abs(known).mean())
    return find_levels(load, gap, lambda mean: f"{round(mean, -2) + 0.0:.0f} N")


def camber_levels(camber: FloatArray) -> list[Level]:
    """Return the camber angles of a campaign, [deg]."""
    return find_levels(camber, 0.5, lambda mean: f"camber {signed_degrees(mean)}")


def angle_levels(angle: FloatArray) -> list[Level]:
    """Return the slip angles of a campaign, [deg]."""
    return find_levels(angle, 0.4, signed_degrees)


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
