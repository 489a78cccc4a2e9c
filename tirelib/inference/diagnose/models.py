"""Models about one problem, of strain or of a force: each is fitted once, and held out once."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from functools import partial
from typing import Any, Generic, Protocol, TypeVar

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import TirelibError
from tirelib.core.forked import forked
from tirelib.effects import Effect
from tirelib.inference.diagnose.held_out import Fold
from tirelib.inference.statistics.hypotheses import Hypotheses


class Fit(Protocol):
    """A fitted model."""

    @property
    def effects(self) -> tuple[Effect, ...]:
        """That the model has."""

    @property
    def strengths(self) -> tuple[FloatArray, ...]:
        """One array of components per effect, in its unit."""

    @property
    def error(self) -> float:
        """Error of the model alone, in the unit of documents."""

    def strength_std(self, index: int) -> FloatArray:
        """Return standard deviations of an effect's strength, in its unit."""


F = TypeVar("F", bound=Fit)
E = TypeVar("E")


class Models(ABC, Generic[F, E]):
    """A model on a campaign, and others with further effects.

    What differs between strain and forces is how a model is fitted, what it leaves on a fold (E),
    and which part of its error plain tires have as well.

    Attributes
    ----------
    hypotheses : Hypotheses
        Which effects may be missing.
    folds : tuple of Fold
        What can be left out of a fit in turn.
    """

    def __init__(
        self,
        hypotheses: Hypotheses,
        folds: tuple[Fold, ...],
        progress: Callable[[str], None] | None = None,
    ) -> None:
        self.hypotheses, self.folds, self.progress = hypotheses, folds, progress
        self._fitted: dict[frozenset[str], F] = {}
        self._held: dict[F, tuple[E, ...]] = {}

    @abstractmethod
    def _fit(self, names: Sequence[str], near: F | None) -> F:
        """Return the model with further effects; errors as of `at`."""

    @abstractmethod
    def _left_out(self, fit: F, fold: Fold) -> E:
        """Return what a model leaves on a fold after a fit to the rest."""

    @abstractmethod
    def held_out(self, fit: F) -> tuple[float, ...]:
        """Return the errors of a model on each fold after a fit to the rest; NaN without one."""

    @abstractmethod
    def floor(self, fit: F) -> float:
        """Return the part of a model's error that noise and what plain tires show explain."""

    def dead(self, effect: Effect) -> str:
        """Return why the campaign cannot show an effect, or an empty text."""
        return self.hypotheses.problem.dead.get(effect.name, "")

    def added(self, fit: F) -> tuple[str, ...]:
        """Return the names of the effects that a fit has and the model as it is has not."""
        return tuple(effect.name for effect in fit.effects[len(self.hypotheses.had) :])

    def at(self, names: Sequence[str] = (), near: F | None = None) -> F:
        """Return the model with further effects, everything fitted at once.

        `near` is a model from whose fit this one starts.

        Raises
        ------
        ConvergenceError
            If no fit settles.
        CalibrationError
            If the model has no solution.
        """
        key = frozenset(names)
        if key not in self._fitted:
            self._fitted[key] = self._fit(names, near)
        return self._fitted[key]

    def with_effect(self, before: F, effect: Effect) -> F:
        """Return the fit with one effect more; errors as of `at`."""
        return self.at((*self.added(before), effect.name), before)

    def singles(self, names: Iterable[str]) -> dict[str, F]:
        """Return the model with each of some effects alone, where that can be fitted."""
        found = {}
        for name in names:
            with suppress(TirelibError):
                found[name] = self.at((name,))
        return found

    def left_out(self, fit: F) -> tuple[E, ...]:
        """Return what a model leaves on each fold after a fit to the rest."""
        self.find([fit])
        return self._held[fit]

    def find(self, held: Iterable[F], more: Sequence[Callable[[], Any]] = ()) -> list[Any]:
        """Find what models leave on each fold, all at once, and return what other calls do."""
        new = [each for each in dict.fromkeys(held) if each not in self._held]
        calls: list[Callable[[], Any]] = []
        calls += [partial(self._left_out, each, fold) for each in new for fold in self.folds]
        if calls and self.progress is not None:
            kind = self.folds[0].of
            self.progress(f"holding out some of the {kind}: {len(calls)} fits to the others")
        found, count = forked([*more, *calls]), len(self.folds)
        for k, each in enumerate(new):
            self._held[each] = tuple(found[len(more) + k * count :][:count])
        return found[: len(more)]
