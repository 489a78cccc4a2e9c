"""The options of a run: its sources, and the conditions that are known besides the strain."""

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import click
from click.core import ParameterSource
from rich.console import Console

from tirebench.cli.options import devices_of_text, wheel_of
from tirebench.deadline import Deadline
from tirebench.errors import DeviceError, RecordingError
from tirebench.links.opening import PortPlan
from tirebench.protocols.plan import ProtocolPlan
from tirebench.recording.header import RecordingHeader
from tirebench.recording.link import ReplayLink
from tirebench.setup.setup_file import check_sources, read_setup
from tirebench.setup.source_plan import SourcePlan, protocol_of
from tirebench.wire.conditions import QUANTITIES, Conditions, read_conditions
from tirebench.wire.device import Device
from tirelib.core.units import to_si
from tirelib.estimators.calibration import Calibration

LOOK = 0.05
"""Time between two looks for a file that is waited for, [s]."""
_OPTIONS = {
    "speed": "--speed KMH, ",
    "pressure": "--pressure BAR, ",
    "camber": "--camber DEG, ",
    "friction": "--condition friction=MU, ",
    "tread_depth": "--condition tread_depth=MM, ",
    "tread_temperature": "--condition tread_temperature=DEGC, ",
}
_WITHOUT = {
    "speed": "the slip ratio cannot be estimated, so no turn is valid as a whole and the run ends "
    "with exit code 1; Fz, alpha and Fy are estimated, and --json has the validity of each",
    "pressure": "standard deviations grow by the possible effect of the pressure",
    "camber": "standard deviations of Fy and alpha grow by the possible effect of camber, and "
    "turns where camber dominates carry the flag camber_unknown",
    "friction": "standard deviations of alpha and kappa grow by the possible effect of the road",
    "tread_depth": "standard deviations, above all of Fz and kappa, grow by the possible wear",
    "tread_temperature": "standard deviations, above all of Fz, grow by what heat or cold may do",
}


_LINE_OPTIONS = {
    "baud": "--baud",
    "bitrate": "--bitrate",
    "data_bitrate": "--data-bitrate",
    "bus_options": "--bus-option",
    "rate": "--rate",
    "map_file": "--map",
}


@dataclass(frozen=True, slots=True)
class RunInputs:
    """The sources of a run, and the conditions that are known besides them.

    Attributes
    ----------
    sources : tuple of SourcePlan
    conditions : Conditions
    wheels : tuple of int
        That are looked at; empty: the first that are heard.
    """

    sources: tuple[SourcePlan, ...]
    conditions: Conditions
    wheels: tuple[int, ...]

    def check_layout(self, lateral: Sequence[float], where: str) -> None:
        """Refuse wheels with other gages than the calibration.

        Raises
        ------
        DeviceError
            Naming both.
        """
        for source in self.sources:
            for device in (source.devices or {None: source.protocol.device}).values():
                for gages in source.gages:
                    device.check_layout(lateral, where, gages)

    @property
    def devices(self) -> list[Device]:
        """The device of each wheel, which defines the strain of a count."""
        return [
            device
            for source in self.sources
            for device in (source.devices or {None: source.protocol.device}).values()
        ]


def live_sources(
    ports: Sequence[str], setup: Path | None, map_file: Path | None, usual: SourcePlan
) -> tuple[SourcePlan, ...]:
    """Return the live sources: one for each ``[WHEEL=]PORT``, or those of a setup.

    Raises
    ------
    DeviceError
        With the faults of a file, or if there can be no such wheel.
    """
    if setup is not None:
        return read_setup(setup, usual)
    sources = []
    for text in ports:
        wheel, rest = wheel_of("--port", text)
        port = replace(usual.port, port=rest)
        protocol = protocol_of(port, usual.protocol.rate, map_file)
        sources.append(replace(usual, port=port, protocol=protocol, wheel=wheel))
    return tuple(sources)


def port_of_file(file: Path, wait: float, console: Console) -> str:
    """Return the port whose name stands in a file, once the file and the port are there.

    Raises
    ------
    DeviceError
        If they do not come in time.
    """
    deadline, told = Deadline.after(wait), False
    while True:
        try:
            port = file.read_text(encoding="utf-8").strip()
        except (OSError, UnicodeDecodeError):
            port = ""
        if port and (not port.startswith("/") or Path(port).exists()):
            return port
        if deadline.expired:
            raise DeviceError(
                f"--port-file {file}: {f'its port {port} is not there' if port else 'no port'}; it "
                "must be the file that `tirebench emulate --port-file` writes; start the "
                "emulator, or wait for it with --wait"
            )
        if not told:
            console.print(f"waiting for {file}", soft_wrap=True, markup=False)
            told = True
        time.sleep(LOOK)


def wait_for_file(file: Path, wait: float, console: Console) -> None:
    """Wait until a file exists, at most so long [s]."""
    deadline = Deadline.after(wait)
    if wait and not file.exists():
        console.print(f"waiting for {file}", soft_wrap=True, markup=False)
    while not (file.exists() or deadline.expired):
        time.sleep(LOOK)


