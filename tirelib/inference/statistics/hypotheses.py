"""Hypotheses about one problem: each is fitted and tested once."""

import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from tirelib.core.errors import ParameterError, TirelibError
from tirelib.core.forked import forked
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

KINKED = 3.0
"""A fit gains what it promised to first order, or up to so many times as much where a law has a
kink: 35 campaigns, docs/theory/inference.md."""

REJECTED = 2.0
"""What the model without further effects leaves, over what noise leaves, from which on its fit need
not settle: it lacks something strong. Other values: docs/theory/verdict_numbers.md."""


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
        if self.base.p > false_alarm:
            self.base = self._settled(self.base)
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

    def against_larger(self, hypothesis: Hypothesis) -> Hypothesis:
        """Return a hypothesis that is not rejected with its p-value against one effect more.

        The error that a law may have can cover what a further effect does. Then nothing stands out
        beside the hypothesis. If the further effect really acts, the runs are still likelier with
        it than without; laws are roughly right or exact in each of the two, whichever makes the
        runs likelier. Any of n effects may be the further one: a likelihood ratio of n / p in
        favour of one of them has at most the probability p where none is there (Bonferroni, and
        Royall as in `tirelib.inference.statistics.rival`), with errors of laws of a known size.
        Something without a name may stand beside either. A larger hypothesis counts only if its
        strengths are in their ranges and each of its effects is there (`explains`).
        """
        larger = [h for h in self._larger(hypothesis) if h.plausible and self.explains(h)]
        if hypothesis.p <= self.false_alarm or not larger:
            return hypothesis
        rival = max(larger, key=lambda h: h.unnamed)
        p = self._count(hypothesis) * float(np.exp(min(hypothesis.unnamed - rival.unnamed, 0.0)))
        if p > self.false_alarm:
            return hypothesis
        out = replace(hypothesis, rival=" and ".join(self.added(rival)), p_rival=p)
        self._made[frozenset(self.added(hypothesis))] = out
        return out

    def may_reject(self, hypothesis: Hypothesis, name: str) -> bool:
        """Return whether this effect beside a hypothesis promises enough to reject it.

        See `against_larger`. What it promises to first order is with laws that are exact, or as
        they are likeliest; where they may look like the further effect, also without that.
        """
        odds = np.log(self._count(hypothesis) / self.false_alarm)
        return any(
            KINKED * (gained[name] - own) >= odds + hypothesis.likelihood - own
            for own, gained in hypothesis.promises
        )

    def _count(self, hypothesis: Hypothesis) -> int:
        """Return of how many effects one may be missing beside a hypothesis."""
        return len(self.effects) - len(self.added(hypothesis))

    def _larger(self, hypothesis: Hypothesis) -> list[Hypothesis]:
        """Return the hypotheses of one effect more that were fitted."""
        names = set(hypothesis.names)
        return [h for h in self.of_size(len(names) + 1 - len(self.had)) if names < set(h.names)]

    def of_size(self, size: int) -> list[Hypothesis]:
        """Return the hypotheses of so many further effects that were fitted."""
        return [h for h in self.tried if len(self.added(h)) == size]

    def without_plain(self, hypothesis: Hypothesis) -> Hypothesis | None:
        """Return the hypothesis of those of its effects that are larger than plain tires show.

        None where no effect is; the given one where fewer effects have no fit.
        """
        added, had = self.added(hypothesis), len(self.had)
        shown = [hypothesis.p_plain(k) for k in range(had, had + len(added))]
        larger = [name for name, p in zip(added, shown, strict=True) if p <= self.false_alarm]
        return (self.at(larger, hypothesis) or hypothesis) if larger else None

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
        """Return the likeliest hypothesis of fewer of its effects that explains the runs as well.

        Something without a name may stand beside either. Where there is such a hypothesis, that
        more effects cover what fewer leave does not show that they are there.
        """
        as_good = (
            h
            for h in (self.base, *self.tried)
            if h.plausible
            and set(h.names) < set(hypothesis.names)
            and h.unnamed >= hypothesis.unnamed
        )
        return max(as_good, key=lambda h: h.likelihood, default=None)

    def explains(self, hypothesis: Hypothesis) -> bool:
        """Return whether each of its effects is there, and not only the error of its law.

        Each has to be larger than plain tires show it. And its law has to make the runs likelier
        without an error, for errors are flexible and would explain something else. For a single
        effect a p-value of alpha and a likelihood ratio of 1 are enough, because it is rejected
        already that nothing is missing. Beside others an effect is one of n that might be there: it
        needs alpha / n and n / alpha.
        """
        added, had = self.added(hypothesis), len(self.had)
        shown = max(hypothesis.p_plain(k) for k in range(had, had + len(added)))
        if len(added) == 1:
            return shown <= self.false_alarm and self.supported(hypothesis, 1.0)
        level = self.false_alarm / len(self.effects)
        return shown <= level and all(
            self._needed(hypothesis, k) >= -np.log(level) for k in range(had, had + len(added))
        )

    def _needed(self, hypothesis: Hypothesis, index: int) -> float:
        """Return how much likelier an effect with an exact law makes the runs, [nats].

        The hypothesis is compared with that of its other effects, whose laws are exact as well, or
        roughly right on both sides. Something without a name may stand beside either. Infinity
        where the other effects were not fitted.
        """
        less = self._made.get(frozenset(self.added(hypothesis)) - {hypothesis.names[index]})
        if less is None:
            return np.inf
        exact = hypothesis.unnamed_exact - less.unnamed_exact
        return max(exact, hypothesis.exact_in[index] - less.unnamed)

    def supported(self, hypothesis: Hypothesis, odds: float | None = None) -> bool:
        """Return whether its laws, taken as exact, explain the runs better than no effect does.

        Where only the errors of laws make the runs likelier, something else is there. `odds` is the
        likelihood ratio that is wanted, by default n / alpha for each effect.
        """
        if odds is None:
            odds = (len(self.effects) / self.false_alarm) ** len(self.added(hypothesis))
        ahead = hypothesis.exact - np.log(odds)
        return bool(ahead >= self._base_against(ahead - self.base.exact).exact)

    def _base_against(self, ahead: float) -> Hypothesis:
        """Return the base; if it may catch up with a hypothesis so far ahead, its fit settles."""
        if 0.0 < ahead < 0.5 * self.base.fit.short:
            self.base = self._made[frozenset()] = self._settled(self.base)
        return self.base

    def _settled(self, base: Hypothesis) -> Hypothesis:
        """Return the base from a fit that settles; what is less than a nat short of it does."""
        if base.fit.short < 2.0:
            return base
        fit = self._fit(self.problem, near=base.fit, loose_from=np.inf)
        return self._tested(self.problem, fit)

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
        how = {"loose_from": REJECTED, **how}
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
