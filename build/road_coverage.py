"""How often the 95 % intervals hold on slippery roads and worn treads that were not calibrated.

    python build/road_coverage.py --tire reference --seed 21
    python build/road_coverage.py --tire random --seed 30 31 32 33 34 35 36 37

Calibrates on the rig's plan `set1` (dry, new), without a word of friction or tread, and judges on
runs whose friction and tread depth are drawn from the declared ranges. Campaigns
and calibration are kept in the folder; with none there, the rig takes some minutes. With `random`
each seed is a tire of its own. `coverage.md` and `coverage.png` are written for each, and what all
of them together show is printed last.
"""

import argparse
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import click
import numpy as np
from proof.tires import tire as random_tire

from tirelib.campaign import read_campaign
from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.core.threads import one_thread
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.calibration_file import read_calibration, write_calibration
from tirelib.estimators.edge import EDGE_UNIT
from tirelib.estimators.estimate import Estimates
from tirelib.estimators.result import TRUTH
from tirelib.estimators.train import train
from tirelib.estimators.unknowns import DEPTH, FRICTION, TWO_SIGMA
from tirelib.measured.observations import ROAD, Observations, observe
from tirelib.report.style import BLUE, ORANGE, new_figure, save, styled
from tirelib.rig.campaign import run_plan
from tirelib.rig.plans import Plan, plan
from tirelib.rig.tire import NEW_DEPTH, TIRES, Condition, RigTire, tire

Turns = tuple[Estimates, Observations]
"""What is estimated of a tire's turns, and the turns."""
BANDS: Mapping[str, tuple[tuple[float, float], ...]] = {
    "friction": ((0.3, 0.5), (0.5, 0.7), (0.7, 0.9), (0.9, 1.1)),
    "wear [mm]": ((0.0, 1.0), (1.0, 2.0), (2.0, 3.0), (3.0, 4.0)),
}


def drawn(runs: int, seed: int) -> Plan:
    """Return runs of any load, slip angle, friction and wear."""
    rng = np.random.default_rng(seed)
    conditions = tuple(
        Condition(
            rng.uniform(1500.0, 8000.0),
            2.3e5,
            65.0 / 3.6,
            np.deg2rad(rng.uniform(-5.0, 5.0)),
            friction=rng.uniform(*FRICTION),
            tread_depth=NEW_DEPTH - rng.uniform(0.0, DEPTH[1] - DEPTH[0]),
        )
        for _ in range(runs)
    )
    return Plan("drawn", "load, slip angle, friction and tread depth drawn", conditions)


def tire_of(name: str, seed: int) -> RigTire:
    """Return a tire of the rig, or with `random` one whose constants are drawn.

    Its road is as dry as that of the others, the rubber between belt and road as thick as on any
    of them.
    """
    if name != "random":
        return tire(name)
    thick = [own.tread_thickness for own in TIRES.values()]
    rng = np.random.default_rng([seed, 78])
    return replace(
        random_tire(seed),
        friction=RigTire().friction,
        tread_thickness=float(rng.uniform(min(thick), max(thick))),
    )


def measured(folder: Path, chosen: Plan, own: RigTire, seed: int, jobs: int) -> Observations:
    """Return what the rig shows of a plan, measured once."""
    if not (folder / "runs.csv").exists():
        run_plan(chosen, own, folder, seed=seed, jobs=jobs, overwrite=True)
    return observe([read_campaign(folder)])


def silent(seen: Observations) -> Observations:
    """Return observations in which nobody says a word of friction or tread."""
    nothing = dict.fromkeys(ROAD, np.full(len(seen), np.nan))
    return replace(seen, features=replace(seen.features, **nothing))


def rows_of(
    estimates: Estimates, seen: Observations, quantity: str, rows: BoolArray
) -> tuple[int, float, float, float, float]:
    """Return turns, share of them that are valid, coverage of those, rms error and rms std."""
    factor = EDGE_UNIT[quantity][1]
    use = rows & estimates.valid[quantity]
    if quantity == "alpha":
        use &= np.isfinite(estimates.std[quantity])
    error = factor * (estimates.value[quantity] - seen.truth[TRUTH[quantity]])[use]
    std = factor * estimates.std[quantity][use]
    if not use.any():
        return int(rows.sum()), 0.0, np.nan, np.nan, np.nan
    return (
        int(rows.sum()),
        float(use.sum() / rows.sum()),
        float(np.mean(np.abs(error) <= TWO_SIGMA * std)),
        float(np.sqrt(np.mean(error**2))),
        float(np.sqrt(np.mean(std**2))),
    )


