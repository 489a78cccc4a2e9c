"""A confidence set of hypotheses: which effects, if any, may be missing.

A hypothesis is a set of effects. It is held against everything else that might be there: each
further effect, more of each group of smooth shapes than plain tires have, and laws that are further
off than laws are. Its p-value is the rank of the largest standard score
(`tirelib.inference.statistics.null`) among plain tires with the hypothesis planted in the user's
plan: for each family of tires by itself; the largest p over the families counts, so that a tire
that is like any one of them is covered. A hypothesis is rejected as well where a rival of as many
effects explains the runs much better (`tirelib.inference.statistics.rival`), whether the rival
itself is rejected or not, or where one effect more makes the runs much likelier
(`Hypotheses.against_larger`), and gives way to fewer of its effects that explain the runs as well
(`Hypotheses.simpler`). A hypothesis counts only if each of its effects is larger than plain tires
show it and explains something (`Hypotheses.explains`). The others with p > alpha, of the smallest
number of effects at which one has it, are what the data say (Ferrari and Yang 2015): the hypothesis
of no effect, nothing is missing; one, that is what is missing; several, they cannot be told apart;
none of any number, something unknown is there.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from tirelib.core.threads import one_thread
from tirelib.effects import Effect
from tirelib.inference.statistics.hypotheses import Hypotheses
from tirelib.inference.statistics.hypothesis import Hypothesis
from tirelib.inference.statistics.plain import Family
from tirelib.inference.statistics.problem import Problem

SINGLES, PARTNERS, LEADERS, FURTHER = 6, 3, 2, 2
"""Hypotheses that are fitted exactly: single effects, partners of each leader, leaders, and effects
beside each hypothesis that stays."""
MOST_EFFECTS = 3
"""Effects of a hypothesis at most."""
PROMISED = 0.1
"""Share of the most that any effect gains to first order below which an effect is not fitted. Half
and double of it: docs/theory/verdict_numbers.md."""
LOOKALIKE_ANGLE = np.deg2rad(80.0)
"""Angle between signatures below which one effect is tried in the place of another: it says what is
tried, and not what is told."""


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
    hypotheses : Hypotheses
        All that were fitted.
    """

    kind: str
    sets: tuple[tuple[str, ...], ...]
    best: Hypothesis
    hypotheses: Hypotheses

    @property
    def base(self) -> Hypothesis:
        """The hypothesis that nothing is missing."""
        return self.hypotheses.base

    @property
    def tried(self) -> tuple[Hypothesis, ...]:
        """All hypotheses with further effects that were fitted exactly."""
        return self.hypotheses.tried

    @property
    def alpha(self) -> float:
        """The false-alarm probability."""
        return self.hypotheses.false_alarm


