"""What half and double of numbers that decide in the estimators do, on the numerical rig.

    python build/estimator_constants.py --out build/out/ramps

Calibrates the full set of gages on the steady runs of `build/ramp_coverage.py`, once as it is and
once with each constant halved and doubled, and judges on the plan `ramps` of another day. A table
is printed: root mean square error of all turns, share in the 95 % interval and rms standard
deviation of Fz, Fy and kappa. A quantity that the calibration then refuses is a dash.
"""

import argparse
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from unittest import mock

import click
import numpy as np
import pandas as pd
from ramp_coverage import RAMPS, STEADY, TRUE, campaigns

from tirelib.core.arrays import FloatArray
from tirelib.core.compiled import choose_numpy
from tirelib.core.threads import one_thread
from tirelib.estimators import ends, fit_links, fit_sliding, pulled
from tirelib.estimators.calibrate import calibrate_chain
from tirelib.estimators.edge import EDGE_UNIT
from tirelib.estimators.regressors import compute_regressors
from tirelib.estimators.unknowns import TWO_SIGMA
from tirelib.measured.observations import Observations, observe
from tirelib.rig.campaign import TRUTH_FILE

CONSTANTS: tuple[tuple[ModuleType, str], ...] = (
    (fit_links, "FREE_ROLLING"),
    (fit_links, "LEAST_FORCE"),
    (fit_links, "LEAST_LOAD"),
    (pulled, "PULL"),
    (pulled, "FEWEST_PULLED"),
    (ends, "FEWEST_BEYOND"),
    (fit_sliding, "FEWEST_SLIDING"),
)
JUDGED = ("Fz", "Fy", "kappa")


def cases() -> Iterator[tuple[str, ModuleType | None, str, float]]:
    """Yield label, module, constant and value."""
    yield "as it is", None, "", 0.0
    for module, name in CONSTANTS:
        for label, factor in (("half", 0.5), ("double", 2.0)):
            where = f"{module.__name__.rsplit('.', 1)[-1]}.{name}"
            yield f"{label} {where}", module, name, factor * getattr(module, name)


def cells(steady: Observations, ramps: Observations, truth: dict[str, FloatArray]) -> list[str]:
    """Return the cells of one calibration."""
    chain, _ = calibrate_chain(steady, range(5))
    found, _ = chain.predict(compute_regressors(ramps.features, range(5)))
    out = []
    for name in JUDGED:
        if name not in found:
            out.append("-")
            continue
        told, factor = found[name], EDGE_UNIT[name][1]
        late = ramps.features.slip_std if name == "kappa" else 0.0
        error, std = factor * (told.value - truth[name]), factor * np.hypot(told.std, late)
        use = ramps.usable & np.isfinite(error)
        held = 100.0 * np.mean(np.abs(error[use]) <= TWO_SIGMA * std[use])
        rms = [np.sqrt(np.mean(x[use] ** 2)) for x in (error, std)]
        out.append(f"{rms[0]:.3g}; {held:.1f} %; {rms[1]:.3g}")
    return out


def main() -> None:
    """Measure, calibrate with each constant, judge, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("build/out/ramps"))
    parser.add_argument("--jobs", type=int, default=2)
    given = parser.parse_args()
    steady = observe(campaigns(given.out, STEADY, given.jobs))
    (campaign,) = campaigns(given.out, RAMPS, given.jobs)
    ramps = observe([campaign])
    points = dict(list(pd.read_csv(campaign.path / TRUTH_FILE).groupby("run")))
    truth = {
        name: np.array(
            [
                np.interp(time, points[run]["time_s"], points[run][column])
                for time, run in zip(ramps.features.time, ramps.run, strict=True)
            ]
        )
        for name, column in TRUE.items()
    }
    units = [f"{name} [{EDGE_UNIT[name][0]}]" for name in JUDGED]
    click.echo(f"| constant | {' | '.join(units)} |\n|{'---|' * (1 + len(units))}")
    for label, module, name, value in cases():
        if module is None:
            row = cells(steady, ramps, truth)
        else:
            with mock.patch.object(module, name, value):
                row = cells(steady, ramps, truth)
        click.echo(f"| {label} | {' | '.join(row)} |")


if __name__ == "__main__":
    choose_numpy()  # constants of the compiled core cannot be changed
    with one_thread():
        main()
