"""Fit a polynomial by Bayesian ridge regression; choose its terms by leaving conditions out.

Two questions are asked of a candidate with equal weight: how well does it predict a condition that
it has not seen (leave one condition out), and how well a whole load between others (leave one load
out, never the outermost)? The second keeps a polynomial from bending between the loads that were
measured.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray, IntArray
from tirelib.core.errors import CalibrationError
from tirelib.estimators.basis import Powers
from tirelib.estimators.border import Border
from tirelib.estimators.ends import CHECKED_SHARE, End, growth, left_out, near
from tirelib.estimators.folds import held_out_folds
from tirelib.estimators.polynomial import Polynomial, Variable, design, leverage
from tirelib.estimators.ridge import ridge_fit, ridge_fits

LARGEST_SHARE = 0.7
"""Terms per distinct condition at the most."""
MOST_LEVELS = 12
"""More levels than these are no levels but a sweep."""
BANDS = 5
"""A condition that was varied evenly is held out in so many bands, as many as a plan has loads."""
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

    `held_out` holds, for each row, the prediction by a fit that did not see its condition; `ends`
    what fits without them say of the outermost data, and of loads between others. `between` is what
    the error between load levels adds to the standard deviation, in the unit of y.
    """

    model: Polynomial
    held_out: FloatArray
    candidates: tuple[tuple[int, float], ...]
    ends: tuple[End, ...] = ()
    between: float = 0.0

    def at_any_load(self, model: Polynomial) -> Polynomial:
        """Return a model of this fit whose deviation is that of any load, not of the levels only.

        A wheel's load lies anywhere. The error there is taken as the one by which the terms were
        chosen: half of the squared error at a condition that was left out, whose neighbours at the
        same load stay, and half of that at a whole load that was left out.
        """
        return replace(model, residual=float(np.hypot(model.residual, self.between)))


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
    between: Sequence[IntArray] = (),
    outermost: Sequence[BoolArray] = (),
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
    between : sequence of int arrays, shape (n,)
        Levels or bands of what was varied; inner ones are held out to learn the border, not to
        choose.
    outermost : sequence of bool arrays, shape (n,)
        Rows at the ends of what was varied: held out, they say how errors grow beyond the data.
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
        held_out, held_variance, held_leverage = _cross_validate(x, y, groups, weights, centre)
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
        inflation = max(1.0, float(np.average(error**2 / held_variance, weights=weights)))
        ends, reach = _ends(x, y, between, outermost, weights, centre)
        reach = found.noise**2 * max(reach, float(np.quantile(held_leverage, CHECKED_SHARE)))
        root = np.sqrt(weights)
        model = Polynomial(
            variables=variables,
            terms=exponents,
            coefficients=found.coefficients,
            covariance=found.covariance * inflation,
            residual=found.noise * float(np.sqrt(inflation)),
            floor=0.0,
            border=Border(
                near=inflation * near(found, x),
                growth=growth(
                    [root[end.rows] * end.error for end in ends],
                    [inflation * (end.noise**2 + end.uncertain) for end in ends],
                    [inflation * end.beyond for end in ends],
                ),
                far=inflation * reach,
            ),
        )
        more = float(np.sqrt(max(score**2 - squares[0], 0.0)))
        best = (score, Fit(model, held_out, (), ends, more))
    if best is None:
        raise CalibrationError(
            f"{what}: {conditions} distinct conditions are too few for "
            f"{min(len(t) for t in candidates)} terms; at least "
            f"{int(np.ceil(min(len(t) for t in candidates) / LARGEST_SHARE))} are needed; "
            "measure more loads or slip angles, or calibrate several campaigns together"
        )
    return replace(best[1], candidates=tuple(tried))


def _cross_validate(
    x: FloatArray, y: FloatArray, groups: IntArray, weights: FloatArray, centre: bool
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return held-out predictions, their variance and leverage (share of the squared noise)."""
    predicted, variance, far = np.empty_like(y), np.empty_like(y), np.empty_like(y)
    left_out = list(held_out_folds(groups, MOST_FOLDS))
    fits = ridge_fits(x, y, weights, centre, (~test for test in left_out))
    for test, fit in zip(left_out, fits, strict=True):
        predicted[test] = x[test] @ fit.coefficients
        uncertain = leverage(x[test], fit.covariance)
        variance[test] = fit.noise**2 + uncertain
        far[test] = uncertain / fit.noise**2
    return predicted, variance, far


def _ends(
    x: FloatArray,
    y: FloatArray,
    levels: Sequence[IntArray],
    outermost: Sequence[BoolArray],
    weights: FloatArray,
    centre: bool,
) -> tuple[tuple[End, ...], float]:
    """Return what was left out, and the leverage (share of squared noise) of levels between."""
    between = [one for level in levels for one in inner_levels(x, level)]
    sets = [*(rows for rows, _ in between), *outermost]
    ends = left_out(x, y, weights, centre, sets)
    reach = [
        float(np.quantile(end.uncertain[inside], CHECKED_SHARE)) / end.noise**2
        for end, (_, inside) in zip(ends, between, strict=False)
    ]
    return ends, max(reach, default=0.0)


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


def bands_of(x: FloatArray) -> IntArray:
    """Return the number of the level at which a condition was held; of a band, where at none.

    Examples
    --------
    >>> bands_of(np.arange(20.0))
    array([0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3, 4, 4, 4, 4])
    """
    level = levels_of(x)
    if level is not None:
        return level
    share = (x - x.min()) / np.ptp(x)
    return np.asarray(np.minimum(BANDS * share, BANDS - 1.0).astype(np.int64))


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
