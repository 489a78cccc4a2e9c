"""One effect of strain more or less: the model fitted to the straight runs, judged on others."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches

from tirelib.core.errors import ParameterError
from tirelib.core.threads import one_thread
from tirelib.effects import CATALOGUE, Effect
from tirelib.inference.compare.error import ModelError
from tirelib.inference.compare.model import TireModel
from tirelib.inference.diagnose.diagnose import FALSE_ALARM, plain_tires
from tirelib.inference.diagnose.fitted import Fitted
from tirelib.inference.diagnose.strain_models import StrainModels
from tirelib.inference.extend.step import Step, added, kept, refuse_second, removed
from tirelib.inference.identify.campaign_data import StraightRuns
from tirelib.inference.problems.strain import StrainProblem
from tirelib.inference.problems.strain_living import in_base
from tirelib.inference.statistics.select import Hypotheses


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
    runs : StraightRuns
    """

    given: ModelError
    refitted: ModelError
    reached: ModelError
    out_before: tuple[ModelError | None, ...]
    out_after: tuple[ModelError | None, ...]
    runs: StraightRuns


@one_thread()
def extended(
    models: StrainModels, given: TireModel, effect: Effect, before: Fitted | None = None
) -> Extension:
    """Return a model with one effect more; values and all strengths are fitted anew.

    Parameters
    ----------
    models : StrainModels
        About the model (`strain_models`).
    given : TireModel
        As its file has it.
    effect : Effect
    before : Fitted, optional
        One of the models, with effects that were added before.

    Raises
    ------
    CalibrationError
        If the campaign cannot show it.
    ConvergenceError
        If a fit does not settle.
    """
    step = added(models, effect, before)
    return _extension(step, models, models, given if before is None else None)


@one_thread()
def remove_effect(
    runs: StraightRuns,
    model: TireModel,
    effect: Effect,
    *,
    progress: Callable[[str], None] | None = None,
) -> Extension:
    """Return a model without one of its effects; the rest is fitted anew.

    Raises
    ------
    ParameterError
        If the model does not have the effect.
    ConvergenceError
        If a fit does not settle.
    """
    places = kept(model.name, model.of_strain[0], effect, "strain")
    models = strain_models(runs, model, [effect], progress)
    before = models.at()
    fewer = TireModel.fitted(
        before.values,
        [before.effects[k] for k in places],
        [before.strengths[k] for k in places],
    )
    others = strain_models(runs, fewer, [effect], progress)
    return _extension(removed(models, effect, others), models, others, model)


def strain_models(
    runs: StraightRuns,
    model: TireModel,
    more: Sequence[Effect],
    progress: Callable[[str], None] | None = None,
) -> StrainModels:
    """Return models about one on straight runs; `more` effects may be the user's own."""
    catalogue = [*CATALOGUE.values(), *(e for e in more if e.name not in CATALOGUE)]
    problem = StrainProblem(runs, model.values, catalogue, *model.of_strain)
    return StrainModels(Hypotheses(problem, plain_tires(), FALSE_ALARM, progress), progress)


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


def _extension(
    step: Step[Fitted], models: StrainModels, others: StrainModels, given: TireModel | None
) -> Extension:
    """Return a step with its runs and errors."""
    told, refitted = models.least_error(step.before, given)
    (out_before,), (out_after,) = models.left_out(step.before), others.left_out(step.after)
    return Extension(
        **vars(step),
        given=told,
        refitted=refitted,
        reached=step.after.reached,
        out_before=out_before,
        out_after=out_after,
        runs=models.runs,
    )


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
