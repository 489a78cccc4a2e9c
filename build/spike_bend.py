"""How far a sample of undisturbed strain stands apart from its neighbours, by the sample rate.

    python build/spike_bend.py CAMPAIGN... --calibration cal.toml

The strain of each campaign is thinned to a half, a fifth and a tenth of its samples. The first
table says by how much of the swing, and of that over the squared wheel angle between samples, a
sample departs from the median of its four neighbours at the most: `SPIKE_BEND` must lie above it.
The second says what half and double of it leave of a fifth of the samples: valid turns, rms error
of the load and turns that are called spiked.
"""

import argparse
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import click
import numpy as np
from road_constants import times

from tirelib.campaign import Campaign, Run, read_campaign
from tirelib.core.compiled import choose_numpy
from tirelib.core.flags import TurnFlag
from tirelib.core.threads import one_thread
from tirelib.estimators.calibration_file import read_calibration
from tirelib.measured.observations import measure_run
from tirelib.measured.signal import LowPass, quality

THINNED = (1, 2, 5, 10)
MARGIN = 20
"""Samples at either end of a run that are not looked at."""


def thinned(run: Run, every: int) -> Run:
    """Return a run with one in so many samples; the trigger moves to the sample before."""
    if run.strain is None:
        return run
    strain, trigger = run.strain[:, ::every], run.trigger
    if trigger is not None:
        trigger = np.zeros(strain.shape[1], dtype=np.bool_)
        trigger[np.minimum(np.flatnonzero(run.trigger) // every, trigger.size - 1)] = True
    return replace(run, strain=strain, trigger=trigger, rate=run.rate / every)


def departures(campaign: Campaign, every: int) -> Iterator[tuple[float, float]]:
    """Yield the angle between samples, [rad], and the largest departure over the swing."""
    for run in campaign.runs():
        omega = run.mean("omega")
        if run.strain is None or not omega:
            continue
        x = thinned(run, every).strain[:, MARGIN:-MARGIN]
        around = np.stack((x[:, :-4], x[:, 1:-3], x[:, 3:-1], x[:, 4:]))
        apart = np.abs(x[:, 2:-2] - np.median(around, axis=0)) / np.ptp(x, axis=1)[:, None]
        yield omega * every / run.rate, float(np.nanmax(apart))


def left(campaign: Campaign, calibration: Path, every: int) -> str:
    """Return what is told of thinned strain."""
    known, error, flagged, count = read_calibration(calibration), [], 0, 0
    for run in campaign.runs():
        header = replace(campaign.header, rate=campaign.header.rate / every)
        features, _ = measure_run(thinned(run, every), header, LowPass(known.order, known.cut_off))
        found, load = known.estimate(features), run.mean("Fz")
        flagged += int((features.flags & int(TurnFlag.SPIKE) != 0).sum())
        count += len(features)
        error += (found.value["Fz"] - load)[found.turn_valid].tolist() if load else []
    rms = np.sqrt(np.mean(np.square(error))) if error else np.nan
    return f"{len(error)} of {count} turns valid, Fz {rms:.1f} N rms, {flagged} turns spiked"


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("campaigns", type=Path, nargs="+")
    parser.add_argument("--calibration", type=Path, required=True)
    given = parser.parse_args()
    campaigns = [read_campaign(path) for path in given.campaigns]
    for every in THINNED:
        found = np.array([pair for each in campaigns for pair in departures(each, every)])
        step, apart = found.T
        large = apart > quality.SPIKE_SHARE  # below, nothing is called a spike in any case
        over = f"{np.max(apart[large] / step[large] ** 2):.0f}" if large.any() else "-"
        click.echo(
            f"one sample in {every}, {1e3 * step.min():.1f} to {1e3 * step.max():.1f} mrad: "
            f"{apart.max():.3f} of the swing, {over} /rad^2"
        )
    for factor in (0.0, 0.5, 1.0, 2.0):
        with times(quality, "SPIKE_BEND", factor):
            click.echo(f"SPIKE_BEND x {factor:g}: {left(campaigns[0], given.calibration, 5)}")


if __name__ == "__main__":
    choose_numpy()  # constants of the compiled core cannot be changed
    with one_thread():
        main()
