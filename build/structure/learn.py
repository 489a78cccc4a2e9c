"""Learn what plain tires leave of a fitted model; count false alarms on a family left out.

    python build/structure/learn.py                 fits, table and p-values
    python build/structure/learn.py --seeds 2,5,8   of these tires only

Reads the campaigns that `build/structure/make.py` made, identifies and fits each plain one (kept in
build/out/structure/fits), and writes the library's table
tirelib/inference/statistics/plain_tires.npz, what the families show, and
tests/golden/plain_tires.json: the p-value of every plain tire, judged by the families other than
its own.
"""

import argparse
import hashlib
import json
import pickle
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from structure.cases import NONE, case_file, load_case
from structure.make import seeds
from tirelib.core.errors import TirelibError
from tirelib.core.threads import one_thread
from tirelib.effects import CATALOGUE
from tirelib.inference.identify.campaign_data import straight_runs
from tirelib.inference.identify.identify import fitted
from tirelib.inference.problems.strain import StrainProblem
from tirelib.inference.statistics.hypothesis import judged
from tirelib.inference.statistics.null import OWN
from tirelib.inference.statistics.plain import Family, learn, save
from tirelib.inference.statistics.posterior import Posterior, posterior
from tirelib.inference.statistics.problem import Point

ROOT = Path(__file__).parents[2]
OUT = ROOT / "build" / "out" / "structure"
TABLE = ROOT / "tirelib" / "inference" / "statistics" / "plain_tires.npz"
GOLDEN = ROOT / "tests" / "golden" / "plain_tires.json"
FAMILIES = ("rig", "continuum", "ring")
FIRST = {"effect": 0.02**2, "shape": 0.005**2}
"""Variances of the fit from which the learning starts."""
FIRST_OWN = 0.0005
"""Size of a run's own misfit in this fit, over its rms strain."""
Fit = tuple[StrainProblem, Posterior]


def main() -> None:
    """Fit, learn, judge, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=seeds, default="table", help="table, 1-60 or 1,5,7")
    parser.add_argument("--out", type=Path, default=OUT)
    options = parser.parse_args()
    names = FAMILIES
    with one_thread():
        fits = {name: fits_of(options.out, name, options.seeds) for name in names}
        families = [family_of(name, list(fits[name].values())) for name in names]
        save(TABLE, families, provenance(fits))
        document: dict[str, Any] = {
            "families": {},
            "sha256": hashlib.sha256(TABLE.read_bytes()).hexdigest(),
        }
        for name in names:
            others = [family for family in families if family.name != name]
            found = {
                seed: judged(problem, fit, others, 0.05, own_effects=0).p
                for seed, (problem, fit) in fits[name].items()
            }
            document["families"][name] = {str(seed): round(p, 4) for seed, p in found.items()}
            share = np.mean([p <= 0.05 for p in found.values()])
            say(f"{name}: {len(found)} plain tires by the other families, {share:.1%} alarms")
        GOLDEN.write_text(json.dumps(document, indent=1) + "\n")


def say(text: str) -> None:
    """Print a line at once."""
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


def fits_of(out: Path, name: str, chosen: Sequence[int]) -> dict[int, Fit]:
    """Return the fits of a family's plain tires by seed; those that fail are left out."""
    files = {seed: case_file(out, name, seed, NONE, 1.0) for seed in chosen}
    fits = {seed: kept_fit(out, file) for seed, file in files.items() if file.exists()}
    return {seed: fit for seed, fit in fits.items() if fit is not None}


def kept_fit(out: Path, file: Path) -> Fit | None:
    """Return the fitted model of a campaign's file, kept in build/out/structure/fits."""
    kept = out / "fits" / f"{file.parent.name}-{file.stem}.pkl"
    if not kept.exists():
        kept.parent.mkdir(parents=True, exist_ok=True)
        kept.write_bytes(pickle.dumps(fit_of(file)))
        say(f"{file.parent.name} {file.stem}")
    found: Fit | None = pickle.loads(kept.read_bytes())
    if found is None:
        return None
    problem, fit = found
    beside = tuple(CATALOGUE[name] for name in fit.rows if name in CATALOGUE)
    strengths = tuple(np.zeros(effect.components) for effect in beside)
    return problem, replace(fit, point=Point(fit.point.base, beside, strengths))


def fit_of(file: Path) -> Fit | None:
    """Return the model without effects fitted to a campaign, or None if there is none."""
    runs = straight_runs(load_case(file).waves)
    try:
        _, identified = fitted(runs)
        problem = StrainProblem(runs, identified.values, list(CATALOGUE.values()))
        spread = {effect.name: FIRST["effect"] for effect in problem.living}
        groups = problem.remainder(problem.start, problem.solve(problem.start))
        spread |= dict.fromkeys(groups, FIRST["shape"])
        fit = posterior(problem, (), spread, problem.whitener(FIRST_OWN))
    except TirelibError as error:
        say(f"{file.name}: {error}")
        return None
    # laws cannot be kept in a file, and are needed no more
    problem.living = ()
    problem.forget()
    return problem, replace(fit, point=Point(fit.point.base), solved=None)


def family_of(name: str, fits: Sequence[Fit]) -> Family:
    """Return what a family's tires show."""
    tires = [
        [replace(view, white=np.zeros(0)) for view in fit.views(problem, OWN)]
        for problem, fit in fits
    ]
    family = learn(name, tires, fits[0][0].widths)
    say(f"{name}: {len(fits)} tires, median of a run's own misfit {family.own:g}")
    return family


def provenance(fits: dict[str, dict[int, Fit]]) -> dict[str, Any]:
    """Return seeds and counts."""
    return {
        "made by": "build/structure/make.py and build/structure/learn.py",
        "seeds": {name: sorted(of) for name, of in fits.items()},
        "counts": {name: len(of) for name, of in fits.items()},
    }


if __name__ == "__main__":
    main()
