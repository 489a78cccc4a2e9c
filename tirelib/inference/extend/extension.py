"""One effect more or less: a model fitted to straight runs or to a force, judged on others.

What differs between strain and forces is how a model is fitted to its campaign, what its floor is
and what can be left out: `Models` say it.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from typing import Any, Generic

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import CalibrationError, ParameterError, TirelibError
from tirelib.core.threads import one_thread
from tirelib.effects import CATALOGUE, Effect
from tirelib.inference.compare.error import ModelError
from tirelib.inference.compare.force_model import ForceModel
from tirelib.inference.compare.model import TireModel
from tirelib.inference.diagnose.diagnose import FALSE_ALARM, plain_tires
from tirelib.inference.diagnose.forces.case import ForceCase
from tirelib.inference.diagnose.forces.models import ForceFit, ForceModels
from tirelib.inference.diagnose.forces.models import plain_tires as plain_of_force
from tirelib.inference.diagnose.held_out import Fold, pooled
from tirelib.inference.diagnose.models import F
from tirelib.inference.diagnose.strain_models import Fitted, StrainModels
from tirelib.inference.identify.campaign_data import StraightRuns
from tirelib.inference.problems.strain import StrainProblem
from tirelib.inference.problems.strain_living import in_base
from tirelib.inference.statistics.hypotheses import Hypotheses

Progress = Callable[[str], None]
SIGNIFICANT = 2.0
"""Standard deviations below which a strength is no different from zero."""


@dataclass(frozen=True, slots=True, eq=False)
class StrainCase:
    """Straight runs and a model of their strain, as `ForceCase` has a force and its model."""

    runs: StraightRuns
    model: TireModel

    @property
    def name(self) -> str:
        """Name of the campaign."""
        return self.runs.waves.header.name


@dataclass(frozen=True, eq=False)
class Step(Generic[F]):
    """A model before and after an effect was added or removed, both fitted.

    Attributes
    ----------
    action : str
        add or remove.
    strength, std : shape (components,)
        Strength of the effect and its standard deviation, in the effect's unit, from the model
        that has the effect.
    floor : float
        Error that structure leaves.
    folds : tuple
        What is left out in turn.
    held_before, held_after : tuple of float
        Errors on it, one per fold.
    flags : tuple of str
        out_of_range, not_significant, no_gain, heldout_worse.
    """

    action: str
    effect: Effect
    strength: FloatArray
    std: FloatArray
    before: F
    after: F
    floor: float
    folds: tuple[Fold, ...]
    held_before: tuple[float, ...]
    held_after: tuple[float, ...]
    flags: tuple[str, ...]

    @property
    def pooled(self) -> dict[str, float]:
        """The held-out errors as documents and histories have them."""
        return {
            "heldout_error_before": pooled(self.held_before, self.folds),
            "heldout_error_after": pooled(self.held_after, self.folds),
        }


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


def models_of(
    case: StrainCase | ForceCase, more: Sequence[Effect] = (), progress: Progress | None = None
) -> StrainModels | ForceModels:
    """Return models about the one of a case; `more` effects may be the user's own."""
    known = [*CATALOGUE.values(), *(each for each in more if each.name not in CATALOGUE)]
    if isinstance(case, ForceCase):
        given, families = case.as_given(known), plain_of_force(case.quantity)
        return ForceModels(case, Hypotheses(given, families, FALSE_ALARM, progress), progress)
    problem = StrainProblem(case.runs, case.model.values, known, *case.model.of_strain)
    return StrainModels(Hypotheses(problem, plain_tires(), FALSE_ALARM, progress), progress)


@one_thread()
def extended(
    models: StrainModels | ForceModels,
    case: StrainCase | ForceCase,
    effect: Effect,
    before: Fitted | ForceFit | None = None,
) -> Extension | ForceExtension:
    """Return a model with one effect more; values and all strengths are fitted anew.

    `before` is one of the models, with effects that were added before; the case's own by default.

    Raises
    ------
    CalibrationError
        If the campaign cannot show the effect.
    ConvergenceError
        If a fit does not settle.
    """
    if reason := models.dead(effect):
        raise CalibrationError(
            f"effect {effect.name!r}: this campaign cannot show it: {reason}; measure such runs, "
            "or leave the effect out"
        )
    kind: Any = models
    first = before or kind.at()
    after = kind.with_effect(first, effect)
    return _judged("add", effect, (kind, first), (kind, after), None if before else case)


