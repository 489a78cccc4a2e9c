"""What the estimators tell while the rig's speed, slip ratio or slip angle changes.

    python build/ramp_coverage.py --out build/out/ramps

Calibrates on steady runs of the rig (plan `set1`, three loads at five speeds and at seven slip
ratios) and judges on another day's plan `ramps`, with the turn rate that the rig measured and
without it. The truth is the rig's own at the middle of the contact: a mean over a turn is another
number where a slip ratio turns round. Campaigns are kept in the folder; with none there, the rig
takes some minutes.
``coverage.md`` is written.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import click
import numpy as np
import pandas as pd

from tirelib.campaign import Campaign, Run, read_campaign
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.edge import EDGE_UNIT
from tirelib.estimators.train import train
from tirelib.estimators.unknowns import TWO_SIGMA
from tirelib.observations import measure_run, observe
from tirelib.rig.campaign import TRUTH_FILE, run_plan
from tirelib.rig.plans import Plan, plan
from tirelib.rig.tire import Condition, tire
from tirelib.signal import LowPass
from tirelib.threads import one_thread

KMH, LOADS = 1.0 / 3.6, (3000.0, 4800.0, 6600.0)
STRAIGHT = Plan(
    "straight_ahead",
    "3 loads x 5 speeds, and 3 loads x 7 slip ratios at 65 km/h, 2.3 bar",
    (
        *(Condition(load, 2.3e5, kmh * KMH) for load in LOADS for kmh in (20, 40, 65, 90, 110)),
        *(
            Condition(load, 2.3e5, 65.0 * KMH, slip_ratio=slip)
            for load in LOADS
            for slip in (-0.08, -0.05, -0.03, -0.015, 0.015, 0.03, 0.05)
        ),
    ),
)
STEADY = {plan("set1"): 1, STRAIGHT: 2}
RAMPS = {plan("ramps"): 4}
"""Plans, and the day that each is measured on."""
OMEGA, SPEED, DENSE = "omega", "speed", "1 kHz"
"""What tells the wheel's own motion: the rig's turn rate and speed, its speed alone, or both with
the values between those of the rig, which are otherwise held from one to the next."""
COLUMNS = (
    ("Fz", OMEGA),
    ("Fz", SPEED),
    ("alpha", OMEGA),
    ("Fy", OMEGA),
    ("kappa", OMEGA),
    ("kappa", SPEED),
    ("kappa", DENSE),
)

TRUE = {
    "Fz": "Fz_N",
    "alpha": "slip_angle_rad",
    "Fy": "Fy_N",
    "kappa": "slip_ratio_1",
}
"""Columns of the rig's truth."""

Judged = dict[tuple[str, str], list[tuple[float, float]]]
"""By quantity and source: error and standard deviation of each valid turn."""


def campaigns(folder: Path, days: dict[Plan, int], jobs: int) -> list[Campaign]:
    """Return campaigns of the rig, each measured once."""
    for chosen, day in days.items():
        where = folder / chosen.name
        if not (where / "truth.csv").exists():  # the rig writes it last
            run_plan(chosen, tire("reference"), where, seed=day, jobs=jobs, overwrite=True)
    return [read_campaign(folder / chosen.name) for chosen in days]


def told_by(run: Run, source: str) -> Run:
    """Return a run with what a source leaves of the rig's channels."""
    if source == SPEED:
        return replace(run, rig={name: x for name, x in run.rig.items() if name != "omega"})
    if source == OMEGA or run.rig_time is None:
        return run
    time = np.arange(run.rig_time[0], run.rig_time[-1], 1e-3)
    rig = {name: np.interp(time, run.rig_time, x) for name, x in run.rig.items()}
    return replace(run, rig=rig, rig_time=time)


def judged(calibration: Calibration, ramps: Campaign) -> tuple[dict[str, Judged], dict[str, str]]:
    """Return the valid turns of each kind of ramp, and how many these are of all."""
    low_pass = LowPass(calibration.order, calibration.cut_off)
    truth = pd.read_csv(ramps.path / TRUTH_FILE).set_index("run")
    out: dict[str, Judged] = {}
    valid: dict[str, list[bool]] = {}
    for run in ramps.runs():
        kind = str(run.plan.extra["ramp"])
        turns, points = out.setdefault(kind, {}), truth.loc[[run.plan.run]]
        for source in (OMEGA, SPEED, DENSE):
            features, _ = measure_run(told_by(run, source), ramps.header, low_pass)
            told = calibration.estimate(features)
            good = told.turn_valid
            if source == OMEGA:
                valid.setdefault(kind, []).extend(good)
            for quantity, column in TRUE.items():
                true = np.interp(features.time, points["time_s"], points[column])
                error = (told.value[quantity] - true)[good]
                rows = zip(error, told.std[quantity][good], strict=True)
                turns.setdefault((quantity, source), []).extend(rows)
    return out, {kind: f"{sum(good)} of {len(good)}" for kind, good in valid.items()}


def cell(rows: list[tuple[float, float]], factor: float) -> str:
    """Return rms error, share in the 95 % interval, and the largest error in std."""
    error, std = np.array(rows).T
    held = 100.0 * np.mean(np.abs(error) <= TWO_SIGMA * std)
    rms = factor * np.sqrt(np.mean(error**2))
    return f"{rms:.2g}; {held:.0f} %; {np.max(np.abs(error) / std):.1f}"


def main() -> None:
    """Measure, calibrate, judge, write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("build/out/ramps"))
    parser.add_argument("--jobs", type=int, default=2)
    given = parser.parse_args()
    calibration = train(observe(campaigns(given.out, STEADY, given.jobs))).calibration
    (ramps,) = campaigns(given.out, RAMPS, given.jobs)
    names = [f"{name} [{EDGE_UNIT[name][0]}], {source}" for name, source in COLUMNS]
    lines = [f"| ramp | valid | {' | '.join(names)} |", f"|{'---|' * (2 + len(names))}"]
    turns, valid = judged(calibration, ramps)
    for kind, found in turns.items():
        cells = [cell(found[column], EDGE_UNIT[column[0]][1]) for column in COLUMNS]
        lines.append(f"| {kind} | {valid[kind]} | {' | '.join(cells)} |")
    (given.out / "coverage.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
    click.echo("\n".join(lines))


if __name__ == "__main__":
    with one_thread():
        main()
