"""Extremes of sampled curves, between the samples."""

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray


def peak(
    y: FloatArray, allowed: BoolArray, start: float, spacing: float
) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Return position and value of the largest sample, refined by a parabola.

    Parameters
    ----------
    y : array, shape (..., n)
        Curves on a uniform grid; NaN where unknown.
    allowed : array of bool, shape (..., n)
        Where the peak may be.
    start, spacing : float
        First grid position and the grid's step.

    Returns
    -------
    position, value : arrays, shape (...,)
        NaN where nothing was allowed.
    at_border : array of bool, shape (...,)
        True where the largest sample has no lower neighbour on both sides: the curve still rises
        at the border of the search range, and the sample itself is returned.

    Examples
    --------
    >>> x = np.linspace(-1.0, 1.0, 21)
    >>> position, value, border = peak(3.0 - (x - 0.12) ** 2, np.ones(21, bool), -1.0, 0.1)
    >>> round(float(position), 6), round(float(value), 6), bool(border)
    (0.12, 3.0, False)
    """
    known = allowed & np.isfinite(y)
    masked = np.where(known, y, -np.inf)
    index = masked.argmax(axis=-1)
    at = np.minimum(np.maximum(index, 1), y.shape[-1] - 2)
    row = np.arange(at.size).reshape(at.shape)
    curves, candidates = y.reshape(-1, y.shape[-1]), masked.reshape(-1, y.shape[-1])
    a, b, c = curves[row, at - 1], curves[row, at], curves[row, at + 1]
    top, highest = candidates[row, at], candidates[row, index]
    none = highest == -np.inf
    at_border = ~((b >= a) & (b >= c) & np.isfinite(top)) & ~none
    bend = a - 2.0 * b + c
    with np.errstate(invalid="ignore", divide="ignore"):
        shift = np.where(at_border | (bend == 0.0), 0.0, 0.5 * (a - c) / bend)
    position = start + spacing * np.where(at_border, index, at + shift)
    value = np.where(at_border, highest, b - 0.25 * (a - c) * shift)
    return np.where(none, np.nan, position), np.where(none, np.nan, value), at_border
