"""``tirebench record``: raw bytes of a port to a file, without an estimator."""

from pathlib import Path
from typing import Any

import click

from tirebench.cli.live import counters
from tirebench.cli.options import (
    PORTS,
    devices_of,
    duration_option,
    port_options,
    setup_option,
    sidecar_option,
    silence_option,
)
from tirebench.cli.recording import at_start, check_ending, recording_options
from tirebench.cli.run_inputs import given_live, live_sources
from tirebench.cli.stop import start_in_order
from tirebench.estimator.estimation import News
from tirebench.estimator.session import Limits, Session
from tirebench.links.opening import PortPlan
from tirebench.live.chain import LiveChain
from tirebench.live.live_plan import LivePlan
from tirebench.live.priority import ordinary, realtime
from tirebench.live.reader import ReaderPlan
from tirebench.live.recording_state import RecordingRule
from tirebench.protocols.plan import ProtocolPlan
from tirebench.recording.document import line_document, wheel_document
from tirebench.recording.header import RecordingHeader
from tirebench.recording.new_file import keep_recordings
from tirebench.setup.source_plan import SourcePlan
from tirebench.wire.conditions import read_conditions
from tirelib.cli.common import NEW_FILE, write_json

_EXAMPLE = f"""\b
Examples:
  tirebench record --port /dev/ttyUSB0 --out a.mcap --duration 600
  tirebench record --port can:socketcan:can0 --rate 5000 --out bus.mcap

{PORTS}
\b
Every byte is written as it came, bad frames included; frames are decoded only to count them.
Exit code: 0 done, 1 the port was lost or not one good frame came, 2 bad input.
"""


@click.command(epilog=_EXAMPLE)
@click.option(
    "--port",
    "ports",
    metavar="[WHEEL=]PORT",
    multiple=True,
    help="Port to read; may be given several times; the forms are listed below.",
)
@setup_option
@click.option(
    "--out",
    metavar="FILE.mcap",
    type=NEW_FILE,
    required=True,
    help="New recording to write (.mcap).",
)
@recording_options
@sidecar_option
@click.option(
    "--device",
    "device_texts",
    metavar="[WHEEL=]D.toml",
    multiple=True,
    help="Device file (scale and zero of the gages), stored in the recording.",
)
@port_options
@duration_option
@silence_option
@click.option(
    "--json",
    "json_file",
    metavar="FILE",
    type=NEW_FILE,
    help="Write the frame and loss counters (JSON).",
)
@click.pass_context
def record(
    context: click.Context,
    ports: tuple[str, ...],
    setup: Path | None,
    out: Path,
    rule: RecordingRule,
    sidecar: Path | None,
    device_texts: tuple[str, ...],
    baud: int,
    bitrate: int,
    data_bitrate: int | None,
    bus_options: tuple[str, ...],
    rate: float,
    map_file: Path | None,
    reconnect: float,
    duration: float | None,
    silence: float | None,
    json_file: Path | None,
) -> None:
    """Record the raw bytes of a port; Ctrl-C ends in good order."""
    if bool(ports) == (setup is not None):
        raise click.UsageError("give exactly one of --port and --setup")
    check_ending("--out", out)
    keep_recordings(json_file, out)
    devices, text = devices_of(device_texts)
    plan = PortPlan("", baud, bitrate, data_bitrate, bus_options)
    usual = SourcePlan(plan, ProtocolPlan(rate=rate), devices, None, text)
    given = None if sidecar is None else read_conditions(sidecar)
    known = given_live(live_sources(ports, setup, map_file, usual), given, ())
    settings: dict[str, Any] = {
        "ports": [source.port.port for source in known.sources],
        "baud": baud,
        "bitrate": bitrate,
        "data_bitrate": data_bitrate,
    }
    first, *more = (source.as_header() for source in known.sources)
    header = RecordingHeader(settings, text, "", first, tuple(more))
    priority = realtime(None)
    reader = ReaderPlan(
        known.sources, reconnect, strain=rule.strain, apart=ordinary(priority), estimated=False
    )
    live = LivePlan(reader, None, known.conditions, header, out, rule=rule)
    with start_in_order() as stop, LiveChain(live, click.echo) as chain:
        session = Session(chain, limits=Limits(duration, silence), watch=_alarm)
        stop.action = session.stop
        click.echo(f"{chain.name} -> {out}")
        click.echo(at_start(out, reader, rule, watched=False))
        click.echo(f"priority: {priority}")
        outcome = session.run()
        wheels, recorded, counts = chain.wheels, chain.recorded.bytes, chain.counts()
    if outcome.message:
        click.echo(f"unplugged: {outcome.message}")
    click.echo(f"ended: {outcome.reason}; {recorded} bytes; {counters(wheels)}")
    failed = counts["recording"]["error"]
    if failed:
        click.secho(f"the recording is incomplete: {failed}", fg="red")
    if json_file is not None:
        write_json(
            json_file,
            {
                "format": "tirebench-record/1",
                "ended": outcome.reason,
                "bytes": recorded,
                "line": line_document(*wheels.counts),
                "chain": counts,
                "wheels": {n: wheel_document(wheels, n) for n in wheels.heard},
            },
        )
    good = wheels.counts[0].ok > 0 and outcome.reason != "unplugged" and not failed
    context.exit(0 if good else 1)


def _alarm(news: News) -> None:
    for said in news.alarms:
        click.secho(f"ALARM: {said}", fg="red", bold=True)
