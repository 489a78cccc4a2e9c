"""Points of a brush whose friction may fall with load, and the problem that they pose."""

from collections.abc import Sequence

import numpy as np

from tirelib.effects import CATALOGUE, Effect
from tirelib.inference.compare.force_model import ForceModel
from tirelib.inference.identify.brush_law import BrushModel, Reference
from tirelib.inference.identify.force_data import ForceData
from tirelib.inference.identify.force_points import force_points
from tirelib.inference.problems.forces import ForceProblem
from tirelib.physics.brush.predict import PointConditions, PointParameters, predict_forces

VALUES = {
    "lateral_stiffness": 8e6,
    "friction": 0.95,
    "half_length": 0.06,
    "load_power": 0.5,
    "slip_angle_offset": 0.0,
    "Fy_offset": 0.0,
}
MODEL = ForceModel(
    "made up", BrushModel("made up", VALUES, Reference(4e3, 2e5), None), (), (4e3, 2e5), ()
)
LOADS, PRESSURES, ANGLES = (2e3, 4e3, 6e3), (1.7e5, 2.3e5), np.deg2rad(np.linspace(-8, 8, 9))


def force_problem(
    loads: Sequence[float] = LOADS,
    pressures: Sequence[float] = PRESSURES,
    cambers: Sequence[float] = (0.0,),
    speeds: Sequence[float] = (20.0,),
    friction_power: float = 0.0,
    noise: float = 5.0,
    quantity: str = "Fy",
    catalogue: Sequence[Effect] = tuple(CATALOGUE.values()),
) -> ForceProblem:
    """Return the problem of steady runs, each measured twice."""
    grid = np.meshgrid(ANGLES, loads, pressures, cambers, speeds, [0, 1], indexing="ij")
    alpha, load, pressure, camber, speed, _ = (x.ravel() for x in grid)
    n = alpha.size
    nothing = np.full(n, np.nan)
    brush = PointParameters(8e6, 0.95 * (load / 4e3) ** friction_power, 0.06 * (load / 4e3) ** 0.5)
    made = predict_forces(brush, PointConditions(load, alpha))
    random = np.random.default_rng(1)
    side = made.Fy + noise * random.standard_normal(n)
    moment = made.Mz + 0.02 * noise * random.standard_normal(n)
    data = ForceData(
        load,
        pressure,
        alpha,
        np.zeros(n),
        camber,
        nothing,
        nothing,
        side,
        moment,
        np.arange(n),
        speed,
    )
    size = noise if quantity == "Fy" else 0.02 * noise
    bench = MODEL.bench(force_points(data))
    return ForceProblem(bench, quantity, MODEL.values, catalogue, noise=size)
