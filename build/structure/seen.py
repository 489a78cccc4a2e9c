"""Count hidden effects that are seen to first order: is "nothing is missing" rejected, and by what.

    python build/structure/seen.py --family rig --seeds 101-170 --ratios 1.2,1.05

Reads the campaigns that `build/structure/make.py` made and the library's table of plain tires. Each
campaign is judged by all families, and by those other than its own. Nothing but the model without
effects is fitted, so that this is quicker than the whole verdicts of `build/structure/judge.py`.
"""

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from structure.learn import FAMILIES, OUT, TABLE, kept_fit, say
from structure.make import seeds
from tirelib.core.threads import one_thread
from tirelib.inference.statistics.hypothesis import judged
from tirelib.inference.statistics.plain import load

LEVEL = 0.05


def main() -> None:
    """Fit, judge, count."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--family", choices=FAMILIES, required=True)
    parser.add_argument("--seeds", type=seeds, required=True, help="101-170 or 101,104")
    parser.add_argument("--ratios", default="1.2,1.05", help="of the base's error")
    parser.add_argument("--out", type=Path, default=OUT)
    options = parser.parse_args()
    every = load(TABLE)[0]
    tables = {"all": every, "others": [f for f in every if f.name != options.family]}
    for ratio in options.ratios.split(","):
        files = sorted((options.out / options.family).glob(f"*-{float(ratio):.2f}.npz"))
        seen, right, count = dict.fromkeys(tables, 0), dict.fromkeys(tables, 0), 0
        for file in files:
            seed, kind, _ = file.stem.split("-")
            fitted = kept_fit(options.out, file) if int(seed) in options.seeds else None
            if fitted is None:
                continue
            count += 1
            for name, families in tables.items():
                found = judged(*fitted, families, LEVEL, own_effects=0)
                rejected = found.p <= LEVEL
                seen[name] += rejected
                right[name] += rejected and found.against == kind
                say(
                    f"{file.stem}, {name}: p {found.p:.3f}, {found.against} {found.statistic:.1f} "
                    f"of {found.limit(LEVEL):.1f}"
                )
        for name in tables:
            say(f"ratio {ratio}, {name}: seen {seen[name]} of {count}, {right[name]} by its effect")


if __name__ == "__main__":
    with one_thread():
        main()
