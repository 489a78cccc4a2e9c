"""Fit the vehicle's tires to the virtual tire, so that its strain and the vehicle agree.

    python -m cosim.vehicle14.fit_tire

The forces of the virtual tire's surface over its range, at 2.3 bar and 80 km/h, are fitted; the
rest of the errors is printed by force and stands in the file.
"""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from scipy.optimize import least_squares
from scipy.stats import qmc

from cosim.vehicle14.tire import FORMAT, NAMES, BrushTires
from tirelib.core.arrays import FloatArray
from tirelib.core.threads import one_thread
from tirelib.fmu.virtual.spec import default_surface
from tirelib.fmu.virtual.surface import read_surface
from tirelib.physics.brush import predict

TARGET = Path(__file__).parents[3] / "models" / "vehicle14" / "tire.toml"
START = {
    "mu": 0.95,
    "mu_load": -0.02,
    "C_y": 4.2e4,
    "C_y_top": 2.0,
    "C_x": 7.5e4,
    "C_x_power": 1.3,
    "a": 0.06,
    "camber": 0.06,
    "camber_load": 0.0,
    "rolling": -0.01,
}
ROLLING = (-0.02, -0.005)
"""Limits of the rolling resistance: a tire does not push."""
SPEED, PRESSURE, POINTS = 80.0 / 3.6, 2.3e5, 2048


def conditions() -> FloatArray:
    """Return conditions spread over the surface's range, shape (n, 6), and at pure slip."""
    surface = read_surface(default_surface())
    low, high = surface.low.copy(), surface.high.copy()
    low[4:], high[4:] = (SPEED, PRESSURE), (SPEED + 1e-9, PRESSURE + 1e-6)
    low[3], high[3] = -0.06, 0.06
    both = qmc.scale(qmc.Sobol(6, seed=3).random(POINTS), low, high)
    both[: POINTS // 4, 2] = np.cos(both[: POINTS // 4, 1]) - 1.0
    both[POINTS // 4 : POINTS // 2, 1] = 0.0
    return np.asarray(both)


def errors(constants: dict[str, float], at: FloatArray, wanted: FloatArray) -> FloatArray:
    """Return the error of Fx, Fy [N] and Mz [N m], shape (n, 3)."""
    load, alpha, kappa, camber = at[:, :4].T
    along = (1.0 + kappa) / np.cos(alpha) - 1.0
    tires = BrushTires(constants, predict)
    found = tires.forces(load, alpha, along, camber, np.ones(load.size))
    return np.stack(found, axis=1) - wanted


def main() -> int:
    """Fit, and write the file."""
    surface = read_surface(default_surface())
    at = conditions()
    wanted = surface.forces_of(surface.answers(at))[:, :3]
    sizes = np.array([abs(START[name]) or 0.05 for name in NAMES])

    def residual(x: FloatArray) -> FloatArray:
        constants = dict(zip(NAMES, (x * sizes).tolist(), strict=True))
        weight = np.array([1.0, 1.0, 10.0]) / (100.0 + 0.05 * at[:, :1])
        return np.asarray((errors(constants, at, wanted) * weight).ravel())

    start = np.array([START[name] for name in NAMES]) / sizes
    low = np.full(len(NAMES), -np.inf)
    high = np.full(len(NAMES), np.inf)
    low[-1], high[-1] = sorted((ROLLING[0] / sizes[-1], ROLLING[1] / sizes[-1]))
    best = least_squares(residual, start, bounds=(low, high), loss="soft_l1")
    constants = dict(zip(NAMES, (best.x * sizes).tolist(), strict=True))
    left = errors(constants, at, wanted)
    spread = np.sqrt(np.mean(left**2, axis=0)).tolist()
    rms = dict(zip(("Fx", "Fy", "Mz"), spread, strict=True))
    content: dict[str, Any] = {
        "format": FORMAT,
        "tire": str(surface.about["tire"]),
        "fitted_to": "models/virtual_tire/reference.npz at 80 km/h and 2.3 bar",
        "constants": {name: float(f"{value:.6g}") for name, value in constants.items()},
        "rms_error": {name: float(f"{value:.3g}") for name, value in rms.items()},
    }
    TARGET.parent.mkdir(parents=True, exist_ok=True)
    TARGET.write_bytes(tomli_w.dumps(content).encode())
    sys.stdout.write(f"{TARGET}: {content['constants']}\n{content['rms_error']}\n")
    return 0


if __name__ == "__main__":
    with one_thread():
        sys.exit(main())
