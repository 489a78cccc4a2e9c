"""A million damaged frames on a serial line: ``python build/bench_faults.py``.

Flips, cuts, insertions, splices and random bytes strike SERIAL v1 frames. None may be accepted that
was not sent, at most 1.1 good frames may be lost for each damage, and memory must stay flat. The
figures land in ``build/out/bench_faults.json``.
"""

import argparse
import json
import sys
import time
from pathlib import Path

from rich.console import Console

from bench.damage import strike_serial

OUT = Path(__file__).resolve().parent / "out" / "bench_faults.json"
MOST_LOST = 1.1
MOST_GROWTH = 8 * 2**20
"""Of memory, [bytes]: what an allocator keeps back."""


def main() -> None:
    """Strike, show, write, and fail if a figure is missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--damages", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    console = Console()
    start = time.process_time()
    outcome = strike_serial(given.damages, given.seed)
    used = time.process_time() - start
    good = (
        outcome.wrong == 0
        and outcome.lost_per_damage <= MOST_LOST
        and outcome.growth <= MOST_GROWTH
    )
    figures = {
        "damages": outcome.damaged, "frames": outcome.sent, "kinds": dict(outcome.kinds),
        "accepted_wrong": outcome.wrong, "good_lost_per_damage": outcome.lost_per_damage,
        "crc_bad": outcome.counts.crc, "framing_bad": outcome.counts.framing,
        "memory_growth_bytes": outcome.growth, "cpu_s": used, "good": good,
    }  # fmt: skip
    console.print(figures)
    OUT.parent.mkdir(parents=True, exist_ok=True)
    OUT.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")
    sys.exit(0 if good else 1)


if __name__ == "__main__":
    main()
