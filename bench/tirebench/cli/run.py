"""``tirebench run``: a port or a recording through the FMU file, live."""

import time
from contextlib import ExitStack
from pathlib import Path

import click

from tirebench.cli.bridges import Bridges, bridge_options
from tirebench.cli.live import Screen
from tirebench.cli.options import (
    PORTS,
    devices_of,
    duration_option,
    pace_option,
    port_options,
    setup_option,
    sidecar_option,
    silence_option,
    trust_option,
)
from tirebench.cli.page import Shown, page_choice, page_options
from tirebench.cli.recording import at_start, check_ending, recording_options
from tirebench.cli.run_inputs import (
    RunInputs,
    conditions_of,
    given_live,
    given_replayed,
    live_sources,
    port_of_file,
    refuse_line_options,
    say_missing,
    wait_for_file,
)
from tirebench.cli.run_session import print_summary, run_session
from tirebench.cli.start_checks import check_conditions, say_slow
from tirebench.cli.stop import start_in_order
from tirebench.estimator.chain import Estimator
from tirebench.estimator.dead_gages import DeadGages
from tirebench.estimator.estimation import Estimation
from tirebench.estimator.fmu_archive import read_fmu
from tirebench.estimator.fmu_model import FmuFile, FmuModel
from tirebench.estimator.session import Limits, Session, Source
from tirebench.estimator.trust import check_trust
from tirebench.links.opening import PortPlan
from tirebench.live.chain import LiveChain
from tirebench.live.live_plan import LivePlan
from tirebench.live.priority import ordinary, realtime
from tirebench.live.reader import ReaderPlan
from tirebench.live.recording_state import RecordingRule
from tirebench.page.alarms import RULES, read_alarms
from tirebench.page.recording_switch import RecordingSwitch
from tirebench.protocols.plan import ProtocolPlan
from tirebench.recording.document import document
from tirebench.recording.header import RecordingHeader
from tirebench.recording.journal import Journal
from tirebench.recording.link import ReplayLink
from tirebench.recording.new_file import keep_recordings
from tirebench.recording.replay import ReplayChain
from tirebench.setup.source_plan import SourcePlan, wheels_of
from tirelib.cli.common import FILE, NEW_FILE, Real, Whole, output

_EXAMPLE = f"""\b
Examples:
  tirebench run --port /dev/ttyUSB0 --fmu StrainTire.fmu --speed 65 --pressure 2.3 --record a.mcap
  tirebench run --port slcan:/dev/ttyACM0 --bitrate 1000000 --data-bitrate 5000000 --fmu X.fmu
  tirebench run --port 0=/dev/ttyUSB0 --port 1=/dev/ttyUSB1 --wait --fmu StrainTire.fmu
  tirebench run --setup rig.toml --fmu StrainTire.fmu --record a.mcap
  tirebench run --replay a.mcap --fmu StrainTire.fmu --json a.json --no-page

{PORTS}
\b
Without --speed there is no slip ratio. A replay takes protocol, device files and conditions from
the recording.
The JSON is that of `tirelib estimate` (N, deg, ISO 8855 axes) plus the losses of each wheel's line.
An FMU is native code: its hash is shown, and an unknown one is refused without --trust.
Exit code: 0 done, 1 the port was lost or not one turn was valid, 2 bad input. Ctrl-C ends
the run in good order.
"""


