"""The command line of the bench, ``tirebench``: the only part of it that prints."""

import click

from tirebench.errors import BenchError
from tirelib.cli import Verbs, run_program
from tirelib.core.errors import TirelibError
from tirelib.core.version import __version__

VERBS = {
    "ports": "List serial ports: device, description, identity.",
    "load": "Compute the load of a bus or a serial line, and refuse what does not fit.",
    "emulate": "Play a campaign, a manoeuvre or a recording as wheels that send, with faults on "
    "request.",
    "run": "Estimate Fz, alpha, kappa and Fy of each turn, live from a port or from a recording.",
    "record": "Record the raw bytes of a port; Ctrl-C ends in good order.",
    "zero": "Take the mean strain of a standing, unloaded wheel as the zero of its gages.",
    "shunt": "Find the gain of each gage with a shunt, on a standing wheel.",
    "replay": "Estimate from a recording what the run estimated.",
    "export": "Write a recording as a campaign, MDF4, CSV, Parquet, or a CAN log (BLF, ASC, log).",
    "repair": "Complete a recording, or the JSON of a run, that was cut off.",
}
"""Verbs in the order of use, each with the first sentence of its help."""

OPTIONAL = dict.fromkeys(
    (
        *("can", "cantools", "cobs", "crccheck", "fmpy", "lz4", "mcap", "orjson", "serial"),
        *("starlette", "uvicorn", "websockets", "zstandard"),
    ),
    "bench",
)
"""Packages that a plain install lacks, and the extra that brings each."""

_EXAMPLE = """\b
Examples:
  tirelib rig --plan set1 --seed 1 --repeats 6 --out day1
  tirelib calibrate day1 --out cal.toml
  tirelib fmu build --calibration cal.toml --out StrainTire.fmu --samples-per-step 16
  tirebench emulate --campaign day1 --run 3 --port-file port &
  tirebench run --port-file port --wait --fmu StrainTire.fmu --speed 65 --pressure 2.3 \\
      --record live.mcap --silence 5
  tirebench run --replay live.mcap --fmu StrainTire.fmu --json live.json --no-page

\b
Exit code: 0 done, 1 the command ran and its answer is negative, 2 bad input.
"""


@click.group(cls=Verbs, package="tirebench.cli", sentences=VERBS, epilog=_EXAMPLE)
@click.version_option(__version__, prog_name="tirebench")
def program() -> None:
    """Read a wheel transmitter, estimate live with an FMU, record, replay."""


def main() -> None:
    """Run the command line."""
    run_program(program, "tirebench", OPTIONAL, (BenchError, TirelibError))
