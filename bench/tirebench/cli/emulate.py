"""``tirebench emulate``: wheels behind a pseudo-terminal or on a bus, as if plugged in."""

import time
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, closing, suppress
from dataclasses import replace
from pathlib import Path

import click

from tirebench.cli.stop import on_stop
from tirebench.deadline import Deadline
from tirebench.emulator.emulator import Player, Script, Tally, Tape, play, record_tape
from tirebench.emulator.faults import TEXT_FAULTS, Faults, parse_faults
from tirebench.emulator.sinks import BusSink, TerminalSink, open_bus
from tirebench.errors import UnpluggedError
from tirebench.protocols import CAN, SERIAL, SLCAN
from tirebench.protocols.transmitter import FORMATS, transmitter
from tirebench.wire.conditions import Conditions, conditions_document
from tirebench.wire.device import Device, read_device
from tirelib.campaign import read_campaign
from tirelib.cli.common import FILE, NEW_FILE, Real, Whole, write_json
from tirelib.cli.progress import progress_bar, progress_options

DRAIN = 600.0
"""At the end, the reader gets this long to take what was sent, [s]."""
LINGER = 10.0
"""After that, the reader gets this long to close the port, [s]."""
VIRTUAL = (
    "warning: the interface virtual connects buses within one program; no other program hears "
    "them; use can:udp_multicast:239.74.163.2, or can:socketcan:vcan0"
)
LOOK = 0.02
"""Time between two looks for a file that is waited for, [s]."""
AHEAD = 60.0
"""A first pass up to this is encoded before the port appears, [s of a wheel]."""

_EXAMPLE = """\b
Examples:
  tirelib rig --plan set1 --out day1
  tirebench emulate --campaign day1 --run 3 --run 7 --port-file port --conditions c.json
  tirebench run --port $(cat port) --conditions c.json --fmu StrainTire.fmu --silence 1
  tirebench emulate --manoeuvre lane_change.toml --format RAW16 --wheel 0 --wheel 1 --truth t.csv
  tirebench emulate --campaign day1 --link port --unplug 3 --replug 0.5 --loop
  tirebench emulate --recording a.mcap --bus can:socketcan:vcan0

\b
It prints the port, waits until a reader opens it, and prints `played` when the reader has taken
all that was sent. Format serial is SERIAL v1 on a serial port; RAW16, RAW12 and RAW12C are CAN
frames: on a bus with --bus, else as slcan on a serial port.
A recording is played as it is, bad frames included.
--fault NAME[=VALUE], several allowed: flips, cuts, inserts, lost, dup (rate per frame), nan (rate
per sample), fades (per second), saturate, dead (number of a gage), hum (microstrain), drift (ppm),
reset (s). A bus shows no flips, cuts and inserts: its frames have a checksum.
Exit code: 0 all was played to a reader, 1 nobody listened to some of it.
"""


