"""``tirebench load``: whether a plan fits on its bus."""

from pathlib import Path

import click

from tirebench.errors import DeviceError
from tirebench.protocols.bus_load import HIGHEST_MEAN, LoadPlan, highest_rate, load_of, suggestions
from tirebench.protocols.layouts import RAW12, RAW12C, RAW16
from tirebench.protocols.transmitter import SERIAL
from tirelib.cli.common import NEW_FILE, Real, Whole, write_json

_EXAMPLE = f"""\b
Examples:
  tirebench load --bus fd --bitrate 1000000 --data-bitrate 5000000 --format RAW12 --wheels 4
  tirebench load --bus classic --bitrate 500000 --wheels 4 --rate 10000
  tirebench load --bus serial --baud 2000000

\b
Frames are counted bit by bit, checksum and bit stuffing included: the mean load for gage
signals, and the worst case of bit stuffing. A plan fits up to {HIGHEST_MEAN:.0%} mean load and
100 % in the worst case.
Exit code: 0 it fits, 1 it does not (a plan that would fit is printed), 2 bad input.
"""


@click.command(epilog=_EXAMPLE)
@click.option(
    "--bus",
    required=True,
    type=click.Choice(["classic", "fd", "serial"]),
    help="Classic CAN, CAN FD, or a serial line.",
)
@click.option(
    "--bitrate",
    default=500_000,
    show_default=True,
    type=Whole(min=1000),
    help="Bit rate of the CAN bus [bit/s].",
)
@click.option(
    "--data-bitrate",
    type=Whole(min=1000),
    help="Bit rate of the data phase of CAN FD [bit/s]. [default: 2000000]",
)
@click.option(
    "--baud",
    default=2_000_000,
    show_default=True,
    type=Whole(min=1200),
    help="Baud rate of the serial line.",
)
@click.option(
    "--format",
    "kind",
    type=click.Choice([RAW16, RAW12, RAW12C]),
    help="Frame format on CAN. [default: RAW16 on fd, RAW12C on classic]",
)
@click.option(
    "--wheels",
    default=1,
    show_default=True,
    type=Whole(1, 8),
    help="Number of wheels that send on it.",
)
@click.option(
    "--rate",
    default=10_000.0,
    show_default=True,
    metavar="HZ",
    type=Real(153.0, 200_000.0),
    help="Sample rate of the gages.",
)
@click.option(
    "--json", "json_file", metavar="FILE", type=NEW_FILE, help="Write the computed loads (JSON)."
)
@click.pass_context
def load(
    context: click.Context,
    bus: str,
    bitrate: int,
    data_bitrate: int | None,
    baud: int,
    kind: str | None,
    wheels: int,
    rate: float,
    json_file: Path | None,
) -> None:
    """Compute the load of a bus or a serial line, and refuse what does not fit."""
    plan = _plan(bus, bitrate, data_bitrate, baud, kind, wheels, rate)
    found = load_of(plan)
    click.echo(plan.text)
    slow, fast = found.bits
    worst_slow, worst_fast = found.worst_bits
    if bus == "fd":
        bits = f"{slow:.0f} + {fast:.0f} bits (worst {worst_slow:.0f} + {worst_fast:.0f})"
    else:
        bits = f"{slow:.1f} bits (worst {worst_slow:.0f})"
    click.echo(f"  {found.frames:.0f} frames/s of {bits}")
    click.echo(
        f"  load {found.mean:.0%} mean, {found.worst:.0%} worst; HEALTH and SYNC "
        f"{found.service:.1%}"
    )
    if found.usb:
        click.echo(f"  as slcan: {found.usb / 1e3:.0f} kB/s to the host")
    others = [] if found.fits else suggestions(plan)
    highest = highest_rate(plan)
    if found.fits:
        click.echo(f"the plan fits; sample rates up to {highest / 1e3:g} kHz would fit")
    else:
        click.echo(
            f"the plan does not fit (at most {HIGHEST_MEAN:.0%} mean and 100 % worst-case load are "
            "allowed); these plans would:"
        )
        for text in others:
            click.echo(f"  {text}")
        if not others:
            click.echo("  no plan with one line fits; use several lines")
    if json_file is not None:
        write_json(
            json_file,
            {
                "format": "tirebench-load/1",
                "plan": plan.text,
                "fits": found.fits,
                "mean": found.mean,
                "worst": found.worst,
                "service": found.service,
                "frames_per_s": found.frames,
                "bits": list(found.bits),
                "worst_bits": list(found.worst_bits),
                "slcan_bytes_per_s": found.usb,
                "highest_rate_hz": highest,
                "would_fit": others,
            },
        )
    context.exit(0 if found.fits else 1)


def _plan(
    bus: str,
    bitrate: int,
    data_bitrate: int | None,
    baud: int,
    kind: str | None,
    wheels: int,
    rate: float,
) -> LoadPlan:
    if bus == "serial":
        if kind is not None:
            raise DeviceError(
                f"--format {kind} --bus serial: a serial line carries SERIAL v1 only, and --format "
                "chooses a CAN format; leave --format out"
            )
        return LoadPlan(SERIAL, baud, None, wheels, rate)
    if bus == "fd":
        return LoadPlan(kind or RAW16, bitrate, data_bitrate or 2_000_000, wheels, rate)
    return LoadPlan(kind or RAW12C, bitrate, data_bitrate, wheels, rate)
