"""A confidence set of hypotheses: which effects, if any, may be missing.

A hypothesis is a set of effects. It is held against everything else that might be there: each
further effect, more of each group of smooth shapes than plain tires have, and laws that are further
off than laws are. Its p-value is the rank of the largest standard score
(`tirelib.inference.statistics.null`) among plain tires with the hypothesis planted in the user's
plan: for each family of tires by itself; the largest p over the families counts, so that a tire
that is like any one of them is covered. A hypothesis is rejected as well where a rival of as many
effects explains the runs much better (`tirelib.inference.statistics.rival`), whether the rival
itself is rejected or not. Every hypothesis with p > alpha is in the set. Its smallest members are
what the data say (Ferrari and Yang 2015): none in it, nothing is missing; one smallest member, that
is what is missing; several, they cannot be told apart; none at all, something unknown is there.
"""

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from tirelib.core.errors import ParameterError, TirelibError
from tirelib.core.forked import forked
from tirelib.core.threads import one_thread
from tirelib.effects import Effect
from tirelib.inference.statistics.hypothesis import Hypothesis, judged
from tirelib.inference.statistics.plain import Family, pooled
from tirelib.inference.statistics.posterior import (
    ROUGH,
    ROUNDS,
    Posterior,
    posterior,
    sizes_at_start,
)
from tirelib.inference.statistics.problem import Point, Problem
from tirelib.inference.statistics.rival import p_against

SINGLES, PARTNERS, LEADERS = 6, 3, 2
"""Hypotheses that are fitted exactly: single effects, partners of each leader, and leaders."""
MOST = 3
"""Effects of a hypothesis at most."""
ALIKE = np.deg2rad(80.0)
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
    hypotheses: "Hypotheses"

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