@click.command(epilog=_EXAMPLE)
@click.option(
    "--campaign",
    "folder",
    metavar="DIR",
    type=click.Path(path_type=Path),
    help="Play runs of this campaign; it must contain strain.",
)
@click.option(
    "--run",
    "numbers",
    metavar="N",
    type=Whole(),
    multiple=True,
    help="Number of a run to play; may be given several times, in the order of play.  [default: "
    "the first]",
)
@click.option("--all", "everything", is_flag=True, help="Play all runs of the campaign.")
@click.option(
    "--manoeuvre",
    "manoeuvre_file",
    metavar="M",
    type=FILE,
    help="Play a manoeuvre (TOML or CSV) that the numerical rig solves.",
)
@click.option("--recording", metavar="R.mcap", type=FILE, help="Play the raw bytes of a recording.")
@click.option(
    "--source",
    "number",
    metavar="N",
    type=Whole(min=0),
    help="Number of the source to play, where the recording has several.",
)
@click.option(
    "--rate",
    default=10_000.0,
    show_default=True,
    metavar="HZ",
    type=Real(153.0, 50_000.0),
    help="Sample rate of the gages in a manoeuvre.",
)
@click.option(
    "--truth",
    "truth_file",
    metavar="T.csv",
    type=NEW_FILE,
    help="Write the rig's forces over time along a manoeuvre (CSV).",
)
@click.option(
    "--format",
    "kind",
    default="serial",
    show_default=True,
    type=click.Choice(FORMATS),
    help="Frame format that the emulated transmitter sends.",
)
@click.option(
    "--bus",
    metavar="can:IF:CHANNEL",
    help="Send on this python-can bus instead of a pseudo-terminal.",
)
@click.option(
    "--link",
    metavar="PATH",
    type=FILE,
    help="Path of a symbolic link to the port, which stays the same when the port is plugged in "
    "again.",
)
@click.option(
    "--device",
    "device_file",
    metavar="D.toml",
    type=FILE,
    help="Device file (scale and zero of the gages).",
)
@click.option(
    "--wheel",
    "wheels",
    multiple=True,
    default=(0,),
    show_default=True,
    type=Whole(0, 255),
    help="Number of an emulated wheel; may be given up to four times.",
)
@click.option(
    "--port-file", metavar="F", type=NEW_FILE, help="Write the path of the port into this file."
)
@click.option(
    "--conditions",
    "sidecar",
    metavar="F.json",
    type=NEW_FILE,
    help="Write the conditions over time and the rig's true values (JSON).",
)
@click.option("--loop", is_flag=True, help="Start again at the end, until Ctrl-C.")
@click.option(
    "--speedup",
    default=1.0,
    show_default=True,
    type=Real(0.01, 1000.0),
    help="Play faster than real time by this factor.",
)
@click.option("--fault", "fault_texts", metavar="NAME[=VALUE]", multiple=True, help="See below.")
@click.option("--seed", default=0, show_default=True, help="Seed of the random faults.")
@click.option(
    "--wait",
    "patience",
    default=60.0,
    show_default=True,
    metavar="S",
    help="How long to wait until a reader opens the port.",
)
@click.option("--after", metavar="F", type=FILE, help="Send nothing until this file exists.")
@click.option("--unplug", metavar="S", type=Real(), help="Emulate a pulled cable after this time.")
@click.option(
    "--replug",
    metavar="S",
    type=Real(min=0.0),
    help="Plug the cable in again after this time, and repeat; needs --link.",
)
@click.option(
    "--json",
    "json_file",
    metavar="FILE",
    type=NEW_FILE,
    help="Write counters of what was sent (JSON).",
)
@progress_options
@click.pass_context
def emulate(
    context: click.Context,
    folder: Path | None,
    numbers: tuple[int, ...],
    everything: bool,
    manoeuvre_file: Path | None,
    recording: Path | None,
    number: int | None,
    rate: float,
    truth_file: Path | None,
    kind: str,
    bus: str | None,
    link: Path | None,
    device_file: Path | None,
    wheels: tuple[int, ...],
    port_file: Path | None,
    sidecar: Path | None,
    loop: bool,
    speedup: float,
    fault_texts: tuple[str, ...],
    seed: int,
    patience: float,
    after: Path | None,
    unplug: float | None,
    replug: float | None,
    json_file: Path | None,
) -> None:
    """Play a campaign, a manoeuvre or a recording as wheels that send, with faults on request."""
    if [folder, manoeuvre_file, recording].count(None) != 2:
        raise click.UsageError("give exactly one of --campaign, --manoeuvre and --recording")
    if replug is not None and (link is None or unplug is None):
        raise click.UsageError(
            "--replug needs --unplug, and --link for a path that does not change"
        )
    if bus is not None and bus.startswith("can:virtual:"):
        click.echo(VIRTUAL, err=True)
    if bus is not None and kind == "serial" and recording is None:
        raise click.UsageError("--bus carries CAN frames only: add --format RAW16, RAW12 or RAW12C")
    if len(set(wheels)) != len(wheels) or len(wheels) > 4:
        raise click.UsageError("--wheel: give one to four different numbers")
    rates = parse_faults(fault_texts)
    if bus is not None and (unseen := [name for name in TEXT_FAULTS if name in rates]):
        raise click.UsageError(
            f"--fault {unseen[0]} with --bus: a bus has a checksum of its own and shows no damaged "
            "frame; leave it out, or send on a port (without --bus)"
        )
    faults = Faults(rates, seed)
    device = Device() if device_file is None else read_device(device_file)
    tape: Tape | None = None
    runs: list[int] = []
    if folder is not None:
        tape, runs = _campaign(folder, numbers, everything, device, faults, wheels)
    elif manoeuvre_file is not None:
        tape = _manoeuvre(manoeuvre_file, device, faults, wheels, rate, seed, truth_file)
    elif recording is not None:
        _check(recording, number)
    line = CAN if bus is not None else SERIAL if kind == "serial" else SLCAN
    sink: TerminalSink | BusSink
    sink = TerminalSink(link, unplug, replug) if bus is None else open_bus(bus, fd=kind != "RAW12C")
    tally, player = Tally(), Player(transmitter(kind), line, faults)
    short = tape is not None and tape.duration * len(wheels) <= AHEAD
    ready = list(player.pieces(tape)) if tape is not None and short else []
    with closing(sink), ExitStack() as stack:
        if sidecar is not None and tape is not None:
            from tirebench.recording.new_file import whole

            with whole(sidecar) as new:  # whoever waits for it reads all of it
                write_json(new, _sidecar(tape, loop))
        click.echo(sink.path)
        if port_file is not None:
            _announce(port_file, sink.path)
            stack.callback(_withdraw, port_file, sink.path)
        try:
            with on_stop():
                sink.wait_for_reader(Deadline.after(patience))
                if after is not None:
                    _wait_for(after)
                start, turn = time.monotonic(), 0
                while True:
                    shift = 0.0
                    pieces: Iterable[Script] = ready if not turn else ()
                    if not pieces:
                        pieces = player.pieces(tape, turn) if tape else _recorded(recording, number)
                    for piece in pieces:
                        play(piece, sink, tally, start=start, speedup=speedup)
                        shift = piece.due[-1] if piece.due else shift
                    turn += 1
                    if not loop:
                        break
                    if tape is None:
                        start += shift / speedup
                if sink.drain(DRAIN):
                    click.echo(sink.played)
                sink.end(LINGER)
        except (KeyboardInterrupt, UnpluggedError) as error:
            click.echo(str(error) or "stopped", err=True)
    _summary(tally, len(runs), faults, sink)
    if json_file is not None:
        write_json(
            json_file,
            {
                "format": "tirebench-emulation/1",
                "runs": runs,
                "frames": tally.sent,
                "unheard": tally.unheard,
                "late_s": tally.late,
                "faults": dict(faults.done),
                "unplugged": getattr(sink, "unplugged", 0),
            },
        )
    context.exit(1 if tally.unheard and replug is None else 0)


