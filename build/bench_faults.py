"""A million damaged frames on each kind of line: ``make faults``.

Flips, cuts, insertions, splices and random bytes strike SERIAL v1, a line with sync and CRC-32 as a
map describes it, and slcan; on a bus, whose frames an adapter checks, frames are lost, doubled,
foreign or of another length. Nothing may be accepted that was not sent, 1.1 good frames may be lost
for each damage, and memory must stay flat.
The text of slcan has no checksum: what flips, splices and random bytes change into other digits
passes, which is shown and not judged; of cuts and insertions one in 5,000 may pass. The figures
land in ``build/out/bench_faults.json``.
"""

import argparse
import json
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from bench_damage import (
    CHANGED,
    KINDS,
    Outcome,
    strike_bus,
    strike_map,
    strike_serial,
    strike_slcan,
)
from rich.console import Console
from rich.table import Table

from tirebench.protocols.layouts import RAW12C, RAW16
from tirelib.core.threads import one_thread

OUT = Path(__file__).resolve().parent / "out" / "bench_faults.json"
MOST_LOST, MOST_LOST_SHORT = 1.1, 1.5
"""Good frames for each damage. A line of RAW12C has 22 characters: a damage of up to 20
often strikes two of them."""
MOST_WRONG_TEXT = 2e-4
"""Share of wrong lines that a cut or an insertion may leave in a text: a digit and a CR may be put
in where a line ends anyway."""
MOST_GROWTH = 8 * 2**20
"""Growth of the memory that an allocator may keep back, [bytes]."""
LENGTH = tuple(kind for kind in KINDS if kind not in CHANGED)


def jobs(damages: int, seed: int) -> dict[str, Callable[[], Outcome]]:
    """Return what is struck; the lines of slcan share their damages among kinds."""
    each = max(1, damages // 4)
    found: dict[str, Callable[[], Outcome]] = {
        "SERIAL v1": lambda: strike_serial(damages, seed),
        "map, sync and CRC-32": lambda: strike_map(damages, seed),
        "bus": lambda: strike_bus(damages, seed),
    }
    for kind in (RAW16, RAW12C):
        for allowed in (LENGTH, CHANGED):
            name = f"slcan {kind}, {', '.join(allowed)}"
            found[name] = lambda kind=kind, allowed=allowed: strike_slcan(each, seed, kind, allowed)
    return found


def judged(name: str, outcome: Outcome, used: float) -> dict[str, Any]:
    """Return the figures of a line, and whether they are good."""
    lengths = "slcan" not in name or set(outcome.kinds) <= set(LENGTH)
    most = MOST_LOST_SHORT if RAW12C in name else MOST_LOST
    wrong = MOST_WRONG_TEXT * outcome.damaged if "slcan" in name else 0.0
    good = outcome.lost_per_damage <= most and outcome.growth <= MOST_GROWTH
    return {
        "damages": outcome.damaged,
        "frames": outcome.sent,
        "kinds": dict(outcome.kinds),
        "accepted_wrong": outcome.wrong,
        "wrong_judged": lengths,
        "good_lost_per_damage": outcome.lost_per_damage,
        "crc_bad": outcome.counts.crc,
        "framing_bad": outcome.counts.framing,
        "memory_growth_bytes": outcome.growth,
        "cpu_s": used,
        "good": good and (outcome.wrong <= wrong or not lengths),
    }


def show(lines: dict[str, dict[str, Any]], console: Console) -> None:
    """Print a row for each line."""
    table = Table("line", "damages", "accepted wrong", "good lost a damage", "memory", "CPU", "")
    for name, one in lines.items():
        wrong = f"{one['accepted_wrong']}{'' if one['wrong_judged'] else ' (no checksum)'}"
        table.add_row(
            name,
            str(one["damages"]),
            wrong,
            f"{one['good_lost_per_damage']:.3f}",
            f"{one['memory_growth_bytes'] / 2**20:+.1f} MB",
            f"{one['cpu_s']:.0f} s",
            "good" if one["good"] else "BAD",
        )
    console.print(table)


def main() -> None:
    """Strike, show, write, and fail if a figure is missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--damages", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    console, lines = Console(), {}
    for name, job in jobs(given.damages, given.seed).items():
        start = time.process_time()
        with console.status(name):
            outcome = job()
        lines[name] = judged(name, outcome, time.process_time() - start)
        good = all(one["good"] for one in lines.values())
        OUT.parent.mkdir(parents=True, exist_ok=True)
        document = {"lines": lines, "good": good}  # what there is so far: it takes its time
        OUT.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    show(lines, console)
    sys.exit(0 if good else 1)


if __name__ == "__main__":
    with one_thread():
        main()
