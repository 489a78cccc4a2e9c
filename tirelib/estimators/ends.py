"""Learn what is lost beyond a calibration's data: leave the data at its ends out, and predict them.

One side of one condition at a time is left out (the highest loads, the largest slip angles, ...),
and each load between others. What a fit without them says of them is held against what was
measured; `tirelib.estimators.border.Border` keeps what is learned.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.estimators.polynomial import leverage
from tirelib.estimators.ridge import Ridge, ridge_fits

INSIDE_SHARE = 0.9
"""Share of the calibrated rows whose leverage counts as inside the data."""
CHECKED_SHARE = 0.95
"""Share of what was held out up to whose leverage a turn counts as checked."""
LEFT_OUT_SHARE = 0.12
"""Share of the rows that is left out on one side of a condition; a level is left out whole."""
LEVEL = 0.03
"""Rows that lie within this share of a condition's range belong to one level."""
FEWEST_BEYOND = 5
"""Rows beyond the data without which an end says nothing."""
MOST_BEYOND = 0.4
"""Share of the rows above which the rest cannot stand for the calibration."""
LEAST_REST = 0.2
"""Share of the range that must remain: of two levels, none can be left out."""


@dataclass(frozen=True, slots=True)
class End:
    """Rows that were left out together, as a fit without them says of them.

    Attributes
    ----------
    rows : bool array, shape (n,)
    error : array, shape (m,), unit of y
        Measurement less prediction of the m rows.
    uncertain, beyond : arrays, shape (m,), unit of y squared
        Leverage, and how far it exceeds that of the rows that stayed.
    noise : float, unit of y
        Noise of that fit.
    """

    rows: BoolArray
    error: FloatArray
    uncertain: FloatArray
    beyond: FloatArray
    noise: float


def outermost(conditions: Mapping[str, FloatArray]) -> Iterator[BoolArray]:
    """Yield the rows at either end of every condition, without which there is a border to cross.

    Parameters
    ----------
    conditions : mapping of name to array, shape (n,)
        What was varied; a condition that is not known everywhere has no ends.

    Examples
    --------
    >>> load = np.array([1.0, 1.01, 5.0, 6.0, 7.0, 8.0, 9.0, 9.1])
    >>> [np.flatnonzero(rows).tolist() for rows in outermost({"load": load})]
    [[6, 7], [0, 1]]
    """
    for x in conditions.values():
        span = np.ptp(x)
        if not np.isfinite(span) or span == 0.0:
            continue
        for side in (x, -x):
            rows = side >= np.quantile(side, 1.0 - LEFT_OUT_SHARE) - LEVEL * span
            if rows.mean() <= MOST_BEYOND and np.ptp(side[~rows]) >= LEAST_REST * span:
                yield rows


def left_out(
    x: FloatArray, y: FloatArray, weights: FloatArray, centre: bool, sets: Sequence[BoolArray]
) -> tuple[End, ...]:
    """Predict each set of rows by a fit without it; x and the rest as `ridge_fits` takes them."""
    fits = ridge_fits(x, y, weights, centre, (~rows for rows in sets))
    made = []
    for rows, fit in zip(sets, fits, strict=True):
        uncertain = leverage(x[rows], fit.covariance)
        error = y[rows] - x[rows] @ fit.coefficients
        beyond = np.maximum(uncertain - near(fit, x[~rows]), 0.0)
        made.append(End(rows, error, uncertain, beyond, fit.noise))
    return tuple(made)


def near(fit: Ridge, x: FloatArray) -> float:
    """Return the leverage up to which a row lies among those of the fit, unit of y squared."""
    return float(np.quantile(leverage(x, fit.covariance), INSIDE_SHARE))


def growth(
    errors: Sequence[FloatArray], inside: Sequence[FloatArray], beyond: Sequence[FloatArray]
) -> float:
    """Return the growth for which errors at the worst end are one standard deviation on average.

    Parameters
    ----------
    errors : arrays, shape (m,)
        Errors of each set that was left out, by a fit that never saw it.
    inside, beyond : arrays, shape (m,)
        Variance without growth, and leverage beyond `Border.near`; unit of y squared.
    """
    most = 0.0
    for error, held, lost in zip(errors, inside, beyond, strict=True):
        far = lost > 0.0
        if far.sum() >= FEWEST_BEYOND:
            most = max(most, _growth(error[far] ** 2, held[far], lost[far]))
    return most


def _growth(square: FloatArray, inside: FloatArray, beyond: FloatArray) -> float:
    """Return g with mean(square / (inside + g beyond)) = 1; 0 if none is needed."""
    from scipy.optimize import brentq  # calibrating only

    def surplus(g: float) -> float:
        return float(np.mean(square / (inside + g * beyond))) - 1.0

    if surplus(0.0) <= 0.0:
        return 0.0
    most = float(np.max(square / beyond))
    return float(brentq(surplus, 0.0, most, xtol=1e-3 * most))