@one_thread()
def select(
    problem: Problem,
    families: Sequence[Family],
    *,
    false_alarm: float = 0.05,
    many: bool = False,
    progress: Callable[[str], None] | None = None,
) -> Verdict:
    """Return which effects, if any, a model lacks.

    Parameters
    ----------
    problem, families, false_alarm, progress
        As of `Hypotheses`, whose errors are raised.
    many : bool
        Whether more effects than `MOST_EFFECTS` may act at once. Where every hypothesis is
        rejected, even with laws that are off by as much as themselves, the effect that stands out
        most is added to the likeliest until one remains.
    """
    hypotheses = Hypotheses(problem, families, false_alarm, progress)
    base, alpha = hypotheses.base, false_alarm

    def done(kind: str, members: Sequence[Hypothesis]) -> Verdict:
        best = members[0] if members else hypotheses.base
        return Verdict(kind, tuple(hypotheses.added(m) for m in members), best, hypotheses)

    if base.p > alpha:
        return done("none", ())
    leaders: list[Hypothesis] = [base]
    # what an effect that states a start does at zero says nothing of what it does there
    elsewhere = [name for name, effect in hypotheses.effects.items() if effect.start]
    for size in range(1, MOST_EFFECTS + 1):
        tried = [
            (leader, _further(leader, hypotheses.effects, SINGLES if size == 1 else PARTNERS))
            for leader in leaders
        ]
        hypotheses.each(
            [
                ((*hypotheses.added(leader), name), leader)
                for leader, further in tried
                for name in dict.fromkeys(further + (elsewhere if size == 1 else []))
            ]
        )
        # those that were fitted to reject fewer effects are among them
        every = sorted(hypotheses.of_size(size), key=lambda h: -h.likelihood)
        possible = [h for h in every if h.plausible and hypotheses.explains(h)]
        # a rival that is itself rejected is not there, but something like it may be
        fitted = [hypotheses.against(h, possible[0]) for h in possible]
        if size < MOST_EFFECTS:
            hypotheses.each(
                [
                    ((*hypotheses.added(h), name), h)
                    for h in fitted
                    if h.p > alpha
                    for name in _further(h, hypotheses.effects, FURTHER)
                    if hypotheses.may_reject(h, name)
                ]
            )
            fitted = [hypotheses.against_larger(h) for h in fitted]
        staying = [h for h in fitted if h.p > alpha]
        simpler = {h: hypotheses.simpler(h) for h in staying}
        members = [h for h in staying if simpler[h] is None]
        if members:
            return done("named" if len(members) == 1 else "indistinguishable", members)
        if staying:
            likeliest = max(filter(None, simpler.values()), key=lambda h: h.likelihood)
            there = likeliest is not hypotheses.base and hypotheses.explains(likeliest)
            if there and hypotheses.supported(likeliest):
                return done("form_inadequate", [likeliest])
            return done("unknown", ())
        # where a hypothesis explains nothing by itself, one of more effects may
        leaders = [h for h in every if h.plausible][:LEADERS]
    leader = leaders[0] if leaders else None
    while many and leader is not None and leader.plausible and not np.isfinite(leader.looseness):
        further = _further(leader, hypotheses.effects, 1)
        leader = hypotheses.at((*hypotheses.added(leader), *further), leader) if further else None
    found = many and leader is not None and leader.plausible
    best = hypotheses.without_plain(leader) if found and leader else _with_loose_laws(hypotheses)
    if best is not None:
        return done("form_inadequate", [best, *(_alike(hypotheses, best) if many else ())])
    return done("unknown", ())


def _with_loose_laws(hypotheses: Hypotheses) -> Hypothesis | None:
    """Return the smallest hypothesis that stays if its laws are off by as much as themselves.

    It is the likeliest such of its size whose laws explain something and whose effects are all
    there; one that is out of its range is not told.
    """
    for size in range(1, MOST_EFFECTS + 1):
        loose = [h for h in hypotheses.of_size(size) if 1.0 < h.looseness < np.inf]
        loose = [h for h in loose if hypotheses.supported(h) and hypotheses.explains(h)]
        best = max(loose, key=lambda h: h.likelihood, default=None)
        if best is not None and best.plausible:
            return best
    return None


def _alike(hypotheses: Hypotheses, best: Hypothesis) -> list[Hypothesis]:
    """Return hypotheses with one effect in the place of another, as good as one whose laws are off.

    Those that are likeliest come first.
    """
    names, null = hypotheses.added(best), hypotheses.base.null
    wanted = [
        (tuple(other if each == name else each for each in names), best)
        for name in names
        for other in hypotheses.effects
        if other not in names and null.angle(name, other) < LOOKALIKE_ANGLE
    ]
    found = [h for h in dict.fromkeys(hypotheses.each(wanted)) if h is not None and h.plausible]
    return sorted((h for h in found if h.looseness <= best.looseness), key=lambda h: -h.likelihood)


def _further(leader: Hypothesis, effects: dict[str, Effect], most: int) -> list[str]:
    """Return the further effects that promise most beside a hypothesis, to first order, best first.

    In turn the one that stands out most, the likeliest with exact laws, and the one that leaves
    least: what laws may be off by hides an effect, and where something stands out that no effect
    explains to first order, all leave the same.
    """
    names = [name for name in leader.null.names if name in effects]
    left, scores = leader.null.left(names), leader.scores
    standing = sorted(names, key=lambda name: -scores[name])
    least = sorted(names, key=lambda name: left[name])
    likeliest = sorted(names, key=lambda name: -leader.further[name])
    turns = (name for each in zip(standing, likeliest, least, strict=True) for name in each)
    promising = _promising(leader, names)
    return [name for name in dict.fromkeys(turns) if name in promising][:most]


def _promising(leader: Hypothesis, names: Sequence[str]) -> set[str]:
    """Return the effects that gain enough to first order, by any of `Hypothesis.promises`."""
    out: set[str] = set()
    for own, gained in leader.promises:
        gains = {name: gained[name] - own for name in names}
        most = max(gains.values(), default=0.0)
        # where no effect gains anything, each may do so beyond first order
        out |= {name for name, gain in gains.items() if most <= 0.0 or gain >= PROMISED * most}
    return out
