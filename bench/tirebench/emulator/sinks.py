"""Where an emulator's frames go: a pseudo-terminal, or a bus of python-can."""

import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tirebench.deadline import Deadline
from tirebench.errors import LinkError, UnpluggedError
from tirebench.links.pseudo import PseudoTerminal

if TYPE_CHECKING:
    import can

AWAY = 3600.0
"""How long a cable that is not plugged in again stays away, [s]."""


class TerminalSink:
    """A pseudo-terminal whose cable may be pulled and plugged in, again and again.

    Parameters
    ----------
    link : Path, optional
        Name that stays, see `tirebench.links.pseudo.PseudoTerminal`.
    unplug : float, optional, [s]
        Pull the cable so long after it was plugged in.
    replug : float, optional, [s]
        Plug it in again so long after it was pulled; without, it ends there.

    Attributes
    ----------
    unplugged : int
        How often the cable was pulled.
    """

    played = "played: the reader has taken all of it"

    def __init__(
        self, link: Path | None = None, unplug: float | None = None, replug: float | None = None
    ) -> None:
        self.unplugged = 0
        self._link = link
        self._plugged_for, self._away_for = unplug, replug
        self._port = PseudoTerminal(link)
        self.path = self._port.path if link is None else str(link)
        self._change = Deadline.never()
        self._away = False

    def wait_for_reader(self, deadline: Deadline) -> None:
        """Return when a reader has opened the port; from then on the cable's clock runs."""
        self._port.wait_for_reader(deadline)
        self._plan()

    def send(self, frames: Sequence[bytes]) -> bool:
        """Write frames; frames sent while the cable is out are lost.

        Raises
        ------
        UnpluggedError
            If the cable was pulled for good.
        """
        if self._change.expired:
            self._pull_or_plug()
        return not self._away and self._port.send(b"".join(frames))

    def drain(self, patience: float) -> bool:
        """Wait until the reader has taken all; False if it left before, or is too slow."""
        return not self._away and self._port.drain(Deadline.after(patience))

    def end(self, patience: float) -> None:
        """Let the reader leave."""
        if not self._away:
            self._port.wait_for_leave(Deadline.after(patience))

    def close(self) -> None:
        """Pull the cable."""
        self._port.close()

    def _pull_or_plug(self) -> None:
        if self._away:
            self._port = PseudoTerminal(self._link)
            self._away = False
            self._plan()
            return
        self._port.close()
        self.unplugged += 1
        if self._away_for is None:
            raise UnpluggedError(f"{self.path}: the cable was pulled, as --unplug asks")
        self._away, self._change = True, Deadline.after(self._away_for)

    def _plan(self) -> None:
        if self._plugged_for is not None:
            self._change = Deadline.after(self._plugged_for)


class BusSink:
    """A bus of python-can.

    Parameters
    ----------
    bus : can.BusABC
    path : str
        For messages.
    """

    played = "played: all of it was put on the bus, which does not show who reads"

    def __init__(self, bus: "can.BusABC", path: str) -> None:
        self.path = path
        self._bus = bus

    def wait_for_reader(self, deadline: Deadline) -> None:
        """Go on at once: a bus does not show who listens."""

    def send(self, frames: Sequence[Any]) -> bool:
        """Send frames, each a list of messages.

        Raises
        ------
        UnpluggedError
            If the bus went away.
        """
        import can

        try:
            for messages in frames:
                for message in messages:
                    self._bus.send(message)
        except (can.CanError, OSError) as error:
            raise UnpluggedError(
                f"{self.path}: the bus was lost ({error}); an uninterrupted connection is needed; "
                "check cable and adapter"
            ) from None
        return True

    def drain(self, patience: float) -> bool:
        """Say yes: a bus has taken what was sent."""
        return True

    def end(self, patience: float) -> None:
        """Give readers a moment for the last frames."""
        time.sleep(min(patience, 0.2))

    def close(self) -> None:
        """Give the bus back."""
        self._bus.shutdown()


def open_bus(text: str, *, fd: bool) -> BusSink:
    """Open a bus to send on: ``can:INTERFACE:CHANNEL``.

    Raises
    ------
    LinkError
        If it cannot be opened.
    """
    import can

    kind, _, rest = text.partition(":")
    interface, _, channel = rest.partition(":")
    if kind != "can" or not interface or not channel:
        raise LinkError(
            f"--bus {text}: can:INTERFACE:CHANNEL is needed, such as "
            "can:udp_multicast:239.74.163.2 or can:socketcan:vcan0; correct it"
        )
    arguments: dict[str, Any] = {"fd": True} if fd else {}
    if interface == "virtual":
        arguments = {"protocol": can.CanProtocol.CAN_FD}
    try:
        return BusSink(can.Bus(interface=interface, channel=channel, **arguments), text)
    except Exception as error:  # each backend has its own, and some raise bare OSError
        known = ", ".join(sorted(can.VALID_INTERFACES))
        raise LinkError(
            f"--bus {text}: cannot be opened ({type(error).__name__}: {error}); known interfaces "
            f"are {known}; check name, channel and driver"
        ) from None
