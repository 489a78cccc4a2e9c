"""Slip ratio per unit of pull of the rig's tires: ``python build/pull_slip.py``.

Prints, for three tires at two loads, the slope of the slip ratio over the pull and the constant
`PULL_SLIP` of `tirelib.measured.signal.slip` that follows. Campaigns are kept in the folder.
"""

import argparse
from pathlib import Path

import click
import numpy as np

from tirelib.campaign import read_campaign
from tirelib.core.threads import one_thread
from tirelib.measured.signal import cut_turns
from tirelib.measured.signal.slip import pull
from tirelib.rig.campaign import TRUTH_FILE, run_plan
from tirelib.rig.plans import Plan
from tirelib.rig.tire import TIRES, Condition, tire

LOADS, SLIPS = (3000.0, 6000.0), (-0.03, -0.015, 0.0, 0.015, 0.03)
PULLED = Plan(
    "pulled",
    "2 loads x 5 slip ratios at 65 km/h, 2.3 bar",
    tuple(Condition(load, 2.3e5, 65.0 / 3.6, slip_ratio=slip) for load in LOADS for slip in SLIPS),
)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("build/out/pull"))
    folder: Path = parser.parse_args().out
    for name in TIRES:
        where = folder / name
        if not (where / TRUTH_FILE).exists():
            run_plan(PULLED, tire(name), where, seed=3, jobs=1, overwrite=True)
        campaign = read_campaign(where)
        lateral = campaign.header.gage_lateral
        centre = int(np.argmin(np.abs(lateral)))
        rows = []
        for run in campaign.runs():
            turns = cut_turns(run.strain, campaign.header.rate, lateral, speed=run.plan.speed)
            strain, halves = turns.trace.strain[1:, centre], turns.trace.pulse[1:]
            rows += [
                (run.plan.load, run.plan.slip_ratio, pull(wave), half)
                for wave, half in zip(strain, halves, strict=True)
            ]
        table = np.array(rows)
        for load in LOADS:
            _, slip, pulled, half = table[np.abs(table[:, 0] - load) < 1.0].T
            slope = np.polyfit(pulled, slip, 1)[0]
            constant = -slope * half.mean() ** 1.5
            click.echo(f"{name}, {load:g} N: {-slope:.3f} per unit of pull, {constant:.5f}")


if __name__ == "__main__":
    with one_thread():
        main()
