"""What the wheels of a car do, as conditions of a calibration."""

import itertools
import math

import numpy as np
from scipy.stats import qmc

from tirelib.core.arrays import FloatArray

POINTS, SEED = 150, 3
"""Conditions of a plan, and the seed of its sequence."""
LOAD = (900.0, 7400.0)
"""Smallest and largest load [N]."""
ALPHA, KAPPA, CAMBER = math.radians(5.8), 0.115, math.radians(3.7)
"""Largest slip angle [rad], braking slip ratio [1] and camber [rad]."""
USUAL = 0.07
"""Largest braking slip ratio of the dense plan [1]."""
LIGHT, LIGHTEST = 40, 1900.0
"""Points of the plan of wheels inside a turn, and their largest load [N]."""
DRIVING = 0.015
"""Largest driving slip ratio [1]."""
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

    The camber follows the slip angle as on a car that leans outwards; braking goes to a slip ratio
    of ``-slip``, slip angle and slip ratio at once only inside an ellipse. The slip ratio here is
    along the wheel's plane: 0 rolls freely at any slip angle.
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


def straight_ahead() -> FloatArray:
    """Return conditions as `design` does: loads, rolling freely at two speeds, and braking."""
    free = [(load, 0.0, 0.0, 0.0, v) for load, v in itertools.product(LOADS_FREE, (12.0, 22.0))]
    braking = [
        (load, 0.0, -slip, 0.0, 18.0) for load, slip in itertools.product(LOADS_BRAKING, BRAKING)
    ]
    return np.array([*free, *braking])


def drive() -> FloatArray:
    """Return everything that a car's wheels do, as `design` does."""
    return np.concatenate(
        (
            design(POINTS, USUAL),
            design(),
            design(LIGHT, USUAL, SEED + 2, LIGHTEST),
            straight_ahead(),
        )
    )
