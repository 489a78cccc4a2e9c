"""Make a campaign of a rolling tire of finite elements, with or without something hidden in it.

    python build/continuum/run.py --seed 7 --out build/out/continuum/7
    python build/continuum/run.py --seed 7 --plan 15 --out DIR --effect tread_friction
    python build/continuum/run.py --seed 7 --out DIR --effect low_pass --strength 2e-4

The seed draws the tire, the laboratory and the order of the runs. The folder can be read by every
command that takes a campaign; truth.json in it holds the tire and what is hidden.
"""

import argparse
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from continuum.campaign import make
from continuum.effects import EFFECTS
from tirelib.core.errors import TirelibError
from tirelib.core.threads import one_thread


def _effects() -> str:
    rows = [
        f"  {e.name:20s}{e.visible:8g}{e.largest:8g} {e.unit:4s}{e.words}" for e in EFFECTS.values()
    ]
    return "effects: a strength that shows clearly, the largest, and the law:\n" + "\n".join(rows)


def main() -> None:
    """Read the command line, make the campaign."""
    parser = argparse.ArgumentParser(
        description=__doc__, epilog=_effects(), formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seed", type=int, required=True, help="0 or above")
    parser.add_argument("--out", type=Path, required=True, help="folder of the campaign")
    parser.add_argument("--plan", type=int, choices=(66, 15), default=66, help="number of runs")
    parser.add_argument(
        "--effect",
        action="append",
        default=[],
        choices=sorted(EFFECTS),
        metavar="NAME",
        help="hide this; may be given several times",
    )
    parser.add_argument(
        "--strength",
        action="append",
        default=[],
        type=float,
        help="of each effect in turn; default: one that shows clearly",
    )
    parser.add_argument("--force", action="store_true", help="replace a campaign that is there")
    given = parser.parse_args()
    if given.strength and len(given.strength) != len(given.effect):
        parser.error("give every --effect its --strength, or none")
    strengths = given.strength or [EFFECTS[name].visible for name in given.effect]
    began = time.process_time()

    def progress(done: int, whole: int) -> None:
        if sys.stderr.isatty() or done in (1, whole):
            spent = time.process_time() - began
            sys.stderr.write(f"\rrun {done} of {whole}, {spent:.0f} s of processor time")
            sys.stderr.flush()

    try:
        hidden = dict(zip(given.effect, strengths, strict=True))
        make(given.out, given.seed, given.plan, hidden, None, progress, overwrite=given.force)
    except (ArithmeticError, TirelibError) as error:
        sys.stderr.write(f"\n{error}\n")
        sys.exit(2)
    sys.stderr.write(f"\n{given.out}: written\n")


if __name__ == "__main__":
    with one_thread():
        main()
