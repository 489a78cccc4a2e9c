"""Models of strain about one problem: each is fitted once, and held against left-out runs once.

Fits are by `tirelib.inference.statistics.posterior`. The numbers are the likeliest ones beside
everything that plain tires show; the model that they make is judged alone, without what plain
tires show.
"""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.core.errors import ConvergenceError, TirelibError
from tirelib.effects import Effect
from tirelib.inference.compare.error import ModelError, Yardstick
from tirelib.inference.compare.model import TireModel
from tirelib.inference.diagnose.held_out import Fold, strain_folds
from tirelib.inference.diagnose.models import Models
from tirelib.inference.identify.campaign_data import StraightRuns
from tirelib.inference.identify.delay import UNIT
from tirelib.inference.problems.strain import StrainProblem
from tirelib.inference.statistics.hypotheses import Hypotheses
from tirelib.inference.statistics.hypothesis import Hypothesis
from tirelib.inference.statistics.plain import BASE
from tirelib.inference.statistics.posterior import ROUGH, Posterior, posterior
from tirelib.inference.statistics.problem import Point
from tirelib.model.base import move
from tirelib.physics.rolling.solve import Rolling

LEAST_GAIN = 0.02
"""Share of the squared error that a step towards the least error takes away, or it is the last; so
does a new whitening about the model that was found. On 8 runs with a sidewall that softens by .3
the given model's error is 36.8 and the least one 25.5, with half and double of this number 25.4 and
25.5."""
LEAST_ROUNDS = 5
"""Most whitenings on the way to the least error."""


@dataclass(frozen=True, slots=True, eq=False)
class Fitted:
    """A fitted model.

    Attributes
    ----------
    hypotheses : Hypotheses
        About that problem.
    hypothesis : Hypothesis
        That the model's effects and no other are there.
    values : mapping
        The tire's numbers, SI.
    reached : ModelError
        Error of the model without what plain tires show.
    """

    problem: StrainProblem
    hypotheses: Hypotheses
    hypothesis: Hypothesis
    values: Mapping[str, float | FloatArray]
    reached: ModelError

    @classmethod
    def of(cls, hypotheses: Hypotheses, hypothesis: Hypothesis, yardstick: Yardstick) -> "Fitted":
        """Return the model of a hypothesis.

        Raises
        ------
        CalibrationError
            If the model alone, without what plain tires show, has no solution.
        """
        problem, fit = problem_of(hypotheses), hypothesis.fit
        values = move(problem.values, fit.point.base[:-1], problem.free)
        model = TireModel.fitted(values, fit.effects, fit.strengths)
        reached = yardstick.error(model, start=fit.solved.model.rolling)
        return cls(problem, hypotheses, hypothesis, values, reached)

    @property
    def effects(self) -> tuple[Effect, ...]:
        """That the model has."""
        return self.hypothesis.fit.effects

    @property
    def strengths(self) -> tuple[FloatArray, ...]:
        """One array of components per effect, in its unit."""
        return self.hypothesis.fit.strengths

    @property
    def model(self) -> TireModel:
        """The tire with its effects, without the delay: what a model file holds."""
        return TireModel.fitted(self.values, self.effects, self.strengths)

    @property
    def error(self) -> float:
        """Error of the model alone, in the unit of `reached`."""
        return self.reached.value

    @property
    def rolling(self) -> Rolling:
        """The solution at the runs: a start for one nearby."""
        found: Rolling = self.hypothesis.fit.solved.model.rolling
        return found

    def strength_std(self, index: int) -> FloatArray:
        """Return standard deviations of an effect's strength, in its unit."""
        return self.hypothesis.fit.std(index)

    @property
    def covariance(self) -> FloatArray:
        """Covariance of the tire's coordinates, the delay, and strengths in ranges, (n, n)."""
        return self.hypothesis.fit.covariance

    def without_runs(self, out: BoolArray) -> tuple[TireModel, float]:
        """Return the model fitted without some of the runs, and the delay [s] found there.

        Smooth misfits of plain tires take part in the fit; other effects do not.

        Raises
        ------
        TirelibError
            If the fit does not settle.
        """
        among, base = self.hypotheses, self.hypothesis.fit.point.base
        start = Point(base, self.effects, self.strengths)
        part = self.problem.part(~out, start)
        found = posterior(
            part,
            self.effects,
            among.spread,
            part.whitener(among.own),
            start=start,
            settled=ROUGH,
        )
        return _model_of(part, found), UNIT * float(found.point.base[-1])

    def held_out(self, fold: Fold, yardstick: Yardstick) -> ModelError | None:
        """Return the error on a fold's runs after a fit to the other runs, with its residual.

        The yardstick is that of the campaign, so that the unit is that of every other error of it.
        None where the fit does not settle or the model fails there.
        """
        try:
            trained, delay = self.without_runs(fold.out)
            start = self.rolling.take(fold.out)
            return yardstick.take(fold.out).error(trained, delay, start=start)
        except TirelibError:
            return None

    def least_error(self, given: TireModel, yardstick: Yardstick) -> tuple[ModelError, ModelError]:
        """Return the error of the model as it is given, and the least one with other numbers.

        The likeliest numbers beside what plain tires show are not those of the least error. These
        are found by least squares from both, and the best of the three counts. The given model has
        the same effects, with the numbers of its file.

        Raises
        ------
        CalibrationError
            If the given model has no solution.
        """
        before = yardstick.error(given, start=self.rolling)
        point = Point(self.hypothesis.fit.point.base, self.effects, self.strengths)
        alone = self.problem.part(np.ones(len(yardstick.at), dtype=bool), point)
        reached, best = self.reached, min(before, self.reached, key=_value)
        found: Posterior | None = None
        with suppress(TirelibError):
            for _ in range(LEAST_ROUNDS):
                found = posterior(
                    alone,
                    self.effects,
                    {},
                    partial(_flat, reached),
                    near=found,
                    start=None if found else point,
                    settled=LEAST_GAIN * yardstick.strain.size,
                )
                start = found.solved.model.rolling
                reached = yardstick.error(_model_of(alone, found), start=start)
                last, best = best, min(best, reached, key=_value)
                if reached.value**2 > (1.0 - LEAST_GAIN) * last.value**2:
                    break
        return before, best


