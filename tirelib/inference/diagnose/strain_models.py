"""Models of strain about one problem: each is fitted once, and held against left-out runs once."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from tirelib.core.errors import ConvergenceError
from tirelib.core.forked import forked
from tirelib.effects import Effect
from tirelib.inference.compare.error import ModelError, Yardstick
from tirelib.inference.compare.model import TireModel
from tirelib.inference.diagnose.fitted import Fitted, fitted, least_error
from tirelib.inference.diagnose.floor import floor_of
from tirelib.inference.diagnose.held_out import folds, held_out, values_of_errors
from tirelib.inference.identify.campaign_data import StraightRuns
from tirelib.inference.problems.strain import StrainProblem
from tirelib.inference.statistics.select import Hypotheses

Progress = Callable[[str], None]


class StrainModels:
    """A model on straight runs and with further effects (`tirelib.inference.extend.step.Models`).

    Parameters
    ----------
    hypotheses : Hypotheses
        About the problem of strain.
    progress : callable, optional

    Attributes
    ----------
    yardstick : Yardstick
    folds : tuple of Fold
        What can be left out in turn.
    """

    def __init__(self, hypotheses: Hypotheses, progress: Progress | None = None) -> None:
        self.hypotheses, self.progress = hypotheses, progress
        self.yardstick = Yardstick.of(self.problem.runs)
        self.folds = folds(self.problem.data)
        self._fitted: dict[frozenset[str], Fitted] = {}
        self._held: dict[Fitted, tuple[ModelError | None, ...]] = {}
        self._least: dict[Fitted, tuple[ModelError, ModelError]] = {}

    @property
    def problem(self) -> StrainProblem:
        """The problem, its whitening about the fitted model."""
        problem = self.hypotheses.problem
        assert isinstance(problem, StrainProblem)  # noqa: S101 - of strain
        return problem

    @property
    def runs(self) -> StraightRuns:
        """The straight runs."""
        return self.problem.runs

    def dead(self, effect: Effect) -> str:
        """Return why the runs cannot show an effect, or an empty text."""
        return self.problem.dead.get(effect.name, "")

    def at(self, names: Sequence[str] = (), near: Fitted | None = None) -> Fitted:
        """Return the model with further effects, all fitted at once.

        `near` is a model from whose fit this one starts.

        Raises
        ------
        ConvergenceError
            If no fit settles.
        CalibrationError
            If the model alone, without what plain tires show, has no solution.
        """
        key = frozenset(names)
        if key not in self._fitted:
            found = self.hypotheses.at(names, None if near is None else near.hypothesis)
            if found is None:
                raise ConvergenceError(
                    f"effect {names[-1]!r}: its fit did not settle; the model with it does not "
                    "fit these runs: look at them with `tirelib compare`, or add another effect "
                    "first",
                    self.problem.values,
                    np.inf,
                )
            self._fitted[key] = fitted(self.hypotheses, found, self.yardstick)
        return self._fitted[key]

    def with_effect(self, before: Fitted, effect: Effect) -> Fitted:
        """Return the fit with one effect more; errors as of `at`."""
        return self.at((*self.hypotheses.added(before.hypothesis), effect.name), before)

    def least_error(
        self, fit: Fitted, given: TireModel | None = None
    ) -> tuple[ModelError, ModelError]:
        """Return the error of a model as it is given, and the least one with other numbers.

        Parameters
        ----------
        fit : Fitted
        given : Model, optional
            The model of the fit as its file has it; as it was fitted by default.
        """
        self.find(fit, given)
        return self._least[fit]

    def left_out(self, *fits: Fitted) -> list[tuple[ModelError | None, ...]]:
        """Return the errors of models on each fold's runs, as `held_out`."""
        self.find(held=fits)
        return [self._held[fit] for fit in fits]

    def find(
        self, fit: Fitted | None = None, given: TireModel | None = None, held: Sequence[Fitted] = ()
    ) -> None:
        """Find the least error of a model, and errors of models on each fold's runs, all at once.

        The arguments are those of `least_error` and `left_out`, which only look up what is found.
        """
        calls: list[Callable[[], Any]] = []
        if fit is not None and fit not in self._least:
            calls.append(partial(least_error, fit, given or fit.model, self.yardstick))
        ahead = len(calls)
        new = [each for each in dict.fromkeys(held) if each not in self._held]
        calls += [
            partial(held_out, each, fold, self.yardstick) for each in new for fold in self.folds
        ]
        if len(calls) > ahead and self.progress is not None:
            self.progress(f"holding out some of the runs: {len(calls) - ahead} fits to the others")
        found = forked(calls)
        if fit is not None and ahead:
            self._least[fit] = found[0]
        for k, each in enumerate(new):
            first = ahead + k * len(self.folds)
            self._held[each] = tuple(found[first : first + len(self.folds)])

    def held_out(self, fit: Fitted) -> tuple[float, ...]:
        """Return the errors of a model on each fold's runs; NaN where there is none."""
        return values_of_errors(self.left_out(fit)[0])

    def floor(self, fit: Fitted) -> float:
        """Return the part of a model's error that noise and what plain tires show explain."""
        return floor_of(fit.reached, fit.hypothesis, self.hypotheses.false_alarm)