class Hypotheses:
    """Hypotheses about one problem, each fitted and tested once.

    Parameters
    ----------
    problem : Problem
    families : sequence of Family
        Plain tires.
    false_alarm : float
        Probability with which a plain tire of any of the families is said to lack something.
    progress : callable, optional

    Attributes
    ----------
    problem : Problem
        The given one, its whitening about the model without further effects.
    base : Hypothesis
        No further effect.
    effects : mapping of name to Effect
        That may be missing.

    Raises
    ------
    ParameterError
        If the families have too few tires for this probability.
    """

    def __init__(
        self,
        problem: Problem,
        families: Sequence[Family],
        false_alarm: float = 0.05,
        progress: Callable[[str], None] | None = None,
    ) -> None:
        least = max(1.0 / (len(family) + 1) for family in families)
        if false_alarm < least:
            raise ParameterError(
                f"false-alarm probability {false_alarm:g}: with {min(map(len, families))} plain "
                f"tires of a family the least that can be had is {least:.3g}; give a larger one"
            )
        self.families = tuple(families)
        self.false_alarm, self.progress = false_alarm, progress
        self._process = os.getpid()
        self.spread = pooled(families, sizes_at_start(problem))
        self.own = max(family.own for family in families)
        self.had = problem.start.effects
        self.effects = {effect.name: effect for effect in problem.living}
        self.problem, self.base = self._begun(problem)
        self._made: dict[frozenset[str], Hypothesis | None] = {frozenset(): self.base}

    def at(self, names: Sequence[str], near: Hypothesis | None = None) -> Hypothesis | None:
        """Return the hypothesis that these effects are missing; None where no fit settles.

        `near` is a fit from which this one starts.
        """
        return self.each([(names, near or self.base)])[0]

    def each(self, wanted: Sequence[tuple[Sequence[str], Hypothesis]]) -> list[Hypothesis | None]:
        """Return several hypotheses, each with the one from whose fit its own starts, as `at`."""
        new = {frozenset(names): (names, near) for names, near in wanted}
        new = {key: each for key, each in new.items() if key not in self._made}
        calls = [
            partial(self._alone, f", {place} of {len(new)}" if len(new) > 1 else "", *each)
            for place, each in enumerate(new.values(), 1)
        ]
        shared = [*self.had, *self.effects.values(), *self.families]
        found = forked(calls, shared)
        self._made |= dict(zip(new, found, strict=True))
        return [self._made[frozenset(names)] for names, _ in wanted]

    def against(self, hypothesis: Hypothesis, rival: Hypothesis) -> Hypothesis:
        """Return a hypothesis that is not rejected with its p-value against a likelier one."""
        ahead = rival.likelihood - hypothesis.likelihood
        if hypothesis.p <= self.false_alarm or np.exp(-ahead) > self.false_alarm:
            return hypothesis
        p = p_against(self.problem, hypothesis, rival)
        out = replace(hypothesis, rival=" and ".join(self.added(rival)), p_rival=p)
        self._made[frozenset(self.added(hypothesis))] = out
        return out

    def _alone(self, place: str, names: Sequence[str], near: Hypothesis) -> Hypothesis | None:
        """Return a hypothesis from a fit nearby; None where no fit settles."""
        self._told(f"trying the model with {' and '.join(names)}{place}")
        more = [self.effects[name] for name in names]
        self.problem.forget()
        try:
            effects = [*self.had, *more]
            whiten = self.problem.whitener(self.own)
            fit = posterior(self.problem, effects, self.spread, whiten, near=near.fit)
            return self._tested(self.problem, fit)
        except TirelibError:
            return None

    def simpler(self, hypothesis: Hypothesis) -> Hypothesis | None:
        """Return the likeliest hypothesis of fewer of its effects that is at least as likely.

        Where there is one that stays with loose laws, a law of its is not right: that more effects
        cover what it leaves does not show that they are there.
        """
        fewer = (
            h
            for h in self.tried
            if h.plausible
            and np.isfinite(h.looseness)
            and set(h.names) < set(hypothesis.names)
            and h.likelihood >= hypothesis.likelihood
        )
        return max(fewer, key=lambda h: h.likelihood, default=None)

    def added(self, hypothesis: Hypothesis) -> tuple[str, ...]:
        """Return the names of a hypothesis' further effects."""
        return hypothesis.names[len(self.had) :]

    @property
    def tried(self) -> tuple[Hypothesis, ...]:
        """All hypotheses with further effects that were fitted."""
        made = (each for key, each in self._made.items() if key)
        return tuple(each for each in made if each is not None)

    def _begun(self, problem: Problem) -> tuple[Problem, Hypothesis]:
        """Return the problem about the likeliest fit without further effects, and this fit."""
        shared = [*self.had, *self.effects.values(), *self.families]
        part, starts = problem.thinned(), list(problem.starts)
        if part is not problem or len(starts) > 1:
            calls = [partial(self._roughly, part, start) for start in starts]
            starts = _apart(part, starts, forked(calls, shared))
        found = forked([partial(self._from, problem, start) for start in starts], shared)
        settled = [each for each in found if not isinstance(each, TirelibError)]
        if not settled:
            raise next(each for each in found if isinstance(each, TirelibError))
        passed, base = max(settled, key=lambda each: each[1].likelihood)
        for solved in passed:
            problem = problem.about(solved)
        return problem, base

    def _roughly(self, part: Problem, start: Point) -> Posterior | None:
        """Return a rough fit of a part of the measurement from a start; None if it diverges."""
        part.forget()
        try:
            return self._fit(part, start=start, settled=ROUGH)
        except TirelibError:
            return None

    def _from(self, problem: Problem, start: Point) -> tuple[list[Any], Hypothesis] | TirelibError:
        """Return the fit from a start, and the solutions that its whitening was about in turn."""
        passed: list[Any] = []
        problem.forget()
        try:
            fit = self._fit(problem, start=start, settled=ROUGH)
            for _ in range(ROUNDS):
                # a whitening is right nearby only
                nearer = problem.about(fit.solved)
                if nearer is problem or fit.far:
                    break  # a model that is far off has no whitening that is right
                passed.append(fit.solved)
                problem, fit = nearer, self._fit(nearer, near=fit, settled=ROUGH)
            fit = self._fit(problem, near=fit)
            self._told("testing what the model leaves against plain tires")
            return passed, self._tested(problem, fit)
        except TirelibError as error:
            return error

    def _fit(self, problem: Problem, **how: Any) -> Posterior:
        """Return the fit without further effects."""
        whiten = problem.whitener(self.own)
        return posterior(problem, self.had, self.spread, whiten, progress=self._told, **how)

    def _told(self, label: str) -> None:
        """Say what is done now; a copy of the first process says nothing."""
        if self.progress is not None and os.getpid() == self._process:
            self.progress(label)

    def _tested(self, problem: Problem, fit: Posterior) -> Hypothesis:
        had = len(self.had)
        return judged(problem, fit, self.families, self.false_alarm, own_effects=had)


