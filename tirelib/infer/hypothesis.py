"""A hypothesis, that these effects and no other are missing, with its test.

Its statistic is the largest standard score of anything beside it, as plain tires of each family
have it in the user's plan with the hypothesis planted (`tirelib.infer.judge`). The rank of the
user's statistic among a family's tires is a p-value; the largest over the families counts, so that
a tire which differs from the known families no more than any of them does from the others is
covered.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.infer.judge import Judge
from tirelib.infer.null import OWN, PRIOR, Null, Products
from tirelib.infer.plain import BASE, ROUGHLY, Family, View
from tirelib.infer.posterior import Posterior
from tirelib.infer.problem import Problem

LAWS = (0.075, 0.15)
"""Relative standard deviations by which laws are off: a hypothesis stays if it does with either."""
LOOSEST = 1.0
"""That which is tried where a hypothesis is rejected: its laws are off by as much as themselves."""
SLACK = 2.0
"""Standard deviations by which a strength may leave its range, those of its law included."""


@dataclass(frozen=True, slots=True, eq=False)
class Hypothesis:
    """A set of effects with its test.

    Attributes
    ----------
    fit : Posterior
    judges : tuple of Judge
        One for every family, that of the largest p-value first.
    law : float
        Relative standard deviation by which its laws are off.
    looseness : float
        By how much more laws have to be off for the hypothesis to stay: 1, or infinity if it is
        rejected even with `LOOSEST`.
    plausible : bool
        Whether the strengths lie in their ranges.
    likelihood : float
        Largest log likelihood over the families, [nats].
    rival : str
        Effects of a hypothesis of as many effects that is likelier; empty where there is none.
    p_rival : float
        p-value of the likelihood ratio in favour of the rival (`tirelib.infer.rival`).
    """

    fit: Posterior
    judges: tuple[Judge, ...]
    law: float
    looseness: float
    plausible: bool
    likelihood: float
    rival: str = ""
    p_rival: float = 1.0

    @property
    def names(self) -> tuple[str, ...]:
        """Of the effects."""
        return self.fit.names

    @property
    def judge(self) -> Judge:
        """The family whose tires the user's is most like."""
        return self.judges[0]

    @property
    def null(self) -> Null:
        """The test by which the statistic is: of another family, in units of the judge's tires."""
        return self.judge.null

    @property
    def scores(self) -> dict[str, float]:
        """Standard score of everything beside the hypothesis."""
        return dict(zip(self.null.names, self.null.scores.tolist(), strict=True))

    @property
    def statistic(self) -> float:
        """The largest of them."""
        return float(self.null.scores.max())

    @property
    def against(self) -> str:
        """What has this score: a further effect, a group of shapes, or the law of an effect."""
        return self.null.names[int(np.argmax(self.null.scores))]

    @property
    def p(self) -> float:
        """p-value of the hypothesis: of the statistic, or of its rival if that is smaller."""
        return min(self.judge.p(self.statistic)[0], self.p_rival)

    @property
    def p_std(self) -> float:
        """Standard deviation of the p-value, from the number of plain tires."""
        return self.judge.p(self.statistic)[1]

    def limit(self, alpha: float) -> float:
        """Return the statistic from which on the p-value is at most alpha."""
        return self.judge.limit(alpha)

    def p_values(self, products: Products, given: str = "") -> FloatArray:
        """Return the p-values of k residuals, (k,); arguments are those of `Null.scores_of`."""
        p = [judge.p_values(products, given) for judge in self.judges]
        return np.asarray(np.max(p, axis=0))


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
    usual, loose = (LAWS, (LOOSEST,)) if fit.effects else (LAWS[-1:], ())
    levels = {law: _likelihoods(views, fit, families, law) for law in usual}
    likelihood = max(max(each) for each in levels.values())
    laws = sorted(usual, key=lambda law: -max(levels[law]))
    looseness = np.inf
    for law in (*laws, *loose):
        best = int(np.argmax(levels[min(law, LAWS[-1])]))
        tested = _tested(problem, fit, views, families, law, best)
        if law == laws[0]:
            judges, used = tested, law
        if _p(tested[0]) > alpha:
            looseness = max(law / LAWS[-1], 1.0)
            if law != LOOSEST:
                judges, used = tested, law
            break
    return Hypothesis(fit, judges, used, looseness, plausible(fit, own_effects), likelihood)


def _null(views: Sequence[View], fit: Posterior, family: Family, law: float) -> Null:
    wide = fit.widths**2
    wide[len(fit.point.base) :] *= PRIOR**2
    return Null(views, family, {BASE: wide, **law_errors(fit, law)})


def _likelihoods(
    views: Sequence[View], fit: Posterior, families: Sequence[Family], law: float
) -> list[float]:
    """Return the largest likelihood over the families for each size of a run's own misfit."""
    return [
        max(_null([view], fit, family, law).likelihood for family in families) for view in views
    ]


def _tested(
    problem: Problem,
    fit: Posterior,
    views: Sequence[View],
    families: Sequence[Family],
    law: float,
    best: int,
) -> tuple[Judge, ...]:
    """Return every family's judge; `best` is the likeliest size of a run's own misfit."""
    near = views[max(best - 1, 0) : best + 2]
    nulls = [_null(near, fit, family, law) for family in families]
    judges = []
    for family in families:
        tires = plain_tires(problem, fit, family, law_errors(fit, law), OWN[best])
        judges.append(Judge.of(family, nulls, products(problem, near, tires)))
    judges.sort(key=lambda judge: (-_p(judge), float(judge.null.scores.max())))
    return tuple(judges)


def _p(judge: Judge) -> float:
    return judge.p(float(judge.null.scores.max()))[0]


def plain_tires(
    problem: Problem,
    fit: Posterior,
    family: Family,
    laws: Mapping[str, float | FloatArray],
    own: float,
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
    random = np.random.default_rng(list(family.name.encode()))
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


def law_errors(fit: Posterior, law: float) -> dict[str, float | FloatArray]:
    """Return variances of the blocks of laws that are off by a relative standard deviation."""
    return {ROUGHLY + name: law**2 for name in fit.names}


def plausible(fit: Posterior, own_effects: int) -> bool:
    """Return whether the strengths of the further effects lie in their ranges."""
    for k, effect in enumerate(fit.effects):
        slack = SLACK * np.hypot(fit.std(k), LAWS[-1] * np.linalg.norm(fit.strengths[k]))
        low, high = effect.low - slack, effect.high + slack
        inside = (fit.strengths[k] >= low) & (fit.strengths[k] <= high)
        if k >= own_effects and not inside.all():
            return False
    return True
