"""CPU time of features and estimates of a campaign: the compiled core beside numpy.

    python build/estimate_speed.py CAMPAIGN CALIBRATION.toml [--runs 24] [--repeat 20]

Times are of one thread, without reading the files, and the least of the repetitions: on a machine
that others use, the others only add to them. Both are timed in turn, so that they have the same
quiet moments. The same numbers come out of both, which is checked.
"""

import argparse
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from tirelib.campaign import conditions_of, read_campaign
from tirelib.core.threads import one_thread
from tirelib.estimators.calibration_file import read_calibration
from tirelib.measured.features import RecordReader, concatenate_features
from tirelib.measured.features.extract import reference_features
from tirelib.measured.signal import LowPass, TurnCutter, stack_turns


def timed(work: Callable[[], Any]) -> tuple[float, Any]:
    """Return the CPU time of a piece of work [s], and its result."""
    begin = time.thread_time()
    result = work()
    return time.thread_time() - begin, result


def main() -> None:
    """Read, compute in both ways, compare, print."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("campaign")
    options.add_argument("calibration")
    options.add_argument("--runs", type=int, default=24)
    options.add_argument("--repeat", type=int, default=20)
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
        reader = RecordReader(lateral, low_pass)
        for run, held in records:
            reader.add(run.strain, run.rate, **held)
        return reader.features()

    ways = {"numpy": (by_numpy, known.reference_estimate), "core": (by_core, known.estimate)}
    least = dict.fromkeys(ways, np.full(2, np.inf))
    values = {}
    for _ in range(given.repeat):
        for name, (features, estimate) in ways.items():
            cut, found = timed(features)
            told, result = timed(lambda e=estimate, f=found: e(f))
            least[name] = np.minimum(least[name], (cut, told))
            values[name] = result.value
    for quantity, wanted in values["numpy"].items():
        np.testing.assert_allclose(values["core"][quantity], wanted, 1e-8, 1e-8)
    samples = sum(run.strain.shape[1] for run, _ in records)
    sys.stdout.write(f"{len(records)} runs, {samples} samples, {len(found)} turns\n")
    for name, (cut, told) in least.items():
        sys.stdout.write(
            f"{name}: features {1e3 * cut:.1f} ms, estimates {1e3 * told:.1f} ms, "
            f"together {1e3 * (cut + told):.1f} ms\n"
        )
    ratio = least["numpy"].sum() / least["core"].sum()
    sys.stdout.write(f"the core takes a {ratio:.1f}th of the time\n")


if __name__ == "__main__":
    with one_thread():
        main()
