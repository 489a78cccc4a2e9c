"""The transmitter's end of a pseudo-terminal, raw, so that a real serial reader can open it."""

import array
import fcntl
import os
import select
import termios
import time
import tty
from pathlib import Path

from tirebench.deadline import Deadline
from tirebench.errors import LinkError, LinkTimeoutError

SETTLE = 0.05
"""After a reader has opened the port, the time it gets to set it up, [s]."""
POLL = 0.02


class PseudoTerminal:
    """A port that behaves as a plugged-in receiver.

    Attributes
    ----------
    path : str
        What a reader opens.

    Parameters
    ----------
    link : Path, optional
        A symbolic link to keep on the port, as udev keeps one by the name of an adapter: it stays
        the same when the port is plugged in again.
    """

    def __init__(self, link: Path | None = None) -> None:
        try:
            self._master, slave = os.openpty()
        except OSError as error:
            raise LinkError(
                f"no pseudo-terminal is available ({error.strerror}); Linux or macOS with a free "
                "one is needed; close other programs"
            ) from None
        tty.setraw(slave, termios.TCSANOW)
        self.path = os.ttyname(slave)
        os.close(slave)  # from now on the master hangs up whenever nobody reads
        os.set_blocking(self._master, False)
        self._poll = select.poll()
        self._poll.register(self._master, select.POLLOUT)
        self._link = link
        if link is not None:
            part = link.with_name(link.name + ".part")
            part.unlink(missing_ok=True)
            part.symlink_to(self.path)
            part.replace(link)

    @property
    def listened(self) -> bool:
        """Whether somebody has the port open."""
        return not any(event & select.POLLHUP for _, event in self._poll.poll(0))

    def wait_for_reader(self, deadline: Deadline) -> None:
        """Return when a reader has opened the port and had time to set it up.

        Raises
        ------
        LinkTimeoutError
            If none comes.
        """
        while not self.listened:
            if deadline.expired:
                raise LinkTimeoutError(
                    f"{self.path}: no program opened the port in time; a reader is needed, such as "
                    f"`tirebench run --port {self.path}`; start it"
                )
            time.sleep(POLL)
        time.sleep(SETTLE)

    def send(self, data: bytes) -> bool:
        """Write all bytes, waiting while the reader is behind; False if nobody reads."""
        view = memoryview(data)
        self.discard()
        while len(view):
            if not self.listened:
                return False
            try:
                view = view[os.write(self._master, view) :]
            except BlockingIOError:
                self._poll.poll(int(1e3 * POLL))
            except OSError:
                return False
        return True

    def drain(self, deadline: Deadline) -> bool:
        """Wait until the reader has taken everything; False at the deadline or if it left."""
        if not self.listened:
            return False
        waiting = array.array("i", [0])
        slave = os.open(self.path, os.O_RDONLY | os.O_NOCTTY | os.O_NONBLOCK)
        try:
            while not deadline.expired:
                fcntl.ioctl(slave, termios.FIONREAD, waiting)
                if waiting[0] == 0:
                    return True
                time.sleep(POLL)
            return False
        finally:
            os.close(slave)

    def wait_for_leave(self, deadline: Deadline) -> None:
        """Wait until the reader has closed the port, or the deadline."""
        while self.listened and not deadline.expired:
            time.sleep(POLL)

    def close(self) -> None:
        """Pull the cable: a reader that still has the port open loses it."""
        if self._master >= 0:
            if self._link is not None:
                self._link.unlink(missing_ok=True)
            os.close(self._master)
            self._master = -1

    def discard(self) -> None:
        """Throw away what a reader has written: commands to an adapter."""
        try:
            while os.read(self._master, 4096):
                pass
        except OSError:  # nothing more, or nobody there
            return
