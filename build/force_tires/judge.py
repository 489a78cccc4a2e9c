"""Judge tires of the three families by plain tires of the others: false alarms, names, unknowns.

    python build/force_tires/judge.py --seeds 201-210                   plain tires
    python build/force_tires/judge.py --seeds 301-313 --kinds known     kinds take turns over seeds
    python build/force_tires/judge.py --seeds 401-406 --kinds unknown --strength 1.5

Every campaign is judged with its own family left out of the table. Prints a line a campaign and the
counts by family; `--strength` is over that which shows clearly (build/force_tires/plans.py).
"""

import argparse
import sys
import time
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from force_tires.bench import problem_of
from force_tires.families import FAMILIES
from force_tires.learn import OUT, say, seeds
from force_tires.plans import KNOWN, UNKNOWN, case
from tirelib.core.errors import TirelibError
from tirelib.core.threads import one_thread
from tirelib.inference.statistics.plain import covering, load
from tirelib.inference.statistics.select import Verdict, select


def main() -> None:
    """Judge and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quantity", default="Fy")
    parser.add_argument("--families", default=",".join(FAMILIES))
    parser.add_argument("--seeds", type=seeds, required=True)
    parser.add_argument("--kinds", default="none", help="none, known, unknown, or names")
    parser.add_argument("--strength", type=float, default=1.0)
    parser.add_argument("--false-alarm", type=float, default=0.05)
    parser.add_argument("--tables", type=Path, default=OUT)
    given = parser.parse_args()
    groups = {"known": list(KNOWN), "unknown": list(UNKNOWN)}
    kinds = groups.get(given.kinds, given.kinds.split(","))
    table = load(given.tables / f"plain_{given.quantity}.npz")[0]
    for family in given.families.split(","):
        others = covering([each for each in table if each.name != family])
        counts = Counter[str]()
        for k, seed in enumerate(given.seeds):
            kind, began = kinds[k % len(kinds)], time.process_time()
            try:
                problem = problem_of(
                    case(family, seed, kind, given.strength, given.quantity), given.quantity
                )
                verdict = select(problem, others, false_alarm=given.false_alarm)
            except TirelibError as error:
                say(f"{family} {seed} {kind}: {error}")
                counts["failed"] += 1
                continue
            said = "dead" if kind in problem.dead else outcome(verdict, kind)
            counts[said] += 1
            sets = [" + ".join(names) for names in verdict.sets]
            say(
                f"{family} {seed} {kind}: {said}: {verdict.kind} {sets} p {verdict.best.p:.3f}, "
                f"against {verdict.base.against} {verdict.base.statistic:.1f} of "
                f"{verdict.base.limit(given.false_alarm):.1f}, {time.process_time() - began:.1f} s"
            )
        say(f"{family}: {dict(counts)}")


def outcome(verdict: Verdict, kind: str) -> str:
    """Return how a verdict stands to the truth."""
    if verdict.kind in ("none", "unknown"):
        wanted = {"none": "none"}.get(kind, "unknown" if kind in UNKNOWN else "")
        return "right" if verdict.kind == wanted else verdict.kind
    if (kind,) in verdict.sets:
        return "right" if len(verdict.sets) == 1 else "in a set"
    return "wrong"


if __name__ == "__main__":
    with one_thread():
        main()
