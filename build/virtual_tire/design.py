"""Solve the numerical rig at the points of a space-filling design; resumable, in a fixed order.

    python build/virtual_tire/design.py --points 200
    python build/virtual_tire/design.py --points 280 --friction

Solutions are kept in build/out/virtual_tire, one file a point; `surface.py` makes the surface of
those that are there. A longer design starts with the points of a shorter one. With `--friction` the
coefficient of friction is a seventh input, and the points are others, in a folder of their own.
"""

import argparse
import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.stats import qmc

from tirelib.core.threads import one_thread
from tirelib.rig.measure import slip_ratio
from tirelib.rig.observe import edges, forces, trace
from tirelib.rig.solve import RigState, SolverError, solve
from tirelib.rig.tire import Condition, tire

OUT = Path(__file__).parents[1] / "out" / "virtual_tire"
OUT_FRICTION = OUT.parent / "virtual_tire_friction"
INPUTS = ("Fz", "alpha", "kappa", "camber", "speed", "pressure")
LOW = np.array([750.0, -np.radians(8.4), -0.126, -np.radians(4.2), 17.0 / 3.6, 1.75e5])
HIGH = np.array([9300.0, np.radians(8.4), 0.126, np.radians(4.2), 155.0 / 3.6, 3.05e5])
"""Range of the design; a little wider than that of the surface, so that no use extrapolates."""
FRICTION = (0.25, 1.15)
"""Range of the coefficient of friction, in a design that varies it."""
SLIP_POWER = 1.4
"""Slip angle and slip ratio are denser where the tire does not slide: u |u|^(power - 1)."""
POINTS = 1440
"""Wheel angles of a stored waveform."""
FORCES = ("Fx", "Fy", "Fz", "Mx", "Mz", "torque")


@dataclass(frozen=True)
class Point:
    """A solved point: inputs, strain (n, 5), contact edges (5, 2), forces, radii.

    The inputs are those of `design`.
    """

    inputs: np.ndarray
    strain: np.ndarray
    edges: np.ndarray
    forces: np.ndarray
    omega: float
    free_radius: float
    loaded_radius: float


def limits(friction: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return the least and the largest of every input."""
    if not friction:
        return LOW, HIGH
    return np.append(LOW, FRICTION[0]), np.append(HIGH, FRICTION[1])


def design(n: int, friction: bool = False) -> np.ndarray:
    """Return the points, shape (n, 6), or with friction (n, 7), in SI."""
    low, high = limits(friction)
    sobol = qmc.Sobol(low.size, seed=3 if friction else 2)
    unit = 2.0 * sobol.random(2 ** int(np.ceil(np.log2(max(n, 2)))))[:n] - 1.0
    for column in (1, 2):
        unit[:, column] *= np.abs(unit[:, column]) ** (SLIP_POWER - 1.0)
    found = 0.5 * (low + high) + 0.5 * (high - low) * unit
    root = np.sqrt([low[0], high[0]])
    found[:, 0] = (0.5 * root.sum() + 0.5 * np.diff(root) * unit[:, 0]) ** 2
    return found


def condition(inputs: np.ndarray) -> Condition:
    """Return the rig's condition; its slip ratio refers to v_x, that of the inputs to v."""
    load, alpha, kappa, camber, speed, pressure = (float(value) for value in inputs[:6])
    slip = (1.0 + kappa) / float(np.cos(alpha)) - 1.0
    return Condition(load, pressure, speed, alpha, camber, slip)


def solved(inputs: np.ndarray, start: RigState | None) -> tuple[RigState, Point]:
    """Solve a point."""
    rolling = tire("reference")
    if inputs.size > len(INPUTS):
        rolling = replace(rolling, friction=float(inputs[-1]))
    state = solve(rolling, condition(inputs), start)
    if abs(slip_ratio(state) - inputs[2]) > 1e-9:
        raise SolverError(f"the slip ratio is {slip_ratio(state)}, not {inputs[2]}")
    force = forces(state)
    values = [force.fx, force.fy, force.fz, force.overturning, force.aligning, force.torque]
    angle, _ = edges(state)
    camber = float(np.cos(state.condition.camber))
    return state, Point(
        inputs,
        trace(state, POINTS).strain,
        angle,
        np.array(values),
        state.omega,
        state.free_radius,
        state.height / camber,
    )


def main(points: int, seconds: float, folder: Path, friction: bool) -> None:
    """Solve what is not there yet, for at most so many seconds of CPU."""
    folder.mkdir(parents=True, exist_ok=True)
    states: list[tuple[np.ndarray, RigState]] = []
    begun = time.process_time()
    low, high = limits(friction)
    for number, inputs in enumerate(design(points, friction)):
        path = folder / f"{number:04d}.npz"
        if path.exists():
            continue
        if time.process_time() - begun > seconds:
            break
        unit = (inputs - low) / (high - low)
        near = sorted(states, key=lambda known: float(np.sum((known[0] - unit) ** 2)))
        start = near[0][1] if near else None
        try:
            state, point = solved(inputs, start)
        except SolverError as error:
            sys.stderr.write(f"{number}: {error}\n")
            np.savez(path, inputs=inputs)
            continue
        states.append((unit, state))
        np.savez(path, **{name: getattr(point, name) for name in Point.__dataclass_fields__})
    sys.stderr.write(f"{time.process_time() - begun:.0f} s of CPU\n")


if __name__ == "__main__":
    with one_thread():
        parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
        parser.add_argument("--points", type=int, default=200)
        parser.add_argument("--seconds", type=float, default=600.0, help="most CPU time to spend")
        parser.add_argument("--friction", action="store_true", help="vary the friction as well")
        parser.add_argument("--folder", type=Path)
        given = parser.parse_args()
        place = given.folder or (OUT_FRICTION if given.friction else OUT)
        main(given.points, given.seconds, place, given.friction)
