"""``tirebench zero``: the zero of each gage from a wheel that stands unloaded."""

from pathlib import Path

import click
import numpy as np

from tirebench.cli.gathering import PORTS, asked, gathering_options
from tirebench.links.opening import PortPlan
from tirebench.wire.gage_setup import write_device, zeroed
from tirelib.cli.common import FILE

_EXAMPLE = f"""\b
Examples:
  tirebench zero --port /dev/ttyUSB0 --device wheel.toml --out wheel-zeroed.toml
  tirebench zero --replay standing.mcap --wheel 2 --out wheel-2.toml

\b
Lift the wheel, inflate it as for the test, and let it stand: the mean counts of each gage become
its zero. A wheel that turns is refused. Give the new file to `run --device [WHEEL=]NEW.toml`.
{PORTS}
\b
Exit code: 0 done, 2 bad input, or the wheel turns.
"""


@click.command(epilog=_EXAMPLE)
@gathering_options
@click.option(
    "--replay", metavar="FILE.mcap", type=FILE, help="Recording to read instead of a port."
)
def zero(
    port: str | None,
    device_texts: tuple[str, ...],
    number: int | None,
    seconds: float,
    still: float,
    out: Path,
    baud: int,
    bitrate: int,
    data_bitrate: int | None,
    bus_options: tuple[str, ...],
    rate: float,
    map_file: Path | None,
    reconnect: float,
    replay: Path | None,
) -> None:
    """Take the mean strain of a standing, unloaded wheel as the zero of its gages."""
    if (port is None) == (replay is None):
        raise click.UsageError("give exactly one of --port and --replay")
    plan = PortPlan(port or "", baud, bitrate, data_bitrate, bus_options)
    wanted = asked(port, device_texts, number, seconds, still, plan, rate, map_file)
    device, mean = wanted.of_port() if replay is None else wanted.of_recording(replay)
    new = zeroed(device, mean)
    write_device(out, new, f"zero of a standing wheel, {port or replay}")
    for gage, (offset, before, after) in enumerate(
        zip(mean, device.zero_of(len(mean)), new.zero, strict=True), 1
    ):
        said = "no data, zero kept" if np.isnan(offset) else f"{1e6 * offset:+.1f} microstrain"
        click.echo(f"gage {gage}: {said}, zero {before:g} -> {after:g} counts")
    click.echo(f"written: {out}")
