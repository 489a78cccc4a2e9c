"""Whether a simpler polynomial tells load and lateral force better beyond the calibrated loads.

    python build/fall_back.py --out build/out/ramps

Leaves each load out of the rig's plan `set1`, alone and with the braked and driven runs of
`build/ramp_coverage.py`, and calibrates without it twice: as in use, and with the smallest
candidate for Fz and for Fy. Printed are the root mean square errors at the load that was left out,
and that of a rule which takes, in turns out of range, the one with the smaller standard deviation.
"""

import argparse
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from unittest import mock

import click
import numpy as np
from ramp_coverage import STEADY, campaigns

from tirelib.core.arrays import FloatArray
from tirelib.core.threads import one_thread
from tirelib.estimators import basis
from tirelib.estimators.calibrate import calibrate_chain
from tirelib.estimators.regressors import compute_regressors
from tirelib.estimators.train import take
from tirelib.measured.observations import Observations, observe
from tirelib.rig.plans import plan

LOAD_STEP = 250.0
"""Least distance of two loads of a plan, [N]."""


@contextmanager
def smallest() -> Iterator[None]:
    """Offer the smallest candidate alone, and no families of terms."""
    load, force = basis.load_candidates, basis.force_candidates
    with ExitStack() as stack:
        for name, offered in (
            ("load_candidates", lambda varying: load(varying)[:1]),
            ("force_candidates", lambda varying: force(varying)[:1]),
            ("load_families", lambda _: {}),
            ("force_families", lambda _: {}),
        ):
            stack.enter_context(mock.patch.object(basis, name, offered))
        yield


def rms(error: FloatArray) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(error**2)))


def rows(seen: Observations) -> Iterator[list[str]]:
    """Yield load, quantity, and errors in use, of the simple polynomial, and of the rule."""
    regressors = compute_regressors(seen.features, range(5))
    nominal = np.round(seen.nominal["load"] / LOAD_STEP) * LOAD_STEP
    for level in np.unique(nominal):
        test = nominal == level
        rest = take(seen, ~test)
        used = calibrate_chain(rest, range(5))[0].predict(regressors)[0]
        with smallest():
            simple = calibrate_chain(rest, range(5))[0].predict(regressors)[0]
        label = f"{np.mean(seen.nominal['load'][test]):.0f} N"
        for quantity in ("Fz", "Fy"):
            one, other = used[quantity], simple[quantity]
            falls = ~one.valid & (other.std < one.std)
            values = one.value, other.value, np.where(falls, other.value, one.value)
            good = test & seen.usable & np.isfinite(one.value + other.value)
            errors = [rms((value - seen.truth[quantity])[good]) for value in values]
            share = f"{100.0 * np.mean(one.valid[good]):.0f} %"
            yield [label, quantity, share, *(f"{error:.0f} N" for error in errors)]


def main() -> None:
    """Measure, leave out, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("build/out/ramps"))
    parser.add_argument("--jobs", type=int, default=2)
    given = parser.parse_args()
    days = {"`set1`": {plan("set1"): 1}, "with braked and driven runs": STEADY}
    head = "| runs | left out | quantity | in range | in use | simple | rule |"
    click.echo(f"{head}\n|{'---|' * 7}")
    for name, plans in days.items():
        for row in rows(observe(campaigns(given.out, plans, given.jobs))):
            click.echo(f"| {name} | {' | '.join(row)} |")


if __name__ == "__main__":
    with one_thread():
        main()
