"""What the base leaves on plain tires of the families, and how well it finds their constants.

    python build/structure/base.py --family continuum --seeds 2,5,8,11
    python build/structure/base.py --family rig --seeds 2,5,8 --without contact_crown
    python build/structure/base.py --family ring --seeds 2,5,8 --prior contact_crown=2

Needs campaigns that `build/structure/make.py` has made. A line for each tire, then one for the
family: median error in units of the noise, rms errors of the numbers in percent, and the share of
95 % intervals that hold, of all and of the numbers that are not flagged. `--without` fits a number
at zero, `--prior` multiplies the standard deviation of a number's prior: half and double of it.
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
from tirelib.core.threads import one_thread
from tirelib.inference.compare.error import error_of
from tirelib.inference.compare.model import TireModel
from tirelib.inference.identify.campaign_data import StraightRuns, straight_runs
from tirelib.inference.identify.discrepancy import Discrepancy
from tirelib.inference.identify.identify import intervals_of, prior_std, start_file
from tirelib.inference.identify.waveform_fit import WaveformFit, fit_waveforms
from tirelib.model.base import PLAIN, values_of
from tirelib.model.solution import solved

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
STIFFNESS_TOLERANCE = 0.03
"""Relative error up to which a vertical stiffness, which has no interval, counts as held."""
NUDGE = 1e-3
"""Relative load by which the vertical stiffness is taken."""


@dataclass(frozen=True)
class Found:
    """What a fit says of a number.

    Attributes
    ----------
    wrong : float
        Relative error.
    held : bool
        Whether the 95 % interval holds the true value.
    flagged : bool
        Whether the number is said to be not identifiable.
    """

    wrong: float
    held: bool
    flagged: bool = False


@dataclass(frozen=True)
class Row:
    """What a fit to a tire found.

    Attributes
    ----------
    error : float
        What the base leaves, in units of the noise.
    numbers : mapping
        By name.
    """

    seed: int
    error: float
    numbers: Mapping[str, Found]


def row(case: Case, without: Sequence[str], prior: Mapping[str, float]) -> Row:
    """Fit the base to a plain tire and compare it with the tire's constants."""
    runs = straight_runs(case.waves)
    start = start_file(case.waves.header, runs, None)
    free = tuple(c for c in PLAIN if c.name not in without)
    std = [prior_std(start, c) * prior.get(c.name, 1.0) for c in free]
    values = values_of(start.tire) | dict.fromkeys(without, 0.0)
    fit = fit_waveforms(runs.data(), values, np.array(std), free=free, discrepancy=Discrepancy())
    true = dict(case.truth["numbers"])
    for name in ("k_u", "k_v"):  # of 2 bar
        true[name] += true[f"{name}_slope"] * (float(values["pressure"]) - 2e5)
    numbers, every = {}, {each.name: each for each in intervals_of(start, fit)}
    for short, name in NUMBERS.items():
        e = every[name]
        numbers[short] = Found(
            e.value / true[short] - 1.0,
            bool(e.low <= true[short] <= e.high),
            "not_identifiable" in e.flags,
        )
    wrong = _stiffness(fit, runs, case)
    numbers[STIFFNESS] = Found(wrong, abs(wrong) <= STIFFNESS_TOLERANCE)
    error = error_of(runs, TireModel.fitted(fit.values, (), ())).value
    return Row(case.seed, error, numbers)


def _stiffness(fit: WaveformFit, runs: StraightRuns, case: Case) -> float:
    """Return the median relative error of the vertical stiffness over the runs."""
    points = runs.data().points
    here = solved(fit.values, points, low_pass=fit.problem.data.low_pass)
    more = solved(
        fit.values,
        replace(points, load=points.load * (1.0 + NUDGE)),
        low_pass=fit.problem.data.low_pass,
        start=here.rolling,
    )
    found = points.load * NUDGE / (more.deflection - here.deflection)
    return float(np.median(found / np.array(case.truth["vertical_stiffness"]) - 1.0))


def told(label: str, rows: Sequence[Row]) -> str:
    """Return a line: error, rms of the relative errors in percent, intervals that hold."""
    parts = [f"{label:14s} error {np.median([r.error for r in rows]):5.2f}"]
    for name in rows[0].numbers:
        rms = 100.0 * np.sqrt(np.mean([r.numbers[name].wrong ** 2 for r in rows]))
        flagged = sum(r.numbers[name].flagged for r in rows)
        parts.append(f"{name} {rms:.1f} %{f' ({flagged} flagged)' if flagged else ''}")
    every = [found for r in rows for found in r.numbers.values()]
    sure = [found for found in every if not found.flagged]
    parts.append(f"held {sum(f.held for f in every)} of {len(every)}")
    parts.append(f"not flagged {sum(f.held for f in sure)} of {len(sure)}")
    return "  ".join(parts) + "\n"


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
        sys.stdout.write(told(f"{given.family} {seed}", rows[-1:]))
        sys.stdout.flush()
    sys.stdout.write(told(given.family, rows))


if __name__ == "__main__":
    with one_thread():
        main()