@one_thread()
def without_effect(
    case: StrainCase | ForceCase, effect: Effect, *, progress: Progress | None = None
) -> Extension | ForceExtension:
    """Return a model without one of its effects; the rest is fitted anew.

    Raises
    ------
    ParameterError
        If the model does not have the effect.
    ConvergenceError
        If a fit does not settle.
    """
    model, acts_on = case.model, "the brush" if isinstance(case, ForceCase) else "strain"
    if effect.name not in (names := [each.name for each in _has(model)]):
        raise ParameterError(
            f"{model.name}: it has no effect {effect.name!r} of {acts_on} to remove; it has "
            f"{', '.join(names) or 'none'}"
        )
    models: Any = models_of(case, [effect], progress)
    fit = models.at()
    stay = [k for k, each in enumerate(fit.effects) if each.name != effect.name]
    kept = [fit.effects[k] for k in stay], [fit.strengths[k] for k in stay]
    fewer: Any = replace(case, model=model.fitted(fit.values, *kept))  # type: ignore[arg-type]
    others: Any = models_of(fewer, [effect], progress)
    return _judged("remove", effect, (models, fit), (others, others.at()), case)


def _judged(
    action: str,
    effect: Effect,
    first: tuple[Any, Any],
    second: tuple[Any, Any],
    given: StrainCase | ForceCase | None,
) -> Extension | ForceExtension:
    """Return the step between two fits, each with the models that it is one of.

    Its error before is that of the given case's model, or that of the first fit.
    """
    (models, before), (others, after) = first, second
    having = after if action == "add" else before
    index = [each.name for each in having.effects].index(effect.name)
    strength, std = having.strengths[index], having.strength_std(index)
    folds = tuple(models.folds)
    held_before, held_after = models.held_out(before), others.held_out(after)
    worse = [new > old for new, old in zip(held_after, held_before, strict=True)]
    flags = {
        "out_of_range": ((strength < effect.low) | (strength > effect.high)).any(),
        "not_significant": (np.abs(strength) < SIGNIFICANT * std).all(),
        "no_gain": action == "add" and after.error >= before.error * (1.0 - 1e-6),
        "heldout_worse": any(each and fold.main for each, fold in zip(worse, folds, strict=True)),
    }
    told = {
        "action": action,
        "effect": effect,
        "strength": strength,
        "std": std,
        "before": before,
        "after": after,
        "floor": others.floor(after),
        "folds": folds,
        "held_before": held_before,
        "held_after": held_after,
        "flags": tuple(flag for flag, on in flags.items() if on),
    }
    if isinstance(models, ForceModels):
        error = before.error if given is None else models.case.given
        return ForceExtension(**told, case=models.case, given=error)
    as_given, refitted = models.least_error(before, given and given.model)
    return Extension(
        **told,
        given=as_given,
        refitted=refitted,
        reached=after.reached,
        out_before=models.left_out(before),
        out_after=others.left_out(after),
        runs=models.runs,
    )


def _has(model: TireModel | ForceModel) -> list[Effect]:
    """Return the effects of a model that its quantity shows."""
    brush = isinstance(model, ForceModel)
    return [each.effect for each in model.used if (each.effect.hook == "brush") == brush]


def refuse(model: TireModel | ForceModel, effect: Effect) -> None:
    """Raise ParameterError if a model has an effect, or its base fits it, or it acts elsewhere."""
    if isinstance(model, ForceModel):
        if effect.hook != "brush":
            raise ParameterError(
                f"effect {effect.name!r} acts on strain, which forces do not show; leave "
                "--quantity out, or choose an effect of the brush"
            )
    elif effect.name in in_base(model.values):
        raise ParameterError(
            f"effect {effect.name!r}: the base model has it as a fitted number; choose another one"
        )
    elif effect.hook == "brush":
        raise ParameterError(
            f"effect {effect.name!r} acts on the brush, which strain does not show; choose an "
            "effect of another stage"
        )
    if effect.name in {each.name for each in _has(model)}:
        raise ParameterError(
            f"{model.name}: it has the effect {effect.name!r} already; choose another one, or take "
            "it out first with --remove"
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
        refuse(case.model, effect)
        try:
            models: Any = models_of(case, [effect])
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
