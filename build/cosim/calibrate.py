"""Calibrate the strain tire on the numerical rig, over what a car's wheels do; two hours.

    python build/cosim/calibrate.py                   # writes build/cosim/calibration.toml

Three plans. Two fill the range that the manoeuvres reach: a camber that follows the slip angle as
on a car that leans outwards, no driving beyond a little, slip angle and slip ratio at once only
inside an ellipse; one densely to the slip that wheels have most of the time, one to the slip that a
controller's wheels overshoot to. The third rolls straight, free and braking. The rig solves its own
tire; neither the response surface of the virtual tire nor any manoeuvre is known
here. A campaign that is there is used again.
"""

import argparse
import itertools
import subprocess
import sys
from pathlib import Path

import numpy as np
from scipy.stats import qmc

from tirelib.cli.progress import progress_bar
from tirelib.core.arrays import FloatArray
from tirelib.core.threads import one_thread
from tirelib.rig.campaign import TRUTH_FILE, run_plan
from tirelib.rig.plans import Plan
from tirelib.rig.tire import Condition, tire

CALIBRATION = Path(__file__).with_name("calibration.toml")
"""The calibration of the co-simulations."""
POINTS, SEED = 150, 3
LOAD = (900.0, 7400.0)
ALPHA, KAPPA, CAMBER = float(np.radians(5.8)), 0.115, float(np.radians(3.7))
"""Largest slip angle [rad], braking slip ratio [1] and camber [rad]."""
USUAL = 0.07
"""Largest braking slip ratio of the dense plan [1]."""
LIGHT, LIGHTEST = 40, 1900.0
"""Points of the plan of wheels inside a turn, and their largest load [N]."""
SLIPPERY = 60
"""Points of the plan on slippery roads."""
FRICTION = (0.3, 0.85)
"""Their friction."""
DRIVING = 0.015
SPEED = (8.0, 30.0)
PRESSURE = 2.3e5
FREE, STRAIGHT = 0.35, 0.2
"""Shares of free rolling and of straight braking."""
LOADS_FREE = (1200.0, 2000.0, 2900.0, 3600.0, 4300.0, 5200.0, 6300.0)
LOADS_BRAKING = (1600.0, 2500.0, 3400.0, 4300.0, 5300.0)
BRAKING = (0.008, 0.016, 0.026, 0.04, 0.06, 0.085)


def design(
    n: int = POINTS, slip: float = KAPPA, seed: int = SEED, heaviest: float = LOAD[1]
) -> FloatArray:
    """Return n conditions, shape (n, 5): load, slip angle, slip ratio, camber, speed; SI.

    Braking goes to a slip ratio of ``-slip``. The slip ratio here is along the wheel's plane: 0
    rolls freely at any slip angle.
    """
    u = qmc.Sobol(6, seed=seed).random(2048)
    s = 2.0 * u - 1.0
    load = (LOAD[0] ** 0.5 + (heaviest**0.5 - LOAD[0] ** 0.5) * u[:, 0]) ** 2
    alpha = ALPHA * np.sign(s[:, 1]) * np.abs(s[:, 1]) ** 1.7
    brakes = np.clip(1.0 - u[:, 2] / 0.85, 0.0, 1.0)
    kappa = np.where(u[:, 2] < 0.85, -slip * brakes**1.5, DRIVING * (u[:, 2] - 0.85) / 0.15)
    straight = u[:, 5] > 1.0 - STRAIGHT
    kappa[u[:, 5] < FREE] = 0.0
    alpha[straight] *= 0.05
    lean = np.minimum(1.0, 0.25 + np.abs(alpha) / np.radians(1.0))
    camber = CAMBER * s[:, 3]
    camber = np.where(straight, 0.4 * camber, -np.sign(alpha) * np.abs(camber) * lean)
    speed = SPEED[0] + (SPEED[1] - SPEED[0]) * u[:, 4]
    table: FloatArray = np.stack((load, alpha, kappa, camber, speed), axis=1)
    return table[(alpha / ALPHA) ** 2 + (kappa / slip) ** 2 < 1.0][:n]


def slippery(n: int = SLIPPERY) -> tuple[FloatArray, FloatArray]:
    """Return conditions as `design` does, others than its own, and a friction for each."""
    table = design(n, USUAL, seed=SEED + 1)
    share = qmc.Sobol(1, seed=SEED).random(2048)[: len(table), 0]
    return table, FRICTION[0] + (FRICTION[1] - FRICTION[0]) * share


def straight_ahead() -> FloatArray:
    """Return conditions as `design` does: loads, rolling freely at two speeds, and braking."""
    free = [(load, 0.0, 0.0, 0.0, v) for load, v in itertools.product(LOADS_FREE, (12.0, 22.0))]
    braking = [
        (load, 0.0, -slip, 0.0, 18.0) for load, slip in itertools.product(LOADS_BRAKING, BRAKING)
    ]
    return np.array([*free, *braking])


def plans(points: int = POINTS) -> dict[str, tuple[Plan, int]]:
    """Return the plans as the rig takes them, with their days, by folder."""

    def conditions(table: FloatArray, friction: FloatArray | None = None) -> tuple[Condition, ...]:
        given = [None] * len(table) if friction is None else friction.tolist()
        return tuple(
            Condition(load, PRESSURE, speed, alpha, camber, kappa if kappa else None, mu)
            for (load, alpha, kappa, camber, speed), mu in zip(table.tolist(), given, strict=True)
        )

    return {
        "usual": (
            Plan("vehicle", "what the wheels of a car do", conditions(design(points, USUAL))),
            7,
        ),
        "campaign": (Plan("vehicle", "what the wheels of a car do", conditions(design(points))), 7),
        "light": (
            Plan(
                "light",
                "wheels inside a turn",
                conditions(design(LIGHT, USUAL, SEED + 2, LIGHTEST)),
            ),
            10,
        ),
        "slippery": (Plan("slippery", "on roads of other friction", conditions(*slippery())), 9),
        "straight": (Plan("straight", "free and braking", conditions(straight_ahead())), 8),
    }


def main() -> None:
    """Measure the plans on the rig and calibrate."""
    root = Path(__file__).parents[2]
    parser = argparse.ArgumentParser(
        description="Calibrate the strain tire on the numerical rig for the co-simulations."
    )
    parser.add_argument("--points", type=int, default=POINTS)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--out", type=Path, default=CALIBRATION, metavar="CAL.toml")
    parser.add_argument(
        "--data",
        type=Path,
        default=root / "build/out/cosim",
        metavar="DIR",
        help="where the rig's measurements go",
    )
    given = parser.parse_args()
    folders = []
    for name, (plan, day) in plans(given.points).items():
        folders.append(str(given.data / name))
        if (given.data / name / TRUTH_FILE).exists():  # the rig writes it last
            continue
        with progress_bar(f"measuring {name}", len(plan.conditions)) as advance:
            run_plan(
                plan,
                tire("reference"),
                given.data / name,
                seed=day,
                jobs=given.jobs,
                overwrite=True,
                progress=lambda *_, say=advance: say(""),
            )
    command = [str(Path(sys.executable).with_name("tirelib")), "calibrate", *folders]
    sys.exit(subprocess.run([*command, "--out", str(given.out)], check=False).returncode)


if __name__ == "__main__":
    with one_thread():
        main()
