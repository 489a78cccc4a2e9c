"""Run CalculiX and read its tables."""

import os
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

MISSING = (
    "fem: no program 'ccx' on the path; CalculiX makes the reference data: install it "
    "(Debian: apt-get install calculix-ccx) or keep the stored data in tests/golden"
)


@dataclass(frozen=True)
class Table:
    """One printed table: what, of which set, at which total time."""

    what: str
    group: str
    time: float
    rows: Floats


def program() -> str:
    """Return the path of ccx."""
    found = shutil.which("ccx")
    if found is None:
        raise SystemExit(MISSING)
    return found


def version() -> str:
    """Return what ccx says of itself."""
    done = subprocess.run([program(), "-v"], capture_output=True, text=True, check=False)
    return done.stdout.strip().removeprefix("This is ")


def run(deck: str, path: Path) -> None:
    """Write the deck and solve it, unless this very deck is solved already.

    `path` is the job without a suffix.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    if _solved(deck, path):
        return
    for suffix in (".dat", ".frd", ".sta", ".cvg"):
        path.with_suffix(suffix).unlink(missing_ok=True)
    path.with_suffix(".inp").write_text(deck)
    threads = os.environ | {"OMP_NUM_THREADS": os.environ.get("OMP_NUM_THREADS", "1")}
    with path.with_suffix(".log").open("w") as log:
        done = subprocess.run(
            [program(), path.name], cwd=path.parent, env=threads, stdout=log, check=False
        )
    text = path.with_suffix(".log").read_text()
    if done.returncode or "*ERROR" in text or "Job finished" not in text:
        raise SystemExit(
            f"fem: ccx ended with {done.returncode} on {path}.inp; the end of {path}.log:\n"
            + "\n".join(text.splitlines()[-15:])
        )


def _solved(deck: str, path: Path) -> bool:
    log, before = path.with_suffix(".log"), path.with_suffix(".inp")
    if not (log.exists() and before.exists() and "Job finished" in log.read_text()):
        return False
    return before.read_text() == deck


def tables(path: Path) -> list[Table]:
    """Return the tables of a job's .dat file in order."""
    found: list[Table] = []
    head, rows = "", []

    def end() -> None:
        if head and rows:
            what = head.split("(")[0].strip()
            group, _, time = head.rpartition(" for set ")[2].partition(" and time ")
            found.append(Table(what, group.strip(), float(time), np.array(rows)))

    for line in path.with_suffix(".dat").read_text().splitlines():
        if " and time " in line:
            end()
            head, rows = line, []
        elif line.strip():
            rows.append([float(x) for x in line.split() if not x.isalpha()])
    end()
    return found


def contact_nodes(path: Path) -> list[dict[int, Floats]]:
    """Return the contact stresses (p, t1, t2) by node of each step of a job's .frd file."""
    steps: list[dict[int, Floats]] = []
    reading = False
    for line in path.with_suffix(".frd").read_text().splitlines():
        if line.startswith(" -4  CONTACT"):
            reading, values = True, {}
        elif reading and line.startswith(" -1"):
            numbers = [float(line[13 + 12 * k : 25 + 12 * k]) for k in range(6)]
            values[int(line[3:13])] = np.array(numbers)
        elif reading and line.startswith(" -3"):
            steps.append(values)
            reading = False
    return steps
