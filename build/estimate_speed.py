"""CPU time of features and estimates of a campaign: the compiled core beside numpy.

    python build/estimate_speed.py CAMPAIGN CALIBRATION.toml [--runs 24] [--repeat 5]

Times are of one thread, without reading the files, and the least of the repetitions: on a machine
that others use, the others only add to them. The same numbers come out of both, which is checked.
"""

import argparse
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from tirelib.campaign import conditions_of, read_campaign
from tirelib.estimators.calibration_file import read_calibration
from tirelib.features import features_of_record
from tirelib.features.extract import reference_features
from tirelib.observations import concatenate_features
from tirelib.signal import LowPass, TurnCutter, stack_turns
from tirelib.threads import one_thread


def least(work: Callable[[], Any], repeat: int) -> tuple[float, Any]:
    """Return the least CPU time of a piece of work [s], and its result."""
    times = []
    for _ in range(repeat):
        begin = time.thread_time()
        result = work()
        times.append(time.thread_time() - begin)
    return min(times), result


def main() -> None:
    """Read, compute in both ways, compare, print."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("campaign")
    options.add_argument("calibration")
    options.add_argument("--runs", type=int, default=24)
    options.add_argument("--repeat", type=int, default=5)
    given = options.parse_args()
    known, campaign = read_calibration(given.calibration), read_campaign(given.campaign)
    lateral = campaign.header.gage_lateral
    low_pass = LowPass(known.order, known.cut_off)
    records = []
    for run, _ in zip(campaign.runs(), range(given.runs), strict=False):
        records.append((run, {"trigger": run.trigger, **conditions_of(run, run.time())}))

    def by_numpy() -> Any:
        parts = []
        for run, held in records:
            turns = TurnCutter(lateral, run.rate, low_pass).push(run.strain, **held)
            parts.append(reference_features(stack_turns(turns, np.array(lateral), run.rate)))
        return concatenate_features(parts)

    def by_core() -> Any:
        return concatenate_features(
            features_of_record(run.strain, run.rate, lateral, low_pass=low_pass, **held)
            for run, held in records
        )

    rows = []
    for features, estimate in (
        (by_numpy, known.reference_estimate),
        (by_core, known.estimate),
    ):
        cut, found = least(features, given.repeat)
        told, result = least(lambda e=estimate, f=found: e(f), given.repeat)
        rows.append((cut, told, result))
    for quantity, values in rows[0][2].value.items():
        np.testing.assert_allclose(rows[1][2].value[quantity], values, 1e-8, 1e-8)
    samples = sum(run.strain.shape[1] for run, _ in records)
    sys.stdout.write(f"{len(records)} runs, {samples} samples, {len(found)} turns\n")
    for name, (cut, told, _) in zip(("numpy", "core"), rows, strict=True):
        sys.stdout.write(
            f"{name}: features {1e3 * cut:.1f} ms, estimates {1e3 * told:.1f} ms, "
            f"together {1e3 * (cut + told):.1f} ms\n"
        )
    ratio = sum(rows[0][:2]) / sum(rows[1][:2])
    sys.stdout.write(f"the core takes a {ratio:.1f}th of the time\n")


if __name__ == "__main__":
    with one_thread():
        main()