def problem_of(hypotheses: Hypotheses) -> StrainProblem:
    """Return the problem that hypotheses of strain are about."""
    problem = hypotheses.problem
    assert isinstance(problem, StrainProblem)  # noqa: S101 - of strain
    return problem


def _model_of(problem: StrainProblem, found: Posterior) -> TireModel:
    values = move(problem.values, found.point.base[:-1], problem.free)
    return TireModel.fitted(values, found.effects, found.strengths)


def _flat(error: ModelError, rows: FloatArray) -> FloatArray:
    """Return rows (k, n_runs, n_phi) in the unit of an error, (k, n)."""
    return error.white_of(rows).reshape(*rows.shape[:-2], -1)


def _value(error: ModelError) -> float:
    return error.value


def floor_of(error: ModelError, hypothesis: Hypothesis, alpha: float) -> float:
    """Return the part of an error that noise and what plain tires show explain, in its unit.

    It is all of the error of the model that the hypothesis describes, unless the hypothesis is
    rejected; then it is what is left when the model takes what the largest standard score is of,
    and its numbers follow, to first order and as their priors allow.
    """
    if hypothesis.p > alpha or error.whiten is None:
        return error.value
    fit = hypothesis.fit
    base = fit.rows[BASE]
    rows = error.whiten(np.concatenate([base, fit.rows[hypothesis.against]]))
    rows = rows.reshape(len(rows), -1)
    rest = error.whiten(error.rest[None]).ravel()
    prior = np.eye(len(base), len(rows)) / fit.widths[:, None]
    follows, *_ = np.linalg.lstsq(
        np.concatenate([rows.T, prior]), np.concatenate([rest, np.zeros(len(base))]), rcond=None
    )
    return min(error.value, float(np.sqrt(np.mean((rest - follows @ rows) ** 2))))


class StrainModels(Models[Fitted, ModelError | None]):
    """A model on straight runs and with further effects.

    Attributes
    ----------
    problem : StrainProblem
        Its whitening is about the fitted model.
    """

    def __init__(
        self, hypotheses: Hypotheses, progress: Callable[[str], None] | None = None
    ) -> None:
        self.problem = problem_of(hypotheses)
        self.yardstick = Yardstick.of(self.problem.runs)
        super().__init__(hypotheses, strain_folds(self.problem.data), progress)
        self._least: dict[Fitted, tuple[ModelError, ModelError]] = {}

    @property
    def runs(self) -> StraightRuns:
        """The straight runs."""
        return self.problem.runs

    def _fit(self, names: Sequence[str], near: Fitted | None) -> Fitted:
        found = self.hypotheses.at(names, None if near is None else near.hypothesis)
        if found is None:
            raise ConvergenceError(
                f"effect {names[-1]!r}: its fit did not settle; the model with it does not "
                "fit these runs: look at them with `tirelib compare`, or add another effect "
                "first",
                self.problem.values,
                np.inf,
            )
        return Fitted.of(self.hypotheses, found, self.yardstick)

    def _left_out(self, fit: Fitted, fold: Fold) -> ModelError | None:
        return fit.held_out(fold, self.yardstick)

    def least_error(
        self, fit: Fitted, given: TireModel | None = None, held: Sequence[Fitted] = ()
    ) -> tuple[ModelError, ModelError]:
        """Return `Fitted.least_error`; the given model is as it was fitted by default.

        What `held` models leave on each fold is found at the same time.
        """
        if fit not in self._least:
            call = partial(fit.least_error, given or fit.model, self.yardstick)
            (self._least[fit],) = self.find(held, [call])
        return self._least[fit]

    def held_out(self, fit: Fitted) -> tuple[float, ...]:
        """Return the errors of a model on each fold's runs; NaN where there is none."""
        return tuple(np.nan if error is None else error.value for error in self.left_out(fit))

    def floor(self, fit: Fitted) -> float:
        """Return the part of a model's error that noise and what plain tires show explain."""
        return floor_of(fit.reached, fit.hypothesis, self.hypotheses.false_alarm)
