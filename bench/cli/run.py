"""``tirebench run``: a port or a recording through the FMU file, live."""

import time
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np
from rich.console import Console

from bench.chain import Estimator, Turn
from bench.cli.bridges import Bridges, bridge_options
from bench.cli.live import Screen, counters
from bench.cli.options import (
    PORTS,
    devices_of,
    devices_of_text,
    opened,
    port_options,
    protocol_of,
)
from bench.cli.page import Shown, page_choice, page_options
from bench.cli.stop import on_stop
from bench.conditions import Conditions, read_conditions
from bench.device import Device
from bench.document import document
from bench.errors import DeviceError
from bench.fmu_archive import FmuArchive, read_fmu
from bench.links import Link
from bench.links.opening import PortPlan
from bench.page.recording_switch import RecordingSwitch
from bench.protocols.plan import ProtocolPlan
from bench.recording import Recorder, RecordingHeader
from bench.session import Limits, Outcome, Session
from bench.trust import check_trust
from bench.wheels import Wheels
from tirelib.cli.common import FILE, output, write_json
from tirelib.units import to_si

if TYPE_CHECKING:
    from bench.fmu_model import FmuModel

_EXAMPLE = f"""\b
Examples:
  tirebench run --port /dev/ttyUSB0 --fmu StrainTire.fmu --speed 65 --pressure 2.3 --record a.mcap
  tirebench run --port slcan:/dev/ttyACM0 --bitrate 1000000 --data-bitrate 5000000 --fmu X.fmu
  tirebench run --replay a.mcap --fmu StrainTire.fmu --json a.json --no-page

{PORTS}
\b
Without --speed there is no slip ratio. A replay takes protocol, device files and conditions from
the recording.
JSON as of `tirelib estimate`: N, deg, ISO 8855 axes; plus what the line lost, for each wheel.
An FMU is native code: its hash is shown, and an unknown one is refused without --trust.
Exit code: 0 done, 1 unplugged or not one valid turn, 2 bad input. Ctrl-C ends in good order.
"""


@dataclass(frozen=True, slots=True)
class Source:
    """Where bytes come from and what they mean."""

    link: Link
    protocol: ProtocolPlan
    devices: Mapping[int | None, Device]
    device_text: str
    conditions: Conditions
    wheels: tuple[int, ...]


@click.command(epilog=_EXAMPLE)
@click.option("--port", metavar="PORT", help="Port to read; see below and `tirebench ports`.")
@click.option("--replay", metavar="FILE", type=FILE, help="Recording to read instead.")
@click.option("--pace", metavar="X", type=click.FloatRange(0.001, 1000.0),
              help="Replay at X times real time.  [default: as fast as possible]")  # fmt: skip
@click.option("--fmu", "fmu_file", metavar="X.fmu", type=FILE, required=True,
              help="Made by `tirelib fmu build`; one instance for each wheel.")  # fmt: skip
@click.option("--trust", is_flag=True, help="Run this FMU although it is unknown; remember it.")
@click.option("--speed", metavar="KMH", type=float, help="Travel speed.")
@click.option("--pressure", metavar="BAR", type=click.FloatRange(min=0.0), help="Gauge pressure.")
@click.option("--camber", metavar="DEG", type=float, help="ISO 8855.")
@click.option("--conditions", "sidecar", metavar="F.json", type=FILE,
              help="The three over time, as `emulate --conditions` writes them.")  # fmt: skip
@click.option("--device", "device_texts", metavar="[WHEEL=]D.toml", multiple=True,
              help="Scale and zero of the gages; one for all wheels, or for each.")  # fmt: skip
@click.option("--wheel", "numbers", multiple=True, type=click.IntRange(0, 255),
              help="Wheels to look at.  [default: the first four that are heard]")  # fmt: skip
@port_options
@click.option("--record", metavar="FILE.mcap", type=FILE, help="Record raw bytes.")
@click.option("--json", "json_file", metavar="FILE", type=FILE, help="Write every turn as JSON.")
@click.option("--duration", metavar="S", type=click.FloatRange(min=0.0), help="End after this.")
@click.option("--silence", metavar="S", type=click.FloatRange(min=0.0),
              help="End when nothing came for so long.")  # fmt: skip
