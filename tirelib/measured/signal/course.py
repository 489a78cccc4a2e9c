r"""How a held condition runs over one turn: a cubic at most, as certain as its scatter lets it be.

A source of a wheel's motion is noisy, quantised, and held from one value to the next. It is fitted
over a turn by Legendre polynomials, whose coefficients are independent of each other: each has the
sampling variance :math:`v_j = (2j + 1)\,\sigma^2 / n`, with the scatter :math:`\sigma` about the
fit and n the number of measured values. A coefficient c is then shrunk to

.. math:: c\,\max\left(0,\ 1 - \frac{v}{c^2}\right),

its posterior mean when it has a Gaussian prior about zero of the width that makes the data most
likely (empirical Bayes; C. M. Bishop, Pattern Recognition and Machine Learning, section 7.2). So a
noisy source says next to nothing of a wheel that turns steadily, and all of one that does not.

A value is held from its measurement until the next, so what is held is half that time old on
average; the fit lies that much earlier. At 100 values a second these 5 ms would be a slip ratio of
0.002 at -8 m/s^2 and 20 m/s. A source that is rounded but not held is moved by half a step.
"""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import legvander

from tirelib.core.arrays import FloatArray

DEGREE = 3
"""Highest degree: braking may begin and end within one turn."""
FEWEST_VALUES = 3
"""Measured values that the turn must contain: two for a line, and one for the scatter about it."""
BINS = 64
"""Means into which the samples are gathered before the fit; a cubic needs no more."""


@dataclass(frozen=True, slots=True)
class Course:
    """How a source runs over one turn.

    Attributes
    ----------
    shape : array, shape (k,)
        Coefficients of the powers of turns from the contact's middle, in the source's unit.
    mean : float
        Over the turn, in the source's unit; not shrunk.
    std : float, [1]
        Relative standard deviation of the shape at the contact over its mean.
    known : bool
        Whether the source has enough values for a course; otherwise its mean is used.
    """

    shape: FloatArray
    mean: float
    std: float
    known: bool


def course(samples: FloatArray, first: float, turn: float) -> Course | None:
    """Return how a source runs from the middle of one contact to beyond the next.

    Parameters
    ----------
    samples : array, shape (n,)
        What was held at each sample.
    first : float, [samples]
        Where the first of them lies, from the contact's middle.
    turn : float, [samples]
        Length of the turn that ends at the contact's middle.

    Returns
    -------
    Course or None
        None where the source is unknown at any sample, stands still or changes its sign.

    Examples
    --------
    >>> found = course(20.0 + 0.01 * np.arange(-100, 11), -100.0, 100.0)
    >>> round(found.mean, 6), round(float(found.shape[0]), 6), found.known
    (19.5, 20.0, True)
    """
    if not np.isfinite(samples).all() or samples.min() * samples.max() <= 0.0:
        return None
    n_measured = 1 + int(np.count_nonzero(samples[1:] != samples[:-1]))
    if n_measured < FEWEST_VALUES:
        part = samples[: max(1, round(-first))]
        mean = float(samples[0] if n_measured == 1 else part.mean())
        return Course(np.array([mean]), mean, 0.0, known=False)
    n = samples.size
    edges = np.linspace(0, n, min(BINS, n) + 1).astype(np.int64)
    y = np.add.reduceat(samples, edges[:-1]) / np.diff(edges)
    late = 0.5 * (n / n_measured - 1.0)  # samples since its measurement, on average
    n_measured = min(n_measured, y.size)
    size = 1 + min(DEGREE, n_measured - FEWEST_VALUES + 1)
    half = 0.5 * (first + n - 1 + turn) / turn  # of the span from -1 to its end, in turns
    z = (0.5 * (edges[:-1] + edges[1:] - 1) - late + first + turn) / (turn * half) - 1.0
    design = legvander(z, size - 1)
    fitted = np.linalg.solve(design.T @ design, y @ design)
    left = y - design @ fitted
    scatter = float(np.mean(left**2)) / (1.0 - size / n_measured)
    independent = n_measured / _alike(left, -(-y.size // n_measured))
    variance = scatter * (2.0 * np.arange(size) + 1.0) / independent
    square = np.maximum(fitted**2, np.finfo(np.float64).tiny)
    kept = np.maximum(1.0 - variance / square, 0.0) * fitted
    kept[0] = fitted[0]
    terms = _LEGENDRE[:size, :size] @ _moved(1.0 / half, 1.0 / half - 1.0)[:size, :size]
    means = terms @ _MEANS[:size]
    mean = float(fitted @ means)
    std = float(np.sqrt((terms[:, 0] - means) ** 2 @ variance)) / abs(mean)
    return Course(kept @ terms, mean, std, known=True)


def _alike(left: FloatArray, lag: int) -> float:
    """Return how many consecutive values count as one, from the residuals of a fit.

    Noise leaves values that know nothing of each other; a course that no cubic follows leaves
    waves. Each value stands `lag` times in a row, whose mean is looked at: the steps of a held one
    are no waves. With the correlation r of neighbours, (1 + r) / (1 - r) of them carry as much
    information as one (M. S. Bartlett, J. R. Stat. Soc. 98, 1935). Fewer than one are not believed.
    """
    value = left[: left.size // lag * lag].reshape(-1, lag).mean(axis=1)
    square = float(value @ value)
    product = float(value[1:] @ value[:-1])
    correlation = product / square if square > 0.0 else 0.0
    return max((1.0 + correlation) / (1.0 - correlation), 1.0)


_LEGENDRE = np.array(
    [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [-0.5, 0.0, 1.5, 0.0], [0.0, -1.5, 0.0, 2.5]]
)
"""Rows: Legendre polynomials by their powers."""
_MEANS = np.array([1.0, -1.0 / 2.0, 1.0 / 3.0, -1.0 / 4.0])
"""Means of the powers from -1 to 0."""


def _moved(gain: float, shift: float) -> FloatArray:
    """Return the matrix whose row k is ``(gain x + shift)^k`` by the powers of x."""
    rows = np.zeros((DEGREE + 1, DEGREE + 1))
    rows[0, 0] = 1.0
    for k in range(DEGREE):
        rows[k + 1] = shift * rows[k]
        rows[k + 1, 1:] += gain * rows[k, :-1]
    return rows
