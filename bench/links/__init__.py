"""Where bytes come from: one protocol, a child for each kind of line.

A reader asks for bytes with a deadline that is handed down; nothing below it waits longer.
"""

from typing import Protocol

from bench.deadline import Deadline


class Link(Protocol):
    """A source of bytes.

    Attributes
    ----------
    name : str
        For messages: the port or the file.
    live : bool
        Whether time passes at the other end. A replay is not live.
    """

    name: str
    live: bool

    def receive(self, deadline: Deadline) -> tuple[int, bytes] | None:
        """Return arrival [ns, monotonic] and what has come, empty at the deadline.

        None means that nothing will come any more.

        Raises
        ------
        UnpluggedError
            If the port went away.
        """

    def close(self) -> None:
        """Give the port back; calling twice does no harm."""


__all__ = ["Link"]
