"""One effect of strain more or less: the model fitted to the straight runs, judged on others."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.compare.error import ModelError, Yardstick
from tirelib.compare.model import Model
from tirelib.diagnose.diagnose import FALSE_ALARM, plain_tires
from tirelib.diagnose.floor import floor_of
from tirelib.diagnose.held_out import Fold, folds, held_out
from tirelib.diagnose.refit import Refit, refit
from tirelib.effects import CATALOGUE, Effect
from tirelib.errors import ParameterError
from tirelib.extend.step import Step, added, removed
from tirelib.identify.campaign_data import StraightRuns
from tirelib.identify.span import span
from tirelib.infer.select import Hypotheses
from tirelib.infer.strain import StrainProblem, in_base
from tirelib.threads import one_thread

START_INSIDE = 0.9
"""Share of the range within which a refit starts."""


@dataclass(frozen=True, eq=False)
class Extension(Step[Refit]):
    """A step of a model of strain.

    Attributes
    ----------
    given, refitted, reached : ModelError
        Of the model as it was given, with its numbers fitted anew, and with the change.
    out_before, out_after : tuple of ModelError or None
        On what was held out, one per fold.
    runs : StraightRuns
    """

    given: ModelError
    refitted: ModelError
    reached: ModelError
    out_before: tuple[ModelError | None, ...]
    out_after: tuple[ModelError | None, ...]
    runs: StraightRuns


@one_thread()
def add_effect(
    runs: StraightRuns,
    model: Model,
    effect: Effect,
    *,
    progress: Callable[[str], None] | None = None,
) -> Extension:
    """Return a model with one effect more; values and all strengths are fitted anew.

    Parameters
    ----------
    runs : StraightRuns
    model : Model
    effect : Effect
    progress : callable, optional

    Raises
    ------
    ParameterError
        If the model has the effect already, or strain cannot have it.
    CalibrationError
        If the campaign cannot show it.
    ConvergenceError
        If a fit does not settle.
    """
    subject = _Strain(runs, model, progress)
    return subject.extension(added(subject, effect))


def remove_effect(
    runs: StraightRuns,
    model: Model,
    effect: Effect,
    *,
    progress: Callable[[str], None] | None = None,
) -> Extension:
    """Return a model without one of its effects; the rest is fitted anew.

    Parameters and errors as for `add_effect`.
    """
    subject = _Strain(runs, model, progress)
    return subject.extension(removed(subject, effect))


def known_effect(name: str, catalogue: Mapping[str, Effect]) -> Effect:
    """Return an effect by name.

    Raises
    ------
    ParameterError
        If there is none; with the nearest names.
    """
    if name in catalogue:
        return catalogue[name]
    near = get_close_matches(name, catalogue, n=3)
    hint = f"did you mean {' or '.join(near)}?" if near else f"known: {', '.join(catalogue)}"
    raise ParameterError(f"effect {name!r} is not known; {hint}")


class _Strain:
    """A model of strain on straight runs (`tirelib.extend.step.Subject`)."""

    acts_on = "strain"

    def __init__(
        self,
        runs: StraightRuns,
        model: Model,
        progress: Callable[[str], None] | None,
    ) -> None:
        self.runs, self.model, self.progress = runs, model, progress
        self.name = model.name
        self.used = [each for each in model.used if each.effect.hook != "brush"]
        self.data = runs.data(with_deflection=False)
        self.yardstick = Yardstick.of(runs)
        self.seen: list[tuple[ModelError | None, ...]] = []

    def extension(self, step: Step[Refit]) -> Extension:
        """Return a step with its runs and errors."""
        near = step.before.correction.contact
        return Extension(
            **vars(step),
            given=self.yardstick.error(self.model, start=near),
            refitted=self.yardstick.error(step.before.model, start=near),
            reached=self.yardstick.error(step.after.model, start=step.after.correction.contact),
            out_before=self.seen[0],
            out_after=self.seen[1],
            runs=self.runs,
        )

    @property
    def effects(self) -> list[Effect]:
        """That the model has and strain shows."""
        return [each.effect for each in self.used]

    def refuse(self, effect: Effect) -> None:
        """Raise ParameterError if the base fits an effect, or it is one of the brush."""
        if effect.name in in_base(self.model.values):
            raise ParameterError(
                f"effect {effect.name!r}: the base model has it as a fitted number; choose another "
                "one"
            )
        if effect.hook == "brush":
            raise ParameterError(
                f"effect {effect.name!r} acts on the brush, which strain does not show; choose an "
                "effect of another stage"
            )

    def fitted(self) -> Refit:
        """Return the model as it is, fitted."""
        strengths = [np.atleast_1d(np.asarray(x.strength, dtype=float)) for x in self.used]
        return refit(self.data, self.model.values, self.effects, strengths, progress=self.progress)

    def dead(self, before: Refit, effect: Effect) -> str:
        """Return why the runs cannot show an effect, or an empty text."""
        return self._problem(before, [effect]).dead.get(effect.name, "")

    def _problem(self, before: Refit, catalogue: Sequence[Effect]) -> StrainProblem:
        effects, strengths = before.effects, before.strengths
        return StrainProblem(self.runs, before.values, catalogue, effects, strengths)

    def with_effect(self, before: Refit, effect: Effect) -> Refit:
        """Return the fit with one effect more, from what serves best to first order."""
        problem = self._problem(before, [effect])
        rows = before.whiten(problem.signature(problem.solve(problem.start), effect))
        rows = rows.reshape(effect.components, -1)
        basis = span(before.whiten(before.slopes).reshape(len(before.slopes), -1).T)
        rest = before.whiten(self.data.strain - before.waveform).ravel()
        own = rows - (rows @ basis) @ basis.T
        strength = effect.scale * np.linalg.lstsq(own.T, rest, rcond=None)[0]
        start: FloatArray = np.clip(strength, START_INSIDE * effect.low, START_INSIDE * effect.high)
        return refit(
            self.data,
            before.values,
            [*before.effects, effect],
            [*before.strengths, start],
            delay=before.delay,
            progress=self.progress,
        )

    def without(self, before: Refit, kept: Sequence[int]) -> Refit:
        """Return the fit with some of the effects."""
        return refit(
            self.data,
            before.values,
            [before.effects[k] for k in kept],
            [before.strengths[k] for k in kept],
            delay=before.delay,
            progress=self.progress,
        )

    def left_out(self) -> Sequence[Fold]:
        """Return the runs that are left out in turn."""
        return folds(self.data)

    def held_out(self, fit: Refit, left: Sequence[Fold]) -> tuple[float, ...]:
        """Return the errors on left-out runs."""
        found = held_out(self.data, fit, tuple(left), self.yardstick, progress=self.progress)
        self.seen.append(found)
        return tuple(float("nan") if error is None else error.value for error in found)

    def floor(self, after: Refit) -> float:
        """Return the error that noise and what plain tires show explain."""
        error = self.yardstick.error(after.model, start=after.correction.contact)
        problem = self._problem(after, list(CATALOGUE.values()))
        base = Hypotheses(problem, plain_tires(), FALSE_ALARM, self.progress).base
        return floor_of(error, base, FALSE_ALARM)
