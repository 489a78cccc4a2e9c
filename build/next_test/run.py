"""Print how often a further run tells look-alikes apart: one at random, the advised, and another.

    python build/next_test/run.py --seeds 6100-6103
    python build/next_test/run.py --scattered --seeds 6100-6103

Resumable: verdicts are kept in build/out/next_test as long as the library's code is the same. Seeds
from 6000 on judge the method and are never used to change it; 1000 to 1999 are for development.
"""

import argparse
import hashlib
import json
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[2]))
sys.path.insert(0, str(Path(__file__).parents[1]))

from hidden.make import seeds as seeds_of
from hidden.measured import keep

import tirelib
from next_test import forces
from next_test.pair import CACHE, cases_of, open_still
from tirelib.core.errors import TirelibError
from tirelib.core.threads import one_thread
from tirelib.inference.planning.document import PROMISING

VISIBLE = 17.0
"""Chi-square by which the campaign alone shows the effect, against none, in the metric of what
plain tires show."""
_PARTS = (
    "effects",
    "inference",
    "model",
    "physics",
)
STAGES = {
    "before": "before",
    "random": "random",
    "chosen": "advised",
    "second": "advised, one or two",
}
"""Kinds of runs of a case, with their words in the table."""
Verdict = dict[str, Any]


def fingerprint() -> str:
    """Return a hash of the code that a verdict depends on, the library's and this one."""
    digest, root = hashlib.sha256(), Path(tirelib.__file__).parent
    for folder in (*(root / part for part in _PARTS), Path(__file__).parent):
        for file in sorted(folder.rglob("*.py")):
            digest.update(file.read_bytes())
    return digest.hexdigest()[:12]


def verdict(case: Any, code: str) -> Verdict:
    """Return the verdict on one case, from the cache if it is there."""
    told = asdict(case)
    name = "-".join(str(value) for value in told.values())
    file = CACHE / "verdicts" / code / f"Fy-{name}.json"
    if file.exists():
        found: Verdict = json.loads(file.read_text(encoding="utf-8"))
        return found
    began = time.process_time()
    try:
        found = told | forces.measured(case)
    except TirelibError as error:
        found = told | {"error": str(error)}
    found["cpu"] = time.process_time() - began
    keep(file, json.dumps(found, default=float).encode())
    return found


def state(found: Verdict, stage: str) -> str:
    """Return right, wrong or open: whether one of the two alone is in the set, and which."""
    told = found.get(stage)
    if told is None or open_still(told):
        return "open"
    return "right" if told["inside"][found["truth"]] else "wrong"


def shares(found: Sequence[Verdict], stage: str) -> str:
    """Return right and wrong of all as text."""
    right, wrong = (sum(state(v, stage) == s for v in found) for s in ("right", "wrong"))
    return f"{right} of {len(found)} | {wrong}"


def table(found: Sequence[Verdict]) -> str:
    """Return the table in Markdown: by pair, all, those open before, and what was foretold."""
    able = [v for v in found if "error" not in v]
    stages = {k: title for k, title in STAGES.items() if any(k in v for v in able)}
    rows = [
        "| pair | " + " | ".join(f"{title}: right | wrong" for title in stages.values()) + " |",
        "|---" * (1 + 2 * len(stages)) + "|",
    ]
    by: dict[str, list[Verdict]] = {}
    for v in able:
        by.setdefault(f"{v['plan']}: {', '.join(sorted((v['truth'], v['rival'])))}", []).append(v)
    still = [v for v in able if state(v, "before") == "open"]
    likely = [v for v in still if v.get("chosen", {}).get("chance", 0.0) >= PROMISING]
    groups = [
        *by.items(),
        ("all", able),
        ("open before", still),
        (f"of these, told a chance of {100 * PROMISING:.0f} % or more", likely),
    ]
    for name, each in groups:
        rows.append(f"| {name} | " + " | ".join(shares(each, stage) for stage in stages) + " |")
    for v in found:
        if "error" in v:
            rows.append(f"\nleft out: {v['error']}")
    return "\n".join(rows)


def _say(text: str) -> None:
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


def main() -> None:
    """Run and tell."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seeds", default="1000", help="such as 6000-6001; a tire each")
    parser.add_argument("--visible", type=float, help="chi-square of the planted effect")
    parser.add_argument(
        "--scattered", action="store_true", help="runs are single points, not sweeps"
    )
    given = parser.parse_args()
    visible = given.visible or VISIBLE
    pairs = forces.pairs(scattered=given.scattered)
    code, found = fingerprint(), []
    for case in [c for seed in seeds_of(given.seeds) for c in cases_of(pairs, seed, visible)]:
        v = verdict(case, code)
        said = {name: v.get(stage, {}).get("gap") for stage, name in STAGES.items()}
        gaps = ", ".join(f"{k} {x:.1f}" if x is not None else f"{k} -" for k, x in said.items())
        _say(f"{case.seed} {case.plan} {case.truth} / {case.rival}: {gaps}")
        found.append(v)
    _say(f"\nseeds {given.seeds}, {len(found)} cases, visible {visible:g}, code {code}\n")
    _say(table(found))


if __name__ == "__main__":
    with one_thread():
        main()
