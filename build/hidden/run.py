"""Hide effects in the numerical rig, let the library look for them, and print how it did.

    python build/hidden/run.py                                    the whole benchmark; hours
    python build/hidden/run.py --seeds 5000-5009 --per-ratio 40   a part of it
    python build/hidden/chain.py 5000:temperature:1.2             a case by files and command line
    python build/hidden/run.py --have --golden                    what is finished; store figures

Resumable: cases and verdicts are kept apart in build/out/hidden, verdicts as long as the library's
code is the same. Seeds from 5000 on judge the method and are never used to change it; seeds 1000
to 1999 are for development.
"""

import argparse
import json
import sys
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from datetime import UTC, datetime
from itertools import zip_longest
from multiprocessing import get_context
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))

from hidden.cases import NONE, VERSION, case_file, kinds, load_case, make_case
from hidden.judge import fingerprint, judge, verdict_file
from hidden.measured import CACHE, keep
from hidden.table import figures, markdown
from tirelib import __version__
from tirelib.diagnose.ensemble import MEMBERS
from tirelib.errors import TirelibError
from tirelib.threads import one_thread

ROOT = Path(__file__).parents[2]
GOLDEN = ROOT / "tests" / "golden" / "hidden_effects.json"
RATIOS = (1.5, 1.2, 1.05)
PAIRS = (
    "sidewall_damping+gage_drift",
    "sidewall_load+nonuniformity",
    "dynamic_stiffening+angle_zero",
    "temperature+low_pass",
    "sidewall_pressure+trailing_sliding",
    "tread_friction+gage_drift",
    "hydroplaning+nonuniformity",
    "sidewall_load+low_pass",
)
FIRST = 5000

Wanted = tuple[int, str, float]


def wanted(none: int, per_ratio: int, unknown: int, pairs: int, first: int) -> list[Wanted]:
    """Return seed, kind and ratio of every case, columns of the table in turn.

    A tire serves several kinds, so that a part of the list is a fair sample of all.
    """
    names, others = kinds(known=True), kinds(known=False)
    columns: list[list[Wanted]] = [[(first + k, NONE, 1.0) for k in range(none)]]
    for ratio in RATIOS:
        columns.append(_spread(names, ratio, per_ratio, first))
    columns.append(_spread(others, 1.5, unknown, first))
    columns.append(_spread(PAIRS, 1.5, pairs, first))
    return [want for row in zip_longest(*columns) for want in row if want is not None]


def _spread(names: Sequence[str], ratio: float, count: int, first: int) -> list[Wanted]:
    """Return cases of all kinds in turn; a round of kinds is a tire."""
    size = len(names)
    return [(first + k // size, names[k % size], ratio) for k in range(count)]


def _failure(want: Wanted) -> Path:
    """Return where is kept why a case cannot be made."""
    return CACHE / f"failed-{VERSION}" / case_file(*want).with_suffix(".txt").name


def run_one(want: Wanted, members: int, make: bool) -> dict[str, Any] | None:
    """Return the verdict of one case; None where it cannot be made or has not been."""
    file = case_file(*want)
    failed = _failure(want)
    if failed.exists() or not (make or file.exists()):
        return None
    if not make:
        case = load_case(file)
        return judge(case, members) if verdict_file(case, members).exists() else None
    try:
        case = make_case(*want)
    except TirelibError as error:
        keep(failed, str(error).encode())
        return None
    return judge(case, members)


def _all(
    wants: Sequence[Wanted], members: int, make: bool, jobs: int
) -> Iterator[dict[str, Any] | None]:
    if jobs == 1:
        for want in wants:
            yield run_one(want, members, make)
        return
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        many = len(wants)
        yield from pool.map(run_one, wants, [members] * many, [make] * many)


def main() -> None:
    """Run and tell."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--none", type=int, default=100, help="cases with nothing hidden")
    parser.add_argument("--per-ratio", type=int, default=60, help="single effects a ratio")
    parser.add_argument("--unknown", type=int, default=45, help="effects in no catalogue")
    parser.add_argument("--pairs", type=int, default=40, help="two effects at once")
    parser.add_argument("--first", type=int, default=FIRST, help="first seed")
    parser.add_argument("--members", type=int, default=MEMBERS, help="of the null ensemble")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--have", action="store_true", help="take finished verdicts only")
    parser.add_argument("--golden", action="store_true", help=f"store the figures in {GOLDEN.name}")
    given = parser.parse_args()
    wants = wanted(given.none, given.per_ratio, given.unknown, given.pairs, given.first)
    rows, left_out, began = [], [], time.perf_counter()
    for count, row in enumerate(_all(wants, given.members, not given.have, given.jobs), start=1):
        want = wants[count - 1]
        if row is None:
            left_out.append(want)
        else:
            rows.append(row)
        said = row["outcome"] if row else "left out"
        took = (time.perf_counter() - began) / 60.0
        sys.stderr.write(f"{count}/{len(wants)} {took:.1f} min {want[1]} {want[2]} {said}\n")
    told = {
        "date": datetime.now(UTC).date().isoformat(),
        "tirelib": __version__,
        "code": fingerprint(),
        "seeds": f"{given.first}-{max((r['seed'] for r in rows), default=given.first)}",
        "members": given.members,
        "out_of_reach": [f"{w[0]} {w[1]} {w[2]:g}" for w in left_out if _failure(w).exists()],
        "not_run": sum(not _failure(w).exists() for w in left_out),
        "figures": figures(rows),
        "by_files": [
            json.loads(file.read_text())
            for file in sorted((CACHE / "chain" / fingerprint()).glob("*.json"))
        ],
    }
    text = markdown(told)
    sys.stdout.write(text)
    if given.golden:
        GOLDEN.write_text(json.dumps(told, indent=1) + "\n")
        GOLDEN.with_suffix(".md").write_text(text)


if __name__ == "__main__":
    with one_thread():
        main()
