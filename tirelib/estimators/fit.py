"""Fit a polynomial by Bayesian ridge regression; choose its terms by leaving conditions out.

Two questions are asked of a candidate with equal weight: how well does it predict a condition that
it has not seen (leave one condition out), and how well a whole load between others (leave one load
out, never the outermost)? The second keeps a polynomial from bending between the loads that were
measured.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from sklearn.model_selection import GroupKFold, LeaveOneGroupOut

from tirelib.arrays import BoolArray, FloatArray, IntArray
from tirelib.errors import CalibrationError
from tirelib.estimators.basis import Powers
from tirelib.estimators.polynomial import Polynomial, Variable, design, leverage
from tirelib.estimators.ridge import ridge_fit, ridge_fits

LARGEST_SHARE = 0.7
"""Terms per distinct condition at the most."""
MOST_LEVELS = 12
"""More levels than these are no levels but a sweep."""
LARGEST_LEVEL = 0.5
"""A level that holds more than this share of the data cannot be held out."""
LEVEL_SLACK = 0.05
"""Share of a term's range by which a held-out row may lie outside what remains."""
FEWEST_ROWS = 3
"""Rows of a held-out level below which it says nothing."""
MOST_FOLDS = 80
"""Beyond so many groups, groups are held out together."""


@dataclass(frozen=True, slots=True)
class Fit:
    """A fitted polynomial and what cross-validation says of it.

    `held_out` holds, for each row, the prediction by a fit that did not see its condition.
    """

    model: Polynomial
    held_out: FloatArray
    candidates: tuple[tuple[int, float], ...]


def variables_for(
    values: Mapping[str, FloatArray], terms: Sequence[Powers], odd: Sequence[str]
) -> tuple[Variable, ...]:
    """Standardise every regressor in use: odd ones about zero, others about the mean."""
    names = sorted({name for term in terms for name in term})
    made = []
    for name in names:
        x = values[name]
        centre = 0.0 if name in odd else float(np.mean(x))
        scale = float(np.abs(x - centre).max()) or 1.0
        made.append(Variable(name, centre, scale))
    return tuple(made)


def design_for(
    values: Mapping[str, FloatArray], terms: Sequence[Powers], odd: Sequence[str]
) -> tuple[tuple[Variable, ...], tuple[tuple[int, ...], ...], FloatArray]:
    """Return variables, exponents and values, shape (n, k), of terms."""
    variables = variables_for(values, terms, odd)
    exponents = tuple(tuple(term.get(v.name, 0) for v in variables) for term in terms)
    return variables, exponents, design(variables, exponents, values)


def fit_best(
    values: Mapping[str, FloatArray],
    y: FloatArray,
    groups: IntArray,
    candidates: Sequence[Sequence[Powers]],
    *,
    odd: Sequence[str] = (),
    level: IntArray | None = None,
    weights: FloatArray | None = None,
    centre: bool = True,
    what: str = "quantity",
) -> Fit:
    """Fit each candidate and keep the one with the least held-out error.

    Parameters
    ----------
    values : mapping of regressor name to array, shape (n,)
    y : array, shape (n,)
        One independent measurement per row.
    groups : array of int, shape (n,)
        Rows of one condition; they are held out together.
    candidates : sequence of term lists
    odd : names of regressors that are standardised about zero
    level : int array, shape (n,), optional
        Load level, growing from 0; inner ones are held out whole.
    weights : array, shape (n,), optional
        Relative precision of the rows.
    centre : bool
        False for an odd quantity: shrink towards zero rather than towards the mean.

    Raises
    ------
    CalibrationError
        If there are too few conditions for even the smallest candidate.
    """
    conditions = np.unique(groups).size
    tried: list[tuple[int, float]] = []
    best: tuple[float, Fit] | None = None
    weights = np.ones(y.size) if weights is None else weights
    for terms in candidates:
        if len(terms) > max(LARGEST_SHARE * conditions, 1.0 if len(terms) == 1 else 0.0):
            continue
        variables, exponents, x = design_for(values, terms, odd)
        held_out, held_std = _cross_validate(x, y, groups, weights, centre)
        error = y - held_out
        squares = [float(np.average(error**2, weights=weights))]
        if level is not None:
            squares += _inner_levels(x, y, level, weights, centre)
        score = float(np.sqrt(0.5 * squares[0] + 0.5 * np.mean(squares[1:] or squares)))
        tried.append((len(terms), score))
        if best is not None and not score < 0.98 * best[0]:
            continue
        found = ridge_fit(x, y, weights, centre)
        # held-out errors, not the fit's own residuals, say how large an error to expect
        inflation = max(1.0, float(np.sqrt(np.average((error / held_std) ** 2, weights=weights))))
        model = Polynomial(
            variables=variables,
            terms=exponents,
            coefficients=found.coefficients,
            covariance=found.covariance * inflation**2,
            residual=found.noise * inflation,
            floor=0.0,
        )
        best = (score, Fit(model, held_out, ()))
    if best is None:
        raise CalibrationError(
            f"{what}: {conditions} distinct conditions are too few for "
            f"{min(len(t) for t in candidates)} terms; at least "
            f"{int(np.ceil(min(len(t) for t in candidates) / LARGEST_SHARE))} are needed; "
            "measure more loads or slip angles, or calibrate several campaigns together"
        )
    return Fit(best[1].model, best[1].held_out, tuple(tried))


