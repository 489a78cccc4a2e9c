"""``tirebench shunt``: the gain of each gage from a known resistor in parallel to it."""

from pathlib import Path
from typing import Any

import click

from tirebench.cli.gathering import PORTS, asked, gathering_options
from tirebench.links.opening import PortPlan
from tirebench.wire.gage_setup import apparent_strain, shunted, write_device
from tirelib.cli.common import Real, Whole

_EXAMPLE = f"""\b
Examples:
  tirebench shunt --port /dev/ttyUSB0 --device wheel.toml --gage-resistance 350 --shunt 100000 \\
      --gage-factor 2.1 --out wheel-shunted.toml
  tirebench shunt --replay off.mcap on.mcap --gage-resistance 350 --shunt 100000 \\
      --gage-factor 2.1 --gage 3 --out wheel.toml

\b
The wheel must stand still. It is read without the shunt, then with it. In a quarter bridge a
resistor Rs in parallel to a gage Rg looks like a compression, a strain of 4 x / (Ks (4 + 2 x)) with
x = - Rg / (Rg + Rs).
The ratio of the measured to this calculated strain gives the gain of each gage. With --positive the
resistor is parallel to the next arm of the bridge, which looks like tension.
{PORTS}
\b
Exit code: 0 done, 2 bad input, or the step of the shunt is not in the data.
"""


class Recording(click.Path):
    """One of the two recordings; an option in its place means that one was left out."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the path."""
        if str(value).startswith("--"):
            self.fail(
                f"{value} stands in the place of a recording; two are needed, the first without "
                "the shunt and the second with it: --replay OFF.mcap ON.mcap",
                param,
                ctx,
            )
        return super().convert(value, param, ctx)


@click.command(epilog=_EXAMPLE)
@gathering_options
@click.option(
    "--replay",
    nargs=2,
    metavar="OFF.mcap ON.mcap",
    type=Recording(path_type=Path, dir_okay=False),
    help="Two recordings, without and with the shunt, instead of a port.",
)
@click.option(
    "--gage-resistance",
    "gage_ohm",
    required=True,
    metavar="OHM",
    type=Real(1.0, 1e5),
    help="Resistance Rg of the gage, such as 350.",
)
@click.option(
    "--shunt",
    "shunt_ohm",
    required=True,
    metavar="OHM",
    type=Real(10.0, 1e8),
    help="Resistance Rs of the shunt, such as 100000.",
)
@click.option(
    "--gage-factor",
    "factor",
    required=True,
    metavar="KS",
    type=Real(0.1, 300.0),
    help="Gage factor Ks.",
)
@click.option(
    "--gage",
    "gages",
    type=Whole(1),
    multiple=True,
    metavar="N",
    help="Number of a shunted gage; may be given several times.  [default: all]",
)
@click.option(
    "--positive",
    is_flag=True,
    help="The shunt is across the next arm of the bridge and looks like tension.",
)
def shunt(
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
    replay: tuple[Path, Path] | None,
    gage_ohm: float,
    shunt_ohm: float,
    factor: float,
    gages: tuple[int, ...],
    positive: bool,
) -> None:
    """Find the gain of each gage with a shunt, on a standing wheel."""
    if (port is None) == (replay is None):
        raise click.UsageError("give exactly one of --port and --replay")
    plan = PortPlan(port or "", baud, bitrate, data_bitrate, bus_options)
    wanted = asked(port, device_texts, number, seconds, still, plan, rate, map_file)
    apparent = apparent_strain(gage_ohm, shunt_ohm, factor) * (-1.0 if positive else 1.0)
    if replay is not None:
        (device, before), (_, after) = map(wanted.of_recording, replay)
    else:
        click.pause("Take the shunt off and press a key ...", err=True)
        device, before = wanted.of_port()
        click.pause("Put the shunt on and press a key ...", err=True)
        _, after = wanted.of_port()
    new = shunted(device, before, after, apparent, gages)
    write_device(out, new, f"shunt {shunt_ohm:g} ohm parallel to {gage_ohm:g} ohm, Ks {factor:g}")
    click.echo(f"the shunt looks like {1e6 * apparent:+.1f} microstrain")
    for gage, (step, gain) in enumerate(zip(after - before, new.gain, strict=True), 1):
        click.echo(f"gage {gage}: {1e6 * step:+.1f} microstrain, gain {gain:g}")
    click.echo(f"written: {out}")
