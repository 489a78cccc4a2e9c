"""Strain of standing wheels from a port or a recording; for `tirebench zero` and `shunt`."""

from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import click

from tirebench.cli.options import PORTS, devices_of, port_options
from tirebench.cli.run_inputs import given_replayed, live_sources
from tirebench.deadline import Deadline
from tirebench.errors import DeviceError
from tirebench.estimator.standing import LARGEST_STANDING_RANGE, Level, Levels, standing_mean
from tirebench.estimator.wheels import Wheels
from tirebench.links import Link
from tirebench.links.opening import PortPlan
from tirebench.protocols.plan import ProtocolPlan
from tirebench.recording.link import ReplayLink
from tirebench.setup.source_plan import SourcePlan, wheels_of
from tirebench.wire.device import Device
from tirebench.wire.timeline import Samples
from tirelib.cli.common import NEW_FILE, Real, Whole, output
from tirelib.core.arrays import FloatArray

Command = TypeVar("Command", bound=Callable[..., Any])
NOBODY = 30.0
"""A line that brings no sample for so long is given up, [s]."""

_OPTIONS = (
    click.option("--port", metavar="PORT", help="Port to read; the forms are listed below."),
    click.option(
        "--device",
        "device_texts",
        metavar="D.toml",
        multiple=True,
        help="Device file to start from.  [default: the standard scale]",
    ),
    click.option(
        "--wheel",
        "number",
        type=Whole(0, 255),
        metavar="N",
        help="Number of the wheel, where several send.",
    ),
    click.option(
        "--seconds",
        default=3.0,
        show_default=True,
        type=Real(1.0, 600.0),
        help="Duration of the mean.",
    ),
    click.option(
        "--still",
        default=1e6 * LARGEST_STANDING_RANGE,
        show_default=True,
        metavar="MICROSTRAIN",
        type=Real(min=0.0, min_open=True),
        help="A wheel whose strain varies by more than this counts as turning.",
    ),
    click.option(
        "--out",
        required=True,
        type=NEW_FILE,
        metavar="NEW.toml",
        help="New device file to write.",
    ),
)


def gathering_options(command: Command) -> Command:
    """Add the options that both verbs have."""
    for option in reversed((*_OPTIONS, port_options)):
        command = option(command)
    return command


@dataclass(frozen=True, slots=True)
class Asked:
    """The port or the recording from which strain is taken.

    Attributes
    ----------
    sources : tuple of SourcePlan
    number : int or None
        Number of the wheel.
    seconds, still : float, [s] and strain
    """

    sources: tuple[SourcePlan, ...]
    number: int | None
    seconds: float
    still: float

    def of_port(self) -> tuple[Device, FloatArray]:
        """Return the device of the wheel and the mean strain of its gages, from the port."""
        with closing(self.sources[0].port.open()) as link:
            return self._mean(link, self.sources)

    def of_recording(self, file: Path) -> tuple[Device, FloatArray]:
        """Return the same from a recording, its first seconds."""
        with closing(ReplayLink(file)) as link:
            given = self.sources[0].devices
            known = given_replayed(link, None, given, (), output())
            return self._mean(link, known.sources)

    def _mean(self, link: Link, sources: Sequence[SourcePlan]) -> tuple[Device, FloatArray]:
        wheels = wheels_of(sources, () if self.number is None else (self.number,))
        found = _levels(link, wheels, self.seconds)
        if len(found) != 1:
            heard = ", ".join(map(str, found)) or "none"
            raise DeviceError(
                f"{link.name}: frames came from these wheels: {heard}; exactly one wheel is "
                "needed; choose it with --wheel, or check the link"
            )
        ((number, levels),) = found.items()
        if number in wheels.contradicted:
            click.secho(
                f"WARNING: {wheels.contradicted[number]}; the mean strain of a standing wheel does "
                "not depend on the sample rate, but estimates do",
                fg="red",
                err=True,
            )
        return wheels.heard[number].timeline.device, standing_mean(levels, self.still)


def asked(
    port: str | None,
    device_texts: tuple[str, ...],
    number: int | None,
    seconds: float,
    still: float,
    plan: PortPlan,
    rate: float,
    map_file: Path | None,
) -> Asked:
    """Return the request that the options describe."""
    devices, text = devices_of(device_texts)
    usual = SourcePlan(plan, ProtocolPlan(rate=rate), devices, None, text)
    sources = (usual,) if port is None else live_sources((port,), None, map_file, usual)
    return Asked(sources, number, seconds, 1e-6 * still)


def _levels(link: Link, wheels: Wheels, seconds: float) -> dict[int, list[Level]]:
    """Read until every wheel that is heard has so many seconds, or nothing more comes."""
    found: dict[int, list[Level]] = {}
    cut: dict[int, Levels] = {}
    end = Deadline.after(NOBODY)
    click.echo(f"{link.name}: waiting for the first frame, up to {NOBODY:g} s", err=True)
    while not end.expired:
        read = link.receive(end.sooner(0.2))
        if read is None:
            break
        for block in wheels.push(read.data, read.arrival, read.source) if read.data else ():
            if isinstance(block.content, Samples):
                end = Deadline.after(NOBODY)
                levels = cut.setdefault(block.wheel, Levels(block.wheel))
                found.setdefault(block.wheel, []).extend(levels.take(block.content))
        if found and all(sum(x.seconds for x in one) >= seconds for one in found.values()):
            break
    return found


__all__ = ["PORTS", "Asked", "asked", "gathering_options"]
