"""What a camber that nobody gives costs: the error of Fy and alpha, and what the prior makes of it.

    python build/camber_doubt.py --out build/out/camber

Calibrates tires of the rig on `set1` (upright) and judges them on runs at cambers of -3 to 3 deg,
four loads and three slip angles, as if nobody gave the camber. Prints what a degree of camber does
at each load, how far cars lean in a turn, and coverage with half and double of the constants.
Campaigns and calibrations are kept in the folder.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import click
import numpy as np
from cosim.vehicle import Controls, Vehicle
from road_constants import times
from road_coverage import measured, rows_of, tire_of

from tirelib.core.arrays import FloatArray
from tirelib.core.compiled import choose_numpy
from tirelib.core.flags import TurnFlag
from tirelib.core.threads import one_thread
from tirelib.estimators import tilt
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.calibration_file import read_calibration, write_calibration
from tirelib.estimators.likeness import CAMBER_DRIFT
from tirelib.estimators.regressors import compute_regressors
from tirelib.estimators.train import train
from tirelib.measured.observations import Observations
from tirelib.rig.plans import Plan, plan
from tirelib.rig.tire import TIRES, Condition

LOADS = (1700.0, 3200.0, 4800.0, 7000.0)
CAMBERS = (-3.0, -1.5, -0.75, 0.0, 0.75, 1.5, 3.0)
ANGLES = (-2.5, 0.0, 2.5)
SEED = 31
SPEED = 20.0
"""Speed of the cars, [m/s]."""


def tilted() -> Plan:
    """Return runs at every camber, load and slip angle."""
    runs = tuple(
        Condition(load, 2.3e5, 65.0 / 3.6, np.deg2rad(angle), np.deg2rad(camber))
        for camber in CAMBERS
        for load in LOADS
        for angle in ANGLES
    )
    return Plan("tilted", "4 loads x 3 slip angles x 7 cambers", runs)


def per_degree(calibration: Calibration, seen: Observations) -> list[str]:
    """Return what a degree of camber does at each load, as if the wheel stood upright."""
    chain = calibration.chains[-1]
    values = regressors_of(seen, np.zeros(len(seen)))
    found, _ = chain.predict(values)
    rest: dict[str, FloatArray] = {}
    for known in (chain.likeness, chain.agreement):
        if known is not None:
            rest |= zip(known.names, known.rest(values).T, strict=True)
    error = {
        "Fy [N]": found["Fy"].value - seen.truth["Fy"],
        "alpha [deg]": np.rad2deg(found["alpha"].value - seen.truth["slip_angle"]),
        **{name: np.rad2deg(rest[name]) for name in CAMBER_DRIFT if name in rest},
    }
    camber, load = np.rad2deg(seen.nominal["camber"]), seen.nominal["load"]
    lines = []
    for name, x in error.items():
        slopes = []
        for at in LOADS:
            rows = seen.usable & (np.abs(load - at) < 1.0) & np.isfinite(x)
            slopes.append(np.polyfit(camber[rows], x[rows], 1)[0] if rows.sum() > 2 else np.nan)
        cells = ", ".join(f"{s:.3g} at {at:.0f} N" for s, at in zip(slopes, LOADS, strict=True))
        lines.append(f"  {name} for {'a radian' if name in rest else 'a degree'}: {cells}")
    return lines


def regressors_of(seen: Observations, camber: FloatArray) -> dict[str, FloatArray]:
    """Return the regressors of all gages with another camber than the rig's."""
    return {
        **compute_regressors(seen.features, range(seen.features.lateral.size)),
        "camber": camber,
    }


def leaning(number: int) -> float:
    """Return the largest camber of a car's wheels [rad] per lateral utilisation, in a slow turn."""
    vehicle = Vehicle(number, SPEED)
    start, used, camber = vehicle.look().wheels.camber, np.zeros(4), np.zeros(4)
    while used.mean() < 0.4 and vehicle.time < 20.0:
        motion = vehicle.step(2e-3, Controls(steer_rate=0.005))
        used, camber = np.abs(motion.fy) / motion.wheels.load, motion.wheels.camber - start
    return float((np.abs(camber) / used).max())


def covered(calibration: Calibration, seen: Observations, part: FloatArray) -> str:
    """Return the shares of turns that are covered and valid, Fy then alpha."""
    found = calibration.estimate(replace(seen.features, camber=np.full(len(seen), np.nan)))
    other = (found.flags & int(TurnFlag.OTHER_TIRE) != 0)[seen.usable & part]
    cells = [f"other_tire {other.sum()} of {other.size}"]
    for quantity in ("Fy", "alpha"):
        _, valid, held, _, std = rows_of(found, seen, quantity, seen.usable & part)
        cells.append(f"{quantity} {100 * held:.0f} % of {100 * valid:.0f} % valid, std {std:.3g}")
    return "; ".join(cells)


def main() -> None:
    """Measure, then try half and double."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("build/out/camber"))
    parser.add_argument("--tire", action="append", choices=tuple(TIRES))
    parser.add_argument("--jobs", type=int, default=2)
    given = parser.parse_args()
    for number in (1, 2, 3):
        click.echo(f"car {number}: {np.rad2deg(leaning(number)):.2f} deg per lateral utilisation")
    for name in given.tire or TIRES:
        own, folder = tire_of(name, SEED), given.out / name
        upright = measured(folder / "set1", plan("set1"), own, SEED, given.jobs)
        seen = measured(folder / "tilted", tilted(), own, SEED + 1, given.jobs)
        file = folder / "calibration.toml"
        if not file.exists():
            write_calibration(train(upright).calibration, file)
        calibration = read_calibration(file)
        click.echo("\n".join([f"{name}:", *per_degree(calibration, seen)]))
        size = np.abs(np.rad2deg(seen.nominal["camber"]))
        for part in sorted(set(np.abs(CAMBERS))):
            rows = np.abs(size - part) < 0.01
            click.echo(f"  camber {part:g} deg: {covered(calibration, seen, rows)}")
        for constant in ("USUAL", "FORCE", "SLOPE", "READ_DOUBT"):
            for factor in (0.5, 1.0, 2.0):
                with times(tilt, constant, factor):
                    click.echo(f"  {constant} x {factor:g}: {covered(calibration, seen, size < 2)}")


if __name__ == "__main__":
    choose_numpy()  # constants of the compiled core cannot be changed
    with one_thread():
        main()
