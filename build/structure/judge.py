"""Judge campaigns by plain tires of the other families: false alarms, names, unknown kinds.

    python build/structure/judge.py                          every campaign that is there
    python build/structure/judge.py --families rig --kinds temperature,low_pass --jobs 2

Reads the campaigns that `build/structure/make.py` made and the plain tires that
`build/structure/learn.py` learned. Every campaign is judged with its own family left out. Writes
verdicts.jsonl, a line a campaign, and prints a table of verdicts by family, kind and error ratio.
Campaigns that verdicts.jsonl has already are not judged again.
"""

import argparse
import json
import multiprocessing
import pickle
import sys
import time
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np

from structure.cases import NONE, load_case
from structure.learn import FAMILIES, OUT, TABLE, say
from tirelib.core.arrays import FloatArray
from tirelib.core.errors import TirelibError
from tirelib.core.threads import one_thread
from tirelib.effects import CATALOGUE
from tirelib.inference.identify.campaign_data import StraightRuns, straight_runs
from tirelib.inference.identify.identify import fitted
from tirelib.inference.problems.strain import StrainProblem
from tirelib.inference.statistics.hypothesis import Hypothesis
from tirelib.inference.statistics.plain import load
from tirelib.inference.statistics.select import Verdict, select

OUTCOMES = ("right", "in a set", "none", "unknown", "form", "wrong", "failed")


def main() -> None:
    """Judge, write, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--families", default=",".join(FAMILIES))
    parser.add_argument("--kinds", help="kinds, none for plain tires; every one by default")
    parser.add_argument("--seeds", help="least and largest seed, for instance 101-199")
    parser.add_argument("--false-alarm", type=float, default=0.05)
    parser.add_argument("--out", type=Path, default=OUT)
    parser.add_argument("--jobs", type=int, default=1)
    options = parser.parse_args()
    kinds = options.kinds.split(",") if options.kinds else None
    low, high = (int(n) for n in (options.seeds or "0-1000000").split("-"))
    kept = options.out / "verdicts.jsonl"
    done = [json.loads(line) for line in kept.read_text().splitlines()] if kept.exists() else []
    has = {entry["case"] for entry in done}
    files = [
        file
        for family in options.families.split(",")
        for file in sorted((options.out / family).glob("*.npz"))
        if low <= int(file.stem.split("-")[0]) <= high
        and (kinds is None or file.stem.split("-")[1] in kinds)
    ]
    todo = [file for file in files if f"{file.parent.name}/{file.stem}" not in has]
    judge = partial(judged, out=options.out, false_alarm=options.false_alarm)
    with multiprocessing.get_context("spawn").Pool(options.jobs) as pool, kept.open("a") as lines:
        for entry in pool.imap(judge, todo):
            say(f"{entry['case']}: {entry['outcome']}, {entry['verdict']} {entry['sets']}")
            lines.write(json.dumps(entry) + "\n")
            lines.flush()
            done.append(entry)
    names = {f"{file.parent.name}/{file.stem}" for file in files}
    show([entry for entry in done if entry["case"] in names])


def judged(file: Path, *, out: Path, false_alarm: float) -> dict[str, Any]:
    """Return the verdict on a campaign by the families other than its own."""
    case = load_case(file)
    families = [f for f in load(TABLE)[0] if f.name != case.family]
    entry: dict[str, Any] = {
        "case": f"{case.family}/{file.stem}",
        "family": case.family,
        "kind": case.kind,
        "known": case.known,
        "wanted": case.wanted,
        "runs": len(case.waves),
    }
    with one_thread():
        try:
            runs = straight_runs(case.waves)
            values = _identified(runs, out / "values" / f"{case.family}-{file.stem}.pkl")
            began = time.process_time()
            problem = StrainProblem(runs, values, list(CATALOGUE.values()))
            verdict = select(problem, families, false_alarm=false_alarm)
        except TirelibError as error:
            return {
                **entry,
                "verdict": "failed",
                "sets": [],
                "outcome": "failed",
                "why": str(error),
            }
    return {
        **entry,
        "verdict": verdict.kind,
        "sets": [list(names) for names in verdict.sets],
        "p": verdict.best.p,
        "seconds": round(time.process_time() - began, 1),
        "hypotheses": [_told(h) for h in verdict.tried],
        "outcome": outcome(verdict, case.kind, known=case.known),
    }


def _identified(runs: StraightRuns, kept: Path) -> Mapping[str, float | FloatArray]:
    kept.parent.mkdir(exist_ok=True)
    if not kept.exists():
        kept.write_bytes(pickle.dumps(dict(fitted(runs)[1].values)))
    values: Mapping[str, float | FloatArray] = pickle.loads(kept.read_bytes())
    return values


def _told(h: Hypothesis) -> dict[str, Any]:
    return {
        "names": list(h.names),
        "likelihood": round(h.likelihood, 1),
        "statistic": round(h.statistic, 2),
        "limit": round(h.limit(0.05), 2),
        "against": h.against,
        "p": round(h.p, 4),
        "laws": h.errors.laws,
        "lookalike": h.errors.lookalike,
        "looseness": h.looseness,
        "p_rival": round(h.p_rival, 4),
        "plausible": h.plausible,
        "strengths": [np.round(s, 5).tolist() for s in h.fit.strengths],
    }


def outcome(verdict: Verdict, kind: str, *, known: bool) -> str:
    """Return how a verdict compares with what is hidden."""
    if kind == NONE:
        return {"none": "right", "unknown": "unknown", "form_inadequate": "form"}.get(
            verdict.kind, "wrong"
        )
    if not known:
        return {"unknown": "right", "none": "none", "form_inadequate": "form"}.get(
            verdict.kind, "wrong"
        )
    if verdict.kind in ("none", "unknown"):
        return verdict.kind
    truth = set(kind.split("+"))
    if not any(set(names) == truth for names in verdict.sets):
        return "wrong"
    if verdict.kind == "form_inadequate":
        return "form"
    return "right" if len(verdict.sets) == 1 else "in a set"


def show(done: Sequence[Mapping[str, Any]]) -> None:
    """Print how many campaigns of a family, kind and ratio have which outcome."""
    table: dict[tuple[str, str, float], Counter[str]] = defaultdict(Counter)
    for entry in done:
        group = "plain" if entry["kind"] == NONE else "known" if entry["known"] else "unknown"
        table[entry["family"], group, entry["wanted"]][entry["outcome"]] += 1
    say(f"{'family':10} {'hidden':8} {'ratio':>5} " + " ".join(f"{o:>9}" for o in OUTCOMES))
    for (family, group, wanted), found in sorted(table.items()):
        counts = " ".join(f"{found[o]:9d}" for o in OUTCOMES)
        say(f"{family:10} {group:8} {wanted:5.2f} {counts}")
    seconds = [entry["seconds"] for entry in done if entry["runs"] >= 60 and "seconds" in entry]
    if seconds:
        say(f"60 and more runs: {np.median(seconds):.0f} s CPU, at most {max(seconds):.0f} s")


if __name__ == "__main__":
    main()
