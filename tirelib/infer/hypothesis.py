"""A hypothesis, that these effects and no other are missing, with its test."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

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
    statistic : float
        T, [nats].
    against : str
        Which effect or shape it is of.
    p, p_std : float
    free_p : float
        The same, with laws that may be off by as much as themselves.
    plausible : bool
        Whether the strengths lie in their ranges.
    evidence : mapping of name to float
        Log evidence of every further effect beside it, [nats].
    limit : float
        T that plain tires exceed with the false-alarm probability.
    left : mapping of name to float
        Largest T, less this limit, that first order leaves beside each further effect.
    seen, level, strict : shape (n_families,)
        T to first order, and log likelihood of the fit with laws that are roughly right and with
        laws that are right, by family, [nats].
    largest : tuple of shape (n_tires,)
        T of plain tires with this hypothesis planted, by family.
    """

    fit: Posterior
    statistic: float
    against: str
    p: float
    p_std: float
    free_p: float
    plausible: bool
    evidence: dict[str, float]
    limit: float
    left: dict[str, float]
    seen: FloatArray
    level: FloatArray
    strict: FloatArray
    largest: tuple[FloatArray, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Of the effects."""
        return self.fit.names


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
    views = [fit.view(problem, own) for own in OWN]
    rows = np.concatenate(list(fit.rows.values()))
    wide = fit.widths**2
    wide[len(fit.point.base) :] *= PRIOR**2
    widths: dict[str, float | FloatArray] = {BASE: wide}
    allowed = {**widths, **law_errors(fit, 1.0)}
    nulls = [Null(problem, views, rows, family, allowed) for family in families]
    seen = [null.seen() for null in nulls]
    largest = [null.largest() for null in nulls]
    each = [_rank(float(s.max()), t) for s, t in zip(seen, largest, strict=True)]
    best = int(np.argmax(each))
    free = each[best]
    if fit.effects and free <= alpha:
        allowed = {**widths, **law_errors(fit, 1.0 / LAW)}
        for family in families:
            null = Null(problem, views, rows, family, allowed)
            free = max(free, _rank(float(null.seen().max()), null.largest()))
    top = int(np.argmax(seen[best]))
    limits = [float(np.quantile(each, 1.0 - alpha)) for each in largest]
    left: dict[str, float] = {}
    if each[best] <= alpha:
        every = [null.beside() for null in nulls]
        left = {
            name: min(one[name] - limit for one, limit in zip(every, limits, strict=True))
            for name in every[best]
        }
    return Hypothesis(
        fit,
        float(seen[best][top]),
        nulls[best].names[top],
        each[best],
        _std(each[best], len(families[best])),
        free,
        plausible(fit, own_effects),
        dict(zip(nulls[best].names, seen[best].tolist(), strict=True)),
        limits[best],
        left,
        np.array([float(each.max()) for each in seen]),
        np.array([null.level() for null in nulls]),
        np.array([null.likeliest(widths)[0] for null in nulls]),
        tuple(largest),
    )


def against_fits(hypothesis: Hypothesis, others: Sequence[Hypothesis]) -> Hypothesis:
    """Return a hypothesis with its p-value where other fits stand against it too.

    One that lacks some of its effects stands for the fit with both, which is at least as likely.
    The laws of the others count as right: what a rough law may add is not theirs.
    """
    names = set(hypothesis.names)
    more = [other for other in others if not set(other.names) <= names and other.plausible]
    if not more:
        return hypothesis
    gains = np.array([other.strict - hypothesis.level for other in more])
    statistic = np.maximum(hypothesis.seen, gains.max(axis=0))
    each = [_rank(float(t), tires) for t, tires in zip(statistic, hypothesis.largest, strict=True)]
    best = int(np.argmax(each))
    against, free = hypothesis.against, hypothesis.free_p
    if statistic[best] > hypothesis.seen[best]:
        free = min(free, each[best])
        strongest = more[int(np.argmax(gains[:, best]))]
        against = ", ".join(name for name in strongest.names if name not in names)
    return replace(
        hypothesis,
        statistic=float(statistic[best]),
        against=against,
        p=each[best],
        p_std=_std(each[best], len(hypothesis.largest[best])),
        free_p=free,
    )


def _rank(seen: float, largest: FloatArray) -> float:
    """Return the share of plain tires, this one among them, that have as much."""
    return float((1 + np.sum(largest >= seen)) / (len(largest) + 1))


def _std(p: float, count: int) -> float:
    """Return the standard deviation of a p-value from so many tires."""
    return max(float(np.sqrt(p * (1.0 - p) / count)), 1.0 / (count + 1))


def law_errors(fit: Posterior, looser: float) -> dict[str, float]:
    """Return variances of the blocks of laws that are but roughly right."""
    out = {}
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
