"""One effect more or less: a model fitted to straight runs or to a force, judged on others."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches

import numpy as np

from tirelib.core.errors import ParameterError, TirelibError
from tirelib.core.threads import one_thread
from tirelib.effects import CATALOGUE, Effect
from tirelib.inference.compare.error import ModelError
from tirelib.inference.compare.model import TireModel
from tirelib.inference.diagnose.diagnose import FALSE_ALARM, plain_tires
from tirelib.inference.diagnose.forces.case import ForceCase
from tirelib.inference.diagnose.forces.models import ForceFit, ForceModels
from tirelib.inference.diagnose.forces.models import plain_tires as plain_of_force
from tirelib.inference.diagnose.strain_models import Fitted, StrainModels
from tirelib.inference.extend.step import (
    Step,
    added,
    refuse_absent,
    refuse_second,
    removed,
    without,
)
from tirelib.inference.identify.campaign_data import StraightRuns
from tirelib.inference.problems.strain import StrainProblem
from tirelib.inference.problems.strain_living import in_base
from tirelib.inference.statistics.hypotheses import Hypotheses

Progress = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Extension(Step[Fitted]):
    """A step of a model of strain.

    Attributes
    ----------
    given, refitted, reached : ModelError
        Errors of the model as it was given, with the numbers of the least error, and with the
        change.
    out_before, out_after : tuple of ModelError or None
        On what was held out, one per fold.
    """

    given: ModelError
    refitted: ModelError
    reached: ModelError
    out_before: tuple[ModelError | None, ...]
    out_after: tuple[ModelError | None, ...]
    runs: StraightRuns

    @property
    def unit(self) -> str:
        """Unit of errors."""
        return self.given.unit

    @property
    def errors(self) -> dict[str, float]:
        """Errors as the model's history has them."""
        return {
            "error_before": self.given.value,
            "error_after": self.reached.value,
            "floor": self.floor,
            **self.pooled,
        }


@dataclass(frozen=True, eq=False)
class ForceExtension(Step[ForceFit]):
    """A step of a brush.

    Attributes
    ----------
    given : float
        Error of the model before the step as it was given, in the unit of errors.
    """

    case: ForceCase
    given: float

    @property
    def unit(self) -> str:
        """Unit of errors in history and document."""
        return self.case.unit

    @property
    def errors(self) -> dict[str, float]:
        """Errors as the model's history has them."""
        return {
            "error_before": self.given,
            "error_refitted": self.before.error,
            "error_after": self.after.error,
            "floor": self.floor,
            **self.pooled,
        }


@one_thread()
def extended(
    models: StrainModels, given: TireModel, effect: Effect, before: Fitted | None = None
) -> Extension:
    """Return a model with one effect more; values and all strengths are fitted anew.

    `given` is the model as its file has it; `before` is one of the models, with effects that were
    added before.

    Raises
    ------
    CalibrationError
        If the campaign cannot show the effect.
    ConvergenceError
        If a fit does not settle.
    """
    step = added(models, effect, before)
    return _extension(step, models, models, given if before is None else None)


@one_thread()
def remove_effect(
    runs: StraightRuns, model: TireModel, effect: Effect, *, progress: Progress | None = None
) -> Extension:
    """Return a model without one of its effects; the rest is fitted anew.

    Raises
    ------
    ParameterError
        If the model does not have the effect.
    ConvergenceError
        If a fit does not settle.
    """
    refuse_absent(model.name, model.of_strain[0], effect, "strain")
    models = strain_models(runs, model, [effect], progress)
    fewer = TireModel.fitted(models.at().values, *without(models.at(), effect))
    others = strain_models(runs, fewer, [effect], progress)
    return _extension(removed(models, effect, others), models, others, model)


def _extension(
    step: Step[Fitted], models: StrainModels, others: StrainModels, given: TireModel | None
) -> Extension:
    """Return a step with its runs and errors."""
    told, refitted = models.least_error(step.before, given)
    return Extension(
        **vars(step),
        given=told,
        refitted=refitted,
        reached=step.after.reached,
        out_before=models.left_out(step.before),
        out_after=others.left_out(step.after),
        runs=models.runs,
    )


