"""A serial port, by pyserial: opened exclusively, read in bulk."""

import errno
import struct
import sys
import time
from collections.abc import Iterator

import serial
from serial.tools import list_ports

from tirebench.deadline import Deadline
from tirebench.errors import LinkError, UnpluggedError
from tirebench.links import Read
from tirebench.protocols import SERIAL

BAUD = 2_000_000
"""Default rate; 16 samples a frame at 10 kHz need 1.13 Mbaud."""
GATHER = 0.004
"""Time from one batch to the next, [s]: fewer and larger ones cost less."""
MUCH, NAP = 2048, 0.001
"""Half of what the system holds for one read, [bytes]; where so much came at once, more waits
behind it, and is fetched after a nap, [s]."""
LARGEST_BATCH = 2**16
"""A batch does not grow beyond this by gathering, [bytes]."""
_TIOCGICOUNT = 0x545D
"""Linux: the counters of a UART."""
_COUNTERS = struct.Struct("20i")
_CAUSES = {
    errno.ENOENT: "no such port exists; plug the receiver in, or name another port",
    errno.EACCES: "this user has no access; add the user to the group dialout and log in again",
    errno.EAGAIN: "another program has it open; close that program",
    errno.EBUSY: "another program has it open; close that program",
    errno.EISDIR: "it is a folder; name a serial port",
    errno.ENOTTY: "it is not a serial port; name another",
}
_OVERRUNS = (7, 10)
"""Places of `overrun` and `buf_overrun` in ``struct serial_icounter_struct``."""


class SerialLink:
    """A port that is read in bulk; see `tirebench.links.Link`.

    Parameters
    ----------
    port : str
        ``/dev/ttyUSB0``, ``COM3``, a link in ``/dev/serial/by-id``, or ``rfc2217://HOST:PORT``.
    baud : int
        Ignored by native USB and pseudo-terminals.
    gather : float, [s]

    Raises
    ------
    LinkError
        If the port is not there, in use, or not allowed.
    """

    live = True

    def __init__(self, port: str, baud: int = BAUD, gather: float = GATHER) -> None:
        self.name = port
        self.encoding = SERIAL
        self._gather = gather
        self._last = 0.0
        try:
            if "://" in port:
                self._port = serial.serial_for_url(port, baud, timeout=0.0, write_timeout=1.0)
            else:
                self._port = serial.Serial(
                    port, baud, timeout=0.0, exclusive=True, write_timeout=1.0
                )
        except (serial.SerialException, OSError, ValueError) as error:
            known = ", ".join(entry.split()[0] for entry in ports()) or "none"
            raise LinkError(
                f"{port}: the port cannot be opened: {_cause(error)}; a free serial port is "
                f"needed; the ports found are: {known}"
            ) from None

    def receive(self, deadline: Deadline) -> Read | None:
        """Return what has come by the deadline, at once when there is something."""
        try:
            patience = round(min(deadline.remaining, 1.0), 2)
            if patience != self._port.timeout:  # to set it costs calls of the system
                self._port.timeout = patience
            data = self._port.read(max(1, self._port.in_waiting))
            arrival = time.monotonic_ns()
            if data:
                data += self._gathered(len(data), deadline)
            self._last = time.monotonic()
            return Read(arrival, bytes(data))
        except (OSError, serial.SerialException, TypeError) as error:
            # in_waiting raises OSError, read SerialException; TypeError: closed by another thread
            raise self._gone(error) from None

    def _gathered(self, newest: int, deadline: Deadline) -> bytes:
        """Return what comes until the next batch is due, after so many bytes at once.

        A port that goes away meanwhile is noticed at the next batch: this one is not lost.
        """
        more, end = b"", deadline.sooner(self._last + self._gather - time.monotonic())
        while not end.expired and len(more) < LARGEST_BATCH:
            time.sleep(min(end.remaining, NAP) if newest >= MUCH else end.remaining)
            try:
                chunk = self._port.read(self._port.in_waiting)
            except (OSError, serial.SerialException, TypeError):
                break
            more, newest = more + chunk, len(chunk)
        return more

    def send(self, data: bytes) -> None:
        """Write bytes: commands to an adapter.

        Raises
        ------
        UnpluggedError
            If the port went away.
        """
        try:
            self._port.write(data)
        except (OSError, serial.SerialException, TypeError) as error:
            raise self._gone(error) from None

    def close(self) -> None:
        """Close the port."""
        self._port.close()

    def overruns(self) -> int:
        """Return how often the UART or its buffer was full; 0 where this is unknown."""
        if sys.platform != "linux":
            return 0
        import fcntl

        try:
            answer = fcntl.ioctl(self._port.fileno(), _TIOCGICOUNT, bytes(_COUNTERS.size))
        except (OSError, serial.SerialException, TypeError):  # a pseudo-terminal has no counters
            return 0
        counters = _COUNTERS.unpack(answer)
        return sum(counters[place] for place in _OVERRUNS)

    def _gone(self, error: Exception) -> UnpluggedError:
        return UnpluggedError(
            f"{self.name}: the port was lost ({error}); an uninterrupted connection is needed; "
            "check cable and receiver, then start again"
        )


def _cause(error: Exception) -> str:
    """Return why a port does not open, and what to do; pyserial's own words where it is rare."""
    number = getattr(error, "errno", None)
    if number is None and f"({errno.ENOTTY}," in str(error):  # given in the text only
        number = errno.ENOTTY
    return _CAUSES.get(number or 0, f"{error}; plug it in, or close the program that uses it")


def ports() -> Iterator[str]:
    """Yield a line for each serial port of this machine: device, description, identity."""
    for port in sorted(list_ports.comports()):
        yield f"{port.device}  {port.description}  {port.hwid}"
