"""One source of a run: a port, what its bytes mean, and what its wheels are called."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tirebench.errors import DeviceError
from tirebench.estimator.wheels import Line, Wheels
from tirebench.links.opening import PortPlan
from tirebench.protocols import LINE_MAP, SERIAL
from tirebench.protocols.plan import ProtocolPlan
from tirebench.protocols.user_map import read_map
from tirebench.wire.conditions import TELLABLE
from tirebench.wire.device import Device
from tirebench.wire.frames import GAGES


@dataclass(frozen=True, slots=True)
class SourcePlan:
    """What is read from one port.

    Attributes
    ----------
    port : PortPlan
    protocol : ProtocolPlan
    devices : mapping of wheel to Device
        ``None`` is the key of the device for all others; empty: what the protocol says.
    wheel : int or None
        Number that its only wheel gets; None: numbers are as sent.
    device_text : str
        Text of the device files.
    """

    port: PortPlan
    protocol: ProtocolPlan = field(default_factory=ProtocolPlan)
    devices: Mapping[int | None, Device] = field(default_factory=dict)
    wheel: int | None = None
    device_text: str = ""

    @property
    def known_wheels(self) -> list[int]:
        """Its wheels, as far as they are known before anything is heard."""
        if self.wheel is not None:
            return [self.wheel]
        user = self.protocol.user_map
        return [] if user is None else [wheel.wheel for wheel in user.wheels]

    @property
    def sends_strain(self) -> bool:
        """Whether it has wheels, and is not a bus that sends conditions only."""
        user = self.protocol.user_map
        return user is None or bool(user.wheels)

    @property
    def gages(self) -> set[int]:
        """Numbers of gages that its wheels have."""
        user = self.protocol.user_map
        return {GAGES} if user is None else {len(wheel.absent) for wheel in user.wheels}

    @property
    def conditions_sent(self) -> list[tuple[str, int | None]]:
        """Conditions that the source sends, each with its wheel; None stands for all wheels."""
        user = self.protocol.user_map
        return [] if user is None else [(TELLABLE[q.name][0], q.wheel) for q in user.quantities]

    def line(self) -> Line:
        """Return what decodes it, fresh."""
        devices = self.devices or {None: self.protocol.device}
        user, known = self.protocol.user_map, len(self.known_wheels)
        expected = max(known, 1) if user is None else known
        said_by = self.protocol.rate_said_by
        return Line(
            self.protocol.decoder(),
            devices,
            self.wheel,
            self.port.port,
            said_by,
            expected,
            tuple(self.known_wheels),
        )

    def as_header(self) -> dict[str, Any]:
        """Return the plan as the header of a recording holds it."""
        return {
            **self.protocol.as_header(),
            "name": self.port.port,
            "wheel": self.wheel,
            "device": self.device_text,
        }


def wheels_of(sources: Sequence[SourcePlan], chosen: Sequence[int] = ()) -> Wheels:
    """Return all wheels of a run, fresh."""
    return Wheels([source.line() for source in sources], chosen)


def protocol_of(port: PortPlan, rate: float, map_file: Path | None) -> ProtocolPlan:
    """Return what is on a port.

    Raises
    ------
    DeviceError
        If a map is given for a line that has none, or has faults.
    """
    user = None if map_file is None else read_map(map_file)
    if user is None:
        return ProtocolPlan(port.encoding, rate)
    if user.of_line != (port.encoding == SERIAL):
        mine, other = (
            ("a serial line", "PORT, tcp:// or udp://")
            if user.of_line
            else ("CAN frames", "slcan:... or can:...")
        )
        raise DeviceError(
            f"--map {map_file} with --port {port.port}: this map describes {mine}, which needs a "
            f"port {other}; name such a port, or another map"
        )
    return ProtocolPlan(LINE_MAP if user.of_line else port.encoding, user.rate, user)
