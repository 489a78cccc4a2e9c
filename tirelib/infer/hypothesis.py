"""A hypothesis, that these effects and no other are missing, with its test."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.infer.null import OWN, PRIOR, Null
from tirelib.infer.plain import BASE, ROUGHLY, Family
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
        Among the plain tires of the family whose p-value is the largest.
    statistic : float
        Largest standard score of anything beside the hypothesis.
    against : str
        What has this score: a further effect, a group of shapes, or the law of an effect.
    limit : float
        Score that plain tires exceed with the false-alarm probability.
    p, p_std : float
    free_p : float
        The same, with laws that may be off by as much as themselves.
    plausible : bool
        Whether the strengths lie in their ranges.
    likelihood : float
        Largest log likelihood over the families, [nats].
    """

    fit: Posterior
    null: Null
    statistic: float
    against: str
    limit: float
    p: float
    p_std: float
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
    own_effects : int
        How many of the fit's effects the model had already: they are part of it.
    """
    nulls = _nulls(problem, fit, families, 1.0)
    p = [_rank(null) for null in nulls]
    best = int(np.argmax(p))
    null, free = nulls[best], p[best]
    if fit.effects and free <= alpha:
        free = max(_rank(each) for each in _nulls(problem, fit, families, 1.0 / LAW))
    return Hypothesis(
        fit,
        null,
        float(null.scores.max()),
        null.names[int(np.argmax(null.scores))],
        float(np.quantile(null.largest, 1.0 - alpha)),
        p[best],
        _std(p[best], len(null.family)),
        free,
        plausible(fit, own_effects),
        max(each.likelihood for each in nulls),
    )


def _nulls(
    problem: Problem, fit: Posterior, families: Sequence[Family], looser: float
) -> list[Null]:
    """Return a fit among the plain tires of every family."""
    views = [fit.view(problem, own) for own in OWN]
    rows = np.concatenate(list(fit.rows.values()))
    wide = fit.widths**2
    wide[len(fit.point.base) :] *= PRIOR**2
    allowed = {BASE: wide, **law_errors(fit, looser)}
    return [Null(problem, views, rows, family, allowed) for family in families]


def _rank(null: Null) -> float:
    """Return the share of plain tires, this one among them, that have as large a score."""
    beyond = int(np.sum(null.largest >= null.scores.max()))
    return (1 + beyond) / (len(null.family) + 1)


def _std(p: float, count: int) -> float:
    """Return the standard deviation of a p-value from so many tires."""
    return max(float(np.sqrt(p * (1.0 - p) / count)), 1.0 / (count + 1))


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