def _apart(
    part: Problem, starts: Sequence[Point], rough: Sequence[Posterior | None]
) -> list[Point]:
    """Return where fits go on: at the end of each rough one, once for those that are one model.

    Two models are one where the whitening about the better one need not follow the other.
    """
    out: list[Point] = []
    kept: list[Problem] = []
    for fit in sorted(filter(None, rough), key=lambda fit: fit.cost):
        if all(there.about(fit.solved) is not there for there in kept):
            kept.append(part.about(fit.solved))
            out.append(fit.point)
    # the whole measurement says what is wrong with a start that a part of it does not settle from
    return out + [start for start, fit in zip(starts, rough, strict=True) if fit is None]


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
        Whether more effects than `MOST` may act at once. Where every hypothesis is rejected, even
        with laws that are off by as much as themselves, the effect that stands out most is added
        to the likeliest until one remains.
    """
    hypotheses = Hypotheses(problem, families, false_alarm, progress)
    base, alpha = hypotheses.base, false_alarm

    def done(kind: str, members: Sequence[Hypothesis]) -> Verdict:
        best = members[0] if members else base
        return Verdict(kind, tuple(hypotheses.added(m) for m in members), best, hypotheses)

    if base.p > alpha:
        return done("none", ())
    leaders: list[Hypothesis] = [base]
    # what an effect that states a start does at zero says nothing of what it does there
    elsewhere = [name for name, effect in hypotheses.effects.items() if effect.start]
    for size in range(1, MOST + 1):
        tried = [
            (leader, _further(leader, hypotheses.effects, SINGLES if size == 1 else PARTNERS))
            for leader in leaders
        ]
        level = hypotheses.each(
            [
                ((*hypotheses.added(leader), name), leader)
                for leader, further in tried
                for name in dict.fromkeys(further + (elsewhere if size == 1 else []))
            ]
        )
        # two leaders may lead to one and the same set
        every = sorted(
            (h for h in dict.fromkeys(level) if h is not None), key=lambda h: -h.likelihood
        )
        possible = [h for h in every if h.plausible]
        # a rival that is itself rejected is not there, but something like it may be
        fitted = [hypotheses.against(h, possible[0]) for h in possible]
        staying = [h for h in fitted if h.p > alpha]
        simpler = {h: hypotheses.simpler(h) for h in staying}
        members = [h for h in staying if simpler[h] is None]
        if members:
            return done("named" if len(members) == 1 else "indistinguishable", members)
        if staying:
            likeliest = max(filter(None, simpler.values()), key=lambda h: h.likelihood)
            return done("form_inadequate", [likeliest])
        leaders = fitted[:LEADERS]
    leader = leaders[0] if leaders else None
    while many and leader is not None and leader.plausible and not np.isfinite(leader.looseness):
        further = _further(leader, hypotheses.effects, 1)
        leader = hypotheses.at((*hypotheses.added(leader), *further), leader) if further else None
    found = many and leader is not None and leader.plausible
    best = leader if found else _with_loose_laws(hypotheses)
    if best is not None:
        return done("form_inadequate", [best, *(_alike(hypotheses, best) if many else ())])
    return done("unknown", ())


def _with_loose_laws(hypotheses: Hypotheses) -> Hypothesis | None:
    """Return the smallest hypothesis that stays if its laws are off by as much as themselves.

    It is the likeliest such of its size; one that is out of its range is not told.
    """
    for size in range(1, MOST + 1):
        same = [h for h in hypotheses.tried if len(hypotheses.added(h)) == size]
        loose = [h for h in same if 1.0 < h.looseness < np.inf]
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
        if other not in names and null.angle(name, other) < ALIKE
    ]
    found = [h for h in dict.fromkeys(hypotheses.each(wanted)) if h is not None and h.plausible]
    return sorted((h for h in found if h.looseness <= best.looseness), key=lambda h: -h.likelihood)


def _further(leader: Hypothesis, effects: dict[str, Effect], most: int) -> list[str]:
    """Return the further effects that promise most beside a hypothesis, to first order, best first.

    In turn the one that stands out most and the one that leaves least: where something stands out
    that no effect explains to first order, all leave the same.
    """
    names = [name for name in leader.null.names if name in effects]
    left, scores = leader.null.left(names), leader.scores
    standing = sorted(names, key=lambda name: -scores[name])
    least = sorted(names, key=lambda name: left[name])
    turns = (name for pair in zip(standing, least, strict=True) for name in pair)
    return list(dict.fromkeys(turns))[:most]
