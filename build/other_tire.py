"""Which tires are noticed as another one, and how pressure and speed shift what a tire looks like.

    python build/other_tire.py --out build/out/other_tire --tire reference --tire soft --tire stiff

Calibrates each tire on `set1` (65 km/h, 2.3 bar) and judges every tire with every calibration, on
another day of `set1`, on `set3` (1.3 to 2.5 bar, 10 to 150 km/h, straight) and on `drift` (1.5 to
2.7 bar, 20 to 140 km/h, straight and at 3 deg). Prints how many turns in range are flagged
`other_tire`, with friction and tread given and not; the same with half and double of what decides
on a turn, and on a campaign; and the shifts of which `DRIFT` is the mean. `--tire random-41` draws
a tire. Further campaigns of the tires (`--own FOLDER`, made by `tirelib rig` or another program of
this folder) are judged by the calibration of their own tire, for the share of false alarms. The rig
takes some minutes a tire; campaigns and calibrations are kept in the folder.
"""

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import click
import numpy as np
from road_constants import times
from road_coverage import measured, silent, tire_of

from tirelib.campaign import read_campaign
from tirelib.cli import limits
from tirelib.core.compiled import choose_numpy
from tirelib.core.flags import TurnFlag
from tirelib.core.threads import one_thread
from tirelib.estimators import likeness
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.calibration_file import read_calibration, write_calibration
from tirelib.estimators.likeness import DRIFT, suspected
from tirelib.estimators.regressors import SIDED, compute_regressors
from tirelib.estimators.result import other_tire
from tirelib.estimators.train import train
from tirelib.measured.observations import Observations, observe
from tirelib.rig.plans import Plan, plan
from tirelib.rig.tire import Condition

PRESSURE, SPEED = 2.3e5, 65.0 / 3.6
SEED = 51
TRIED = ("PRESSURE_DOUBT", "SPEED_DOUBT", "ROAD_DOUBT")
"""Doubts of which half and double are tried; `DRIFT` and `ROAD_DRIFT` are tried as a whole. Those
of the road are tried where friction and tread are not given."""


def drifting() -> Plan:
    """Return runs at other pressures and at other speeds, straight and at 3 deg."""
    away = [(p * 1e5, SPEED) for p in (1.5, 1.9, 2.3, 2.7)]
    away += [(PRESSURE, v / 3.6) for v in (20.0, 100.0, 140.0)]
    runs = tuple(
        Condition(load, pressure, speed, np.deg2rad(angle))
        for load in (2500.0, 4500.0, 6500.0)
        for pressure, speed in away
        for angle in (0.0, 3.0)
    )
    return Plan("drift", "3 loads x 4 pressures and 3 speeds x 2 slip angles", runs)


def shifts(calibration: Calibration, seen: Observations) -> Mapping[str, tuple[float, float]]:
    """Return the shift of each regressor per doubled pressure, and per (40 m/s)^2."""
    full = calibration.chains[-1]
    if full.likeness is None or full.agreement is None:
        raise SystemExit("too few conditions")
    names = (*full.likeness.names, *full.agreement.names)
    values = compute_regressors(seen.features, range(seen.features.lateral.size))
    values["speed_squared"] = values["speed"] ** 2
    rest = np.hstack([known.rest(values) for known in (full.likeness, full.agreement)])
    use = seen.usable & np.isfinite(rest).all(axis=1)
    pressure = values["pressure"] / PRESSURE - 1.0
    speed = (values["speed_squared"] - SPEED**2) / 1600.0
    cornering = np.abs(seen.truth["slip_angle"]) > np.deg2rad(1.0)
    found = {}
    for column, name in enumerate(names):
        side = np.where(name in SIDED, np.sign(seen.truth["slip_angle"]), 1.0)
        rows = use & cornering if name in SIDED else use
        design = np.stack((np.ones_like(pressure), pressure, speed), axis=1) * side[:, None]
        answer = np.linalg.lstsq(design[rows], rest[rows, column], rcond=None)[0]
        found[name] = (float(answer[1]), float(answer[2]))
    return found


