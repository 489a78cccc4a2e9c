"""Make cases of the benchmark ahead of their diagnosis.

python build/hidden/make.py --seeds 1000-1002 --kinds all --ratios 1.5,1.2
python build/hidden/make.py --seeds 1000-1011 --kinds none
"""

import argparse
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from hidden.cases import NONE, case_file, make_case
from hidden.measured import CACHE
from tirelib.core.errors import TirelibError
from tirelib.core.threads import one_thread
from tirelib.rig.hidden import HIDDEN


def seeds(text: str) -> list[int]:
    """Return the seeds of `1-3,7`."""
    out: list[int] = []
    for part in text.split(","):
        first, _, last = part.partition("-")
        out += range(int(first), int(last or first) + 1)
    return out


def chosen(text: str) -> list[str]:
    """Return the kinds of `all`, `known`, `unknown` or a list."""
    named = {
        "all": list(HIDDEN),
        "known": [n for n, e in HIDDEN.items() if e.known],
        "unknown": [n for n, e in HIDDEN.items() if not e.known],
    }
    return named.get(text, text.split(","))


def main() -> None:
    """Make the cases and say how each went."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", required=True)
    parser.add_argument("--kinds", default="all")
    parser.add_argument("--ratios", default="1.5")
    given = parser.parse_args()
    for seed in seeds(given.seeds):
        for kind in chosen(given.kinds):
            for ratio in [1.0] if kind == NONE else map(float, given.ratios.split(",")):
                _one(seed, kind, ratio)


def _one(seed: int, kind: str, ratio: float) -> None:
    failed = CACHE / "failed" / case_file(seed, kind, ratio).with_suffix(".txt").name
    if failed.exists():
        return
    began = time.process_time()
    new = not case_file(seed, kind, ratio).exists()
    try:
        case = make_case(seed, kind, ratio)
    except TirelibError as error:
        failed.parent.mkdir(parents=True, exist_ok=True)
        failed.write_text(str(error))
        sys.stdout.write(f"{seed} {kind} {ratio}: {str(error)[:150]}\n")
    else:
        if new:
            sys.stdout.write(
                f"{seed} {kind:24s} {ratio:.2f}: {case.ratio:.3f} (whitened {case.white_ratio:.2f})"
                f" {dict(case.strength)} {time.process_time() - began:.1f} s\n"
            )
    sys.stdout.flush()


if __name__ == "__main__":
    with one_thread():
        main()
