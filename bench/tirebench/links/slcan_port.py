"""A CAN adapter that speaks slcan on a serial port, read in bulk.

python-can reads slcan byte by byte, which does not hold the rate of one wheel over CAN FD.
"""

from tirebench.deadline import Deadline
from tirebench.errors import DeviceError
from tirebench.links import SOCKETS, Read
from tirebench.links.serial_port import SerialLink
from tirebench.links.socket_port import SocketLink
from tirebench.protocols import SLCAN

BITRATES = {
    10_000: "S0",
    20_000: "S1",
    50_000: "S2",
    100_000: "S3",
    125_000: "S4",
    250_000: "S5",
    500_000: "S6",
    750_000: "S7",
    1_000_000: "S8",
}
DATA_BITRATES = {2_000_000: "Y2", 5_000_000: "Y5"}


def commands(bitrate: int, data_bitrate: int | None, *, transmit: bool) -> bytes:
    r"""Return what opens the adapter's channel, listening only unless transmission is asked for.

    Classic adapters (Lawicel) know ``L``; those with CAN FD (CANable 2.0) are made silent by
    ``M1`` and opened by ``O``.

    Raises
    ------
    DeviceError
        If the adapter has no command for a rate.

    Examples
    --------
    >>> commands(500_000, None, transmit=False)
    b'\r\rC\rS6\rL\r'
    >>> commands(1_000_000, 5_000_000, transmit=False)
    b'\r\rC\rS8\rY5\rM1\rO\r'
    """
    for given, known in ((bitrate, BITRATES), (data_bitrate, DATA_BITRATES)):
        if given is not None and given not in known:
            raise DeviceError(
                f"bit rate {given}: slcan supports {', '.join(str(rate) for rate in known)}; "
                "choose one of them, or another kind of adapter"
            )
    words = ["", "", "C", BITRATES[bitrate]]
    if data_bitrate is None:
        words += ["O" if transmit else "L"]
    else:
        words += [DATA_BITRATES[data_bitrate], "M0" if transmit else "M1", "O"]
    return "".join(f"{word}\r" for word in words).encode()


class SlcanLink:
    """The adapter's text lines as they come; see `tirebench.links.Link`."""

    live = True

    def __init__(
        self, port: str, bitrate: int, data_bitrate: int | None = None, *, transmit: bool = False
    ) -> None:
        opening = commands(bitrate, data_bitrate, transmit=transmit)
        sockets = port.startswith(SOCKETS)
        self._port = SocketLink(port) if sockets else SerialLink(port)
        self.name = f"slcan:{port}"
        self.encoding = SLCAN
        try:
            self._port.send(opening)
        except Exception:
            self._port.close()
            raise

    def receive(self, deadline: Deadline) -> Read | None:
        """Return what has come by the deadline, at once when there is something."""
        return self._port.receive(deadline)

    def send(self, data: bytes) -> None:
        """Write lines, where transmission was asked for."""
        self._port.send(data)

    def close(self) -> None:
        """Close the port; the adapter is left as it is, so that nothing waits for it."""
        self._port.close()

    def overruns(self) -> int:
        """Return how often a buffer of the port was full."""
        return self._port.overruns()