def flagged(calibration: Calibration, seen: Observations) -> tuple[int, int]:
    """Return how many turns are flagged, and how many are in range."""
    found = calibration.estimate(seen.features)
    other = (found.flags & int(TurnFlag.OTHER_TIRE)) != 0
    return int(other.sum()), int((found.turn_valid | other).sum())


def row(calibration: Calibration, days: Mapping[str, Observations]) -> list[str]:
    """Return a cell for each campaign: flagged of those in range, in brackets with nothing said."""
    cells = []
    for seen in days.values():
        given, unsaid = flagged(calibration, seen), flagged(calibration, silent(seen))
        mark = "!" if suspected(*given) else ""
        cells.append(f"{given[0]} of {given[1]}{mark} ({unsaid[0]})")
    return cells


def halves(
    calibrations: Mapping[str, Calibration], days: Mapping[str, Mapping[str, Observations]]
) -> list[str]:
    """Return for half and double of each constant the flagged turns of own and of other tires."""
    lines = [
        "| constant | factor | own tire | other tires, set1 | set3 | drift |",
        "|---|---|---|---|---|---|",
    ]

    def judge(label: str, factor: float, *, unsaid: bool = False) -> None:
        count = dict.fromkeys(("own", "set1", "set3", "drift"), (0, 0))
        for name, calibration in calibrations.items():
            for other, campaigns in days.items():
                for kind, seen in campaigns.items():
                    key = "own" if name.split(",")[0] == other else kind
                    found = flagged(calibration, silent(seen) if unsaid else seen)
                    count[key] = (count[key][0] + found[0], count[key][1] + found[1])
        cells = " | ".join(f"{a} of {b}" for a, b in count.values())
        lines.append(f"| {label} | {factor:g} | {cells} |")

    judge("as it is", 1.0)
    judge("as it is, nothing said", 1.0, unsaid=True)
    for name in TRIED:
        for factor in (0.5, 2.0):
            with times(likeness, name, factor):
                judge(f"`{name}`", factor, unsaid=name == "ROAD_DOUBT")
    for name in ("DRIFT", "ROAD_DRIFT"):
        table = getattr(likeness, name)
        own = dict(table)
        for factor in (0.5, 2.0):
            table.update({key: tuple(factor * x for x in pair) for key, pair in own.items()})
            judge(f"`{name}`", factor, unsaid=name == "ROAD_DRIFT")
        table.update(own)
    return lines


def verdicts(
    calibrations: Mapping[str, Calibration], days: Mapping[str, Mapping[str, Observations]]
) -> list[str]:
    """Return what half and double of the numbers that decide on a whole campaign change.

    A campaign is called another tire's, or the check of its tire is called weak; with friction and
    tread given, and, counted as campaigns of their own, not given.
    """
    found: list[tuple[bool, Mapping[str, Any]]] = []
    for name, calibration in calibrations.items():
        for other, campaigns in days.items():
            own = name.split(",")[0] == other
            for seen in campaigns.values():
                for given in (seen, silent(seen)):
                    found.append((own, other_tire(calibration.estimate(given.features))))
    lines = [
        "| number | value | own tire suspected | others suspected | called weakly checked |",
        "|---|---|---|---|---|",
    ]
    numbers = ((likeness, "FEWEST_UNLIKE"), (likeness, "SHARE_UNLIKE"), (limits, "WEAKLY_CHECKED"))
    for module, name in numbers:
        for factor in (0.5, 1.0, 2.0):
            with times(module, name, factor):
                told = [
                    (own, {**one, "suspected": suspected(one["turns"], one["judged"])})
                    for own, one in found
                ]
                cells = [
                    f"{sum(one['suspected'] for own, one in told if own is mine)} of "
                    f"{sum(own is mine for own, _ in told)}"
                    for mine in (True, False)
                ]
                weak = sum(bool(limits.weakly_checked(one)) for _, one in told)
                value = getattr(module, name)
                lines.append(f"| `{name}` | {value:g} | {' | '.join(cells)} | {weak} |")
    return lines


