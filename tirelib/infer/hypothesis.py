"""A hypothesis, that these effects and no other are missing, with its test.

Its statistic is the largest standard score of anything beside it (`tirelib.infer.null`), by the
family of plain tires that excuses most. A user's tire belongs to none of the families. So the
p-value is calibrated on tires that are judged likewise: each plain tire, with the hypothesis
planted in the user's plan, by the families other than its own. The rank of the user's statistic
among a family's tires is a p-value; the largest over the families counts, so that a tire which
differs from the known families no more than any of them does from the others is covered.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tirelib.arrays import FloatArray, IntArray
from tirelib.infer.null import OWN, PRIOR, Null, Products
from tirelib.infer.plain import BASE, ROUGHLY, Family, View
from tirelib.infer.posterior import Posterior
from tirelib.infer.problem import Problem

LAW = 0.15
"""Relative standard deviation by which a law is off as conditions change."""
LOOSER = (2.0, 1.0 / LAW)
"""Factors of `LAW` that are tried where a hypothesis is rejected; the last lets a law be off by as
much as itself."""
SLACK = 2.0
"""Standard deviations by which a strength may leave its range, those of its law included."""


@dataclass(frozen=True, slots=True, eq=False)
class Hypothesis:
    """A set of effects with its test.

    Attributes
    ----------
    fit : Posterior
    null : Null
        Of the family that excuses most.
    nulls : tuple of Null
        Of every family.
    plain : tuple of shape (n_tires,)
        Statistic of each plain tire by the families other than its own, by family.
    statistic : float
    against : str
        What has this score: a further effect, a group of shapes, or the law of an effect.
    looseness : float
        By how much more than usual laws have to be off for the hypothesis to stay: 1, one of
        `LOOSER`, or infinity.
    plausible : bool
        Whether the strengths lie in their ranges.
    likelihood : float
        Largest log likelihood over the families, [nats].
    """

    fit: Posterior
    null: Null
    nulls: tuple[Null, ...]
    plain: tuple[FloatArray, ...]
    statistic: float
    against: str
    looseness: float
    plausible: bool
    likelihood: float

    @property
    def names(self) -> tuple[str, ...]:
        """Of the effects."""
        return self.fit.names

    @property
    def scores(self) -> dict[str, float]:
        """Standard score of everything beside the hypothesis."""
        return dict(zip(self.null.names, self.null.scores.tolist(), strict=True))

    @property
    def p(self) -> float:
        """p-value of the hypothesis."""
        return p_value(self.statistic, self.plain)[0]

    @property
    def p_std(self) -> float:
        """Standard deviation of the p-value, from the number of plain tires."""
        return p_value(self.statistic, self.plain)[1]

    def limit(self, alpha: float) -> float:
        """Return the statistic from which on the p-value is at most alpha."""
        return max(float(np.quantile(each, 1.0 - alpha, method="higher")) for each in self.plain)


def p_value(statistic: float, plain: Sequence[FloatArray]) -> tuple[float, float]:
    """Return the p-value of a statistic among plain tires by family, and its standard deviation."""
    each = [(1 + int(np.sum(tires >= statistic))) / (len(tires) + 1) for tires in plain]
    p, count = max(zip(each, map(len, plain), strict=True))
    return p, max(float(np.sqrt(p * (1.0 - p) / count)), 1.0 / (count + 1))


def judged(
    problem: Problem,
    fit: Posterior,
    families: Sequence[Family],
    alpha: float,
    *,
    own_effects: int,
) -> Hypothesis:
    """Return a fitted hypothesis with its statistic and p-value.

    Parameters
    ----------
    families : sequence of Family
        At least two.
    own_effects : int
        How many of the fit's effects the model had already: they are part of it.
    """
    views = [fit.view(problem, own) for own in OWN]
    nulls, plain, likelihood = _tested(problem, fit, views, families, 1.0)
    null = min(nulls, key=lambda null: float(null.scores.max()))
    statistic = float(null.scores.max())
    rejected = p_value(statistic, plain)[0] <= alpha
    looseness = np.inf if rejected else 1.0
    for looser in LOOSER if rejected and fit.effects else ():
        loose, tires, _ = _tested(problem, fit, views, families, looser)
        if p_value(min(float(each.scores.max()) for each in loose), tires)[0] > alpha:
            looseness = looser
            break
    return Hypothesis(
        fit,
        null,
        nulls,
        plain,
        statistic,
        null.names[int(np.argmax(null.scores))],
        looseness,
        plausible(fit, own_effects),
        likelihood,
    )


def _tested(
    problem: Problem,
    fit: Posterior,
    views: Sequence[View],
    families: Sequence[Family],
    looser: float,
) -> tuple[tuple[Null, ...], tuple[FloatArray, ...], float]:
    """Return the tests by every family, the statistics of plain tires, and the likelihood."""
    wide = fit.widths**2
    wide[len(fit.point.base) :] *= PRIOR**2
    laws = law_errors(fit, looser)
    levels = [
        max(Null([view], family, {BASE: wide, **laws}).likelihood for family in families)
        for view in views
    ]
    best = int(np.argmax(levels))
    views = views[max(best - 1, 0) : best + 2]
    nulls = tuple(Null(views, family, {BASE: wide, **laws}) for family in families)
    tires = [
        products(problem, views, plain_tires(problem, fit, family, laws, OWN[best], number))
        for number, family in enumerate(families)
    ]
    for null, own in zip(nulls, tires, strict=True):
        null.measure(own)
    plain = tuple(
        by_others(nulls, family, own)[0] for family, own in zip(families, tires, strict=True)
    )
    return nulls, plain, max(levels)


def by_others(
    nulls: Sequence[Null], family: Family, tires: Products
) -> tuple[FloatArray, IntArray]:
    """Return the statistic of a family's tires by the other families, and the place of the test.

    Shapes (k,): by the family that excuses most.
    """
    largest = np.array(
        [
            np.full(len(tires[0][1]), np.inf)
            if null.family is family
            else null.scores_of(tires).max(axis=0)
            for null in nulls
        ]
    )
    return largest.min(axis=0), np.argmin(largest, axis=0)


def plain_tires(
    problem: Problem,
    fit: Posterior,
    family: Family,
    laws: Mapping[str, float | FloatArray],
    own: float,
    seed: int,
) -> FloatArray:
    """Return what a fitted hypothesis leaves of a family's plain tires in the user's plan.

    The hypothesis' laws are off, and every run has a misfit of its own, as they are for the user.

    Returns
    -------
    shape (n_tires, ...)
    """
    whiten, rows = problem.whitener(own), np.concatenate(list(fit.rows.values()))
    blocks, first = {}, 0
    for name, each in fit.rows.items():
        blocks[name] = slice(first, first + len(each))
        first += len(each)
    random = np.random.default_rng([len(family), seed])
    planted = family.on(blocks, first)
    for name, variance in laws.items():
        block = blocks[name]
        size = (len(family), block.stop - block.start)
        planted[:, block] = np.sqrt(variance) * random.standard_normal(size)
    count = whiten(fit.rest).size
    tires = whiten.coloured(random.standard_normal((len(family), count)))
    return np.asarray(tires + np.tensordot(planted, rows, axes=1))


def products(problem: Problem, views: Sequence[View], tires: FloatArray) -> Products:
    """Return the products of residuals (k, ...) with the rows of every view."""
    out = []
    for view in views:
        white = problem.whitener(view.own)(tires)
        out.append((view.white @ white.T, np.sum(white**2, axis=1)))
    return out


def law_errors(fit: Posterior, looser: float) -> dict[str, float | FloatArray]:
    """Return variances of the blocks of laws that are but roughly right."""
    return {ROUGHLY + name: (looser * LAW) ** 2 for name in fit.names}


def plausible(fit: Posterior, own_effects: int) -> bool:
    """Return whether the strengths of the further effects lie in their ranges."""
    for k, effect in enumerate(fit.effects):
        slack = SLACK * np.hypot(fit.std(k), LAW * np.linalg.norm(fit.strengths[k]))
        low, high = effect.low - slack, effect.high + slack
        inside = (fit.strengths[k] >= low) & (fit.strengths[k] <= high)
        if k >= own_effects and not inside.all():
            return False
    return True
