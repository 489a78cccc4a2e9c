"""Bytes over the network: a TCP server to which the receiver sends, or UDP datagrams."""

import socket
import time
from contextlib import suppress
from select import select
from urllib.parse import urlsplit

from tirebench.deadline import Deadline
from tirebench.errors import DeviceError, LinkError, UnpluggedError
from tirebench.links import SOCKETS, Read
from tirebench.links.serial_port import GATHER, LARGEST_BATCH
from tirebench.protocols import SERIAL

CONNECT = 2.0
"""Time limit for the answer of a server, [s]."""
BUFFER = 2**22
"""What the system is asked to hold between two reads, [bytes]: 9 s of four wheels."""
_STREAMS = ("tcp", "socket")


class SocketLink:
    """``tcp://HOST:PORT`` or ``udp://[HOST]:PORT``; see `tirebench.links.Link`.

    Parameters
    ----------
    url : str
        TCP connects to the address. UDP listens at it: at one address of this machine, or without
        HOST at all of them.

    Raises
    ------
    DeviceError
        If it is not a valid address.
    LinkError
        If the server is not there, or the address is in use.
    """

    live = True

    def __init__(self, url: str) -> None:
        kind, host, number = address(url)
        self.name, self.encoding = url, SERIAL
        self._stream = kind in _STREAMS
        self._last = 0.0
        try:
            if self._stream:
                self._socket = socket.create_connection((host, number), CONNECT)
            else:
                self._socket = _bound(host, number)
        except OSError as error:
            what = (
                "a server that listens at this address"
                if self._stream
                else "a free address of this host"
            )
            raise LinkError(
                f"{url}: cannot be opened ({error.strerror or error}); {what} is needed; check "
                "address, cable and firewall"
            ) from None
        self._socket.setblocking(False)

    def receive(self, deadline: Deadline) -> Read | None:
        """Return what has come by the deadline, at once when there is something."""
        select([self._socket], [], [], min(deadline.remaining, 1.0))
        arrival = time.monotonic_ns()
        data = self._take()
        if data:
            wait = deadline.sooner(self._last + GATHER - time.monotonic()).remaining
            time.sleep(max(wait, 0.0))
            with suppress(UnpluggedError):  # noticed at the next read: this one is not lost
                data += self._take()
        self._last = time.monotonic()
        return Read(arrival, data)

    def send(self, data: bytes) -> None:
        """Send bytes: commands to an adapter behind a server.

        Raises
        ------
        UnpluggedError
            If the server went away.
        """
        try:
            self._socket.sendall(data)
        except OSError as error:
            raise self._gone(error) from None

    def close(self) -> None:
        """Close the connection."""
        self._socket.close()

    def overruns(self) -> int:
        """Return 0: the system does not report it."""
        return 0

    def _take(self) -> bytes:
        """Return the waiting bytes, up to `LARGEST_BATCH` and one piece more."""
        parts: list[bytes] = []
        while sum(map(len, parts)) < LARGEST_BATCH:
            try:
                part = self._socket.recv(LARGEST_BATCH)
            except BlockingIOError:
                break
            except OSError as error:
                raise self._gone(error) from None
            if self._stream and not part:
                if parts:
                    break
                raise self._gone(ConnectionError("the server closed the connection"))
            parts.append(part)
        return b"".join(parts)

    def _gone(self, error: OSError) -> UnpluggedError:
        return UnpluggedError(
            f"{self.name}: the connection was lost ({error}); an uninterrupted connection is "
            "needed; check cable and receiver, then start again"
        )


def _bound(host: str, number: int) -> socket.socket:
    """Return a socket that takes datagrams."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    made = socket.socket(family, socket.SOCK_DGRAM)
    try:
        with suppress(OSError):  # as much as the system allows
            made.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER)
        made.bind((host, number))
    except OSError:
        made.close()
        raise
    return made


def address(url: str) -> tuple[str, str, int]:
    """Return kind, host and number of a port in the network.

    Raises
    ------
    DeviceError
        If it is not a valid address.

    Examples
    --------
    >>> address("udp://:5005")
    ('udp', '', 5005)
    """
    parts = urlsplit(url)
    try:
        number = parts.port
    except ValueError:
        number = None
    nobody = parts.scheme in _STREAMS and not parts.hostname
    if not url.startswith(SOCKETS) or not number or parts.path or nobody:
        raise DeviceError(
            f"--port {url}: not a valid address; tcp://HOST:PORT or udp://[HOST]:PORT is needed, "
            "such as tcp://192.168.1.20:4001 or udp://:5005; correct it"
        )
    return parts.scheme, parts.hostname or "", number
