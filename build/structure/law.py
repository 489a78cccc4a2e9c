"""Learn by how much the catalogue's laws are off where another simulator has the same effect.

    python build/structure/law.py

Fits every campaign with one known effect with that effect, and prints for each family the log
likelihood of the relative standard deviation of a law
(`tirelib.inference.statistics.law_errors.LAWS`), summed over its campaigns. The other families'
plain tires give the rest of the covariance.
"""

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np

from structure.cases import load_case
from structure.judge import _identified
from structure.learn import FAMILIES, OUT, TABLE, say
from tirelib.core.errors import TirelibError
from tirelib.core.threads import one_thread
from tirelib.effects import CATALOGUE
from tirelib.inference.identify.campaign_data import straight_runs
from tirelib.inference.problems.strain import StrainProblem
from tirelib.inference.statistics.law_errors import Errors, law_errors
from tirelib.inference.statistics.null import OWN, Null
from tirelib.inference.statistics.plain import BASE, Family, load, pooled
from tirelib.inference.statistics.posterior import posterior, sizes_at_start
from tirelib.inference.statistics.problem import Point

GRID = tuple(0.15 * 2.0 ** np.arange(-3, 4))


def main() -> None:
    """Print the likelihoods."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=OUT)
    parser.add_argument("--families", default=",".join(FAMILIES))
    options = parser.parse_args()
    say(f"{'law error':36}" + " ".join(f"{law:8.3f}" for law in GRID))
    with one_thread():
        for family in options.families.split(","):
            others = [f for f in load(TABLE)[0] if f.name != family]
            total = np.zeros(len(GRID))
            for file in sorted((options.out / family).glob("*.npz")):
                kind = file.stem.split("-")[1]
                if kind in CATALOGUE:
                    found = likelihoods(file, kind, others, options.out)
                    if found is not None:
                        total += found
                        say(row(f"{family} {file.stem}", found))
            say(row(family, total))


def row(name: str, found: np.ndarray) -> str:
    """Return a line of log likelihoods less the largest."""
    return f"{name:36}" + " ".join(f"{each:8.1f}" for each in found - found.max())


def likelihoods(file: Path, kind: str, others: list[Family], out: Path) -> np.ndarray | None:
    """Return the log likelihoods of law errors for one campaign with its own effect."""
    case = load_case(file)
    runs = straight_runs(case.waves)
    try:
        values = _identified(runs, out / "values" / f"{case.family}-{file.stem}.pkl")
        problem = StrainProblem(runs, values, list(CATALOGUE.values()))
        own = max(family.own for family in others)
        start = Point(
            problem.start.base, (CATALOGUE[kind],), (np.zeros(CATALOGUE[kind].components),)
        )
        fit = posterior(
            problem,
            [CATALOGUE[kind]],
            pooled(others, sizes_at_start(problem)),
            problem.whitener(own),
            start=start,
        )
    except TirelibError as error:
        say(f"{file.name}: {error}")
        return None
    views = fit.views(problem, OWN)
    found = []
    for law in GRID:
        found.append(
            max(
                Null(
                    view,
                    family,
                    family.spread(fit.sizes),
                    {BASE: fit.widths**2, **law_errors(fit, Errors((law,), fit.lookalike), view)},
                    fit.sides,
                ).likelihood
                for family in others
                for view in views
            )
        )
    return np.array(found)


if __name__ == "__main__":
    main()
