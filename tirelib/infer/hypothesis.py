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

from tirelib.arrays import FloatArray
from tirelib.infer.null import OWN, PRIOR, Null
from tirelib.infer.plain import BASE, ROUGHLY, Family, View
from tirelib.infer.posterior import Posterior
from tirelib.infer.problem import Problem

LAW = 0.15
"""Relative standard deviation by which a law is off as conditions change."""
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
    plain : tuple of shape (n_tires,)
        Statistic of each plain tire by the families other than its own, by family.
    statistic : float
    against : str
        What has this score: a further effect, a group of shapes, or the law of an effect.
    free_p : float
        p-value with laws that may be off by as much as themselves.
    plausible : bool
        Whether the strengths lie in their ranges.
    likelihood : float
        Largest log likelihood over the families, [nats].
    """

    fit: Posterior
    null: Null
    plain: tuple[FloatArray, ...]
    statistic: float
    against: str
    free_p: float
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
    null, plain, likelihood = _tested(problem, fit, families, 1.0)
    statistic = float(null.scores.max())
    p = free = p_value(statistic, plain)[0]
    if fit.effects and p <= alpha:
        loose, tires, _ = _tested(problem, fit, families, 1.0 / LAW)
        free = max(p, p_value(float(loose.scores.max()), tires)[0])
    return Hypothesis(
        fit,
        null,
        plain,
        statistic,
        null.names[int(np.argmax(null.scores))],
        free,
        plausible(fit, own_effects),
        likelihood,
    )


def _tested(
    problem: Problem, fit: Posterior, families: Sequence[Family], looser: float
) -> tuple[Null, tuple[FloatArray, ...], float]:
    """Return the family that excuses most, the statistics of plain tires, and the likelihood."""
    wide = fit.widths**2
    wide[len(fit.point.base) :] *= PRIOR**2
    laws = law_errors(fit, looser)
    views = [fit.view(problem, own) for own in OWN]
    levels = [
        max(Null([view], family, {BASE: wide, **laws}).likelihood for family in families)
        for view in views
    ]
    best = int(np.argmax(levels))
    views = views[max(best - 1, 0) : best + 2]
    nulls = [Null(views, family, {BASE: wide, **laws}) for family in families]
    products = _planted(problem, fit, families, laws, views, OWN[best])
    for null, own in zip(nulls, products, strict=True):
        null.measure(own)
    plain = tuple(
        np.min(
            [null.scores_of(tires).max(axis=0) for null in nulls if null.family is not family],
            axis=0,
        )
        for family, tires in zip(families, products, strict=True)
    )
    return min(nulls, key=lambda null: float(null.scores.max())), plain, max(levels)


def _planted(
    problem: Problem,
    fit: Posterior,
    families: Sequence[Family],
    laws: Mapping[str, float | FloatArray],
    views: Sequence[View],
    own: float,
) -> list[list[tuple[FloatArray, FloatArray]]]:
    """Return the plain tires of every family as residuals in the user's plan.

    The hypothesis' laws are off, and every run has a misfit of its own, as they are for the user.
    """
    normal = views[0].normal
    rows = np.concatenate(list(fit.rows.values()))
    whiten, out = problem.whitener(own), []
    for number, family in enumerate(families):
        random = np.random.default_rng([len(family), number])
        planted = family.on(normal)
        for name, variance in laws.items():
            block = normal.blocks[name]
            size = (len(family), block.stop - block.start)
            planted[:, block] = np.sqrt(variance) * random.standard_normal(size)
        tires = whiten.coloured(random.standard_normal((len(family), normal.count)))
        tires = tires + np.tensordot(planted, rows, axes=1)
        products = []
        for view in views:
            white = problem.whitener(view.own)(tires)
            products.append((view.white @ white.T, np.sum(white**2, axis=1)))
        out.append(products)
    return out


def law_errors(fit: Posterior, looser: float) -> dict[str, float | FloatArray]:
    """Return variances of the blocks of laws that are but roughly right."""
    out: dict[str, float | FloatArray] = {}
    for effect, strength in zip(fit.effects, fit.strengths, strict=True):
        size = float(np.linalg.norm(strength)) / effect.scale
        out[ROUGHLY + effect.name] = (looser * LAW * size) ** 2
    return out


def plausible(fit: Posterior, own_effects: int) -> bool:
    """Return whether the strengths of the further effects lie in their ranges."""
    for k, effect in enumerate(fit.effects):
        slack = SLACK * np.hypot(fit.std(k), LAW * np.linalg.norm(fit.strengths[k]))
        low, high = effect.low - slack, effect.high + slack
        inside = (fit.strengths[k] >= low) & (fit.strengths[k] <= high)
        if k >= own_effects and not inside.all():
            return False
    return True