def _cross_validate(
    x: FloatArray, y: FloatArray, groups: IntArray, weights: FloatArray, centre: bool
) -> tuple[FloatArray, FloatArray]:
    """Return held-out predictions and their standard deviations, each of shape (n,)."""
    count = np.unique(groups).size
    splitter = LeaveOneGroupOut() if count <= MOST_FOLDS else GroupKFold(MOST_FOLDS)
    predicted, std = np.empty_like(y), np.empty_like(y)
    left_out = [np.isin(np.arange(y.size), test) for _, test in splitter.split(x, y, groups)]
    fits = ridge_fits(x, y, weights, centre, (~test for test in left_out))
    for test, fit in zip(left_out, fits, strict=True):
        predicted[test] = x[test] @ fit.coefficients
        std[test] = np.sqrt(fit.noise**2 + leverage(x[test], fit.covariance))
    return predicted, std


def levels_of(x: FloatArray, share: float = 0.05) -> IntArray | None:
    """Return the number of the level, from the lowest, at which a condition was held.

    A gap wider than `share` of the range separates two levels. None unless there are three at least
    and twelve at the most: otherwise the condition was not varied in steps.

    Examples
    --------
    >>> levels_of(np.array([1.0, 5.1, 1.02, 5.0, 9.0])).tolist()
    [0, 1, 0, 1, 2]
    """
    if not np.isfinite(x).all() or np.ptp(x) == 0.0:
        return None
    order = np.argsort(x, kind="stable")
    steps = np.diff(x[order]) > share * np.ptp(x)
    number = np.empty(x.size, dtype=np.int64)
    number[order] = np.concatenate(([0], np.cumsum(steps)))
    return number if 3 <= number.max() + 1 <= MOST_LEVELS else None


def inner_levels(x: FloatArray, level: IntArray) -> Iterator[tuple[BoolArray, BoolArray]]:
    """Yield the rows of each inner level that can be held out, and which of them to judge by.

    What was measured at a level only cannot be asked of the others.
    """
    for number in range(1, int(level.max())):
        test = level == number
        if test.mean() > LARGEST_LEVEL:
            continue
        low, high = x[~test].min(axis=0), x[~test].max(axis=0)
        slack = LEVEL_SLACK * (high - low)
        inside = ((x[test] >= low - slack) & (x[test] <= high + slack)).all(axis=1)
        if inside.sum() >= FEWEST_ROWS:
            yield test, inside


def _inner_levels(
    x: FloatArray, y: FloatArray, level: IntArray, weights: FloatArray, centre: bool
) -> list[float]:
    """Return the mean square error at each inner level by a fit without it."""
    levels = list(inner_levels(x, level))
    fits = ridge_fits(x, y, weights, centre, (~test for test, _ in levels))
    squares = []
    for (test, inside), fit in zip(levels, fits, strict=True):
        error = (y[test] - x[test] @ fit.coefficients)[inside]
        squares.append(float(np.average(error**2, weights=weights[test][inside])))
    return squares
