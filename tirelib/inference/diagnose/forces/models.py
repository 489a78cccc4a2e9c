"""Models of one force: each is fitted once, and held against left-out points once."""

from collections.abc import Callable, Sequence
from functools import cache, partial
from pathlib import Path

import numpy as np

from tirelib.core.errors import TirelibError
from tirelib.core.forked import forked
from tirelib.effects import Effect
from tirelib.inference.diagnose.forces.fit import ForceFit, MeasuredForce, fit_force, with_effect
from tirelib.inference.diagnose.held_out import Fold, force_folds
from tirelib.inference.identify.span import span
from tirelib.inference.problems.forces import ForceProblem
from tirelib.inference.statistics.hypotheses import Hypotheses
from tirelib.inference.statistics.hypothesis import Hypothesis
from tirelib.inference.statistics.null import PRIOR
from tirelib.inference.statistics.plain import BASE, ROUGHLY, Family, covering, load

TABLES = Path(__file__).parents[2] / "statistics"
"""Where the tables of what plain tires show are (`build/force_tires/learn.py`)."""


@cache
def plain_tires(quantity: str) -> tuple[Family, ...]:
    """Return the families of plain tires that come with the library, for one force."""
    return covering(load(TABLES / f"plain_{quantity}.npz")[0])


class ForceModels:
    """A brush on one force and with further effects (`tirelib.inference.extend.step.Models`).

    Parameters
    ----------
    problem : MeasuredForce
        What is fitted.
    given : ForceProblem
        The same force as the inference sees it, about the brush as its file has it.
    hypotheses : Hypotheses, optional
        About the given problem; made where they are asked for by default.
    """

    def __init__(
        self,
        problem: MeasuredForce,
        given: ForceProblem,
        false_alarm: float,
        hypotheses: Hypotheses | None = None,
        progress: Callable[[str], None] | None = None,
    ) -> None:
        self.problem, self.given, self.false_alarm = problem, given, false_alarm
        self.progress, self._hypotheses = progress, hypotheses
        self.folds = force_folds(problem)
        self._fitted: dict[tuple[str, ...], ForceFit] = {}
        self._held: dict[ForceFit, tuple[float, ...]] = {}

    @property
    def hypotheses(self) -> Hypotheses:
        """Which effects may be missing."""
        if self._hypotheses is None:
            families = plain_tires(self.problem.quantity)
            self._hypotheses = Hypotheses(self.given, families, self.false_alarm, self.progress)
        return self._hypotheses

    def dead(self, effect: Effect) -> str:
        """Return why the points cannot show an effect, or an empty text."""
        return self.given.dead.get(effect.name, "")

    def at(self) -> ForceFit:
        """Return the brush with the effects that it has, fitted; errors as of `fit_force`."""
        if () not in self._fitted:
            start = self.given.start
            self._fitted[()] = fit_force(
                self.problem, self.given.values, start.effects, start.strengths
            )
        return self._fitted[()]

    def added(self, fit: ForceFit) -> tuple[str, ...]:
        """Return the names of the effects that the brush has not and a fit has."""
        return tuple(effect.name for effect in fit.effects[len(self.given.start.effects) :])

    def with_effect(self, before: ForceFit, effect: Effect) -> ForceFit:
        """Return the fit with one effect more; raises TirelibError if it does not settle."""
        key = (*self.added(before), effect.name)
        if key not in self._fitted:
            self._fitted[key] = with_effect(self.problem, before, effect)
        return self._fitted[key]

    def singles(self, effects: Sequence[Effect]) -> dict[str, ForceFit]:
        """Return the brush with each of some effects alone, held out as well; without failures."""
        base = self.at()
        found = forked([partial(self._single, each) for each in effects], [*base.effects, *effects])
        out = {}
        for effect, single in zip(effects, found, strict=True):
            if single is not None:
                fit, errors = single
                out[effect.name] = self._fitted[effect.name,] = fit
                self._held[fit] = errors
        return out

    def _single(self, effect: Effect) -> tuple[ForceFit, tuple[float, ...]] | None:
        try:
            fit = self.with_effect(self.at(), effect)
        except TirelibError:
            return None
        return fit, self.held_out(fit)

    def held_out(self, fit: ForceFit) -> tuple[float, ...]:
        """Return the errors of a model on each fold's points after a fit to the others, SI."""
        if fit not in self._held:
            if self.progress is not None:
                count = len(self.folds)
                self.progress(f"holding out some of the points: {count} fits to the others")
            self._held[fit] = tuple(held_out(self.problem, fit, fold) for fold in self.folds)
        return self._held[fit]

    def floor(self, fit: ForceFit) -> float:
        """Return the part of a model's error that noise and plain tires explain, SI.

        It is NaN where the noise is unknown, or no hypothesis of its effects could be fitted.
        """
        found = self.hypotheses.at(self.added(fit)) if self.given.noise_known else None
        if found is None:
            return float("nan")
        return force_floor(self.problem, fit, found, self.false_alarm)


def held_out(problem: MeasuredForce, fit: ForceFit, fold: Fold) -> float:
    """Return a model's rms on a fold's points after a fit to the others, [N] or [N m].

    The fitted model is the start. NaN where the fit does not settle or the model fails there.
    """
    try:
        trained = fit_force(problem.take(~fold.out), fit.values, fit.effects, fit.strengths)
        seen = problem.take(fold.out)
        found = seen.predict(trained.values, trained.changes)
        return float(np.sqrt(np.mean((seen.measured - found) ** 2)))
    except TirelibError:
        return float("nan")


def force_floor(
    problem: MeasuredForce, fit: ForceFit, hypothesis: Hypothesis, alpha: float
) -> float:
    """Return the part of a fitted brush's rms that noise and what plain tires show explain, SI.

    It is all of it unless the hypothesis that the fit's effects and no other are there is rejected;
    then it is what is left when the model takes what stands out most, and laws of its effects that
    are off by as much as themselves.
    """
    if hypothesis.p > alpha:
        return fit.error
    blocks = hypothesis.fit.rows
    more = [rows for name, rows in blocks.items() if name.startswith(ROUGHLY)]
    if not hypothesis.against.startswith(ROUGHLY):
        more.append(PRIOR * blocks[hypothesis.against])
    basis = span(blocks[BASE].T)
    rows = np.concatenate(more) / problem.scale
    rows = rows - (rows @ basis) @ basis.T
    left = (problem.measured - fit.predicted) / problem.scale
    taken = np.linalg.solve(rows @ rows.T + np.eye(len(rows)), rows @ left) @ rows
    return min(fit.error, problem.scale * float(np.sqrt(np.mean((left - taken) ** 2))))
