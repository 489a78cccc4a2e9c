"""What a measurement has to say of itself to be reasoned about: strain and forces alike.

A problem holds measured numbers and a model of them. About any point of the model it gives the
residual and everything that may explain it as rows of the same shape, and the whitening by what
differs from run to run unintentionally (noise, set points). The rest of this package knows
nothing else of tires.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.effects import Effect


@dataclass(frozen=True, slots=True)
class Point:
    """A point of the model: the base's coordinates, and effects at strengths.

    Attributes
    ----------
    base : shape (n_base,)
        Moves of the base's numbers and of nuisance parameters from where the problem starts.
    effects : tuple of Effect
    strengths : tuple of shape (components,)
        In the effects' units.
    """

    base: FloatArray
    effects: tuple[Effect, ...] = ()
    strengths: tuple[FloatArray, ...] = ()

    @property
    def ranges(self) -> list[FloatArray]:
        """Strengths in ranges, of shape (components,) each."""
        return [s / e.scale for e, s in zip(self.effects, self.strengths, strict=True)]

    @property
    def coordinates(self) -> FloatArray:
        """The base's coordinates and the strengths in ranges, (n_coordinates,)."""
        return np.concatenate([self.base, *self.ranges])


FOLLOWED = 0.003
"""Change of what a model gives, over the measured numbers, below which a whitening need not follow
a fit. A base of strain that lacks an effect is then as likely from any start: with a stiffness a
quarter off, its cost is 4626, 4623 and 4661; with .01 it is 4626, 4474 and 5026."""


class Whitening(Protocol):
    """Turns rows (k, ...) into whitened ones (k, n)."""

    @property
    def log_volume(self) -> float:
        """Logarithm of the determinant of what it multiplies rows with."""

    def __call__(self, rows: FloatArray) -> FloatArray:
        """Return whitened rows."""

    def reduced(self, rows: FloatArray) -> FloatArray:
        """Return what of rows the whitening needs, whatever the size of a run's own misfit."""

    def white(self, reduced: FloatArray) -> FloatArray:
        """Return whitened rows (k, n) of what `reduced` gave of rows (k, ...)."""

    def coloured(self, white: FloatArray) -> FloatArray:
        """Return rows (k, ...) whose whitened ones are these, (k, n)."""


class Solved(Protocol):
    """The model at a point."""

    @property
    def rest(self) -> FloatArray:
        """Residual, measured less model, of any shape (...)."""


class Model(Protocol):
    """Measured numbers with a model of them, as a fit needs them."""

    @property
    def start(self) -> Point:
        """The model as the user has it."""

    @property
    def widths(self) -> FloatArray:
        """Prior standard deviations of the base's coordinates, shape (n_base,)."""

    @property
    def ends(self) -> tuple[FloatArray, FloatArray]:
        """Ends of the base's coordinates, shape (n_base,) each; infinite where there is none."""

    @property
    def living(self) -> Sequence[Effect]:
        """Effects that this plan may show and the model has not."""

    def solve(self, point: Point, near: Any = None) -> Solved:
        """Return the model at a point; raises TirelibError where it has none."""

    def slopes(self, point: Point, solved: Any, *, near: bool = False) -> FloatArray:
        """Return slopes by the base, then by strengths in ranges, (n_coordinates, ...).

        With `near`, those that cost much may be of a point nearby.
        """

    def remainder(self, point: Point, solved: Any) -> Mapping[str, FloatArray]:
        """Return groups of smooth shapes that no law describes, rows (k, ...) each."""

    def roughly(
        self, point: Point, solved: Any, slopes: FloatArray, count: int
    ) -> Sequence[FloatArray]:
        """Return how the laws of the model's effects may be off, rows (k, ...) for each effect.

        They are as large as what the effect does. The model has the point's first `count` effects;
        slopes are by all coordinates, as `slopes` gives them.
        """

    @property
    def lookalike(self) -> float:
        """How much of what a law does may be an error that looks like any one other effect.

        A relative standard deviation; zero where `roughly` has all that an error may look like.
        """


class Problem(Model, Protocol):
    """A model whose hypotheses are tested: with a whitening, and what the plan can show."""

    @property
    def starts(self) -> Sequence[Point]:
        """Where fits of the model start, `start` first: a fit ends in the valley it starts in."""

    @property
    def dead(self) -> Mapping[str, str]:
        """Effects that this plan cannot show, with the reason."""

    def whitener(self, own: float) -> Whitening:
        """Return the whitening.

        `own` is the size of the misfit that each run has for itself.
        """

    def about(self, solved: Any) -> "Problem":
        """Return the problem with its whitening about a solution; itself where it is."""

    def thinned(self) -> "Problem":
        """Return the problem of a part of the measurement, where fits begin; itself if it is small.

        It has the same coordinates and effects.
        """

    def forget(self) -> None:
        """Forget what only saves time, so that a fit does not depend on those before it."""
