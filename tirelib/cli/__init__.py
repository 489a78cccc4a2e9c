"""The command line, ``tirelib``: the only part of the library that prints."""

import sys

import click

from tirelib import __version__
from tirelib.cli.calibrate import calibrate
from tirelib.cli.campaign import campaign
from tirelib.cli.estimate import estimate
from tirelib.cli.features import features
from tirelib.cli.rig import rig
from tirelib.errors import TirelibError

_EXAMPLE = """\b
Examples:
  tirelib rig --plan set1 --out build/out/set1
  tirelib campaign check build/out/set1
  tirelib calibrate build/out/set1 --out build/out/cal.toml
  tirelib estimate build/out/set1 --calibration build/out/cal.toml

\b
Exit code: 0 done, 1 ran but the answer is negative, 2 bad input.
"""


@click.group(epilog=_EXAMPLE)
@click.version_option(__version__, prog_name="tirelib")
def program() -> None:
    """Innerliner strain to vertical load, slip angle, slip ratio and lateral force."""


for _command in (campaign, features, calibrate, estimate, rig):
    program.add_command(_command)


def main() -> None:
    """Run the command line; an error that the library raises on purpose ends with exit code 2."""
    try:
        program(prog_name="tirelib")
    except TirelibError as error:
        click.echo(f"Error: {error}", err=True)
        sys.exit(2)
