"""What the base leaves on plain tires of the families, and how well it finds their constants.

    python build/structure/base.py --family continuum --seeds 2,5,8,11
    python build/structure/base.py --family rig --seeds 2,5,8 --without contact_crown
    python build/structure/base.py --family ring --seeds 2,5,8 --prior contact_crown=2

Needs campaigns that `build/structure/make.py` has made. A line for each tire, then one for the
family: median error in units of the noise, rms errors of the numbers in percent, and the share of
95 % intervals that hold. `--without` fits a number at zero, `--prior` multiplies the standard
deviation of a number's prior: half and double of it.
"""

import argparse
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from structure.cases import NONE, Case, case_file, load_case
from structure.make import FAMILIES, OUT, seeds
from tirelib.compare.error import error_of
from tirelib.compare.model import Model
from tirelib.identify.campaign_data import StraightRuns, straight_runs
from tirelib.identify.discrepancy import Discrepancy
from tirelib.identify.identify import prior_std, start_file, structure_std
from tirelib.identify.waveform_fit import Prior, WaveformFit, fit_waveforms
from tirelib.model.base import PLAIN, values_of
from tirelib.model.whole import solve_whole
from tirelib.threads import one_thread

NUMBERS: Mapping[str, str] = {
    "EI": "bending_stiffness",
    "k_u": "radial_stiffness",
    "k_v": "tangential_stiffness",
    "k_t": "tread_stiffness",
    "EA": "extension_stiffness",
    "GA": "shear_stiffness",
}
"""Names of `Family.numbers`, and of the base."""
STIFFNESS = "vertical stiffness"
NEAR = 0.03
"""Relative error up to which a vertical stiffness, which has no interval, counts as held."""
NUDGE = 1e-3
"""Relative load by which the vertical stiffness is taken."""


@dataclass(frozen=True)
class Row:
    """What a fit to a tire found.

    Attributes
    ----------
    error : float
        What the base leaves, in units of the noise.
    wrong, held : mapping
        By name the relative error, and whether the 95 % interval holds the true value.
    """

    seed: int
    error: float
    wrong: Mapping[str, float]
    held: Mapping[str, bool]


def row(case: Case, without: Sequence[str], prior: Mapping[str, float]) -> Row:
    """Fit the base to a plain tire and compare it with the tire's constants."""
    runs = straight_runs(case.waves)
    start = start_file(case.waves.header, runs, None)
    free = tuple(c for c in PLAIN if c.name not in without)
    std = [prior_std(start, c) * prior.get(c.name, 1.0) for c in free]
    values = values_of(start.tire) | dict.fromkeys(without, 0.0)
    fit = fit_waveforms(
        runs.data(), values, Prior(np.array(std)), free=free, discrepancy=Discrepancy()
    )
    true = dict(case.truth["numbers"])
    for name in ("k_u", "k_v"):  # of 2 bar
        true[name] += true[f"{name}_slope"] * (float(values["pressure"]) - 2e5)
    structure = dict(zip((c.name for c in free), structure_std(start, free), strict=True))
    wrong, held = {}, {}
    for short, name in NUMBERS.items():
        k = [c.name for c in free].index(name)
        value, coordinate = float(fit.values[name]), free[k]
        wrong[short] = value / true[short] - 1.0
        ends = np.sort([float(coordinate.moved(value, z)) for z in fit.interval[k]])
        more = 1.96 * coordinate.spread(value, float(structure[name]))
        low, high = value - np.hypot(value - ends[0], more), value + np.hypot(ends[1] - value, more)
        held[short] = bool(low <= true[short] <= high)
    wrong[STIFFNESS] = _stiffness(fit, runs, case)
    held[STIFFNESS] = abs(wrong[STIFFNESS]) <= NEAR
    error = error_of(runs, Model.fitted(fit.values, (), ())).value
    return Row(case.seed, error, wrong, held)


def _stiffness(fit: WaveformFit, runs: StraightRuns, case: Case) -> float:
    """Return the median relative error of the vertical stiffness over the runs."""
    points = runs.data().points
    here = solve_whole(fit.values, points)
    more = solve_whole(
        fit.values, replace(points, load=points.load * (1.0 + NUDGE)), start=here.contact
    )
    found = points.load * NUDGE / (more.deflection - here.deflection)
    return float(np.median(found / np.array(case.truth["vertical_stiffness"]) - 1.0))


def told(label: str, errors: Sequence[float], rows: Sequence[Row]) -> str:
    """Return a line: error, rms of the relative errors in percent, intervals that hold."""
    parts = [f"{label:14s} error {np.median(errors):5.2f}"]
    for name in rows[0].wrong:
        rms = 100.0 * np.sqrt(np.mean([r.wrong[name] ** 2 for r in rows]))
        parts.append(f"{name} {rms:.1f} %")
    held = [h for r in rows for h in r.held.values()]
    return "  ".join([*parts, f"held {sum(held)} of {len(held)}"]) + "\n"


def main() -> None:
    """Fit and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--family", choices=FAMILIES, required=True)
    parser.add_argument("--seeds", required=True, type=seeds, help="1-60 or 1,5,7-9")
    parser.add_argument("--without", action="append", default=[], choices=[c.name for c in PLAIN])
    parser.add_argument("--prior", action="append", default=[], help="NAME=FACTOR")
    parser.add_argument("--out", type=Path, default=OUT)
    given = parser.parse_args()
    prior = {name: float(factor) for name, factor in (p.split("=") for p in given.prior)}
    rows = []
    for seed in given.seeds:
        case = load_case(case_file(given.out, given.family, seed, NONE, 1.0))
        rows.append(row(case, given.without, prior))
        sys.stdout.write(told(f"{given.family} {seed}", [rows[-1].error], rows[-1:]))
        sys.stdout.flush()
    sys.stdout.write(told(given.family, [r.error for r in rows], rows))


if __name__ == "__main__":
    with one_thread():
        main()