@click.option("--turns", metavar="N", type=click.IntRange(min=1), help="End after so many turns.")
@bridge_options
@page_options
@click.pass_context
def run(
    context: click.Context,
    port: str | None,
    replay: Path | None,
    pace: float | None,
    fmu_file: Path,
    trust: bool,
    speed: float | None,
    pressure: float | None,
    camber: float | None,
    sidecar: Path | None,
    device_texts: tuple[str, ...],
    numbers: tuple[int, ...],
    baud: int,
    bitrate: int,
    data_bitrate: int | None,
    bus_options: tuple[str, ...],
    rate: float,
    map_file: Path | None,
    reconnect: float,
    record: Path | None,
    json_file: Path | None,
    duration: float | None,
    silence: float | None,
    turns: int | None,
    estimates_out: str | None,
    plotjuggler: str | None,
    page: bool | None,
    host: str,
    network: bool,
    page_port: int,
    tui: bool,
) -> None:
    """Estimate Fz, alpha, kappa and Fy of each turn, live from a port or from a recording."""
    if (port is None) == (replay is None):
        raise click.UsageError("just one of --port and --replay is needed")
    if replay is not None and record is not None:
        raise click.UsageError("--record goes with --port: a recording is there already")
    paced = replay is None or pace is not None
    choice = page_choice(page, host, network, page_port, tui, paced=paced)
    archive = read_fmu(fmu_file)
    given = _conditions(speed, pressure, camber, sidecar)
    devices, device_text = devices_of(device_texts)
    plan = PortPlan(port or "", baud, bitrate, data_bitrate, bus_options)
    console = output()
    console.print(f"FMU {fmu_file}, sha256 {archive.sha256}", soft_wrap=True)
    console.print(f"FMU {check_trust(archive, trust=trust)}", soft_wrap=True)
    with ExitStack() as stack:
        models = _Models(archive, stack)
        models.first()  # a port is opened last: from then on bytes come
        if replay is not None:
            source = _replayed(replay, pace, given, devices, numbers, archive, console)
        else:
            protocol = protocol_of(plan, rate, map_file)
            source = Source(opened(plan, reconnect), protocol, devices or {None: protocol.device},
                            device_text, given or Conditions.constant(), numbers)  # fmt: skip
        stack.callback(source.link.close)
        bridges = stack.enter_context(Bridges(estimates_out, plotjuggler, plan))
        model = models.first()
        console.print(f"{source.link.name} -> {model.name}, {model.samples} samples a step")
        calibration = model.calibration
        if calibration is not None:
            for device in source.devices.values():
                device.check_layout(calibration.lateral, str(fmu_file))
        shown = stack.enter_context(Shown(choice, console))
        recorder: RecordingSwitch | None = None
        if replay is None:
            settings = {"port": port, "baud": baud, "bitrate": bitrate,
                        "data_bitrate": data_bitrate, "wheels": list(numbers),
                        "fmu": str(fmu_file), "speed_kmh": speed, "pressure_bar": pressure,
                        "camber_deg": camber}  # fmt: skip

            def begin(file: Path) -> Recorder:
                header = RecordingHeader(settings, source.device_text, archive.sha256,
                                         source.protocol.as_header())  # fmt: skip
                return Recorder(file, header, source.conditions)

            first = record or Path(time.strftime("tirebench-%Y%m%d-%H%M%S.mcap"))
            switch = RecordingSwitch(begin, first, started=record is not None)
            recorder = stack.enter_context(switch)
        link = shown.watched(source.link, recorder)
        wheels = Wheels(source.protocol.decoder(), models.of_wheel, source.devices,
                        source.conditions, source.wheels)  # fmt: skip
        limits = Limits(duration, silence, turns)
        keep = json_file is not None
        shown.open(wheels, fmu_file, calibration, source.devices)
        outcome, used = _session(
            link, wheels, models, recorder, limits, keep, console, bridges, shown
        )
    _summary(console, outcome, wheels, used, source, recorder)
    if json_file is not None:
        origin = {"link": source.link.name, "fmu_sha256": archive.sha256, "ended": outcome.reason,
                  "cpu_share": used if source.link.live else None}  # fmt: skip
        runs = source.conditions.runs
        write_json(json_file, document(outcome.turns, runs, wheels.counts, origin, calibration,
                                       wheels.chains))  # fmt: skip
        console.print(f"written: {json_file}", soft_wrap=True)
    good = outcome.valid > 0 and outcome.reason != "unplugged"
    context.exit(0 if good else 1)


