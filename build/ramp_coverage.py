"""What the estimators tell while the rig's speed, slip ratio or slip angle changes.

    python build/ramp_coverage.py --out build/out/ramps
    python build/ramp_coverage.py --out build/out/ramps --days 4 5 6 7 8 9 --only "speed +4"

Calibrates on steady runs of the rig (plan `set1`, three loads at five speeds and at seven slip
ratios) and judges on another day's plan `ramps`, with the turn rate that the rig measured and
without it. The truth is the rig's own at the middle of the contact: a mean over a turn is another
number where a slip ratio turns round. Campaigns are kept in the folder; with none there, the rig
takes some minutes. ``coverage.md`` is written.

What the gages' gains of the day do to a straight run is one error for all its turns, so a few runs
say little of how often an interval holds: `--days` measures the ramps on further days, `--only`
those alone whose name begins so. The share of runs that are held in the middle of their turns is
printed with more than one day.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import click
import numpy as np
import pandas as pd

from tirelib.campaign import Campaign, Run, read_campaign
from tirelib.core.threads import one_thread
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.edge import EDGE_UNIT
from tirelib.estimators.train import train
from tirelib.estimators.unknowns import TWO_SIGMA
from tirelib.measured.observations import measure_run, observe
from tirelib.measured.signal import LowPass
from tirelib.rig.campaign import TRUTH_FILE, run_plan
from tirelib.rig.plans import Plan, plan
from tirelib.rig.tire import Condition, tire

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


def ramps_of(day: int, only: str) -> dict[Plan, int]:
    """Return the ramps of a day whose name begins so."""
    whole = plan("ramps")
    if day in RAMPS.values() and not only:
        return RAMPS
    runs = tuple(run for run in whole.conditions if getattr(run, "about", "").startswith(only))
    name = f"ramps_{day}_{only.replace(' ', '_').replace('/', '')}"
    return {Plan(name, whole.about, runs): day}


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

Judged = dict[tuple[str, str], list[tuple[float, float, float]]]
"""By quantity and source: error, standard deviation and run of each valid turn."""


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


def judge(
    calibration: Calibration, ramps: Campaign, out: dict[str, Judged], valid: dict[str, list[bool]]
) -> None:
    """Add the valid turns of each kind of ramp, and which turns these are."""
    low_pass = LowPass(calibration.order, calibration.cut_off)
    truth = pd.read_csv(ramps.path / TRUTH_FILE).set_index("run")
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
                number = np.full(error.shape, float(hash((ramps.path, run.plan.run))))
                rows = zip(error, told.std[quantity][good], number, strict=True)
                turns.setdefault((quantity, source), []).extend(rows)


def cell(rows: list[tuple[float, float, float]], factor: float, *, by_run: bool = False) -> str:
    """Return rms error, share in the 95 % interval, and the largest error in std.

    With `by_run` also how many runs have more than half of their turns in the interval.
    """
    error, std, run = np.array(rows).T
    inside = np.abs(error) <= TWO_SIGMA * std
    rms = factor * np.sqrt(np.mean(error**2))
    said = f"{rms:.2g}; {100.0 * np.mean(inside):.0f} %; {np.max(np.abs(error) / std):.1f}"
    if by_run:
        held = [np.mean(inside[run == one]) > 0.5 for one in np.unique(run)]
        said += f"; {sum(held)} of {len(held)} runs"
    return said


def main() -> None:
    """Measure, calibrate, judge, write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("build/out/ramps"))
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--days", type=int, nargs="+", default=[4])
    parser.add_argument(
        "--only", default="", help='beginning of a ramp\'s name, such as "speed +4"'
    )
    given = parser.parse_args()
    calibration = train(observe(campaigns(given.out, STEADY, given.jobs))).calibration
    turns: dict[str, Judged] = {}
    valid: dict[str, list[bool]] = {}
    for day in given.days:
        for ramps in campaigns(given.out, ramps_of(day, given.only), given.jobs):
            judge(calibration, ramps, turns, valid)
    names = [f"{name} [{EDGE_UNIT[name][0]}], {source}" for name, source in COLUMNS]
    lines = [f"| ramp | valid | {' | '.join(names)} |", f"|{'---|' * (2 + len(names))}"]
    several = len(given.days) > 1
    for kind, found in turns.items():
        cells = [cell(found[c], EDGE_UNIT[c[0]][1], by_run=several) for c in COLUMNS]
        good = f"{sum(valid[kind])} of {len(valid[kind])}"
        lines.append(f"| {kind} | {good} | {' | '.join(cells)} |")
    if not (several or given.only):
        (given.out / "coverage.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
    click.echo("\n".join(lines))


if __name__ == "__main__":
    with one_thread():
        main()
