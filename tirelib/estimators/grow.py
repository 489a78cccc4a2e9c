r"""Let a list of terms grow by whole families, as long as what was held out is predicted better.

Two questions are asked of every family, those of `tirelib.estimators.fit`: a condition left out,
and a whole load between others left out. A family is taken up only if it makes both errors
together smaller by `GAIN`, and the first one too: what helps between the loads and not between the
conditions is chance. The best family goes first; then the others are asked again.

Held-out errors are found without fitting anew. With the penalty of the ridge regression held, the
errors of rows B by a fit that never saw them are

.. math:: e_B = (I - H_{BB})^{-1} r_B, \qquad H = X (X^T X + \lambda I)^{-1} X^T,

r the residuals of the fit on all rows: exact, by the Sherman-Morrison-Woodbury identity.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray, IntArray
from tirelib.estimators.basis import Powers
from tirelib.estimators.fit import design_for, inner_levels
from tirelib.estimators.ridge import ridge_fit

GAIN = 0.97
"""Ratio of held-out errors below which a family is worth its terms."""
TERMS_PER_CONDITION = 0.4
"""Terms per distinct condition up to which families are taken up."""


@dataclass(frozen=True, slots=True)
class Errors:
    """Held-out errors (rms, unit of y): of conditions, and of these and inner loads together."""

    conditions: float
    both: float


def grow(
    values: Mapping[str, FloatArray],
    y: FloatArray,
    groups: IntArray,
    candidates: Sequence[Sequence[Powers]],
    families: Mapping[str, Sequence[Powers]],
    *,
    odd: Sequence[str] = (),
    level: IntArray | None = None,
    centre: bool = True,
) -> list[Powers]:
    """Let every candidate grow by the families that make it better; return the best.

    Parameters
    ----------
    values, y, groups, odd, level, centre
        As `tirelib.estimators.fit.fit_best` takes them.
    candidates : sequence of term lists
        Where to begin; an empty list comes back if there are too few conditions for any.
    families : mapping of term lists by name
    """
    most = TERMS_PER_CONDITION * np.unique(groups).size
    judged: dict[frozenset[frozenset[tuple[str, int]]], Errors] = {}

    def judge(terms: Sequence[Powers]) -> Errors:
        """Judge terms in whatever order: candidates often grow to the same ones."""
        same = frozenset(frozenset(term.items()) for term in terms)
        if same not in judged:
            x = design_for(values, terms, odd)[2]
            judged[same] = held_out_errors(x, y, groups, level, centre)
        return judged[same]

    grown = [
        _grown(list(terms), families, judge, most) for terms in candidates if len(terms) <= most
    ]
    return min(grown, key=lambda one: one[0].both)[1] if grown else []


def _grown(
    terms: list[Powers],
    families: Mapping[str, Sequence[Powers]],
    judge: Callable[[Sequence[Powers]], Errors],
    most: float,
) -> tuple[Errors, list[Powers]]:
    """Take up one family after the other; return the terms with their errors."""
    best = judge(terms)
    while True:
        found = []
        for family in families.values():  # one that was taken up adds no term any more
            longer = [*terms, *(term for term in family if term not in terms)]
            if len(terms) < len(longer) <= most:
                found.append((judge(longer), longer))
        if not found:
            return best, terms
        errors, longer = min(found, key=lambda one: one[0].both)
        if errors.both > GAIN * best.both or errors.conditions > GAIN * best.conditions:
            return best, terms
        best, terms = errors, longer


def held_out_errors(
    x: FloatArray, y: FloatArray, groups: IntArray, level: IntArray | None, centre: bool = True
) -> Errors:
    """Return what is said of conditions and of inner loads by fits that never saw them.

    Parameters
    ----------
    x : array, shape (n, k)
        Terms; the first column is the constant.
    y : array, shape (n,)
    groups : int array, shape (n,)
    level : int array, shape (n,), optional
    centre : bool
        Whether y is shrunk towards its mean, or towards zero.
    """
    fit = ridge_fit(x, y, np.ones(y.size), centre)
    about = y - y.mean() if centre else y
    scaled = x / fit.size
    inverse = np.linalg.inv(scaled.T @ scaled + fit.penalty * np.eye(x.shape[1]))
    hat = scaled @ inverse @ scaled.T
    rest = about - hat @ about
    squares = (rest / (1.0 - np.diag(hat))) ** 2
    _, group, size = np.unique(groups, return_inverse=True, return_counts=True)
    for number in np.flatnonzero(size > 1):
        rows = group == number
        squares[rows] = _left_out(hat, rest, rows) ** 2
    conditions = float(np.mean(squares))
    levels = (
        []
        if level is None
        else [
            float(np.mean(_left_out(hat, rest, rows)[inside] ** 2))
            for rows, inside in inner_levels(x, level)
        ]
    )
    both = 0.5 * conditions + 0.5 * float(np.mean(levels or [conditions]))
    return Errors(float(np.sqrt(conditions)), float(np.sqrt(both)))


def _left_out(hat: FloatArray, rest: FloatArray, rows: BoolArray) -> FloatArray:
    """Return the errors of rows by a fit without them."""
    own = np.eye(int(rows.sum())) - hat[np.ix_(rows, rows)]
    return np.asarray(np.linalg.solve(own, rest[rows]), dtype=np.float64)