class _Models:
    """An instance of the FMU for each wheel; the first is made early, to fail early."""

    def __init__(self, archive: FmuArchive, stack: ExitStack) -> None:
        self._archive = archive
        self._stack = stack
        self._made: list[FmuModel] = []
        self._used = 0

    def first(self) -> "FmuModel":
        """Return the first instance."""
        if not self._made:
            from bench.fmu_model import FmuModel  # late: FMPy takes a second to import

            self._made.append(self._stack.enter_context(FmuModel(self._archive)))
        return self._made[0]

    def of_wheel(self, wheel: int) -> Estimator:
        """Return a fresh instance for a wheel."""
        from bench.fmu_model import FmuModel

        self._used += 1
        if self._used > len(self._made):
            self._made.append(self._stack.enter_context(FmuModel(self._archive)))
        return self._made[self._used - 1]

    def take_messages(self) -> list[str]:
        """Return what the instances have logged since the last call."""
        return [said for model in self._made for said in model.take_messages()]


def _session(
    link: Link,
    wheels: Wheels,
    models: _Models,
    recorder: RecordingSwitch | None,
    limits: Limits,
    keep: bool,
    console: Console,
    bridges: Bridges,
    shown: Shown,
) -> tuple[Outcome, float]:
    """Run until something ends it; return what came of it and the share of a core it took."""
    with ExitStack() as stack:
        screen = None
        if not shown.quiet:
            screen = stack.enter_context(Screen(console, wheels, link.name))

        def watch(turns: list[Turn]) -> None:
            messages = models.take_messages()
            if screen is not None:
                for said in messages:
                    console.print(f"FMU: {said}", soft_wrap=True, markup=False)
                screen.watch(turns)
            bridges.send(turns)
            shown.watch(turns, messages)

        session = Session(link, wheels, limits=limits, keep=keep, watch=watch)
        start = time.monotonic(), time.process_time()
        with on_stop(session.stop):
            outcome = session.run()
        used = (time.process_time() - start[1]) / max(time.monotonic() - start[0], 1e-9)
        shown.end(outcome.reason)
    if recorder is not None:
        recorder.close(outcome.reason)
    return outcome, used


def _conditions(
    speed: float | None, pressure: float | None, camber: float | None, sidecar: Path | None
) -> Conditions | None:
    """Return conditions of the options; None when there are none."""
    values = {"speed": (speed, "km/h", "speed"), "pressure": (pressure, "bar", "pressure"),
              "camber": (camber, "deg", "angle")}  # fmt: skip
    given = {
        name: to_si(value, unit, dimension)
        for name, (value, unit, dimension) in values.items()
        if value is not None
    }
    if sidecar is None:
        return Conditions.constant(**given) if given else None
    if given:
        raise DeviceError(
            f"--{', --'.join(given)} and --conditions {sidecar} are given; one or the other says "
            "what holds; leave one out"
        )
    return read_conditions(sidecar)


def _replayed(
    replay: Path,
    pace: float | None,
    conditions: Conditions | None,
    devices: Mapping[int | None, Device],
    wheels: tuple[int, ...],
    archive: FmuArchive,
    console: Console,
) -> Source:
    """Open a recording; options that are given replace what it holds, and that is said."""
    from bench.links.replay import ReplayLink

    link = ReplayLink(replay, pace)
    header = link.recording.header
    protocol = ProtocolPlan.of_header(header.protocol, str(replay))
    if header.fmu and header.fmu != archive.sha256:
        console.print(f"note: recorded with another FMU ({header.fmu[:12]}...)")
    if devices or conditions is not None:
        console.print("note: device file or conditions of the recording are replaced by options")
    own = devices_of_text(header.device, str(replay)) or {None: protocol.device}
    if not wheels:
        wheels = tuple(header.settings.get("wheels") or ())
    return Source(link, protocol, devices or own, header.device,
                  conditions or link.recording.conditions, wheels)  # fmt: skip


def _summary(
    console: Console,
    outcome: Outcome,
    wheels: Wheels,
    used: float,
    source: Source,
    recorder: RecordingSwitch | None,
) -> None:
    """Say how it ended and what came of it."""
    if outcome.message:
        console.print(f"unplugged: {outcome.message}", soft_wrap=True, markup=False)
    console.print(
        f"ended: {outcome.reason}; {outcome.count} turns, {outcome.valid} valid (ISO 8855 axes); "
        f"{counters(wheels)}",
        soft_wrap=True,
    )
    recording: Any = getattr(source.link, "recording", None)
    if recording is not None and recording.complete is False:
        console.print(f"note: the recording breaks off ({recording.damage})", soft_wrap=True)
    if source.link.live and outcome.latency:
        middle, high = np.percentile(np.array(outcome.latency) * 1e3, (50, 99))
        console.print(f"byte in to estimate out: median {middle:.1f} ms, 99 % {high:.1f} ms; "
                      f"{100 * used:.0f} % of a core")  # fmt: skip
    for file in () if recorder is None else recorder.files:
        console.print(f"recorded: {file}", soft_wrap=True)
