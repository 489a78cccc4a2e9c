"""One effect of strain more or less: the model fitted to the straight runs, judged on others."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.compare.error import ModelError, Yardstick
from tirelib.compare.model import Model
from tirelib.diagnose.diagnose import FALSE_ALARM, plain_tires
from tirelib.diagnose.fitted import Fitted, fitted, least_error
from tirelib.diagnose.floor import floor_of
from tirelib.diagnose.held_out import Fold, folds, held_out
from tirelib.effects import CATALOGUE, Effect
from tirelib.errors import ConvergenceError, ParameterError
from tirelib.extend.step import Step, added, removed
from tirelib.identify.campaign_data import StraightRuns
from tirelib.infer.select import Hypotheses
from tirelib.infer.strain import StrainProblem
from tirelib.infer.strain_living import in_base
from tirelib.threads import one_thread


@dataclass(frozen=True, eq=False)
class Extension(Step[Fitted]):
    """A step of a model of strain.

    Attributes
    ----------
    given, refitted, reached : ModelError
        Of the model as it was given, with the numbers of the least error, and with the change.
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
    subject = _Strain(runs, model, effect, progress)
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
    subject = _Strain(runs, model, effect, progress)
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
        effect: Effect,
        progress: Callable[[str], None] | None,
    ) -> None:
        self.runs, self.model, self.progress = runs, model, progress
        self.own = [effect]  # it may be one of the user's
        self.name = model.name
        self.used = [each for each in model.used if each.effect.hook != "brush"]
        self.yardstick = Yardstick.of(runs)
        self.seen: list[tuple[ModelError | None, ...]] = []

    def extension(self, step: Step[Fitted]) -> Extension:
        """Return a step with its runs and errors."""
        given, refitted = least_error(step.before, self.model, self.yardstick)
        return Extension(
            **vars(step),
            given=given,
            refitted=refitted,
            reached=step.after.reached,
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

    def fitted(self) -> Fitted:
        """Return the model as it is, fitted."""
        strengths = [np.atleast_1d(np.asarray(x.strength, dtype=float)) for x in self.used]
        return self._fitted(self.model.values, self.effects, strengths)

    def _fitted(
        self,
        values: Mapping[str, float | FloatArray],
        effects: Sequence[Effect],
        strengths: Sequence[FloatArray],
    ) -> Fitted:
        """Return the model of a tire and effects, fitted."""
        catalogue = [*CATALOGUE.values(), *(e for e in self.own if e.name not in CATALOGUE)]
        problem = StrainProblem(self.runs, values, catalogue, effects, strengths)
        among = Hypotheses(problem, plain_tires(), FALSE_ALARM, self.progress)
        return fitted(among, among.base, self.yardstick)

    def dead(self, before: Fitted, effect: Effect) -> str:
        """Return why the runs cannot show an effect, or an empty text."""
        return str(before.hypotheses.problem.dead.get(effect.name, ""))

    def with_effect(self, before: Fitted, effect: Effect) -> Fitted:
        """Return the fit with one effect more."""
        found = before.hypotheses.at((effect.name,))
        if found is None:
            raise ConvergenceError(
                f"effect {effect.name!r}: its fit did not settle; the model with it does not "
                "fit these runs: look at them with `tirelib compare`, or add another effect first",
                before.values,
                np.inf,
            )
        return fitted(before.hypotheses, found, self.yardstick)

    def without(self, before: Fitted, kept: Sequence[int]) -> Fitted:
        """Return the fit with some of the effects."""
        return self._fitted(
            before.values,
            [before.effects[k] for k in kept],
            [before.strengths[k] for k in kept],
        )

    def left_out(self) -> Sequence[Fold]:
        """Return the runs that are left out in turn."""
        return folds(self.runs.data(with_deflection=False))

    def held_out(self, fit: Fitted, left: Sequence[Fold]) -> tuple[float, ...]:
        """Return the errors on left-out runs."""
        found = held_out(fit, tuple(left), self.yardstick)
        self.seen.append(found)
        return tuple(float("nan") if error is None else error.value for error in found)

    def floor(self, after: Fitted) -> float:
        """Return the error that noise and what plain tires show explain."""
        return floor_of(after.reached, after.hypothesis, FALSE_ALARM)
