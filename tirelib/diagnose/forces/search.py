"""Rounds of the search for what a brush lacks: joint ranking, exact refits, ranking again."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from tirelib.arrays import BoolArray, FloatArray
from tirelib.diagnose.forces.candidates import ForceCandidates, force_candidates
from tirelib.diagnose.forces.fit import ForceFit, Problem, fit_force
from tirelib.diagnose.forces.ranking import ForceRanking, ForceScores
from tirelib.effects import Effect
from tirelib.errors import TirelibError

ALARM = 3.0
"""Score over the ensemble's largest from which an effect is an alarm; from 1 on it is a hint."""
HELPS = 0.985
"""Error of the exact refit with an effect, over that without, up to which it is kept."""
LEAST_SHARE = 0.03
"""Share of the left misfit that has to come back without an effect for it to matter."""
LAW = 0.2
"""Share by which the law of an effect may be off: a twin has to explain more than its square."""
ROUNDS = 3
RANGE_SLACK = 2.0
"""Standard deviations by which a strength may leave its range."""


class Search:
    """Rounds: rank jointly, try the suspects by exact refits, rank again."""

    def __init__(
        self,
        problem: Problem,
        catalogue: Sequence[Effect],
        limits: Mapping[str, float],
        base: ForceFit,
        first: ForceCandidates,
        scores: ForceScores,
    ) -> None:
        self.problem, self.catalogue, self.limits = problem, catalogue, limits
        self.base, self.model, self.found, self.now = base, base, first, scores
        self.first, self.scores = first, scores
        self.named: list[str] = []
        self.tried: set[str] = set()
        self.rounds = 0

    def effect(self, name: str) -> Effect:
        """Return an effect of the catalogue."""
        return next(effect for effect in self.catalogue if effect.name == name)

    def alarmed(self, name: str) -> bool:
        """Whether an effect was an alarm at first."""
        if name not in self.first.names:
            return False
        return bool(alarms(self.first, self.scores, self.limits)[self.first.names.index(name)])

    def round(self, tell: Callable[[str], None]) -> bool:
        """Try the suspects of one ranking; return whether one was kept."""
        suspects = alarms(self.found, self.now, self.limits)
        order = np.argsort(-self.now.share)
        kept = False
        for index in order[suspects[order]]:
            effect = self.found.living[int(index)].effect
            if effect.name in self.tried:
                continue
            self.tried.add(effect.name)
            tell(f"refit with {effect.name}")
            start = inside(effect, self.now.strength[int(index)])
            try:
                trial = fit_force(
                    self.problem,
                    self.model.values,
                    [*self.model.effects, effect],
                    [*self.model.strengths, start],
                )
            except TirelibError:
                continue
            if trial.error <= HELPS * self.model.error and self._beyond_law(effect.name, trial):
                self.model, kept = trial, True
                self.named.append(effect.name)
        self.rounds += 1
        if kept:
            self.found = force_candidates(self.problem, self.model, self.catalogue)
            ranking = ForceRanking(self.problem, self.model, self.found)
            self.now = ranking.scores(self.problem.measured - self.model.predicted)
        return kept

    def _beyond_law(self, name: str, trial: ForceFit) -> bool:
        """Whether an effect explains more than what the law of a named twin may be off by."""
        if name not in self.first.names:
            return True
        twins = {twin for twin, _ in self.first.twins(self.first.names.index(name))}
        if not twins & set(self.named):
            return True
        before, now = self.base.error**2, self.model.error**2
        return now - trial.error**2 >= LAW**2 * (before - now)

    def _without(self, name: str) -> tuple[int, ForceFit]:
        """Return the place of a named effect in the model, and the model fitted without it."""
        index = [effect.name for effect in self.model.effects].index(name)
        rest = [k for k in range(len(self.model.effects)) if k != index]
        return index, fit_force(
            self.problem,
            self.model.values,
            [self.model.effects[k] for k in rest],
            [self.model.strengths[k] for k in rest],
        )

    def take_out(self, name: str) -> None:
        """Take a named effect out of the model; what is left after the joint fit stays."""
        _, self.model = self._without(name)
        self.named.remove(name)

    def drop_needless(self) -> None:
        """Take out names without which the others do as well, or that end out of range."""
        for name in reversed(list(self.named)):
            index, less = self._without(name)
            effect, strength = self.model.effects[index], self.model.strengths[index]
            slack = RANGE_SLACK * self.model.strength_std(index)
            inside = (strength >= effect.low - slack) & (strength <= effect.high + slack)
            if self.model.error > HELPS * less.error or not inside.all():
                self.model = less
                self.named.remove(name)


def inside(effect: Effect, strength: FloatArray) -> FloatArray:
    """Return a start for a fit within an effect's range."""
    start: FloatArray = np.clip(strength, 0.9 * effect.low, 0.9 * effect.high)
    return start


def ratio_of(
    found: ForceCandidates, scores: ForceScores, limits: Mapping[str, float]
) -> FloatArray:
    """Return scores over thresholds."""
    threshold = np.array([limits.get(name, np.inf) for name in found.names])
    out: FloatArray = scores.score / np.maximum(threshold, 1e-30)
    return out


def alarms(found: ForceCandidates, scores: ForceScores, limits: Mapping[str, float]) -> BoolArray:
    """Return which effects are in range, beyond the variants' scores, and matter."""
    ratio = ratio_of(found, scores, limits)
    out: BoolArray = scores.inside & (ratio >= ALARM) & (scores.share >= LEAST_SHARE)
    return out
