"""Steady cornering runs with one pressure after the other, so that a drift looks like pressure."""

from functools import cache

import numpy as np

from tests.unit.inference.force_points import MODEL
from tirelib.core.arrays import FloatArray
from tirelib.inference.diagnose.forces.case import ForceCase
from tirelib.inference.identify.force_data import ForceData
from tirelib.inference.identify.force_points import force_points
from tirelib.physics.brush.predict import PointConditions, PointParameters, predict_forces

PRESSURES = (1.7e5, 2.0e5, 2.3e5)
LOADS = (2e3, 4e3, 6e3)
NOISE = 4.0


def side_force(
    truth: tuple[str, float],
    load: FloatArray,
    pressure: FloatArray,
    angle: FloatArray,
    order: FloatArray,
) -> FloatArray:
    """Return Fy of a brush whose friction goes with pressure, or falls with time, by other laws."""
    kind, size = truth
    # a straight line over pressure, and wear that slows down
    factor = 1.0 - size * (pressure / 2e5 - 1.0) if kind == "pressure" else 1.0
    factor = 1.0 - size * (1.0 - np.exp(-1.5 * order)) if kind == "wear" else factor
    brush = PointParameters(8e6, 0.95 * factor, 0.06 * (load / 4e3) ** 0.5)
    found: FloatArray = predict_forces(brush, PointConditions(load, angle)).Fy
    return found


@cache
def case(kind: str, size: float, seed: int = 3) -> ForceCase:
    """Return the campaign: every run twice, pressures in order, all else in turn."""
    angles = np.deg2rad([-8.0, -4.0, -1.5, 1.5, 4.0, 8.0])
    grid = np.meshgrid(PRESSURES, [0, 1], LOADS, angles, indexing="ij")
    pressure, _, load, angle = (x.ravel() for x in grid)
    n = load.size
    side = side_force((kind, size), load, pressure, angle, np.arange(n) / (n - 1.0))
    side = side + NOISE * np.random.default_rng(seed).standard_normal(n)
    nothing, flat = np.full(n, np.nan), np.zeros(n)
    data = ForceData(
        load,
        pressure,
        angle,
        flat,
        flat,
        nothing,
        nothing,
        side,
        nothing,
        np.arange(n),
        np.full(n, 20.0),
        time=10.0 * np.arange(n),
    )
    bench = MODEL.bench(force_points(data))
    return ForceCase("in order", MODEL, "Fy", bench, bench, NOISE, n // 2, ())
