"""Co-simulations with Python's FMUs and with compiled ones: the same figures, and how much faster.

    python build/cosim/native_speed.py slalom range hydroplaning     # or nothing, for all

Each part is one of ``make cosim``. It runs twice in this process, and the program prints the CPU
time of both runs. Everything that the two runs find is compared: numbers by their difference
relative to the larger one, words exactly.
"""

import argparse
import dataclasses
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from cosim import closed_loop
from cosim.calibrate import CALIBRATION
from cosim.manoeuvres import MANOEUVRES
from cosim.recording import TIME_STEP, build_fmus
from cosim.run import DRILL, LOOPS, work
from tirelib.core.threads import one_thread


def leaves(found: Any, place: str = "") -> Iterator[tuple[str, Any]]:
    """Yield all numbers and words of what a loop found, and where they stand."""
    if dataclasses.is_dataclass(found):
        found = {f.name: getattr(found, f.name) for f in dataclasses.fields(found)}
    if isinstance(found, dict):
        for name, part in found.items():
            yield from leaves(part, f"{place}.{name}")
    elif isinstance(found, list | tuple):
        for number, part in enumerate(found):
            yield from leaves(part, f"{place}[{number}]")
    else:
        yield place, found


def apart(one: Any, other: Any) -> tuple[int, float, str]:
    """Return how many numbers there are, how far apart they are at most, and where.

    Raises
    ------
    SystemExit
        If a word differs, or something is there only once.
    """
    count, most, where = 0, 0.0, ""
    for (place, a), (again, b) in zip(leaves(one), leaves(other), strict=True):
        x, y = np.asarray(a), np.asarray(b)
        if x.dtype.kind != "f":
            if place != again or not np.array_equal(x, y):
                raise SystemExit(f"{place}: {a} is not {b}")
            continue
        if x.shape != y.shape or not np.array_equal(np.isfinite(x), np.isfinite(y)):
            raise SystemExit(f"{place}: {a} is not {b}")
        known = np.isfinite(x)
        size = np.maximum(np.abs(x[known]), np.abs(y[known])).max(initial=0.0)
        off = np.abs(x[known] - y[known]).max(initial=0.0) / size if size else 0.0
        count += x.size
        if off > most:
            most, where = float(off), place
    return count, most, where


def main() -> None:
    """Build both kinds, run each part with both, print."""
    parts = [*MANOEUVRES, DRILL, *LOOPS]
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("parts", nargs="*", metavar="PART", help=f"of {', '.join(parts)}")
    given = options.parse_args()
    if unknown := set(given.parts) - set(parts):
        options.error(f"{', '.join(unknown)}: allowed are {', '.join(parts)}")
    with tempfile.TemporaryDirectory() as folder:
        for part in given.parts or parts:
            step = closed_loop.TIME_STEP if part in LOOPS else TIME_STEP
            found, spent = {}, {}
            for python in (False, True):
                place = Path(folder) / f"{step}{python}"
                fmus = build_fmus(place, CALIBRATION, step, python=python)
                begin = time.process_time()
                found[python] = work(part, fmus)
                spent[python] = time.process_time() - begin
            count, most, where = apart(found[False], found[True])
            sys.stdout.write(
                f"{part}: CPU {spent[False]:.1f} s compiled, {spent[True]:.1f} s Python, "
                f"{spent[True] / spent[False]:.1f} times; {count} numbers, at most {most:.1e} "
                f"apart{' in ' + where if where else ''}\n"
            )
            sys.stdout.flush()


if __name__ == "__main__":
    with one_thread():
        main()