def conditions_of(
    options: Mapping[str, float | None], named: Sequence[str], sidecar: Path | None
) -> Conditions | None:
    """Return conditions of the options; None when there are none.

    Parameters
    ----------
    options : mapping of name to value
        In the units of files; None: not given.
    named : sequence of str
        ``NAME=VALUE``, in the same units.
    sidecar : Path or None

    Raises
    ------
    DeviceError
        If a condition is given twice, is unknown or no number; if a file is given beside values, or
        has faults.
    """
    given = {name: value for name, value in options.items() if value is not None}
    for text in named:
        name, _, number = text.partition("=")
        if name not in QUANTITIES or name in given or not _is_number(number):
            units = ", ".join(f"{known} [{unit}]" for known, (unit, _) in QUANTITIES.items())
            raise DeviceError(
                f"--condition {text}: NAME=VALUE is needed, each name once; known names and units "
                f"are {units}; correct it"
            )
        given[name] = float(number)
    if sidecar is None:
        si = {name: float(to_si(value, *QUANTITIES[name])) for name, value in given.items()}
        return Conditions.constant(**si) if si else None
    if given:
        raise DeviceError(
            f"{', '.join(given)} and --conditions {sidecar} were both given; the conditions must "
            "come from one of them; leave one out"
        )
    return read_conditions(sidecar)


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False


def given_live(
    sources: tuple[SourcePlan, ...], conditions: Conditions | None, wheels: tuple[int, ...]
) -> RunInputs:
    """Return the sources and conditions that the options of a live run give.

    Raises
    ------
    DeviceError
        If sources contradict each other or the conditions.
    """
    check_sources(sources, conditions)
    return RunInputs(sources, conditions or Conditions.constant(), wheels)


def recorded_sources(
    header: RecordingHeader, where: str, devices: Mapping[int | None, Device]
) -> tuple[SourcePlan, ...]:
    """Return the sources that a recording has; devices that are given replace its own.

    Raises
    ------
    RecordingError
        If the header is damaged.
    """
    sources = []
    for number, source in enumerate(header.sources):
        protocol = ProtocolPlan.of_header(source, where)
        text = str(source.get("device", header.device))
        own = devices_of_text(text, where)
        port = PortPlan(str(source.get("name", f"source {number}")))
        wheel = source.get("wheel")
        if wheel is not None and wheel not in range(256):
            raise RecordingError(
                f"{where}: wheel = {str(wheel)[:40]} of source {number}; 0 .. 255 is allowed; "
                "the header is damaged; take another recording"
            )
        sources.append(SourcePlan(port, protocol, devices or own, wheel, text))
    return tuple(sources)


def refuse_line_options(context: click.Context) -> None:
    """Refuse options that a replay does not use, because the recording holds them.

    Raises
    ------
    click.UsageError
        If one of them was given; the message names the first.
    """
    for name, option in _LINE_OPTIONS.items():
        if context.get_parameter_source(name) is ParameterSource.COMMANDLINE:
            raise click.UsageError(
                f"{option} cannot be used with --replay: the recording holds the settings of its "
                "lines"
            )


def given_replayed(
    link: ReplayLink,
    conditions: Conditions | None,
    devices: Mapping[int | None, Device],
    wheels: tuple[int, ...],
    console: Console,
    *,
    single: bool = False,
) -> RunInputs:
    """Return what a recording states; given options replace what they name, with a note."""
    header, recorded = link.recording.header, link.recording.conditions
    replaced = ["the device file"] if devices else []
    if conditions is not None and single:
        replaced += conditions.known
        conditions = conditions.over(recorded)
    elif conditions is not None:
        replaced.append("all conditions")
    if replaced:
        console.print(
            f"note: options on the command line replace {', '.join(replaced)} of the recording",
            soft_wrap=True,
        )
    sources = recorded_sources(header, link.name, devices)
    if not wheels:
        wheels = tuple(header.settings.get("wheels") or ())
    return RunInputs(sources, conditions or recorded, wheels)


def missing(given: RunInputs, calibration: Calibration) -> tuple[dict[str, str], dict[str, str]]:
    """Return the unknown conditions in words: those that the calibration needs, and useful ones."""
    told = [place for source in given.sources for place in source.conditions_sent]
    wheels = {*given.wheels, *(w for source in given.sources for w in source.known_wheels)}
    words: dict[str, str] = {}
    for name in {*calibration.needed, *_WITHOUT} - set(given.conditions.known):
        places = [wheel for other, wheel in told if other == name]
        without = sorted(wheels - set(places))
        if not places:
            words[name] = name
        elif None not in places and without:
            words[name] = f"{name} of wheel {', '.join(map(str, without))}"
    needed = {name: words[name] for name in calibration.needed if name in words}
    return needed, {name: words[name] for name in _WITHOUT if name in words.keys() - needed}


def _option(name: str) -> str:
    return _OPTIONS.get(name, f"--condition {name}=VALUE, ")


def say_missing(given: RunInputs, calibration: Calibration, console: Console) -> None:
    """Print which conditions are unknown, and what cannot be detected, before the first turn."""
    needed, useful = missing(given, calibration)
    for name, words in needed.items():
        console.print(
            f"WARNING: no {words}: the calibration needs it, so NO TURN WILL BE VALID; give "
            f"{_option(name)}--conditions FILE, or a map with [{name}]",
            style="bold red",
            soft_wrap=True,
            markup=False,
        )
    for name, words in useful.items():
        console.print(
            f"note: no {words}: {_WITHOUT[name]}; give {_option(name)}"
            f"--conditions FILE, or a map with [{name}]",
            soft_wrap=True,
            markup=False,
        )
    if not calibration.knows_tire:
        console.print(
            "note: this calibration cannot detect that another tire is on the wheel (it has fewer "
            "than 17 conditions, or was made by an earlier version); calibrate with more "
            "conditions",
            soft_wrap=True,
            markup=False,
        )
