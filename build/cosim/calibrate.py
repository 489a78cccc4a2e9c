"""Calibrate the strain tire on the numerical rig, over what a car's wheels do; two hours.

    python build/cosim/calibrate.py                   # writes build/cosim/calibration.toml

Three plans (`tirelib.fmu.virtual.drive`). Two fill the range that the manoeuvres reach: a camber
that follows the slip angle as on a car that leans outwards, no driving beyond a little, slip angle
and slip ratio at once only inside an ellipse; one densely to the slip that wheels have most of the
time, one to the slip that a controller's wheels overshoot to. The third rolls straight, free and
braking. The rig solves its own tire; neither the response surface of the virtual tire nor any
manoeuvre is known here. A campaign that is there is used again.
"""

import argparse
import subprocess
import sys
from pathlib import Path

from scipy.stats import qmc

from tirelib.cli.progress import progress_bar
from tirelib.core.arrays import FloatArray
from tirelib.core.threads import one_thread
from tirelib.fmu.virtual.drive import (
    LIGHT,
    LIGHTEST,
    POINTS,
    PRESSURE,
    SEED,
    USUAL,
    design,
    straight_ahead,
)
from tirelib.rig.campaign import TRUTH_FILE, run_plan
from tirelib.rig.plans import Plan
from tirelib.rig.tire import Condition, tire

CALIBRATION = Path(__file__).with_name("calibration.toml")
"""The calibration of the co-simulations."""
SLIPPERY = 60
"""Points of the plan on slippery roads."""
FRICTION = (0.3, 0.85)
"""Their friction."""


def slippery(n: int = SLIPPERY) -> tuple[FloatArray, FloatArray]:
    """Return conditions as `design` does, others than its own, and a friction for each."""
    table = design(n, USUAL, seed=SEED + 1)
    share = qmc.Sobol(1, seed=SEED).random(2048)[: len(table), 0]
    return table, FRICTION[0] + (FRICTION[1] - FRICTION[0]) * share


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
