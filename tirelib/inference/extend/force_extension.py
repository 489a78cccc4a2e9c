"""One brush effect more or less: the brush fitted to one force, judged on points left out."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ParameterError, TirelibError
from tirelib.core.threads import one_thread
from tirelib.effects import CATALOGUE, Effect
from tirelib.inference.diagnose.diagnose import FALSE_ALARM
from tirelib.inference.diagnose.forces.assess import ForceCase
from tirelib.inference.diagnose.forces.fit import ForceFit
from tirelib.inference.diagnose.forces.models import ForceModels
from tirelib.inference.extend.step import Step, added, kept, refuse_second, removed
from tirelib.inference.problems.forces import ForceProblem


@dataclass(frozen=True, eq=False)
class ForceExtension(Step[ForceFit]):
    """A step of a brush; errors in [N] or [N m].

    Attributes
    ----------
    case : ForceCase
    given : float
        Error of the model before the step as it was given, in the unit of errors.
    """

    case: ForceCase
    given: float


@one_thread()
def extended_brush(
    models: ForceModels, case: ForceCase, effect: Effect, before: ForceFit | None = None
) -> ForceExtension:
    """Return a brush with one effect more; parameters and all strengths are fitted anew.

    Parameters
    ----------
    models : ForceModels
        About the brush of the case (`force_models`).
    case : ForceCase
    effect : Effect
    before : ForceFit, optional
        One of the models, with effects that were added before.

    Raises
    ------
    CalibrationError
        If the campaign cannot show it.
    ConvergenceError
        If a fit does not settle.
    """
    given = case.given if before is None else case.error(before)
    return ForceExtension(**vars(added(models, effect, before)), case=case, given=given)


@one_thread()
def remove_brush_effect(
    case: ForceCase,
    effect: Effect,
    *,
    progress: Callable[[str], None] | None = None,
) -> ForceExtension:
    """Return a brush without one of its effects; errors as of `remove_effect`."""
    places = kept(case.model.name, case.effects, effect, "the brush")
    models = force_models(case, [effect], progress)
    before = models.at()
    others = _about(
        case,
        before.values,
        [before.effects[k] for k in places],
        [before.strengths[k] for k in places],
        [effect],
        progress,
    )
    step = removed(models, effect, others)
    return ForceExtension(**vars(step), case=case, given=case.given)


def force_models(
    case: ForceCase,
    more: Sequence[Effect] = (),
    progress: Callable[[str], None] | None = None,
) -> ForceModels:
    """Return models about the brush of a case; `more` effects may be the user's own."""
    return _about(case, case.model.values, case.effects, case.strengths, more, progress)


def _about(
    case: ForceCase,
    values: Mapping[str, float],
    effects: Sequence[Effect],
    strengths: Sequence[FloatArray],
    more: Sequence[Effect],
    progress: Callable[[str], None] | None,
) -> ForceModels:
    catalogue = [*CATALOGUE.values(), *(each for each in more if each.name not in CATALOGUE)]
    given = ForceProblem(
        case.problem.bench,
        case.quantity,
        values,
        catalogue,
        noise=case.noise,
        effects=effects,
        strengths=strengths,
    )
    return ForceModels(case.problem, given, FALSE_ALARM, progress=progress)


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
