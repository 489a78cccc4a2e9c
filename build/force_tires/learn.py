"""Learn what plain tires leave of a fitted brush, and count false alarms on a family left out.

    python build/force_tires/learn.py
    python build/force_tires/learn.py --quantities Fy,Mz,Fx --out build/out

Writes tirelib/inference/statistics/plain_Fy.npz (plain_Fx.npz, plain_Mz.npz) with its seeds and the
families' hash, and prints which plain tires are said to lack something, each judged by the other
families, to first order.
"""

import argparse
import ast
import hashlib
import json
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from force_tires.bench import problem_of
from force_tires.families import FAMILIES
from force_tires.plans import case
from tirelib.core.errors import TirelibError
from tirelib.core.threads import one_thread
from tirelib.inference.problems.forces import ForceProblem
from tirelib.inference.statistics.hypothesis import judged
from tirelib.inference.statistics.null import OWN
from tirelib.inference.statistics.plain import Family, covering, learn, save
from tirelib.inference.statistics.posterior import Posterior, posterior

HERE = Path(__file__).parent
OUT = Path(__file__).parents[2] / "tirelib" / "inference" / "statistics"
FIRST = {"effect": 0.1**2, "shape": 0.01**2}
"""Variances of the fits from which the learning starts."""
FIRST_OWN = 0.002
"""Size of a run's own misfit in these fits, over its rms force."""
LARGEST = 32.0
"""Most by which one tire shows more of the smooth shapes than its family: tires of a rig leave more
than those of a program, so that the likelihood of the tire decides."""
Fit = tuple[ForceProblem, Posterior]


def seeds(text: str) -> range:
    """Return the seeds of `1-40`."""
    first, last = text.split("-")
    return range(int(first), int(last) + 1)


def say(text: str) -> None:
    """Print a line at once."""
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


def fit_of(family: str, seed: int, quantity: str) -> Fit | None:
    """Return the fitted brush of a plain tire, or None if there is none."""
    try:
        problem = problem_of(case(family, seed, quantity=quantity), quantity)
        spread = {effect.name: FIRST["effect"] for effect in problem.living}
        groups = problem.remainder(problem.start, problem.solve(problem.start))
        spread |= dict.fromkeys(groups, FIRST["shape"])
        return problem, posterior(problem, (), spread, problem.whitener(FIRST_OWN))
    except TirelibError as error:
        say(f"{family} {seed} {quantity}: {error}")
        return None


def family_of(name: str, fits: Sequence[Fit]) -> Family:
    """Return what a family's tires show."""
    tires = [
        [replace(view, white=np.zeros(0)) for view in fit.views(problem, OWN)]
        for problem, fit in fits
    ]
    return learn(name, tires, fits[0][1].widths, LARGEST)


def main() -> None:
    """Fit, learn, judge, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quantities", default="Fy")
    parser.add_argument("--seeds", type=seeds, default=seeds("1-40"))
    parser.add_argument("--out", type=Path, default=OUT)
    given = parser.parse_args()
    for quantity in given.quantities.split(","):
        found = {
            name: {seed: fit_of(name, seed, quantity) for seed in given.seeds} for name in FAMILIES
        }
        fits = {
            name: {seed: fit for seed, fit in of.items() if fit is not None}
            for name, of in found.items()
        }
        families = [family_of(name, list(of.values())) for name, of in fits.items()]
        for family in families:
            shown = {k: round(float(np.sqrt(v)), 3) for k, v in family.shown().items()}
            say(f"{quantity} {family.name} {len(family)}, own {family.own:g}: {json.dumps(shown)}")
        provenance = {
            "made by": "build/force_tires/learn.py",
            "seeds": {name: sorted(of) for name, of in fits.items()},
            "families_sha256": families_sha256(),
        }
        save(given.out / f"plain_{quantity}.npz", families, provenance)
        for name, of in fits.items():
            others = covering([family for family in families if family.name != name])
            p = {s: judged(*fit, others, 0.05, own_effects=0).p for s, fit in of.items()}
            alarms = [seed for seed, each in p.items() if each <= 0.05]
            say(f"{quantity} {name}: {len(alarms)} of {len(p)} alarms, seeds {alarms}")


def families_sha256() -> str:
    """Return the hash of the families and plans, without texts and without imports."""
    hashed = hashlib.sha256()
    for name in ("families.py", "plans.py"):
        tree = ast.parse((HERE / name).read_text())
        for node in ast.walk(tree):
            body = getattr(node, "body", None)
            if isinstance(body, list):
                said = (
                    isinstance(each, ast.ImportFrom)
                    or (isinstance(each, ast.Expr) and isinstance(each.value, ast.Constant))
                    for each in body
                )
                node.body = [each for each, text in zip(body, said, strict=True) if not text]  # type: ignore[attr-defined]
        hashed.update(ast.unparse(tree).encode())
    return hashed.hexdigest()


if __name__ == "__main__":
    with one_thread():
        main()
