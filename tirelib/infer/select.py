"""A confidence set of hypotheses: which effects, if any, may be missing.

A hypothesis is a set of effects. It is held against everything else that might be there: each
further effect, and more of each group of smooth shapes than plain tires have. The statistic is the
largest log evidence of any of these beside the hypothesis,

    T(H) = max over a of log p(r | H and a) - log p(r | H),

to first order about H for every a, and by its own fit for those effects that first order finds
likeliest: a base that has bent itself to a strong effect is too far from the truth for first order.
and Its p-value is the rank of T among plain tires with the hypothesis planted in the user's plan:
for each family of tires by itself, judged by what its other tires show; the largest p over the
families counts, so that a tire that is like any one of them is covered. Every hypothesis with
p > alpha is in the set. Its smallest members are what the data say (Ferrari and Yang 2015): none in
it, nothing is missing; one smallest member, that is what is missing; several, they cannot be told
apart; none at all, something unknown is there.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.effects import Effect
from tirelib.errors import TirelibError
from tirelib.infer.hypothesis import Hypothesis, against_fits, judged
from tirelib.infer.normal import Weighed
from tirelib.infer.plain import BASE, Family, pooled
from tirelib.infer.posterior import posterior
from tirelib.infer.problem import Problem

SINGLES, PARTNERS, LEADERS = 6, 3, 3
"""Hypotheses that are fitted exactly: single effects, partners of each leader, and leaders."""
LEAVES = 0.5
"""Share of the evidence against a hypothesis that a further effect may leave, to first order."""
MOST = 3
"""Effects of a hypothesis at most."""


@dataclass(frozen=True, slots=True, eq=False)
class Verdict:
    """What the confidence set says.

    Attributes
    ----------
    kind : str
        none, named, indistinguishable, form_inadequate or unknown.
    sets : tuple of tuple of str
        Smallest members, best first; empty for none and unknown.
    best : Hypothesis
        That the verdict's model is made of.
    base : Hypothesis
        No further effect.
    tried : tuple of Hypothesis
        All that were fitted exactly.
    alpha : float
    """

    kind: str
    sets: tuple[tuple[str, ...], ...]
    best: Hypothesis
    base: Hypothesis
    tried: tuple[Hypothesis, ...]
    alpha: float


def select(
    problem: Problem,
    families: Sequence[Family],
    *,
    false_alarm: float = 0.05,
    progress: Callable[[str], None] | None = None,
) -> Verdict:
    """Return which effects, if any, a model lacks.

    Parameters
    ----------
    problem : Problem
    families : sequence of Family
        Plain tires.
    false_alarm : float
        Probability with which a plain tire of any of the families is said to lack something.
    progress : callable, optional
    """
    spread, own = pooled(families), max(family.own for family in families)
    had = problem.start.effects
    effects = {effect.name: effect for effect in problem.living}
    tried: dict[frozenset[str], Hypothesis | None] = {}

    def at(names: Sequence[str], near: Hypothesis | None) -> Hypothesis | None:
        key = frozenset(names)
        if key not in tried:
            more = [effects[name] for name in names]
            try:
                fit = posterior(
                    problem,
                    [*had, *more],
                    spread,
                    own,
                    near=None if near is None else near.fit,
                    strengths=_start(problem, near, more, own, spread),
                    progress=progress,
                )
                tried[key] = judged(problem, fit, families, false_alarm, own_effects=len(had))
            except TirelibError:
                tried[key] = None
        return tried[key]

    first = posterior(problem, had, spread, own, strengths=problem.start.strengths)
    base = judged(problem, first, families, false_alarm, own_effects=len(had))

    def done(kind: str, members: Sequence[Hypothesis]) -> Verdict:
        best = members[0] if members else base
        sets = tuple(_added(member, len(had)) for member in members) if members else ()
        every = tuple(each for each in tried.values() if each is not None)
        return Verdict(kind, sets, best, base, every, false_alarm)

    likeliest = _leading(base, effects)[:SINGLES]
    level = [at((name,), base) for name in likeliest]
    fitted = [h for h in level if h is not None and h.plausible]
    base = _settled(problem, base, fitted, families, false_alarm, spread, own, len(had))
    tried[frozenset()] = base
    base = against_fits(base, fitted)
    if base.p > false_alarm:
        return done("none", ())
    names = [name for name in _further(base, effects, SINGLES, LEADERS) if name not in likeliest]
    level += [at((name,), base) for name in names]
    for size in range(1, MOST + 1):
        # two leaders may lead to one and the same set
        every = [h for h in tried.values() if h is not None]
        fitted = [against_fits(h, every) for h in dict.fromkeys(level) if h is not None]
        fitted.sort(key=lambda h: -float(h.level.max()))
        members = [h for h in fitted if h.plausible and h.p > false_alarm]
        if members:
            return done("named" if len(members) == 1 else "indistinguishable", members)
        if size == MOST:
            break
        level = []
        for leader in [h for h in fitted if h.plausible][: LEADERS if size == 1 else 1]:
            added = _added(leader, len(had))
            for partner in _further(leader, effects, PARTNERS, 0):
                level.append(at((*added, partner), leader))
    free = [h for h in tried.values() if h is not None and h.fit.names[len(had) :]]
    free = [h for h in free if h.plausible and h.free_p > false_alarm]
    if free:
        fewest = min(len(h.names) for h in free)
        return done(
            "form_inadequate",
            sorted((h for h in free if len(h.names) == fewest), key=lambda h: h.fit.cost)[:1],
        )
    return done("unknown", ())


def _settled(
    problem: Problem,
    base: Hypothesis,
    others: Sequence[Hypothesis],
    families: Sequence[Family],
    alpha: float,
    spread: dict[str, float],
    own: float,
    had: int,
) -> Hypothesis:
    """Return the base, fitted again from the likeliest of other fits if that is likelier."""
    if not others:
        return base
    best = max(others, key=lambda h: float(h.strict.max()))
    if float((best.strict - base.level - base.seen).max()) < 0.5 * base.limit:
        return base
    start = problem.start
    try:
        fit = posterior(
            problem, start.effects, spread, own, near=best.fit, strengths=start.strengths
        )
    except TirelibError:
        return base
    again = judged(problem, fit, families, alpha, own_effects=had)
    return again if float(again.level.max()) > float(base.level.max()) else base


def _added(hypothesis: Hypothesis, had: int) -> tuple[str, ...]:
    return hypothesis.names[had:]


def _leading(hypothesis: Hypothesis, effects: dict[str, Effect]) -> list[str]:
    """Return effects by their evidence beside a hypothesis, best first."""
    return sorted(effects, key=lambda name: -hypothesis.evidence.get(name, -np.inf))


def _further(leader: Hypothesis, effects: dict[str, Effect], most: int, least: int) -> list[str]:
    """Return the effects that take away most of what stands against a hypothesis, best first.

    One that leaves more than `LEAVES` of it, to first order, is tried only if fewer than `least`
    leave less: two effects may be needed together.
    """
    excess = leader.statistic - leader.limit
    found = {name: left for name, left in leader.left.items() if name in effects}
    every = sorted(found, key=lambda name: found[name])
    good = sum(found[name] < LEAVES * excess for name in every)
    return every[: min(most, max(good, least))]


def _start(
    problem: Problem,
    near: Hypothesis | None,
    more: Sequence[Effect],
    own: float,
    spread: dict[str, float],
) -> list[FloatArray]:
    """Return strengths to start from: those of the fit nearby, first order for what is new."""
    had = [*problem.start.strengths]
    if near is None:
        return [*had, *(np.zeros(e.components) for e in more)]
    known = dict(zip(near.names, near.fit.strengths, strict=True))
    normal = near.fit.view(problem, own).normal
    wide = {e.name: 1.0 for e in more if e.name not in known}
    diagonal = normal.spread({**spread, BASE: near.fit.widths**2, **wide})
    mean = Weighed(normal, diagonal).mean(normal.right)
    out = list(near.fit.strengths[: len(had)])
    for effect in more:
        if effect.name in known:
            out.append(known[effect.name])
        else:
            first = mean[normal.blocks[effect.name]] * effect.scale
            out.append(np.clip(first, 0.9 * effect.low, 0.9 * effect.high))
    return out