def strain_models(
    runs: StraightRuns,
    model: TireModel,
    more: Sequence[Effect],
    progress: Progress | None = None,
) -> StrainModels:
    """Return models about one on straight runs; `more` effects may be the user's own."""
    problem = StrainProblem(runs, model.values, _catalogue(more), *model.of_strain)
    return StrainModels(Hypotheses(problem, plain_tires(), FALSE_ALARM, progress), progress)


@one_thread()
def extended_brush(
    models: ForceModels, case: ForceCase, effect: Effect, before: ForceFit | None = None
) -> ForceExtension:
    """Return a brush with one effect more; arguments and errors as of `extended`."""
    given = case.given if before is None else before.error
    return ForceExtension(**vars(added(models, effect, before)), case=case, given=given)


@one_thread()
def remove_brush_effect(
    case: ForceCase, effect: Effect, *, progress: Progress | None = None
) -> ForceExtension:
    """Return a brush without one of its effects; errors as of `remove_effect`."""
    refuse_absent(case.model.name, case.effects, effect, "the brush")
    models = force_models(case, [effect], progress)
    fewer = case.model.fitted(models.at().values, *without(models.at(), effect))
    others = force_models(replace(case, model=fewer), [effect], progress)
    return ForceExtension(**vars(removed(models, effect, others)), case=case, given=case.given)


def force_models(
    case: ForceCase, more: Sequence[Effect] = (), progress: Progress | None = None
) -> ForceModels:
    """Return models about the brush of a case; `more` effects may be the user's own."""
    given, families = case.as_given(_catalogue(more)), plain_of_force(case.quantity)
    return ForceModels(case, Hypotheses(given, families, FALSE_ALARM, progress), progress)


def _catalogue(more: Sequence[Effect]) -> list[Effect]:
    return [*CATALOGUE.values(), *(each for each in more if each.name not in CATALOGUE)]


def refuse(model: TireModel, effect: Effect) -> None:
    """Raise ParameterError if a model has an effect, or its base fits it, or it is of the brush."""
    if effect.name in in_base(model.values):
        raise ParameterError(
            f"effect {effect.name!r}: the base model has it as a fitted number; choose another one"
        )
    if effect.hook == "brush":
        raise ParameterError(
            f"effect {effect.name!r} acts on the brush, which strain does not show; choose an "
            "effect of another stage"
        )
    refuse_second(model.name, model.of_strain[0], effect)


def refuse_brush(case: ForceCase, effect: Effect) -> None:
    """Raise ParameterError if a model has an effect, or it does not act on the brush."""
    _refuse_of_strain(case, effect)
    refuse_second(case.model.name, case.effects, effect)


def _refuse_of_strain(case: ForceCase, effect: Effect) -> None:
    if effect.hook != "brush":
        raise ParameterError(
            f"effect {effect.name!r} acts on strain, which forces do not show; leave "
            f"--quantity {case.quantity} out, or choose an effect of the brush"
        )


def case_for(cases: Sequence[ForceCase], effect: Effect) -> ForceCase:
    """Return the force to which an effect is fitted if none is asked for.

    That of the model's last step with forces, so that its history is of one quantity; else the
    force whose error the effect lowers most; else the first.

    Raises
    ------
    ParameterError
        If the effect does not act on the brush.
    """
    told = [entry.get("quantity") for entry in cases[0].model.history]
    last = [case for name in reversed(told) for case in cases if case.quantity == name]
    if last or len(cases) == 1:
        return (last or list(cases))[0]
    best, lowest = cases[0], np.inf
    for case in cases:
        if effect.name in {each.name for each in case.effects}:
            return case
        _refuse_of_strain(case, effect)
        try:
            models = force_models(case, [effect])
            if models.dead(effect):
                continue
            ratio = models.with_effect(models.at(), effect).error / models.at().error
        except TirelibError:
            continue
        if ratio < lowest:
            best, lowest = case, ratio
    return best


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
