"""Estimates to other programs: CAN frames for a dyno, JSON over UDP for PlotJuggler.

Neither may slow or end a run: what cannot be sent is dropped and counted.
"""

import ipaddress
import json
import socket
from collections import Counter
from collections.abc import Sequence
from typing import Any, Protocol

from tirebench.errors import DeviceError, LinkError
from tirebench.estimator.chain import Turn
from tirebench.links.opening import PortPlan
from tirebench.live.estimate_frames import estimate_frames
from tirebench.protocols import CAN, SERIAL
from tirebench.protocols.slcan import encode
from tirebench.recording.document import turn_document


class Sender(Protocol):
    """Where turns are sent."""

    dropped: int

    def send(self, turns: Sequence[Turn]) -> None:
        """Send turns, or drop them."""

    def close(self) -> None:
        """Give the port back."""


class UdpSender:
    """One datagram of JSON a turn: PlotJuggler's UDP server reads it.

    The values stand below ``tirebench/WHEEL``; units are those of the document, ``t`` is the
    device time in seconds.
    """

    def __init__(self, host: str, port: int) -> None:
        self.dropped = 0
        self._target = (host, port)
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        self._socket.setblocking(False)

    def send(self, turns: Sequence[Turn]) -> None:
        """Send each turn as a datagram."""
        for turn in turns:
            entry = {k: v for k, v in turn_document(turn).items() if isinstance(v, int | float)}
            line = {"t": turn.device_time, "tirebench": {str(turn.wheel): entry}}
            try:
                self._socket.sendto(json.dumps(line).encode(), self._target)
            except OSError:
                self.dropped += 1

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


class CanSender:
    """Estimates on a CAN bus that was opened to transmit; see `tirebench.protocols.estimates`."""

    def __init__(self, port: PortPlan) -> None:
        if port.encoding == SERIAL:
            raise DeviceError(
                f"--estimates-out {port.port}: not a CAN bus; slcan:PORT or can:INTERFACE:CHANNEL "
                "is needed; name one"
            )
        self.dropped = 0
        self._packed = port.encoding == CAN
        self._link: Any = port.open(transmit=True)
        self._numbers: Counter[int] = Counter()

    def send(self, turns: Sequence[Turn]) -> None:
        """Send the frames of each turn."""
        for turn in turns:
            number = self._numbers[turn.wheel]
            self._numbers[turn.wheel] += 1
            frames = estimate_frames(turn, turn.wheel % 8, number)
            try:
                self._link.send(frames if self._packed else b"".join(encode(frames)))
            except LinkError:
                self.dropped += 1

    def close(self) -> None:
        """Close the bus."""
        self._link.close()


def udp_target(text: str) -> tuple[str, int]:
    """Return host and port of ``PORT`` or ``HOST:PORT``; the loopback where no host is named.

    Raises
    ------
    DeviceError
        If it is neither.

    Examples
    --------
    >>> udp_target("9870"), udp_target("192.0.2.7:9870")
    (('127.0.0.1', 9870), ('192.0.2.7', 9870))
    """
    host, _, port = text.rpartition(":")
    host = host.strip("[]") or "127.0.0.1"
    try:
        number = int(port)
        ipaddress.ip_address(host)
    except ValueError:
        number = -1
    if not 0 < number < 65536:
        raise DeviceError(
            f"--plotjuggler {text}: PORT or ADDRESS:PORT is needed, such as 9870 or "
            "192.0.2.7:9870; correct it"
        )
    return host, number
