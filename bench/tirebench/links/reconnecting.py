"""A link that opens again by itself when its port went away."""

import time
from collections.abc import Callable
from pathlib import Path

from tirebench.deadline import Deadline
from tirebench.errors import LinkError, UnpluggedError
from tirebench.links import BACK, LOST, Link, Read

FIRST_WAIT, LONGEST_WAIT = 0.1, 2.0
"""Time between two attempts: it doubles from the first to the longest, [s]."""
GLANCE = 0.05
"""While it waits, the port's name is looked for this often: a port that appears is tried, [s]."""


class ReconnectingLink:
    """Report a lost port, try to open it again, and report its return; see `tirebench.links.Link`.

    Parameters
    ----------
    open_link : callable
        Opens the port.
    patience : float, [s]
        When the port stays away for longer, the loss is raised.
    away : str, optional
        Name of a port that may be away now: it is waited for.
    wait : float, [s]
        How long, where it was never open before; 0: it was, and `patience` holds.
    forever : bool
        After that it is not raised, but stands in `gone`, and the port is still tried.

    Attributes
    ----------
    gone : str
        What was to be raised, where it is tried forever; empty while there is patience.

    Raises
    ------
    LinkError
        If the port cannot be opened at first, and is not one that may be away.
    """

    live = True

    def __init__(
        self,
        open_link: Callable[[], Link],
        patience: float,
        away: str = "",
        *,
        wait: float = 0.0,
        forever: bool = False,
    ) -> None:
        self.gone = ""
        self._forever = forever
        self._open = open_link
        self._patience = patience
        self._link: Link | None = None
        self.name, self.encoding = away, ""
        self._overruns = 0
        self._wait = FIRST_WAIT
        self._next = self._given_up = 0.0
        self._loss: LinkError = UnpluggedError(
            f"{away}: the port was lost; check cable and receiver"
        )
        self._seen = True
        self._found = BACK  # what it means when the port is there
        try:
            self._link = open_link()
            self.name, self.encoding = self._link.name, self._link.encoding
        except LinkError as error:
            if not away:
                raise
            self._lose(error if wait else self._loss)
            if wait:
                self._given_up, self._found = time.monotonic() + wait, ""

    def receive(self, deadline: Deadline) -> Read | None:
        """Return what has come by the deadline; see `tirebench.links.Link.receive`."""
        if self._link is None:
            return self._again(deadline)
        try:
            return self._link.receive(deadline)
        except UnpluggedError as error:
            if self._patience <= 0.0 and not self._forever:
                raise
            self._lose(error)
            return Read(time.monotonic_ns(), b"", LOST)

    def close(self) -> None:
        """Close the port if it is open."""
        if self._link is not None:
            self._link.close()

    def overruns(self) -> int:
        """Return the overruns so far, those before a loss included."""
        return self._overruns + (0 if self._link is None else self._link.overruns())

    def _lose(self, error: LinkError) -> None:
        if self._link is not None:
            self._overruns += self._link.overruns()
            try:
                self._link.close()
            except (OSError, LinkError):
                self._overruns += 0  # a port that is gone may not like to be closed
        now = time.monotonic()
        self._link, self._loss, self._wait = None, error, FIRST_WAIT
        self._next, self._given_up = now + FIRST_WAIT, now + self._patience
        self._seen = self._there()

    def _again(self, deadline: Deadline) -> Read:
        """Wait for the next attempt or the deadline, and try."""
        while True:
            now = time.monotonic()
            there = self._there()
            if now >= self._next or (there and not self._seen):
                self._seen = there
                if self._try():
                    found, self._found = self._found, BACK
                    return Read(time.monotonic_ns(), b"", found)
                self._wait = min(2.0 * self._wait, LONGEST_WAIT)
                self._next = time.monotonic() + self._wait
            self._seen = there
            if time.monotonic() > self._given_up:
                if not self._forever:
                    raise self._loss
                self.gone = str(self._loss)
            if deadline.expired:
                return Read(time.monotonic_ns(), b"")
            left = min(GLANCE, deadline.remaining, max(self._next - time.monotonic(), 0.0))
            time.sleep(max(left, 1e-3))

    def _try(self) -> bool:
        try:
            self._link = self._open()
        except LinkError:
            return False
        self.name, self.encoding, self.gone = self._link.name, self._link.encoding, ""
        return True

    def _there(self) -> bool:
        """Return whether the port exists in the file system, where its name is a path."""
        path = self.name.rpartition(":")[2]
        return path.startswith("/") and Path(path).exists()
