"""Every figure of the estimators and the bench, measured again with one command: ``make measured``.

    python build/measure_again.py                  # all of it; hours, on a machine that is quiet
    python build/measure_again.py faults endurance # some of it
    python build/measure_again.py --list

Each command's output lands in ``build/out/measured/NAME.log``, with the load of the machine before
and after it and the processor time that it took: a figure of real time is worth nothing beside
other people's jobs. A command that fails does not stop the others; exit code 1 names it.
"""

import argparse
import os
import resource
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path

import click

ROOT = Path(__file__).parents[1]
ROAD = "build/road_coverage.py --tire"
COMMANDS: Mapping[str, str] = {
    "faults": "build/bench_faults.py",
    "endurance": "build/bench_endurance.py --realtime",
    "ordinary": "build/bench_endurance.py --part line --minutes 2",
    "cosim": "build/cosim/run.py --all --json build/out/measured/cosim.json",
    "ramps": "build/ramp_coverage.py",
    "ramp_days": 'build/ramp_coverage.py --days 4 5 6 7 8 9 --only "speed +4"',
    "ramp_error": "build/ramp_error.py",
    "estimator_constants": "build/estimator_constants.py",
    "road": f"{ROAD} reference soft stiff",
    "other_roads": f"{ROAD} random --seed 30 31 32 33 34 35 36 37",
    "road_constants": "build/road_constants.py build/out/road/stiff-21",
    "other_tire": "build/other_tire.py --tire reference --tire soft --tire stiff",
    "camber": "build/camber_doubt.py",
    "fall_back": "build/fall_back.py",
}
"""What each measures stands at the top of its file, what it found in docs/howto/cosim.md,
docs/theory/closed_loops.md, docs/reference/bench_proof.md and docs/theory/estimates_measured.md."""


def measured(name: str, folder: Path) -> bool:
    """Run a command, keep what it prints, and tell whether it ended well."""
    load, began = os.getloadavg()[0], time.monotonic()
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    with (folder / f"{name}.log").open("w", encoding="utf-8") as log:
        command = f"{sys.executable} {COMMANDS[name]}"
        log.write(f"$ {command}\n")
        log.flush()
        code = subprocess.run(command, shell=True, cwd=ROOT, stdout=log, stderr=log).returncode
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        said = (
            f"{name}: exit code {code}, {time.monotonic() - began:.0f} s, {used:.0f} s of "
            f"processor; load {load:.1f} before, {os.getloadavg()[0]:.1f} after"
        )
        log.write(f"{said}\n")
    click.echo(said)
    return code == 0


def main() -> None:
    """Measure what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(COMMANDS))
    parser.add_argument("--list", action="store_true", help="print the commands and end")
    parser.add_argument("--out", type=Path, default=ROOT / "build/out/measured")
    given = parser.parse_args()
    if unknown := set(given.names) - set(COMMANDS):
        parser.error(f"{', '.join(sorted(unknown))}: allowed are {', '.join(COMMANDS)}")
    if given.list:
        click.echo("\n".join(f"{name:20} python {command}" for name, command in COMMANDS.items()))
        return
    given.out.mkdir(parents=True, exist_ok=True)
    bad = [name for name in given.names or COMMANDS if not measured(name, given.out)]
    if bad:
        click.echo(f"not as wanted: {', '.join(bad)}; see {given.out}")
    sys.exit(bool(bad))


if __name__ == "__main__":
    main()