def _wait_for(file: Path) -> None:
    """Wait until the file exists or the program is stopped."""
    while not file.exists():
        time.sleep(LOOK)


def _campaign(
    folder: Path,
    numbers: tuple[int, ...],
    everything: bool,
    device: Device,
    faults: Faults,
    wheels: tuple[int, ...],
) -> tuple[Tape, list[int]]:
    from tirebench.emulator.sources import campaign_runs

    campaign = read_campaign(folder)
    device.check_layout(campaign.header.gage_lateral, str(folder))
    runs = campaign_runs(campaign, numbers, everything)
    tape = record_tape(runs, device, faults, wheels, campaign.header)
    return tape, [run.plan.run for run in runs]


def _manoeuvre(
    file: Path,
    device: Device,
    faults: Faults,
    wheels: tuple[int, ...],
    rate: float,
    seed: int,
    truth_file: Path | None,
) -> Tape:
    from tirebench.emulator.manoeuvre import nodes, read_manoeuvre
    from tirebench.emulator.sources import manoeuvre_tape, write_truth

    manoeuvre = read_manoeuvre(file)
    device.check_layout(manoeuvre.tire.lateral.tolist(), str(file))
    count = sum(len(nodes(manoeuvre.of_wheel(wheel))) for wheel in wheels)
    with progress_bar("solving the rig along the manoeuvre", count) as progress:
        tape, motions = manoeuvre_tape(
            manoeuvre, device, faults, wheels, rate=rate, seed=seed, progress=progress
        )
    if truth_file is not None:
        write_truth(truth_file, motions)
    return tape


def _check(recording: Path, source: int | None) -> None:
    """Refuse a faulty recording before a reader waits for it."""
    from tirebench.emulator.sources import chosen_source
    from tirebench.recording.recording import Recording

    with closing(Recording(recording)) as opened:
        chosen_source(opened, source)


def _recorded(recording: Path | None, source: int | None) -> Iterator[Script]:
    from tirebench.emulator.sources import recording_pieces
    from tirebench.recording.recording import Recording

    if recording is None:
        return
    with closing(Recording(recording)) as opened:
        yield from recording_pieces(opened, source)


def _summary(tally: Tally, runs: int, faults: Faults, sink: TerminalSink | BusSink) -> None:
    where = f" in {runs} runs" if runs else ""
    click.echo(
        f"{tally.sent} frames{where}, {tally.unheard} of them sent while no reader "
        f"listened, at most {1e3 * tally.late:.1f} ms late"
    )
    for name, count in faults.done.items():
        click.echo(f"  {count:6d} {name}")
    if isinstance(sink, TerminalSink) and sink.unplugged:
        click.echo(f"  {sink.unplugged:6d} unplugged")


def _sidecar(tape: Tape, loop: bool) -> dict[str, object]:
    known: Conditions = tape.conditions
    length = round(1e6 * tape.duration) if loop else 0
    return conditions_document(replace(known, loop_us=length))


def _announce(port_file: Path, path: str) -> None:
    """Write the port's path in one go, so that whoever waits for the file reads all of it."""
    port_file.parent.mkdir(parents=True, exist_ok=True)
    part = port_file.with_name(port_file.name + ".part")
    part.write_text(path + "\n", encoding="utf-8")
    part.replace(port_file)


def _withdraw(port_file: Path, path: str) -> None:
    """Remove the file that names a port which is gone, unless it names another one by now."""
    with suppress(OSError):
        if port_file.read_text(encoding="utf-8").strip() == path:
            port_file.unlink()
