"""``tirebench replay``: a recording through the FMU file, at any pace."""

from pathlib import Path

import click

from tirebench.cli.options import pace_option, trust_option
from tirebench.cli.run import run
from tirelib.cli.common import FILE, NEW_FILE, Whole

_EXAMPLE = """\b
Examples:
  tirebench replay live.mcap --fmu StrainTire.fmu --json again.json
  tirebench replay live.mcap --fmu StrainTire.fmu --pace 1

\b
The same as `tirebench run --replay`. At any pace the estimates equal those of the run, bit for bit.
To play a recording to another program, see `tirebench emulate --recording`.
Exit code: as for `tirebench run`.
"""


@click.command(epilog=_EXAMPLE)
@click.argument("recording", metavar="RECORDING", type=FILE)
@click.option(
    "--fmu",
    "fmu_file",
    metavar="X.fmu",
    type=FILE,
    required=True,
    help="FMU of the estimator, made by `tirelib fmu build`.",
)
@trust_option
@pace_option
@click.option(
    "--wheel",
    "numbers",
    multiple=True,
    type=Whole(0, 255),
    help="Numbers of the wheels to estimate. [default: as in the run]",
)
@click.option(
    "--json", "json_file", metavar="FILE", type=NEW_FILE, help="Write every turn as JSON."
)
@click.pass_context
def replay(
    context: click.Context,
    recording: Path,
    fmu_file: Path,
    trust: bool,
    pace: float | None,
    numbers: tuple[int, ...],
    json_file: Path | None,
) -> None:
    """Estimate from a recording what the run estimated."""
    context.invoke(
        run,
        replay=recording,
        fmu_file=fmu_file,
        trust=trust,
        pace=pace,
        numbers=numbers,
        json_file=json_file,
        page=False,
    )
