"""``tirebench run``: a port or a recording through the FMU file, live."""

import time
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np
from rich.console import Console

from bench.chain import Chain, Turn
from bench.cli.live import Screen, counters
from bench.cli.stop import on_stop
from bench.conditions import Conditions, read_conditions
from bench.device import Device, parse_device, read_device
from bench.document import document
from bench.errors import DeviceError
from bench.fmu_archive import FmuArchive, read_fmu
from bench.links import Link
from bench.recording import Recorder, RecordingHeader
from bench.session import Limits, Outcome, Session
from tirelib.cli.common import FILE, output, write_json
from tirelib.units import to_si

if TYPE_CHECKING:
    from bench.fmu_model import FmuModel

_EXAMPLE = """\b
Examples:
  tirebench run --port /dev/ttyUSB0 --fmu StrainTire.fmu --speed 65 --pressure 2.3 --record a.mcap
  tirebench run --replay a.mcap --fmu StrainTire.fmu --json a.json --no-page

\b
Without --speed there is no slip ratio. A replay takes device file and conditions from the
recording.
JSON as of `tirelib estimate`: N, deg, ISO 8855 axes; plus what the line lost.
An FMU is native code: to run it is to trust it. Its hash is shown.
Exit code: 0 done, 1 unplugged or not one valid turn, 2 bad input. Ctrl-C ends in good order.
"""


@dataclass(frozen=True, slots=True)
class Source:
    """Where bytes come from and what they mean."""

    link: Link
    device: Device
    device_text: str
    conditions: Conditions
    wheel: int | None


@click.command(epilog=_EXAMPLE)
@click.option("--port", metavar="PORT", help="Serial port to read; see `tirebench ports`.")
@click.option("--replay", metavar="FILE", type=FILE, help="Recording to read instead.")
@click.option("--fmu", "fmu_file", metavar="X.fmu", type=FILE, required=True,
              help="Made by `tirelib fmu build`.")  # fmt: skip
@click.option("--speed", metavar="KMH", type=float, help="Travel speed.")
@click.option("--pressure", metavar="BAR", type=click.FloatRange(min=0.0), help="Gauge pressure.")
@click.option("--camber", metavar="DEG", type=float, help="ISO 8855.")
@click.option("--conditions", "sidecar", metavar="F.json", type=FILE,
              help="The three over time, as `emulate --conditions` writes them.")  # fmt: skip
@click.option("--device", "device_file", metavar="D.toml", type=FILE,
              help="Scale and zero of the gages.")  # fmt: skip
@click.option("--wheel", type=click.IntRange(0, 255), help="[default: the first that is heard]")
@click.option("--baud", default=2_000_000, show_default=True, type=click.IntRange(min=1200))
@click.option("--record", metavar="FILE.mcap", type=FILE, help="Record raw bytes.")
@click.option("--json", "json_file", metavar="FILE", type=FILE, help="Write every turn as JSON.")
@click.option("--duration", metavar="S", type=click.FloatRange(min=0.0), help="End after this.")
@click.option("--silence", metavar="S", type=click.FloatRange(min=0.0),
              help="End when nothing came for so long.")  # fmt: skip
@click.option("--turns", metavar="N", type=click.IntRange(min=1), help="End after so many turns.")
@click.option("--no-page", is_flag=True, help="No live page in the browser (there is none yet).")
@click.pass_context
def run(
    context: click.Context,
    port: str | None,
    replay: Path | None,
    fmu_file: Path,
    speed: float | None,
    pressure: float | None,
    camber: float | None,
    sidecar: Path | None,
    device_file: Path | None,
    wheel: int | None,
    baud: int,
    record: Path | None,
    json_file: Path | None,
    duration: float | None,
    silence: float | None,
    turns: int | None,
    no_page: bool,
) -> None:
    """Estimate Fz, alpha, kappa and Fy of each turn, live from a port or from a recording."""
    if (port is None) == (replay is None):
        raise click.UsageError("just one of --port and --replay is needed")
    if replay is not None and record is not None:
        raise click.UsageError("--record goes with --port: a recording is there already")
    archive = read_fmu(fmu_file)
    given = _conditions(speed, pressure, camber, sidecar)
    device = None if device_file is None else read_device(device_file)
    console = output()
    console.print(f"FMU {fmu_file}, sha256 {archive.sha256}", soft_wrap=True)
    with ExitStack() as stack:
        from bench.fmu_model import FmuModel  # late: FMPy takes a second to import

        model = stack.enter_context(FmuModel(archive))
        if replay is not None:  # a port is opened last: from then on bytes come
            source = _replayed(replay, given, device, wheel, archive, console)
        else:
            source = _live(str(port), baud, given, device, device_file, wheel)
        stack.callback(source.link.close)
        console.print(f"{source.link.name} -> {model.name}, {model.samples} samples a step")
        calibration = model.calibration
        if calibration is not None:
            source.device.check_layout(calibration.lateral, str(fmu_file))
        recorder = None
        if record is not None:
            settings = {"port": port, "baud": baud, "wheel": wheel, "fmu": str(fmu_file),
                        "speed_kmh": speed, "pressure_bar": pressure,
                        "camber_deg": camber}  # fmt: skip
            header = RecordingHeader(settings, source.device_text, archive.sha256)
            recorder = stack.enter_context(Recorder(record, header, source.conditions))
        chain = Chain(model, source.device, source.conditions, source.wheel)
        limits = Limits(duration, silence, turns)
        keep = json_file is not None
        outcome, used = _session(source, chain, model, recorder, limits, keep, console)
    _summary(console, outcome, chain, used, source, record)
    if json_file is not None:
        origin = {"link": source.link.name, "fmu_sha256": archive.sha256, "ended": outcome.reason,
                  "cpu_share": used if source.link.live else None}  # fmt: skip
        runs = source.conditions.runs
        write_json(json_file, document(outcome.turns, runs, chain.counts, origin, calibration))
        console.print(f"written: {json_file}", soft_wrap=True)
    good = outcome.valid > 0 and outcome.reason != "unplugged"
    context.exit(0 if good else 1)


