"""A model with effects, fitted to straight runs by `tirelib.inference.statistics.posterior`.

The numbers are the likeliest ones beside everything that plain tires show; the model that they make
is judged alone, without what plain tires show.
"""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import partial

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.core.errors import TirelibError
from tirelib.effects import Effect
from tirelib.inference.compare.error import ModelError, Yardstick
from tirelib.inference.compare.model import TireModel
from tirelib.inference.identify.delay import UNIT
from tirelib.inference.problems.strain import StrainProblem
from tirelib.inference.statistics.hypotheses import Hypotheses
from tirelib.inference.statistics.hypothesis import Hypothesis
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
        About the problem that it is fitted to.
    hypothesis : Hypothesis
        That its effects and no other are there.
    values : mapping
        The tire's numbers, SI.
    reached : ModelError
        Error of the model without what plain tires show.
    """

    hypotheses: Hypotheses
    hypothesis: Hypothesis
    values: Mapping[str, float | FloatArray]
    reached: ModelError

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
        among, fit = self.hypotheses, self.hypothesis.fit
        start = Point(fit.point.base, self.effects, self.strengths)
        assert isinstance(among.problem, StrainProblem)  # noqa: S101 - of strain
        part = among.problem.part(~out, start)
        found = posterior(
            part,
            self.effects,
            among.spread,
            part.whitener(among.own),
            start=start,
            settled=ROUGH,
        )
        values = move(part.values, found.point.base[:-1], part.free)
        model = TireModel.fitted(values, found.effects, found.strengths)
        return model, UNIT * float(found.point.base[-1])


def fitted(hypotheses: Hypotheses, hypothesis: Hypothesis, yardstick: Yardstick) -> Fitted:
    """Return the model of a hypothesis.

    Raises
    ------
    CalibrationError
        If the model alone, without what plain tires show, has no solution.
    """
    problem, fit = hypotheses.problem, hypothesis.fit
    assert isinstance(problem, StrainProblem)  # noqa: S101 - of strain
    values = move(problem.values, fit.point.base[:-1], problem.free)
    model = TireModel.fitted(values, fit.effects, fit.strengths)
    reached = yardstick.error(model, start=fit.solved.model.rolling)
    return Fitted(hypotheses, hypothesis, values, reached)


def least_error(
    model: Fitted, given: TireModel, yardstick: Yardstick
) -> tuple[ModelError, ModelError]:
    """Return the error of a model as it is given, and the least one with other numbers.

    The likeliest numbers beside what plain tires show are not those of the least error. These are
    found by least squares from both, and the best of the three counts.

    Parameters
    ----------
    model : Fitted
    given : TireModel
        The same effects, with the numbers of its file.
    yardstick : Yardstick

    Raises
    ------
    CalibrationError
        If the given model has no solution.
    """
    before = yardstick.error(given, start=model.rolling)
    among, fit = model.hypotheses, model.hypothesis.fit
    assert isinstance(among.problem, StrainProblem)  # noqa: S101 - of strain
    point = Point(fit.point.base, model.effects, model.strengths)
    alone = among.problem.part(np.ones(len(yardstick.at), dtype=bool), point)
    reached, best = model.reached, min(before, model.reached, key=_value)
    found: Posterior | None = None
    with suppress(TirelibError):
        for _ in range(LEAST_ROUNDS):
            found = posterior(
                alone,
                model.effects,
                {},
                partial(_flat, reached),
                near=found,
                start=None if found else point,
                settled=LEAST_GAIN * yardstick.strain.size,
            )
            numbers = move(alone.values, found.point.base[:-1], alone.free)
            least = TireModel.fitted(numbers, found.effects, found.strengths)
            reached = yardstick.error(least, start=found.solved.model.rolling)
            last, best = best, min(best, reached, key=_value)
            if reached.value**2 > (1.0 - LEAST_GAIN) * last.value**2:
                break
    return before, best


def _flat(error: ModelError, rows: FloatArray) -> FloatArray:
    """Return rows (k, n_runs, n_phi) in the unit of an error, (k, n)."""
    return error.white_of(rows).reshape(*rows.shape[:-2], -1)


def _value(error: ModelError) -> float:
    return error.value