@click.command(epilog=_EXAMPLE)
@click.option(
    "--port",
    "ports",
    metavar="[WHEEL=]PORT",
    multiple=True,
    help="Port to read; may be given several times; see below and `tirebench ports`.",
)
@setup_option
@click.option(
    "--port-file",
    metavar="FILE",
    type=FILE,
    help="File that holds the port's name (`emulate --port-file`).",
)
@click.option(
    "--wait",
    metavar="[S]",
    type=Real(min=0.0),
    default=0.0,
    is_flag=False,
    flag_value=60.0,
    help="Wait for ports and a conditions file that do not exist yet, 60 s unless a time is given.",
)
@click.option("--replay", metavar="FILE", type=FILE, help="Recording to read instead of a port.")
@pace_option
@click.option(
    "--fmu",
    "fmu_file",
    metavar="X.fmu",
    type=FILE,
    required=True,
    help="FMU of the estimator, made by `tirelib fmu build`; each wheel gets its own instance.",
)
@trust_option
@click.option("--speed", metavar="KMH", type=Real(), help="Travel speed.")
@click.option("--pressure", metavar="BAR", type=Real(min=0.0), help="Gauge pressure.")
@click.option("--camber", metavar="DEG", type=Real(), help="Camber angle (ISO 8855 signs).")
@click.option(
    "--condition",
    "named",
    metavar="NAME=VALUE",
    multiple=True,
    help="Any other condition by its name: friction=0.8, tread_depth=5 (mm), "
    "tread_temperature=35 (degC).",
)
@sidecar_option
@click.option(
    "--device",
    "device_texts",
    metavar="[WHEEL=]D.toml",
    multiple=True,
    help="Device file (scale and zero of the gages), one for all wheels or one for each.",
)
@click.option(
    "--wheel",
    "numbers",
    multiple=True,
    type=Whole(0, 255),
    help="Numbers of the wheels to estimate. [default: the first four that send frames]",
)
@port_options
@click.option(
    "--record",
    metavar="FILE.mcap",
    type=NEW_FILE,
    help="Record raw bytes, strain, estimates and counters.",
)
@recording_options
@click.option(
    "--json",
    "json_file",
    metavar="FILE",
    type=NEW_FILE,
    help="Write every turn as JSON, as it comes.",
)
@duration_option
@silence_option
@click.option("--turns", metavar="N", type=Whole(min=1), help="End after this number of turns.")
@click.option(
    "--every-turn",
    is_flag=True,
    help="Estimate every turn, even late, while the port waits. [default: skip data that are 3 s "
    "late]",
)
@click.option(
    "--realtime/--no-realtime",
    "asked",
    default=None,
    help="Run with real-time priority. [default: where the user's rights allow it]",
)
@bridge_options
@page_options
@click.pass_context
def run(
    context: click.Context,
    ports: tuple[str, ...],
    setup: Path | None,
    port_file: Path | None,
    wait: float,
    replay: Path | None,
    pace: float | None,
    fmu_file: Path,
    trust: bool,
    speed: float | None,
    pressure: float | None,
    camber: float | None,
    named: tuple[str, ...],
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
    rule: RecordingRule,
    json_file: Path | None,
    duration: float | None,
    silence: float | None,
    turns: int | None,
    every_turn: bool,
    asked: bool | None,
    estimates_out: str | None,
    plotjuggler: str | None,
    page: bool | None,
    host: str,
    network: bool,
    page_port: int,
    tui: bool,
    alarms: Path | None,
) -> None:
    """Estimate Fz, alpha, kappa and Fy of each turn, live from a port or from a recording."""
    if [bool(ports), setup is not None, port_file is not None, replay is not None].count(True) != 1:
        raise click.UsageError("give exactly one of --port, --setup, --port-file and --replay")
    if replay is not None and record is not None:
        raise click.UsageError(
            "--record cannot be used with --replay: the data are already recorded"
        )
    if replay is not None:
        refuse_line_options(context)
    if record is None and rule.around is not None:
        raise click.UsageError("--trigger needs --record FILE.mcap, which it writes to")
    if record is not None:
        check_ending("--record", record)
    keep_recordings(json_file, record, replay)
    priority = realtime(asked) if replay is None else ""
    paced = replay is None or pace is not None
    rules = RULES if alarms is None else read_alarms(alarms)
    choice = page_choice(page, host, network, page_port, tui, paced=paced)
    archive = read_fmu(fmu_file)
    devices, device_text = devices_of(device_texts)
    plan = PortPlan("", baud, bitrate, data_bitrate, bus_options)
    console = output()
    if port_file is not None:
        ports = (port_of_file(port_file, wait, console),)
    elif wait and replay is None:
        console.print(f"waiting up to {wait:g} s for ports that do not exist yet")
    options = {"speed": speed, "pressure": pressure, "camber": camber}
    if sidecar is not None:
        wait_for_file(sidecar, wait, console)
    conditions = conditions_of(options, named, sidecar)
    console.print(f"FMU {fmu_file}, sha256 {archive.sha256}", soft_wrap=True)
    console.print(f"FMU {check_trust(archive, trust=trust)}", soft_wrap=True)
    with start_in_order() as stop, ExitStack() as stack:
        file = stack.enter_context(FmuFile(archive))
        link = None if replay is None else stack.enter_context(ReplayLink(replay, pace))
        if link is None:
            usual = SourcePlan(plan, ProtocolPlan(rate=rate), devices, None, device_text)
            sources = live_sources(ports, setup, map_file, usual)
            known = given_live(sources, conditions, numbers)
        else:
            known = given_replayed(
                link, conditions, devices, numbers, console, single=sidecar is None
            )
            recorded_with = link.recording.header.fmu
            if recorded_with and recorded_with != archive.sha256:
                console.print(
                    f"note: the recording was made with another FMU ({recorded_with[:12]}...)"
                )
        calibration = file.calibration
        if calibration is not None:
            known.check_layout(calibration.lateral, str(fmu_file))
            if conditions is not None:
                check_conditions(conditions, calibration)
            say_missing(known, calibration, console)
            say_slow(known, calibration, console)
        bridges = stack.enter_context(Bridges(estimates_out, plotjuggler, plan))
        shown = Shown(choice, console, rules)
        switch: RecordingSwitch | None = None
        source: Source
        if link is None:
            settings = {
                "ports": [source.port.port for source in known.sources],
                "baud": baud,
                "bitrate": bitrate,
                "data_bitrate": data_bitrate,
                "wheels": list(numbers),
                "fmu": str(fmu_file),
                "speed_kmh": speed,
                "pressure_bar": pressure,
                "camber_deg": camber,
            }
            first, *more = (source.as_header() for source in known.sources)
            header = RecordingHeader(settings, device_text, archive.sha256, first, tuple(more))
            recorded = record is not None or shown.anything
            reader = ReaderPlan(
                known.sources,
                reconnect,
                numbers,
                recorded,
                every_turn,
                rule.strain,
                wait,
                ordinary(priority),
            )
            chain = stack.enter_context(
                LiveChain(
                    LivePlan(reader, file, known.conditions, header, record, shown.anything, rule),
                    lambda text: console.print(text, soft_wrap=True, markup=False),
                )
            )
            file_name = record or Path(time.strftime("tirebench-%Y%m%d-%H%M%S.mcap"))
            switch = RecordingSwitch(chain, file_name, started=record is not None)
            source = chain
        else:
            source = _in_process(link, file, known, stack, laps=shown.anything)
        console.print(f"{source.name} -> {file.name}, {file.samples} samples a step")
        if record is not None:
            console.print(
                at_start(record, reader, rule, watched=shown.anything), soft_wrap=True, markup=False
            )
        if priority:
            console.print(f"priority: {priority}", soft_wrap=True, markup=False)
        stack.enter_context(shown)
        of_recording = link is not None and conditions is None
        said_by = "recording" if of_recording else sidecar.name if sidecar else "option"
        shown.open(
            source,
            switch,
            fmu_file,
            calibration,
            known.devices,
            known.conditions,
            said_by,
            Path() if record is None else record.parent,
        )
        journal = None if json_file is None else Journal(json_file)
        if journal is not None:
            stack.callback(journal.close)
        limits = Limits(duration, silence, turns)
        session = Session(source, limits=limits, keep=json_file is not None)
        stop.action = session.stop
        dead = DeadGages(() if calibration is None else calibration.lateral)
        screen = None if shown.quiet else Screen(console, source, reconnect)
        outcome, used = run_session(session, source, screen, dead, bridges, shown, journal, switch)
        print_summary(console, outcome, source, dead, used, link, switch)
        if journal is not None:
            origin = {
                "link": source.name,
                "fmu_sha256": archive.sha256,
                "ended": outcome.reason,
                "cpu_share": used if source.live else None,
                "chain": source.counts(),
                "dead_gages": dead.said,
            }
            journal.finish(
                document(outcome.turns, known.conditions.runs, source.wheels, origin, calibration)
            )
            console.print(f"written: {json_file}", soft_wrap=True)
    if outcome.error is not None:
        raise outcome.error
    good = outcome.valid > 0 and outcome.reason != "unplugged"
    context.exit(0 if good else 1)


def _in_process(
    link: ReplayLink, file: FmuFile, known: RunInputs, stack: ExitStack, *, laps: bool
) -> ReplayChain:
    """Return a recording through an instance of the FMU for each wheel, in this process."""

    def estimator(_: int) -> Estimator:
        return stack.enter_context(FmuModel(file))

    wheels = wheels_of(known.sources, known.wheels)
    jumps = link.recording.jumps()
    return ReplayChain(link, wheels, Estimation(estimator, known.conditions, jumps, laps=laps))
