"""Messages and signals that a map names, looked up with every fault kept."""

from collections.abc import Mapping
from typing import Any

from tirebench.protocols.map_messages import Message
from tirebench.protocols.signals import Signal
from tirelib.core.errors import TirelibError
from tirelib.core.units import to_si

LONGEST_SIGNAL = 32


class SignalLookup:
    """Collects every fault of a map before it raises."""

    def __init__(self, document: dict[str, Any], where: str) -> None:
        self.document = document
        self.where = where
        self.faults: list[str] = []

    def known_keys(self, what: str, table: Mapping[str, Any], known: set[str]) -> None:
        """Note each key that a table cannot have: a misspelt one would be left out silently."""
        self.faults += [
            f"{self.where}: {what}unknown key {key}; allowed keys are {', '.join(sorted(known))}; "
            "correct it"
            for key in sorted(set(table) - known)
        ]

    def fault(self, what: str, given: object, allowed: str, remedy: str = "correct it") -> None:
        """Note a fault."""
        self.faults.append(f"{self.where}: {what} = {given!r}; {allowed}; {remedy}")

    def message(self, what: str, name: Any, messages: Mapping[str, Message]) -> Message | None:
        """Return a message by its name, or None after noting the existing names."""
        message = messages.get(str(name))
        if message is None:
            self.fault(
                what, name, f"the known messages are {', '.join(sorted(messages)) or 'none'}"
            )
        return message

    def signal(self, what: str, name: Any, message: Message) -> Signal | None:
        """Return a signal that can be read, or None after noting what is wrong."""
        signal = message.signals.get(str(name))
        if signal is None:
            self.fault(
                f"{what}: signal",
                name,
                f"{message.name} has the signals {', '.join(message.signals) or 'none'}",
            )
            return None
        for part in (signal, signal.selector):
            if part is not None and not _fits(part, message):
                self.fault(
                    f"{what}: signal",
                    part.name,
                    f"a signal must lie inside the {message.length} bytes of {message.name} and "
                    f"have 1 to {LONGEST_SIGNAL} bits, or 32 or 64 bits if it is a float",
                )
                return None
        if signal.selector is not None and signal.selector.selector is not None:
            self.fault(
                f"{what}: signal",
                name,
                "a multiplexer that is itself multiplexed is not supported",
                "name another",
            )
            return None
        return signal

    def integer(self, what: str, signal: Signal) -> None:
        """Note a signal that is not an integer."""
        if signal.real:
            self.fault(
                f"{what}: signal",
                signal.name,
                "counter and time must be integers, because a float does not show where it wraps",
                "name another signal, or give the column's bits",
            )

    def optional(
        self, what: str, table: dict[str, Any], key: str, message: Message
    ) -> Signal | None:
        """Return the signal that a key names; None without the key."""
        return self.signal(what, table[key], message) if key in table else None

    def seconds(self, what: str, unit: Any, time: Signal) -> float:
        """Return the step of a time signal, [s]."""
        try:
            return time.factor * float(to_si(1.0, str(unit), "time"))
        except TirelibError as error:
            self.fault(f"{what}: time_unit", unit, f"a unit of time is needed ({error})")
            return 1.0


def is_wheel(number: object) -> bool:
    """Return whether it can be the number of a wheel."""
    return isinstance(number, int) and not isinstance(number, bool) and 0 <= number <= 255


def _fits(signal: Signal, message: Message) -> bool:
    """Whether a signal has a length that can be read and lies inside its message."""
    places = signal.places
    good = signal.length in (32, 64) if signal.real else 1 <= signal.length <= LONGEST_SIGNAL
    return good and int(places.min()) >= 0 and int(places.max()) < 8 * message.length
