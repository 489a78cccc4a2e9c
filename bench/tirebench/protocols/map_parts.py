"""Content of a map of another make's transmitter: its wheels, and the conditions that it sends."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from tirebench.protocols.map_messages import Message
from tirebench.protocols.signals import Signal
from tirebench.wire.conditions import TELLABLE, Measured
from tirebench.wire.device import Device
from tirebench.wire.frames import GAGES
from tirelib.core.units import to_si


@dataclass(frozen=True, slots=True)
class WheelMap:
    """Where a wheel's strain is.

    Attributes
    ----------
    wheel : int
    message : Message
    strain : tuple of Signal
        Signals of the gages that are there, oldest sample first.
    counter, time : Signal or None
    tick : float, [s]
        Step of `time`.
    absent : tuple of bool, one a gage of the calibration
        Gages that are not there.
    """

    wheel: int
    message: Message
    strain: tuple[Signal, ...]
    counter: Signal | None
    time: Signal | None
    tick: float
    absent: tuple[bool, ...] = (False,) * GAGES

    @property
    def samples(self) -> int:
        """Samples in a frame."""
        return len(self.strain) // self.absent.count(False)


@dataclass(frozen=True, slots=True)
class CarriedQuantity:
    """Where a condition is.

    Attributes
    ----------
    name : str
        One of `tirebench.wire.conditions.TELLABLE`.
    message : Message
    signal : Signal
    unit : str
        Unit of the signal's value.
    wheel : int or None
        For which it holds; None: for all.
    hold : float, [s]
        How long the bus may be silent about it before it is unknown.
    """

    name: str
    message: Message
    signal: Signal
    unit: str
    wheel: int | None = None
    hold: float = math.inf

    def measured(self, raw: float) -> Measured:
        """Return what a raw value means."""
        shown = self.signal.offset + self.signal.factor * raw
        name, dimension = TELLABLE[self.name]
        return Measured(name, float(to_si(shown, self.unit, dimension)), self.wheel, self.hold)


@dataclass(frozen=True, slots=True)
class UserMap:
    """What a map says.

    Attributes
    ----------
    rate : float, [Hz]
    wheels : tuple of WheelMap
        Empty for a bus that only sends conditions.
    device : Device
        Scale and zero, where the map says a unit of strain; else those of counts.
    quantities : tuple of Quantity
    text : str
        Text of the file, DBC included, for the header of a recording.
    messages : tuple of Message
    """

    rate: float
    wheels: tuple[WheelMap, ...]
    device: Device
    quantities: tuple[CarriedQuantity, ...]
    text: str
    messages: tuple[Message, ...] = ()

    @property
    def of_line(self) -> bool:
        """Whether it is of a serial line, not of a CAN bus."""
        return any(message.cut is not None for message in self.messages)


def clashes(place: tuple[str, int | None], places: Sequence[tuple[str, int | None]]) -> bool:
    """Return whether more than one place sends a condition of a wheel (None: of all wheels)."""
    name, wheel = place
    same = [w for n, w in places if n == name and (w is None or wheel is None or w == wheel)]
    return len(same) > 1
