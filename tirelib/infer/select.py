"""A confidence set of hypotheses: which effects, if any, may be missing.

A hypothesis is a set of effects. It is held against everything else that might be there: each
further effect, more of each group of smooth shapes than plain tires have, and laws that are further
off than laws are. Its p-value is the rank of the largest standard score (`tirelib.infer.null`)
among plain tires with the hypothesis planted in the user's plan: for each family of tires by
itself; the largest p over the families counts, so that a tire that is like any one of them is
covered. Every hypothesis with p > alpha is in the set. Its smallest members are what the data say
(Ferrari and Yang 2015): none in it, nothing is missing; one smallest member, that is what is
missing; several, they cannot be told apart; none at all, something unknown is there.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.effects import Effect
from tirelib.errors import ParameterError, TirelibError
from tirelib.infer.hypothesis import Hypothesis, judged
from tirelib.infer.normal import Weighed
from tirelib.infer.plain import BASE, Family, pooled
from tirelib.infer.posterior import posterior
from tirelib.infer.problem import Problem

SINGLES, PARTNERS, LEADERS = 6, 3, 2
"""Hypotheses that are fitted exactly: single effects, partners of each leader, and leaders."""
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

    Raises
    ------
    ParameterError
        If the families have too few tires for this probability.
    """
    least = max(1.0 / (len(family) + 1) for family in families)
    if false_alarm < least:
        raise ParameterError(
            f"false-alarm probability {false_alarm:g}: with {min(map(len, families))} plain tires "
            f"of a family the least that can be had is {least:.3g}; give a larger one"
        )
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

    if base.p > false_alarm:
        return done("none", ())
    leaders: list[Hypothesis] = [base]
    added: list[tuple[str, ...]] = [()]
    for size in range(1, MOST + 1):
        level = [
            at((*names, further), leader)
            for leader, names in zip(leaders, added, strict=True)
            for further in _further(leader, effects, SINGLES if size == 1 else PARTNERS)
        ]
        # two leaders may lead to one and the same set
        fitted = [h for h in dict.fromkeys(level) if h is not None and h.plausible]
        fitted.sort(key=lambda h: -h.likelihood)
        members = [h for h in fitted if h.p > false_alarm]
        if members:
            return done("named" if len(members) == 1 else "indistinguishable", members)
        leaders = fitted[: LEADERS if size == 1 else 1]
        added = [_added(leader, len(had)) for leader in leaders]
    free = [h for h in tried.values() if h is not None and h.plausible and h.free_p > false_alarm]
    if free:
        fewest = min(len(h.names) for h in free)
        likeliest = max((h for h in free if len(h.names) == fewest), key=lambda h: h.likelihood)
        return done("form_inadequate", [likeliest])
    return done("unknown", ())


def _added(hypothesis: Hypothesis, had: int) -> tuple[str, ...]:
    return hypothesis.names[had:]


def _further(leader: Hypothesis, effects: dict[str, Effect], most: int) -> list[str]:
    """Return the further effects that leave least beside a hypothesis, to first order, best first.

    The one that stands out most is always among them.
    """
    names = [name for name in leader.null.names if name in effects]
    left, scores = leader.null.left(names), leader.scores
    least = sorted(names, key=lambda name: left[name])[:most]
    first = max(names, key=lambda name: scores[name], default="")
    return least if first in least or not first else [first, *least[: most - 1]]


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
