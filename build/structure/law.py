"""Learn by how much the catalogue's laws are off where another simulator has the same effect.

    python build/structure/law.py
    python build/structure/law.py --families rig --seeds 101-170

Fits every campaign with one known effect with that effect. For each family it prints the log
likelihood of the relative standard deviation of a law
(`tirelib.inference.statistics.law_errors.LAWS`), summed over its campaigns, and that of the share
of what the law does that looks like one other effect
(`tirelib.inference.problems.strain_laws.LOOKALIKE_SHARE`), summed over campaigns and over the
other effects, each by itself. The other families' plain tires give the rest of the covariance.
"""

import argparse
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np

from structure.cases import load_case
from structure.judge import _identified
from structure.learn import FAMILIES, OUT, TABLE, say
from structure.make import seeds
from tirelib.core.errors import TirelibError
from tirelib.core.threads import one_thread
from tirelib.effects import CATALOGUE
from tirelib.inference.identify.campaign_data import straight_runs
from tirelib.inference.problems.strain import StrainProblem
from tirelib.inference.statistics.law_errors import Errors, law_errors
from tirelib.inference.statistics.null import OWN, Null
from tirelib.inference.statistics.plain import BASE, Family, load, pooled
from tirelib.inference.statistics.posterior import Posterior, posterior, sizes_at_start
from tirelib.inference.statistics.problem import Point
from tirelib.inference.statistics.views import View

LAW = tuple(0.15 * 2.0 ** np.arange(-3, 4))
SHARE = (0.0, 0.02, 0.04, 0.075, 0.15, 0.3)


def main() -> None:
    """Print the likelihoods."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=OUT)
    parser.add_argument("--families", default=",".join(FAMILIES))
    parser.add_argument("--ratio", default="1.50", help="error ratio, as in the names of files")
    parser.add_argument("--seeds", type=seeds, help="1-60 or 1,5,7-9; every one by default")
    options = parser.parse_args()
    say(f"{'error of the law | share alike':36}" + heading(LAW) + " |" + heading(SHARE))
    with one_thread():
        for family in options.families.split(","):
            others = [f for f in load(TABLE)[0] if f.name != family]
            found = [each for file in files(options, family) if (each := likelihoods(file, others))]
            if found:
                say(row(family, *(np.sum(each, axis=0) for each in zip(*found, strict=True))))


def files(options: argparse.Namespace, family: str) -> list[Path]:
    """Return the campaigns of a family in which one known effect is hidden."""
    found = []
    for file in sorted((options.out / family).glob(f"*-{options.ratio}.npz")):
        seed, kind = file.stem.split("-")[:2]
        if kind in CATALOGUE and (options.seeds is None or int(seed) in options.seeds):
            found.append(file)
    return found


def heading(values: Sequence[float]) -> str:
    """Return the values of a grid as the columns of a table."""
    return " ".join(f"{value:8.3f}" for value in values)


def row(name: str, *likelihoods: np.ndarray) -> str:
    """Return a line of log likelihoods less the largest of each grid."""
    each = (" ".join(f"{value:8.1f}" for value in found - found.max()) for found in likelihoods)
    return f"{name:36}" + " |".join(each)


def likelihoods(file: Path, others: list[Family]) -> tuple[np.ndarray, np.ndarray] | None:
    """Return log likelihoods of law errors and of shares for a campaign with its own effect."""
    try:
        problem, fit = fitted(file, others)
    except TirelibError as error:
        say(f"{file.name}: {error}")
        return None
    views = fit.views(problem, OWN)
    best = [likeliest(fit, views, others, law) for law in LAW]
    by_law = np.array([null.likelihood for null in best])
    null, laws = best[by_law.argmax()], (LAW[by_law.argmax()],)
    beside = {effect.name: fit.seen[effect.name] for effect in fit.point.effects[1:]}
    done = fit.seen[fit.names[0]]
    exact = Errors(laws, 0.0)
    by_share = np.zeros(len(SHARE))
    for name, other in beside.items():
        if not other:
            continue
        for k, share in enumerate(SHARE):
            allowed = {name: share**2 * done / other}
            by_share[k] += null_at(fit, null.view, null.family, exact, allowed).likelihood
    say(row(f"{file.parent.name} {file.stem}", by_law, by_share))
    return by_law, by_share


def fitted(file: Path, others: list[Family]) -> tuple[StrainProblem, Posterior]:
    """Return a campaign's problem and its fit with the effect that is hidden in it."""
    case = load_case(file)
    runs = straight_runs(case.waves)
    values = _identified(runs, file.parents[1] / "values" / f"{case.family}-{file.stem}.pkl")
    problem = StrainProblem(runs, values, list(CATALOGUE.values()))
    effect = CATALOGUE[case.kind]
    fit = posterior(
        problem,
        [effect],
        pooled(others, sizes_at_start(problem)),
        problem.whitener(max(family.own for family in others)),
        start=Point(problem.start.base, (effect,), (np.zeros(effect.components),)),
    )
    return problem, fit


def likeliest(fit: Posterior, views: Sequence[View], others: list[Family], law: float) -> Null:
    """Return the test with the largest likelihood, whatever it allows to look alike."""
    each = (
        null_at(fit, view, family, Errors((law,), share), {})
        for view in views
        for family in others
        for share in (0.0, fit.lookalike)
    )
    return max(each, key=lambda null: null.likelihood)


def null_at(
    fit: Posterior,
    view: View,
    family: Family,
    errors: Errors,
    more: Mapping[str, float | np.ndarray],
) -> Null:
    """Return the test of a fit whose law is off by so much, with more variances by block."""
    allowed = {BASE: fit.widths**2, **law_errors(fit, errors), **more}
    return Null(view, family, family.spread(fit.sizes), allowed, fit.sides, fit.gage)


if __name__ == "__main__":
    main()
