"""Make campaigns of plain tires, and of tires with something hidden, of three families.

    python build/structure/make.py --family rig --seeds 1-60
    python build/structure/make.py --family continuum --seeds 101-106 \
        --kinds temperature,low_pass --ratios 1.5,1.1
    python build/structure/make.py --family ring --seeds 201-220 --kinds unknown

Resumable: a case that is there is not made again, nor one that could not be made (`failed`). The
kinds take turns over the seeds: the first seed hides the first kind. Every third seed has 15 runs,
the others 66.
"""

import argparse
import sys
import time
from dataclasses import asdict
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from structure.cases import NONE, Case, case_file, save_case
from structure.day import PLAIN_TIRES, day, measured
from structure.elements import Elements
from structure.family import Family
from structure.planted import planted_cases
from structure.rig import Rig
from structure.ring import Ring
from tirelib.core.errors import TirelibError
from tirelib.core.threads import one_thread

FAMILIES: dict[str, Family] = {f.name: f for f in (Rig(), Elements(), Ring())}
OUT = Path(__file__).parents[1] / "out" / "structure"


def seeds(text: str) -> list[int]:
    """Return the seeds of `1-3,7`, or those of the plain tires in the library's table."""
    if text == "table":
        return list(PLAIN_TIRES)
    out: list[int] = []
    for part in text.split(","):
        first, _, last = part.partition("-")
        out += range(int(first), int(last or first) + 1)
    return out


def chosen(family: Family, text: str) -> list[str]:
    """Return the kinds of `known`, `unknown` or a list."""
    if text in ("known", "unknown"):
        return [h.name for h in family.hidden.values() if h.known is (text == "known")]
    return text.split(",")


def plain_case(family: Family, seed: int) -> Case:
    """Return the campaign of a tire that hides nothing."""
    began = time.process_time()
    tire, today = family.draw(seed, NONE), day(family.number, seed)
    frames = family.frames(tire, today.settings, {}, today.angle)
    waves = measured(today, frames, family.geometry(tire))
    truth = {
        "numbers": family.numbers(tire),
        "vertical_stiffness": [f.stiffness for f in frames],
        "height": [f.height for f in frames],
        "tire": asdict(tire),
        "seconds": time.process_time() - began,
    }
    nan = float("nan")
    return Case(family.name, seed, NONE, 1.0, waves, waves, {}, True, 1.0, 1.0, nan, truth)


def make(family: Family, seed: int, kind: str, ratios: list[float], out: Path) -> str:
    """Make the cases of a seed and a kind that are not there; return what to say."""
    wanted = [1.0] if kind == NONE else ratios
    files = {r: case_file(out, family.name, seed, kind, r) for r in wanted}
    failed = {r: out / "failed" / family.name / f"{file.stem}.txt" for r, file in files.items()}
    missing = [r for r in wanted if not files[r].exists() and not failed[r].exists()]
    if not missing:
        return ""
    began = time.process_time()
    said = []
    try:
        if kind == NONE:
            made = {1.0: plain_case(family, seed)}
        else:
            made = planted_cases(family, seed, kind, missing)
    except (TirelibError, ArithmeticError, ValueError) as error:
        made = {}
        for r in missing:
            failed[r].parent.mkdir(parents=True, exist_ok=True)
            failed[r].write_text(f"{type(error).__name__}: {error}\n")
        said.append(str(error)[:150])
    for r, case in made.items():
        save_case(case, files[r])
        said.append(f"{case.ratio:.3f} ({case.white_ratio:.3f}) {dict(case.strength)}")
    spent = time.process_time() - began
    return f"{family.name} {seed} {kind}: {'; '.join(said)}, {spent:.1f} s\n"


def main() -> None:
    """Make the cases and say how each went."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--family", choices=FAMILIES, required=True)
    parser.add_argument("--seeds", required=True, type=seeds, help="1-60 or 1,5,7-9, or table")
    parser.add_argument("--kinds", default=NONE, help="none, known, unknown, or names")
    parser.add_argument("--ratios", default="1.5,1.2,1.1", help="of the base's error")
    parser.add_argument("--out", type=Path, default=OUT)
    given = parser.parse_args()
    family = FAMILIES[given.family]
    kinds = chosen(family, given.kinds)
    ratios = [float(r) for r in given.ratios.split(",")]
    for number, seed in enumerate(given.seeds):
        sys.stdout.write(make(family, seed, kinds[number % len(kinds)], ratios, given.out))
        sys.stdout.flush()


if __name__ == "__main__":
    with one_thread():
        main()
