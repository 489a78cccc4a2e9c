"""A CAN bus by python-can: any of its interfaces, by name."""

import socket
import time
from collections.abc import Mapping
from typing import Any

import can
import numpy as np

from tirebench.deadline import Deadline
from tirebench.errors import DeviceError, LinkError, UnpluggedError
from tirebench.links import Read
from tirebench.protocols import CAN
from tirebench.wire.can_batch import FD_SIZE, CanBatch, pack

LARGEST_BATCH = 4096
"""Frames that one read brings at most."""
GATHER = 0.002
"""After the first frame, wait this long for more, [s]."""
_SILENT: Mapping[str, dict[str, Any]] = {
    "cantact": {"monitor": True},
    "kvaser": {"driver_mode": False},
    "nixnet": {"listen_only": True},
    "pcan": {"state": can.BusState.PASSIVE},
    "seeedstudio": {"operation_mode": "silent"},
    "slcan": {"listen_only": True},
    "systec": {"state": can.BusState.PASSIVE},
    "vector": {"listen_only": True},
}
"""Option that sets each interface to listen-only."""
_NO_CONTROLLER = ("virtual", "udp_multicast", "serial", "socketcan", "socketcand")
"""Interfaces that drive no controller themselves; that of SocketCAN is set by the system."""
ACKNOWLEDGE = "acknowledge"
"""Bus option that accepts a controller which cannot be set to listen-only."""


class CanLink:
    """Frames of a bus, packed; see `tirebench.links.Link`.

    Parameters
    ----------
    interface, channel : str
        As python-can names them: ``socketcan`` and ``can0``, ``virtual`` and ``test``.
    bitrate, data_bitrate : int, optional
        Where the interface sets them; a data bit rate means CAN FD.
    options : mapping, optional
        More of python-can's arguments: ``host``, ``port``, ``app_name``.
    transmit : bool
        Otherwise nothing is sent, and the controller is set to listen-only.

    Raises
    ------
    LinkError
        If the bus cannot be opened.
    DeviceError
        If the controller cannot be set to listen-only, and the option `ACKNOWLEDGE` does not accept
        that.
    """

    live = True

    def __init__(
        self,
        interface: str,
        channel: str,
        bitrate: int | None = None,
        data_bitrate: int | None = None,
        options: Mapping[str, Any] | None = None,
        *,
        transmit: bool = False,
    ) -> None:
        self.name = f"can:{interface}:{channel}"
        self.encoding = CAN
        self._transmit = transmit
        arguments: dict[str, Any] = {"receive_own_messages": False}
        if interface != "virtual" and bitrate is not None:
            arguments["bitrate"] = bitrate
        if data_bitrate is not None:
            arguments["fd"] = True
            if interface != "virtual":
                arguments["data_bitrate"] = data_bitrate
        if interface == "virtual":
            arguments["protocol"] = can.CanProtocol.CAN_FD
            arguments.pop("fd", None)
        given = dict(options or {})
        accepted = bool(given.pop(ACKNOWLEDGE, 0))
        if not (transmit or accepted):
            arguments |= _silent(self.name, interface)
        try:
            self._bus = can.Bus(interface=interface, channel=channel, **(arguments | given))
        except Exception as error:  # each backend has its own, and some raise bare OSError
            known = ", ".join(sorted(can.VALID_INTERFACES))
            raise LinkError(
                f"{self.name}: the bus cannot be opened ({type(error).__name__}: {error}); known "
                f"interfaces are {known}; check its name, channel, driver and your access rights"
            ) from None

    def receive(self, deadline: Deadline) -> Read | None:
        """Return the frames that have come by the deadline, packed, at once when there are any."""
        first = self._next(min(deadline.remaining, 1.0))
        arrival = time.monotonic_ns()
        if first is None:
            self._check_server()
            return Read(arrival, b"")
        messages = [first]
        end = deadline.sooner(GATHER)
        while len(messages) < LARGEST_BATCH:
            message = self._next(end.remaining)
            if message is None:
                break
            messages.append(message)
        batch = packed(messages)
        return Read(arrival, pack(batch) if len(batch) else b"")

    def send(self, batch: CanBatch) -> None:
        """Send frames.

        Raises
        ------
        LinkError
            If transmission was not asked for.
        UnpluggedError
            If the bus went away.
        """
        if not self._transmit:
            raise LinkError(
                f"{self.name}: the bus was opened for listening only; sending needs a bus that is "
                "opened for sending; open it so"
            )
        try:
            for row in range(len(batch)):
                self._bus.send(message_of(batch, row))
        except (can.CanError, OSError, ValueError) as error:
            raise self._gone(error) from None

    def close(self) -> None:
        """Give the bus back."""
        self._bus.shutdown()

    def overruns(self) -> int:
        """Return 0: python-can does not report it."""
        return 0

    def _next(self, timeout: float) -> can.Message | None:
        try:
            return self._bus.recv(timeout)
        except (can.CanError, OSError, ValueError, AttributeError) as error:
            raise self._gone(error) from None

    def _check_server(self) -> None:
        """Detect a closed connection to a server, which python-can takes for an idle bus."""
        for own in vars(self._bus).values():
            if isinstance(own, socket.socket) and own.type == socket.SOCK_STREAM:
                try:
                    ended = own.recv(1, socket.MSG_PEEK | socket.MSG_DONTWAIT) == b""
                except BlockingIOError:
                    ended = False
                except OSError as error:
                    raise self._gone(error) from None
                if ended:
                    raise self._gone(ConnectionError("the server closed the connection"))

    def _gone(self, error: Exception) -> UnpluggedError:
        return UnpluggedError(
            f"{self.name}: the bus was lost ({type(error).__name__}: {error}); an uninterrupted "
            "connection is needed; check cable and adapter, then start again"
        )


def _silent(name: str, interface: str) -> dict[str, Any]:
    """Return what makes the controller of an interface silent."""
    if interface in _SILENT or interface in _NO_CONTROLLER:
        return _SILENT.get(interface, {})
    if interface not in can.VALID_INTERFACES:
        return {}  # python-can says so better
    raise DeviceError(
        f"{name}: python-can cannot set this interface to listen-only, so its controller would "
        f"acknowledge the frames of other nodes; {', '.join(sorted(_SILENT))} can listen only; use "
        f"one of them, or accept the acknowledgement with --bus-option {ACKNOWLEDGE}=1"
    )


def packed(messages: list[can.Message]) -> CanBatch:
    """Return data frames as a batch; error and remote frames are left out."""
    kept = [m for m in messages if not (m.is_error_frame or m.is_remote_frame)]
    width = FD_SIZE - 8 if any(len(m.data) > 8 for m in kept) else 8
    data = b"".join(bytes(m.data).ljust(width, b"\0") for m in kept)
    return CanBatch(
        identifier=np.array([m.arbitration_id for m in kept], np.int64),
        extended=np.array([m.is_extended_id for m in kept], np.bool_),
        fd=np.array([m.is_fd for m in kept], np.bool_),
        length=np.array([len(m.data) for m in kept], np.int64),
        data=np.frombuffer(data, np.uint8).reshape(-1, width),
    )


def message_of(batch: CanBatch, row: int, timestamp: float = 0.0) -> can.Message:
    """Return one frame as python-can has it."""
    fd = bool(batch.fd[row])
    return can.Message(
        timestamp=timestamp,
        arbitration_id=int(batch.identifier[row]),
        is_extended_id=bool(batch.extended[row]),
        is_fd=fd,
        bitrate_switch=fd,
        data=batch.data[row, : batch.length[row]].tobytes(),
    )
