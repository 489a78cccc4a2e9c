"""One effect more or less, for strain and for forces: fit, fit again, judge on what is left out.

What differs is how a model is fitted to its campaign, what its floor is and what can be left out:
a `Subject` says it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.effects import Effect
from tirelib.errors import CalibrationError, ParameterError

SIGNIFICANT = 2.0
"""Standard deviations below which a strength is no different from zero."""


class Fit(Protocol):
    """A fitted model."""

    @property
    def effects(self) -> tuple[Effect, ...]:
        """That the model has."""

    @property
    def strengths(self) -> tuple[FloatArray, ...]:
        """One array of components per effect."""

    @property
    def error(self) -> float:
        """Rms of what is left."""

    def strength_std(self, index: int) -> FloatArray:
        """Return standard deviations of an effect's strength."""


F = TypeVar("F", bound=Fit)


class Subject(Protocol[F]):
    """A model on a campaign.

    Attributes
    ----------
    name : str
        Of the model.
    acts_on : str
        What its effects act on, in words.
    """

    name: str
    acts_on: str

    @property
    def effects(self) -> Sequence[Effect]:
        """That the model has, of this kind."""

    def refuse(self, effect: Effect) -> None:
        """Raise ParameterError if an effect cannot act here."""

    def fitted(self) -> F:
        """Return the model as it is, fitted."""

    def dead(self, before: F, effect: Effect) -> str:
        """Return why the campaign cannot show an effect, or an empty text."""

    def with_effect(self, before: F, effect: Effect) -> F:
        """Return the fit with one effect more."""

    def without(self, before: F, kept: Sequence[int]) -> F:
        """Return the fit with some of the effects."""

    def left_out(self) -> Sequence[Any]:
        """Return what is left out in turn."""

    def held_out(self, fit: F, folds: Sequence[Any]) -> tuple[float, ...]:
        """Return the errors on what is left out."""

    def floor(self, after: F) -> float:
        """Return the error that structure leaves."""


@dataclass(frozen=True, eq=False)
class Step(Generic[F]):
    """A model before and after an effect was added or removed, both fitted.

    Attributes
    ----------
    action : str
        add or remove.
    effect : Effect
    strength, std : shape (components,)
        With the effect, in its unit.
    before, after : Fit
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
    folds: tuple[Any, ...]
    held_before: tuple[float, ...]
    held_after: tuple[float, ...]
    flags: tuple[str, ...]


def added(subject: Subject[F], effect: Effect) -> Step[F]:
    """Return a model with one effect more, everything fitted anew.

    Raises
    ------
    ParameterError
        If the model has the effect already, or it cannot act here.
    CalibrationError
        If the campaign cannot show it.
    ConvergenceError
        If a fit does not settle.
    """
    subject.refuse(effect)
    refuse_second(subject, effect)
    before = subject.fitted()
    if reason := subject.dead(before, effect):
        raise CalibrationError(
            f"effect {effect.name!r}: this campaign cannot show it: {reason}; measure such runs, "
            "or leave the effect out"
        )
    after = subject.with_effect(before, effect)
    return _judged(subject, "add", effect, before, after, after)


def removed(subject: Subject[F], effect: Effect) -> Step[F]:
    """Return a model without one of its effects; the rest is fitted anew.

    Raises
    ------
    ParameterError
        If the model does not have the effect.
    ConvergenceError
        If a fit does not settle.
    """
    names = [each.name for each in subject.effects]
    if effect.name not in names:
        raise ParameterError(
            f"{subject.name}: it has no effect {effect.name!r} of {subject.acts_on} to remove; it "
            f"has {', '.join(names) or 'none'}"
        )
    before = subject.fitted()
    after = subject.without(before, [k for k, name in enumerate(names) if name != effect.name])
    return _judged(subject, "remove", effect, before, after, before)


def refuse_second(subject: Subject[F], effect: Effect) -> None:
    """Refuse an effect that the model has.

    Raises
    ------
    ParameterError
        If it has.
    """
    if effect.name in {each.name for each in subject.effects}:
        raise ParameterError(
            f"{subject.name}: it has the effect {effect.name!r} already; choose another one, or "
            "take it out first with --remove"
        )


def _judged(
    subject: Subject[F], action: str, effect: Effect, before: F, after: F, having: F
) -> Step[F]:
    """Return the step; `having` is the fit that has the effect."""
    index = [each.name for each in having.effects].index(effect.name)
    strength, std = having.strengths[index], having.strength_std(index)
    folds = tuple(subject.left_out())
    held_before, held_after = (subject.held_out(fit, folds) for fit in (before, after))
    flags = []
    if ((strength < effect.low) | (strength > effect.high)).any():
        flags.append("out_of_range")
    if (np.abs(strength) < SIGNIFICANT * std).all():
        flags.append("not_significant")
    if action == "add" and after.error >= before.error * (1.0 - 1e-6):
        flags.append("no_gain")
    counted = [
        new > old
        for new, old, fold in zip(held_after, held_before, folds, strict=True)
        if getattr(fold, "main", True)
    ]
    if any(counted):
        flags.append("heldout_worse")
    return Step(
        action,
        effect,
        strength,
        std,
        before,
        after,
        subject.floor(after),
        folds,
        held_before,
        held_after,
        tuple(flags),
    )
