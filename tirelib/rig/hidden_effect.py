"""An effect that the rig can hide: its law, its range, and the unit in which a user states it."""

from collections.abc import Callable
from dataclasses import dataclass

from tirelib.core.errors import ParameterError
from tirelib.rig.observe import Trace
from tirelib.rig.shown import Shown, ShownLaw
from tirelib.rig.tire import Condition, RigTire

TireLaw = Callable[[RigTire, Condition, float, float], RigTire]
"""(tire, condition, place in the campaign from 0 to 1, strength) -> tire of that run."""


@dataclass(frozen=True)
class Stated:
    """The unit in which the library's catalogue has an effect: factor x strength^power.

    The mean over a length and the spread of a height come into the catalogue as squares.
    """

    unit: str
    factor: float
    power: int = 1


MICROSTRAIN = Stated("ustrain", 1e6)
SQUARE_MM = Stated("mm^2", 1e6, 2)


@dataclass(frozen=True)
class Hidden:
    """An effect that the rig can hide.

    Attributes
    ----------
    name : str
        As verdicts would name it, or its own name where no catalogue has it.
    law : str
        In words.
    visible, largest : float
        A strength that shows clearly, and the largest that makes sense; in the law's unit.
    unit : str
        Unit of the law, SI.
    known : bool
        Whether the library's catalogue has an effect of this name.
    signed : bool
        Whether either sign makes sense.
    on_tire, on_trace
        What it changes: the tire of a run, or what the gages show of the solved state.
    stated : Stated or None
        How a user states a strength, where that is not the law's unit.
    """

    name: str
    law: str
    visible: float
    largest: float
    unit: str
    known: bool = True
    signed: bool = False
    on_tire: TireLaw | None = None
    on_trace: ShownLaw | None = None
    stated: Stated | None = None

    @property
    def stated_unit(self) -> str:
        """Return the unit in which a user states a strength."""
        return self.unit if self.stated is None else self.stated.unit

    def as_stated(self, strength: float) -> float:
        """Return a strength of the law as a user states it."""
        if self.stated is None:
            return strength
        return float(f"{self.stated.factor * strength**self.stated.power:.12g}")

    def from_stated(self, number: float) -> float:
        """Return the law's strength for what a user states.

        Raises
        ------
        ParameterError
            If it is another sign or size than makes sense; zero is allowed.
        """
        low, high = (self.as_stated(s) for s in (0.01 * self.visible, self.largest))
        if number != 0.0 and not (low <= (abs(number) if self.signed else number) <= high):
            sides = ", of either sign" if self.signed else ""
            raise ParameterError(
                f"{self.name}={number:g}: strengths from {low:g} to {high:g} {self.stated_unit}"
                f"{sides} are allowed; {self.as_stated(self.visible):g} shows clearly"
            )
        if self.stated is None:
            return number
        return float((number / self.stated.factor) ** (1.0 / self.stated.power))

    def tire(self, tire: RigTire, cond: Condition, place: float, strength: float) -> RigTire:
        """Return the tire as it is in a run."""
        if self.on_tire is None or strength == 0.0:
            return tire
        return self.on_tire(tire, cond, place, strength)

    def trace(self, seen: Shown, strength: float) -> Trace:
        """Return what the gages show."""
        if self.on_trace is None or strength == 0.0:
            return seen.trace
        return self.on_trace(seen, strength)
