"""Models of one force: numbers of the least error, by `tirelib.inference.statistics.posterior`.

The likeliest numbers beside everything that plain tires show leave too much of a real tire's curve
to smooth shapes, which no model has. A model of a force is therefore fitted without these shapes,
all points alike.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from tirelib.core.arrays import FloatArray, IntArray, rms
from tirelib.core.errors import TirelibError
from tirelib.effects import Effect
from tirelib.inference.diagnose.forces.case import ForceCase
from tirelib.inference.diagnose.held_out import Fold, force_folds
from tirelib.inference.diagnose.models import Models
from tirelib.inference.identify.brush_law import SPECS
from tirelib.inference.identify.span import span
from tirelib.inference.problems.forces import ForceProblem
from tirelib.inference.statistics.hypotheses import Hypotheses
from tirelib.inference.statistics.hypothesis import Hypothesis
from tirelib.inference.statistics.null import PRIOR
from tirelib.inference.statistics.plain import BASE, ROUGHLY, Family, covering, load
from tirelib.inference.statistics.posterior import Posterior, posterior

TABLES = Path(__file__).parents[2] / "statistics"
"""Where the tables of what plain tires show are (`build/force_tires/learn.py`)."""

SETTLED = 1e-3
"""Fall of the cost that a step has to promise, or a fit has settled: numbers that its points hardly
hold move what is held out. On 60 steady runs the error there is 42.4 with .1, and 43.0 from .001
on."""


@cache
def plain_tires(quantity: str) -> tuple[Family, ...]:
    """Return the families of plain tires that come with the library, for one force."""
    return covering(load(TABLES / f"plain_{quantity}.npz")[0])


@dataclass(frozen=True, slots=True, eq=False)
class ForceFit:
    """A fitted brush.

    Attributes
    ----------
    values : mapping
        Parameters of the brush, SI.
    covariance : shape (p, p)
        Covariance of the coordinates and of strengths in ranges, with errors that go together
        within a block.
    error : float
        Rms of measured less model over all points of the campaign, in the unit of documents.
    """

    problem: ForceProblem
    fit: Posterior
    values: Mapping[str, float]
    covariance: FloatArray
    error: float

    @property
    def effects(self) -> tuple[Effect, ...]:
        """That the model has."""
        return self.fit.effects

    @property
    def strengths(self) -> tuple[FloatArray, ...]:
        """One array of components per effect, in its unit."""
        return self.fit.strengths

    @property
    def rest(self) -> FloatArray:
        """Measured less model at the points of the fit, (n,), [N] or [N m]."""
        found: FloatArray = self.fit.solved.rest
        return found

    def strength_std(self, index: int) -> FloatArray:
        """Return standard deviations of an effect's strength, in its unit."""
        deviation = np.sqrt(np.diag(self.covariance)[self.fit.place(index)])
        return np.asarray(self.effects[index].scale * deviation)

    def value_std(self, name: str) -> float:
        """Return the standard deviation of a fitted parameter, SI."""
        at = self.problem.names.index(name)
        unit = SPECS[name].slope(self.values[name])
        return float(abs(unit) * np.sqrt(self.covariance[at, at]))


class ForceModels(Models[ForceFit, float]):
    """A brush on one force and with further effects.

    Attributes
    ----------
    problem : ForceProblem
        About the brush as its file has it.
    """

    def __init__(
        self,
        case: ForceCase,
        hypotheses: Hypotheses,
        progress: Callable[[str], None] | None = None,
    ) -> None:
        super().__init__(hypotheses, force_folds(case.bench), progress)
        assert isinstance(hypotheses.problem, ForceProblem)  # noqa: S101 - of a force
        self.case, self.problem = case, hypotheses.problem

    def _fit(self, names: Sequence[str], near: ForceFit | None) -> ForceFit:
        among, start = self.hypotheses, near.fit.point if near else self.problem.start
        effects = [*among.had, *(among.effects[name] for name in names)]
        every = np.ones(self.problem.present, dtype=bool)
        fit = self._least(self.problem.part(every, start), effects)
        values = self.problem.constants(fit.point)
        error = self.case.error(values, fit.effects, fit.strengths)
        block = self.case.bench.points.data.block
        return ForceFit(self.problem, fit, values, _covariance(fit, self.case.scale, block), error)

    def _least(self, problem: ForceProblem, effects: Sequence[Effect]) -> Posterior:
        """Return the fit of least squares to the points of a problem, from its start."""
        scale = self.case.scale
        start = problem.start
        return posterior(
            problem, effects, {}, lambda rows: rows / scale, start=start, settled=SETTLED
        )

    def _left_out(self, fit: ForceFit, fold: Fold) -> float:
        try:
            trained = self._least(self.problem.part(~fold.out, fit.fit.point), fit.effects)
            seen = self.problem.part(fold.out, trained.point)
            return self.case.factor * rms(seen.solve(seen.start).rest)
        except TirelibError:
            return float("nan")

    def held_out(self, fit: ForceFit) -> tuple[float, ...]:
        """Return the errors of a model on each fold's points; NaN where there is none."""
        return self.left_out(fit)

    def floor(self, fit: ForceFit) -> float:
        """Return the part of a model's error that noise and plain tires explain.

        It is NaN where the noise is unknown, or no hypothesis of its effects could be fitted.
        """
        found = self.hypotheses.at(self.added(fit)) if self.problem.noise_known else None
        if found is None:
            return float("nan")
        return force_floor(fit, found, self.case.scale, self.hypotheses.false_alarm)


def _covariance(fit: Posterior, scale: float, block: IntArray) -> FloatArray:
    """Return the covariance of a least-squares fit, with errors that go together within a block."""
    rows, rest, p = fit.rows[BASE] / scale, fit.solved.rest / scale, len(fit.widths)
    number = np.asarray(np.unique(block, return_inverse=True)[1]).ravel()
    blocks = int(number.max()) + 1
    if blocks > 2 * p:
        score = np.stack([np.bincount(number, row * rest) for row in rows])
        inside = score @ score.T * blocks / (blocks - p)
    else:
        inside = rows @ rows.T * float(rest @ rest) / max(rest.size - p, 1)
    return np.asarray(fit.covariance @ inside @ fit.covariance)


def force_floor(fit: ForceFit, hypothesis: Hypothesis, scale: float, alpha: float) -> float:
    """Return the part of a fitted brush's error that noise and what plain tires show explain.

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
    rows = np.concatenate(more) / scale
    rows, left = rows - (rows @ basis) @ basis.T, fit.rest / scale
    taken = np.linalg.solve(rows @ rows.T + np.eye(len(rows)), rows @ left) @ rows
    return fit.error * min(rms(left - taken) / rms(left), 1.0)