def _session(
    source: Source,
    chain: Chain,
    model: "FmuModel",
    recorder: Recorder | None,
    limits: Limits,
    keep: bool,
    console: Console,
) -> tuple[Outcome, float]:
    """Run until something ends it; return what came of it and the share of a core it took."""
    with Screen(console, chain, source.link.name) as screen:

        def watch(turns: list[Turn]) -> None:
            for said in model.take_messages():
                console.print(f"FMU: {said}", soft_wrap=True, markup=False)
            screen.watch(turns)

        session = Session(
            source.link, chain, recorder=recorder, limits=limits, keep=keep, watch=watch
        )
        start = time.monotonic(), time.process_time()
        with on_stop(session.stop):
            outcome = session.run()
        used = (time.process_time() - start[1]) / max(time.monotonic() - start[0], 1e-9)
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


def _live(
    port: str,
    baud: int,
    conditions: Conditions | None,
    device: Device | None,
    device_file: Path | None,
    wheel: int | None,
) -> Source:
    from bench.links.serial_port import SerialLink

    text = "" if device_file is None else device_file.read_text(encoding="utf-8")
    return Source(
        SerialLink(port, baud), device or Device(), text, conditions or Conditions.constant(), wheel
    )


def _replayed(
    replay: Path,
    conditions: Conditions | None,
    device: Device | None,
    wheel: int | None,
    archive: FmuArchive,
    console: Console,
) -> Source:
    """Open a recording; options that are given replace what it holds, and that is said."""
    from bench.links.replay import ReplayLink

    link = ReplayLink(replay)
    recording = link.recording
    header = recording.header
    if header.fmu and header.fmu != archive.sha256:
        console.print(f"note: recorded with another FMU ({header.fmu[:12]}...)")
    if device is not None or conditions is not None:
        console.print("note: device file or conditions of the recording are replaced by options")
    own = parse_device(header.device, f"{replay}: device file") if header.device else Device()
    if wheel is None:
        wheel = header.settings.get("wheel")
    return Source(link, device or own, header.device, conditions or recording.conditions, wheel)


def _summary(
    console: Console,
    outcome: Outcome,
    chain: Chain,
    used: float,
    source: Source,
    record: Path | None,
) -> None:
    """Say how it ended and what came of it."""
    if outcome.message:
        console.print(f"unplugged: {outcome.message}", soft_wrap=True, markup=False)
    console.print(
        f"ended: {outcome.reason}; {outcome.count} turns, {outcome.valid} valid (ISO 8855 axes); "
        f"{counters(chain)}",
        soft_wrap=True,
    )
    recording: Any = getattr(source.link, "recording", None)
    if recording is not None and recording.complete is False:
        console.print(f"note: the recording breaks off ({recording.damage})", soft_wrap=True)
    if source.link.live and outcome.latency:
        middle, high = np.percentile(np.array(outcome.latency) * 1e3, (50, 99))
        console.print(f"byte in to estimate out: median {middle:.1f} ms, 99 % {high:.1f} ms; "
                      f"{100 * used:.0f} % of a core")  # fmt: skip
    if record is not None:
        console.print(f"recorded: {record}", soft_wrap=True)
