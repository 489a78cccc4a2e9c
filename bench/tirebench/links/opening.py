"""A port as it is typed, and the link that it names.

===========================  ==========================================================
typed                        link
===========================  ==========================================================
``/dev/ttyUSB0``, ``COM3``   SERIAL v1 on a serial port
``tcp://HOST:PORT``          the same from a server in the network (``socket://`` too)
``udp://[HOST]:PORT``        the same in datagrams that are sent to this machine
``rfc2217://HOST:PORT``      the same from a serial port in the network
``slcan:/dev/ttyACM0``       CAN adapter with slcan, our own bulk reader
``can:INTERFACE:CHANNEL``    python-can: ``can:socketcan:can0``, ``can:virtual:test``, ...
===========================  ==========================================================
"""

from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from tirebench.errors import DeviceError
from tirebench.links import SOCKETS, Link
from tirebench.protocols import CAN, SERIAL, SLCAN

BITRATE = 500_000
KINDS = ("slcan", "can")
URLS = (*SOCKETS, "rfc2217://")
_MODULES = {SERIAL: "serial_port", SLCAN: "slcan_port", CAN: "can_bus"}


@dataclass(frozen=True, slots=True)
class PortPlan:
    """A port and how it is opened.

    Attributes
    ----------
    port : str
        As typed.
    baud : int
        Baud rate of a serial line.
    bitrate : int
        Bit rate of a CAN bus.
    data_bitrate : int or None
        None for classic CAN.
    options : tuple of str
        ``KEY=VALUE`` for python-can.
    """

    port: str
    baud: int = 2_000_000
    bitrate: int = BITRATE
    data_bitrate: int | None = None
    options: tuple[str, ...] = ()

    @property
    def encoding(self) -> str:
        """Encoding of its bytes; see `tirebench.protocols`."""
        return {"slcan": SLCAN, "can": CAN}.get(self.port.partition(":")[0], SERIAL)

    def load(self) -> None:
        """Import what `open` needs: python-can takes over half a second of CPU."""
        module = "socket_port" if self.port.startswith(SOCKETS) else _MODULES[self.encoding]
        import_module(f"tirebench.links.{module}")

    def check(self) -> None:
        """Look at what was typed; nothing is opened.

        Raises
        ------
        DeviceError
            If it names no port.
        """
        kind, colon, rest = self.port.partition(":")
        if self.port.startswith(SOCKETS):
            from tirebench.links.socket_port import address

            address(self.port)
        elif self.port.startswith(URLS):
            return
        elif self.port in KINDS or (colon and kind not in KINDS and "/" not in kind):
            raise DeviceError(
                f"--port {self.port}: {kind!r} is not a {'name' if kind in KINDS else 'kind'} of a "
                "port; a serial port such as /dev/ttyUSB0 or COM3, tcp://HOST:PORT, "
                "udp://[HOST]:PORT, slcan:/dev/ttyACM0 or can:INTERFACE:CHANNEL is needed; see "
                "`tirebench ports`"
            )
        if self.encoding == SLCAN and not rest:
            raise DeviceError(
                f"--port {self.port}: the serial port is missing; slcan:PORT is needed, such as "
                "slcan:/dev/ttyACM0; `tirebench ports` lists the ports"
            )
        if self.encoding == CAN and not all(rest.partition(":")):
            raise DeviceError(
                f"--port {self.port}: the channel is missing; can:INTERFACE:CHANNEL is needed, "
                "such as can:socketcan:can0; correct it"
            )
        bus_options(self.options)

    def open(self, *, transmit: bool = False) -> Link:
        """Return the open link.

        Raises
        ------
        LinkError
            If it cannot be opened.
        DeviceError
            If what was typed names no port.
        """
        self.check()
        rest = self.port.partition(":")[2]
        if self.encoding == SLCAN:
            from tirebench.links.slcan_port import SlcanLink

            return SlcanLink(rest, self.bitrate, self.data_bitrate, transmit=transmit)
        if self.encoding == CAN:
            from tirebench.links.can_bus import CanLink

            interface, _, channel = rest.partition(":")
            return CanLink(
                interface,
                channel,
                self.bitrate,
                self.data_bitrate,
                bus_options(self.options),
                transmit=transmit,
            )
        if self.port.startswith(SOCKETS):
            from tirebench.links.socket_port import SocketLink

            return SocketLink(self.port)
        from tirebench.links.serial_port import SerialLink

        return SerialLink(self.port, self.baud)


def bus_options(texts: Sequence[str]) -> dict[str, Any]:
    """Return python-can's arguments from ``KEY=VALUE``; whole numbers become numbers.

    Raises
    ------
    DeviceError
        If a text has no ``=``; the message names every such text.

    Examples
    --------
    >>> bus_options(["host=127.0.0.1", "port=29536"])
    {'host': '127.0.0.1', 'port': 29536}
    """
    faults = [
        f"--bus-option {text}: the '=' is missing; KEY=VALUE is needed; correct it"
        for text in texts
        if "=" not in text
    ]
    if faults:
        raise DeviceError(faults)
    pairs = (text.partition("=")[::2] for text in texts)
    return {key: int(value) if value.isdecimal() else value for key, value in pairs}