def table(calibration: Calibration, dry: Observations, seen: Observations) -> list[str]:
    """Return the lines of coverage.md."""
    at = {
        "friction": seen.features.friction,
        "wear [mm]": 1e3 * (NEW_DEPTH - seen.features.tread_depth),
    }
    lines = [
        "| what is said | part | quantity | valid | in the 95 % interval | rms error | std |",
        "|---|---|---|---|---|---|---|",
    ]
    for label, given in (("nothing", silent(seen)), ("friction and tread", seen)):
        estimates = calibration.estimate(given.features)
        parts = {"all": seen.usable} | {
            f"{name} {low:g} to {high:g}": seen.usable & (x >= low) & (x < high)
            for name, x in at.items()
            for low, high in BANDS[name]
        }
        for part, rows in parts.items():
            for quantity, (unit, _) in EDGE_UNIT.items():
                _, valid, held, rms, std = rows_of(estimates, seen, quantity, rows)
                lines.append(
                    f"| {label} | {part} | {quantity} | {100 * valid:.0f} % | {100 * held:.0f} % | "
                    f"{rms:.3g} {unit} | {std:.3g} |"
                )
    lines += [
        "",
        "| quantity | growth of the std, dry and new | lost on the drawn roads | ratio |",
        "|---|---|---|---|",
    ]
    known, unknown = calibration.estimate(dry.features), calibration.estimate(silent(dry).features)
    estimates = calibration.estimate(silent(seen).features)
    for quantity, (unit, factor) in EDGE_UNIT.items():
        good = known.valid[quantity] & unknown.valid[quantity]
        more = unknown.std[quantity][good] ** 2 - known.std[quantity][good] ** 2
        growth = factor * float(np.sqrt(max(more.mean(), 0.0)))
        lost = rows_of(estimates, seen, quantity, seen.usable)[3]
        lines.append(f"| {quantity} | {growth:.3g} {unit} | {lost:.3g} | {growth / lost:.2f} |")
    return lines


@styled
def draw(calibration: Calibration, seen: Observations, folder: Path) -> None:
    """Draw error over friction and over wear, beside twice the standard deviation."""
    estimates = calibration.estimate(silent(seen).features)
    figure = new_figure(11.0, 9.0)
    axes = figure.subplots(4, 2, sharex="col")
    across: tuple[tuple[str, FloatArray], ...] = (
        ("friction [1]", seen.features.friction),
        ("tread lost [mm]", 1e3 * (NEW_DEPTH - seen.features.tread_depth)),
    )
    for row, (quantity, (unit, factor)) in enumerate(EDGE_UNIT.items()):
        good = seen.usable & estimates.valid[quantity]
        error = factor * (estimates.value[quantity] - seen.truth[TRUTH[quantity]])[good]
        reach = TWO_SIGMA * factor * estimates.std[quantity][good]
        for column, (label, x) in enumerate(across):
            axis = axes[row, column]
            axis.errorbar(
                x[good],
                np.zeros(good.sum()),
                yerr=reach,
                fmt="none",
                ecolor=ORANGE,
                elinewidth=2.0,
                alpha=0.35,
                label="95 % interval",
            )
            axis.plot(x[good], error, "o", color=BLUE, label="estimate less truth")
            axis.set_ylabel(f"{quantity} [{unit}]")
            if row == 3:
                axis.set_xlabel(label)
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    figure.suptitle("Nothing said of friction and tread; calibrated on a dry road with a new tread")
    save(figure, folder, "coverage")


def judged(name: str, seed: int, given: argparse.Namespace) -> list[Turns]:
    """Measure and calibrate a tire, write and print its table; return the turns behind it."""
    folder: Path = given.out / f"{name}-{seed}"
    own = tire_of(name, seed)
    dry = measured(folder / "set1", plan("set1"), own, seed, given.jobs)
    seen = measured(folder / "drawn", drawn(given.runs, seed + 2), own, seed + 1, given.jobs)
    file = folder / "calibration.toml"
    if not file.exists():
        write_calibration(train(silent(dry)).calibration, file)
    calibration = read_calibration(file)
    lines = table(calibration, dry, seen)
    (folder / "coverage.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
    draw(calibration, seen, folder)
    click.echo("\n".join((f"{own.name}, seed {seed}", "", *lines, "")))
    return [(calibration.estimate(x.features), seen) for x in (silent(seen), seen)]


def together(turns: list[list[Turns]]) -> list[str]:
    """Return the lines of what all tires show: by turn, and the share of each tire."""
    lines = [
        "| what is said | quantity | turns | in the 95 % interval | of each tire |",
        "|---|---|---|---|---|",
    ]
    for part, label in enumerate(("nothing", "friction and tread")):
        for quantity in EDGE_UNIT:
            count, held = [], []
            for own in turns:
                estimates, seen = own[part]
                every, share, inside, *_ = rows_of(estimates, seen, quantity, seen.usable)
                count.append(every * share)
                held.append(inside)
            each = ", ".join(f"{100 * x:.0f}" for x in held)
            total = float(np.average(held, weights=count))
            lines.append(
                f"| {label} | {quantity} | {sum(count):.0f} | {100 * total:.1f} % | {each} |"
            )
    return lines


def main() -> None:
    """Measure, calibrate, judge, write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("build/out/road"))
    parser.add_argument("--tire", nargs="+", default=["reference"], choices=(*TIRES, "random"))
    parser.add_argument("--runs", type=int, default=64)
    parser.add_argument(
        "--seed", type=int, nargs="+", default=[21], help="of the noise and of what is drawn"
    )
    parser.add_argument("--jobs", type=int, default=2)
    given = parser.parse_args()
    turns = [judged(name, seed, given) for name in given.tire for seed in given.seed]
    click.echo("\n".join(together(turns)))


if __name__ == "__main__":
    with one_thread():
        main()
