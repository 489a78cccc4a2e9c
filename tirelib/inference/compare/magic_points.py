"""Points that a Magic Formula is fitted to where no campaign has any: those of a model's brush."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ParameterError
from tirelib.inference.compare.force_model import ForceModel
from tirelib.inference.identify.force_data import ForceData
from tirelib.inference.identify.force_points import ForcePoints
from tirelib.physics.brush.predict import PointForces

LOADS = (0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 1.75)
"""Loads, over the reference load of the brush. Half and double as many leave the error of Fy at
other loads as it is (.65, .63 and .63 %; `build/export_constants.py`)."""
PRESSURES = (0.85, 1.15)
"""Further pressures, over the reference pressure, where the brush depends on it. Half and double of
the step leave the error of Fy between them as it is (.64, .62 and .67 %)."""
CAMBERS = tuple(np.deg2rad([-4.0, 4.0]).tolist())
"""Further camber angles, where the brush depends on it, [rad]."""
SHARES = np.array([0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.65, 0.8, 1.0])
"""Slips, over the largest one: dense where the curves bend."""


def model_points(
    model: ForceModel, *, slip_angle: float, slip_ratio: float, speed: float, radius: float
) -> ForceData:
    """Return the forces of a model over loads, pressures, cambers, and pure and combined slips.

    Parameters
    ----------
    slip_angle : float, [rad]
        The largest; the points reach from its negative to it.
    speed : float, [m/s]
    radius : float, [m]
        Unloaded radius, for the turn rate.

    Raises
    ------
    ParameterError
        If an effect of the model needs a condition that no point has.
    """
    for name, value, most in (("slip angle", slip_angle, 0.6), ("slip ratio", slip_ratio, 0.9)):
        if not 0.01 <= value <= most:
            raise ParameterError(f"largest {name} = {value:.4g}; allowed are 0.01 to {most:g}")
    load, pressure = model.reference
    both = np.concatenate([-SHARES[::-1], [0.0], SHARES])
    few = np.concatenate([-SHARES[[8, 3]], SHARES[[3, 8]]])
    pure = [(alpha, 0.0) for alpha in slip_angle * both] + [(0.0, k) for k in slip_ratio * both]
    combined = list(product(slip_angle * few, slip_ratio * few))

    def at(loads: Sequence[float], *, share: float = 1.0, camber: float = 0.0) -> FloatArray:
        slips = pure if share != 1.0 or camber else pure + combined
        rows = [(z * load, share * pressure, camber, a, k) for z in loads for a, k in slips]
        return np.array(rows)

    def forces(points: FloatArray) -> PointForces:
        return model.predict(_points(points, speed, radius))

    few_loads = LOADS[1::2]
    parts = [at(LOADS)]
    for away in (
        [at(few_loads, share=x) for x in PRESSURES],
        [at(few_loads, camber=x) for x in CAMBERS],
    ):
        here = away[0].copy()
        here[:, 1:3] = pressure, 0.0
        one, other = forces(here), forces(away[0])
        if not (np.allclose(one.Fx, other.Fx) and np.allclose(one.Fy, other.Fy)):
            parts += away
    points = np.concatenate(parts)
    found = forces(points)
    return replace(_points(points, speed, radius).data, Fx=found.Fx, Fy=found.Fy, Mz=found.Mz)


def _points(points: FloatArray, speed: float, radius: float) -> ForcePoints:
    """Return rows of load, pressure, camber, slip angle and slip ratio as points of steady runs."""
    load, pressure, camber, alpha, kappa = points.T
    n, speeds = np.arange(load.size), np.full(load.size, speed)
    data = ForceData(load, pressure, alpha, kappa, camber, speeds / radius, speed=speeds)
    return ForcePoints(data, np.zeros(n.size), np.ones_like(n), n, np.zeros(n.size, dtype=bool))
