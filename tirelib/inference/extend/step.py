"""One effect more or less, for strain and for forces: fit, fit again, judge on what is left out.

What differs is how a model is fitted to its campaign, what its floor is and what can be left out:
`Models` say it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Generic

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import CalibrationError, ParameterError
from tirelib.effects import Effect
from tirelib.inference.diagnose.held_out import Fold, pooled
from tirelib.inference.diagnose.models import F, Fit, Models

SIGNIFICANT = 2.0
"""Standard deviations below which a strength is no different from zero."""


@dataclass(frozen=True, eq=False)
class Step(Generic[F]):
    """A model before and after an effect was added or removed, both fitted.

    Attributes
    ----------
    action : str
        add or remove.
    strength, std : shape (components,)
        With the effect, in its unit.
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


def added(models: Models[F, Any], effect: Effect, before: F | None = None) -> Step[F]:
    """Return a model with one effect more, everything fitted anew.

    `before` is one of the models, with effects that were added before; the one without by default.

    Raises
    ------
    CalibrationError
        If the campaign cannot show it.
    ConvergenceError
        If a fit does not settle.
    """
    if reason := models.dead(effect):
        raise CalibrationError(
            f"effect {effect.name!r}: this campaign cannot show it: {reason}; measure such runs, "
            "or leave the effect out"
        )
    first = before or models.at()
    after = models.with_effect(first, effect)
    return _judged("add", effect, models, first, models, after)


def removed(models: Models[F, Any], effect: Effect, fewer: Models[F, Any]) -> Step[F]:
    """Return a model without one of its effects, which others are about; the rest fitted anew.

    Raises
    ------
    ConvergenceError
        If a fit does not settle.
    """
    return _judged("remove", effect, models, models.at(), fewer, fewer.at())


def refuse_second(name: str, has: Sequence[Effect], effect: Effect) -> None:
    """Raise ParameterError if a model, by its name, has an effect already."""
    if effect.name in {each.name for each in has}:
        raise ParameterError(
            f"{name}: it has the effect {effect.name!r} already; choose another one, or take it "
            "out first with --remove"
        )


def refuse_absent(name: str, has: Sequence[Effect], effect: Effect, acts_on: str) -> None:
    """Raise ParameterError if a model, by its name, does not have an effect."""
    names = [each.name for each in has]
    if effect.name not in names:
        raise ParameterError(
            f"{name}: it has no effect {effect.name!r} of {acts_on} to remove; it has "
            f"{', '.join(names) or 'none'}"
        )


def without(fit: Fit, effect: Effect) -> tuple[tuple[Effect, ...], tuple[FloatArray, ...]]:
    """Return the effects of a fit but one, and their strengths."""
    names = [each.name for each in fit.effects]
    stays = [k for k, name in enumerate(names) if name != effect.name]
    return tuple(fit.effects[k] for k in stays), tuple(fit.strengths[k] for k in stays)


def _judged(
    action: str, effect: Effect, models: Models[F, Any], before: F, others: Models[F, Any], after: F
) -> Step[F]:
    """Return the step between two models."""
    having = after if action == "add" else before
    index = [each.name for each in having.effects].index(effect.name)
    strength, std = having.strengths[index], having.strength_std(index)
    folds = tuple(models.folds)
    held_before, held_after = models.held_out(before), others.held_out(after)
    flags = []
    if ((strength < effect.low) | (strength > effect.high)).any():
        flags.append("out_of_range")
    if (np.abs(strength) < SIGNIFICANT * std).all():
        flags.append("not_significant")
    if action == "add" and after.error >= before.error * (1.0 - 1e-6):
        flags.append("no_gain")
    pairs = zip(held_after, held_before, folds, strict=True)
    if any(new > old for new, old, fold in pairs if fold.main):
        flags.append("heldout_worse")
    return Step(
        action,
        effect,
        strength,
        std,
        before,
        after,
        others.floor(after),
        folds,
        held_before,
        held_after,
        tuple(flags),
    )
