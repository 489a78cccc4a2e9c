"""A serial port, by pyserial: opened exclusively, read in bulk."""

import struct
import sys
import time
from collections.abc import Iterator

import serial
from serial.tools import list_ports

from bench.deadline import Deadline
from bench.errors import LinkError, UnpluggedError
from bench.links import Read
from bench.protocols import SERIAL

BAUD = 2_000_000
"""Default rate; 16 samples a frame at 10 kHz need 1.13 Mbaud."""
GATHER = 0.002
"""After the first byte, wait this long for more: fewer and larger batches cost less, [s]."""
_TIOCGICOUNT = 0x545D
"""Linux: the counters of a UART."""
_COUNTERS = struct.Struct("20i")
_OVERRUNS = (7, 10)
"""Places of `overrun` and `buf_overrun` in ``struct serial_icounter_struct``."""


class SerialLink:
    """A port that is read in bulk; see `bench.links.Link`.

    Parameters
    ----------
    port : str
        ``/dev/ttyUSB0``, ``COM3``, or a link in ``/dev/serial/by-id``.
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
        try:
            self._port = serial.Serial(port, baud, timeout=0.0, exclusive=True, write_timeout=1.0)
        except (serial.SerialException, OSError, ValueError) as error:
            known = ", ".join(entry.split()[0] for entry in ports()) or "none"
            raise LinkError(
                f"{port}: the port cannot be opened ({error}); a free serial port is needed, "
                f"those found are: {known}; plug it in, close the other program, or check the "
                "rights (group dialout)"
            ) from None

    def receive(self, deadline: Deadline) -> Read | None:
        """Return what has come by the deadline, at once when there is something."""
        try:
            self._port.timeout = min(deadline.remaining, 1.0)
            first = self._port.read(max(1, self._port.in_waiting))
            arrival = time.monotonic_ns()
            if not first:
                return Read(arrival, b"")
            if self._gather:
                time.sleep(min(self._gather, deadline.remaining))
            self._port.timeout = 0.0
            return Read(arrival, bytes(first + self._port.read(self._port.in_waiting)))
        except (OSError, serial.SerialException, TypeError) as error:
            # in_waiting raises OSError, read SerialException; TypeError: closed by another thread
            raise self._gone(error) from None

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
        """Return how often the UART or its buffer was full; 0 where the system does not tell."""
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
            f"{self.name}: the port went away ({error}); a steady connection is needed; "
            "check cable and receiver, then start again"
        )


def ports() -> Iterator[str]:
    """Yield a line for each serial port of this machine: device, description, identity."""
    for port in sorted(list_ports.comports()):
        yield f"{port.device}  {port.description}  {port.hwid}"
