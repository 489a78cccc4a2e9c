"""Sources of bytes: one protocol class, with an implementation for each kind of line.

A reader asks for bytes with a deadline that is handed down; nothing below it waits longer. No link
transmits unless it is asked to.
"""

from typing import NamedTuple, Protocol

from tirebench.deadline import Deadline


class Read(NamedTuple):
    """What came.

    Attributes
    ----------
    arrival : int, [ns]
        Monotonic.
    data : bytes
        Empty if nothing came.
    event : str
        `LOST` or `BACK` when the port went away or came back, `RESUMED` when the process that
        reads it was started again, `PASSED` or `DECODED`; else empty.
    source : int
        Which of the run's sources it is of.
    """

    arrival: int
    data: bytes
    event: str = ""
    source: int = 0


SOCKETS = ("tcp://", "socket://", "udp://")
"""How the address of a port in the network begins."""
LOST, BACK, RESUMED = "lost", "back", "resumed"
PASSED, DECODED = "decoding paused from here on", "decoded from here"
"""Between these two marks bytes were recorded but not decoded, because the machine was too busy."""


class Link(Protocol):
    """A source of bytes.

    Attributes
    ----------
    name : str
        For messages: the port or the file.
    live : bool
        Whether time passes at the other end. A replay is not live.
    encoding : str
        What the bytes are, see `tirebench.protocols`.
    """

    name: str
    live: bool
    encoding: str

    def receive(self, deadline: Deadline) -> Read | None:
        """Return what has come, empty at the deadline.

        None means that nothing will come any more.

        Raises
        ------
        UnpluggedError
            If the port went away.
        """

    def close(self) -> None:
        """Give the port back; calling twice does no harm."""

    def overruns(self) -> int:
        """Return how often a buffer below was full, as far as the system reports it."""


__all__ = ["BACK", "DECODED", "LOST", "PASSED", "RESUMED", "Link", "Read"]