def broad(name: str, folder: Path, jobs: int) -> Calibration:
    """Return a calibration of one tire on all loads, cambers, speeds and pressures."""
    kind, _, seed = name.partition("-")
    for number, plans in enumerate(("set1", "set2", "set3")):
        chosen, day = folder / f"broad-{plans}", SEED + 10 + number
        measured(chosen, plan(plans), tire_of(kind, int(seed or 0)), day, jobs)
    file = folder / "broad.toml"
    if not file.exists():
        folders = sorted(folder.glob("broad-set*"))
        write_calibration(train(observe([read_campaign(f) for f in folders])).calibration, file)
    return read_calibration(file)


def false_alarms(calibrations: Mapping[str, Calibration], folders: Sequence[Path]) -> list[str]:
    """Return how many turns of further campaigns are taken for another tire's: none should be."""
    lines, turns, runs = [], np.zeros(2, dtype=np.int64), 0
    for folder in folders:
        seen = observe([read_campaign(folder)])
        name = seen.headers[0].tire.name
        own = next(x for x in calibrations.values() if x.tire == name)
        found = np.array(flagged(own, seen))
        estimates = own.estimate(seen.features)
        runs += np.unique(seen.run[estimates.turn_valid]).size
        turns += found
        lines.append(f"{folder}: {found[0]} of {found[1]} turns in range")
    return [*lines, f"own tire, further campaigns: {turns[0]} of {turns[1]} turns of {runs} runs"]


def main() -> None:
    """Measure, calibrate, judge, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("build/out/other_tire"))
    parser.add_argument("--tire", action="append", required=True)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--broad", action="store_true", help="also a broad one of the first tire")
    parser.add_argument("--own", type=Path, nargs="*", default=[], help="further campaigns")
    given = parser.parse_args()
    calibrations, days, moved = {}, {}, {}
    for name in given.tire:
        kind, _, seed = name.partition("-")
        own, folder = tire_of(kind, int(seed or 0)), given.out / name
        day = measured(folder / "set1", plan("set1"), own, SEED, given.jobs)
        file = folder / "calibration.toml"
        if not file.exists():
            write_calibration(train(day).calibration, file)
        calibrations[name] = read_calibration(file)
        days[name] = {
            "set1": measured(folder / "day2", plan("set1"), own, SEED + 1, given.jobs),
            "set3": measured(folder / "set3", plan("set3"), own, SEED + 2, given.jobs),
        }
        days[name]["drift"] = measured(folder / "drift", drifting(), own, SEED + 3, given.jobs)
        moved[name] = shifts(calibrations[name], days[name]["drift"])
    if given.broad:
        name = given.tire[0]
        calibrations[f"{name}, set1 to set3"] = broad(name, given.out / name, given.jobs)
    click.echo("| calibrated | judged | set1 | set3 | drift |\n|---|---|---|---|---|")
    for name, calibration in calibrations.items():
        for other, campaigns in days.items():
            click.echo(f"| {name} | {other} | {' | '.join(row(calibration, campaigns))} |")
    click.echo("\n".join(["", *halves(calibrations, days)]))
    click.echo("\n".join(["", *verdicts(calibrations, days)]))
    click.echo("\n".join(["", *false_alarms(calibrations, given.own)]))
    click.echo("\nshift with a doubled pressure, and with (40 m/s)^2; now, then tire by tire")
    for name, (pressure, speed) in DRIFT.items():
        cells = [f"{moved[tire][name][k]:8.4f}" for k in (0, 1) for tire in moved]
        click.echo(f"{name:18}{pressure:8.4f}{speed:8.4f}  " + " ".join(cells))


if __name__ == "__main__":
    choose_numpy()  # constants of the compiled core cannot be changed
    with one_thread():
        main()
