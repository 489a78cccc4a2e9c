"""Points of equal conditions as one: what a study of the brush's misfit is computed on."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import FloatArray, IntArray
from tirelib.inference.identify.brush_law import point_parameters
from tirelib.inference.identify.brush_problem import ROBUST, BrushProblem
from tirelib.inference.identify.error_bands import levels, numbered
from tirelib.inference.identify.force_data import ForceData
from tirelib.physics.brush.predict import PointParameters

MOST_OWN_CELLS = 150
"""Up to so many points each is its own cell."""
MOST_CELLS = 800
_CAMBER = float(np.deg2rad(0.5))
_SLIPS = 36
"""Cells over the range of a slip."""


@dataclass(frozen=True, slots=True, eq=False)
class Cells:
    """Misfit and its slopes by cell, of one force, over the force's scale.

    Attributes
    ----------
    at : shape (7, m)
        Means of `places` over the cells.
    misfit : shape (m,)
        Mean of measured less predicted.
    smooth : shape (m,)
        The same for a curve that has the brush's slope at zero and its friction, but no bend at
        zero slip.
    slope : shape (m, p)
        Slope of the prediction by z.
    """

    force: str
    at: FloatArray
    misfit: FloatArray
    smooth: FloatArray
    slope: FloatArray


def places(brush: PointParameters, data: ForceData) -> FloatArray:
    """Return where forces are looked at, shape (7, n).

    Load [N], pressure [Pa] (1 where unknown), slip angle [rad], slip ratio, camber [rad], and the
    slip angle [rad] and slip ratio at which the brush slides as a whole there.
    """
    across, along = slip_stiffnesses(brush)
    force = 3.0 * np.asarray(brush.friction) * data.load
    pressure = np.nan_to_num(data.pressure, nan=1.0)
    slides = np.arctan(force / across), force / along
    return np.stack([data.load, pressure, data.slip_angle, data.slip_ratio, data.camber, *slides])


def cells_of(problem: BrushProblem, z: FloatArray) -> tuple[Cells, ...]:
    """Return the cells of each force of a solved problem; outliers count little."""
    data = problem.data
    residual = problem.residual(z)
    slope = problem.jacobian(z).reshape(*residual.shape, z.size)
    number = cell_numbers(data)
    brush = point_parameters(problem.at(z), data, problem.reference, problem.half)
    at, scale = places(brush, data), np.asarray(problem.scale)
    out = []
    for k, name in enumerate(problem.forces):
        weight = np.isfinite(getattr(data, name)) * (
            ROBUST / np.maximum(np.abs(residual[k]), ROBUST)
        )
        mean = _mean_over(number, weight)
        misfit = -mean(residual[k])
        bend = mean(_bend(name, brush, data)) / float(scale[k])
        slopes = np.stack([mean(column) for column in slope[k].T], axis=1)
        out.append(Cells(name, np.stack(list(map(mean, at))), misfit, misfit + bend, slopes))
    return tuple(out)


def _mean_over(number: IntArray, weight: FloatArray) -> Callable[[FloatArray], FloatArray]:
    """Return the weighted mean over the cells that have any weight."""
    total = np.bincount(number, weight)
    used = total > 0.0

    def mean(values: FloatArray) -> FloatArray:
        return np.asarray(np.bincount(number, weight * values)[used] / total[used])

    return mean


def slip_stiffnesses(brush: PointParameters) -> tuple[FloatArray, FloatArray]:
    """Return 2 c a^2 over slip angle [N/rad] and slip ratio [N]."""
    size = 2.0 * np.asarray(brush.half_length, dtype=np.float64) ** 2
    across = np.asarray(brush.lateral_stiffness, dtype=np.float64)
    along = brush.longitudinal_stiffness
    return across * size, (across if along is None else np.asarray(along)) * size


def _bend(force: str, brush: PointParameters, data: ForceData) -> FloatArray:
    """Return by how much the brush exceeds a curve of the same slope and friction without bend.

    With x the demand over mu Fz, the brush is x - x^2/3 + x^3/27 of either sign of slip, and the
    other curve tanh x; for the moment x (1 - x/3)^3 and x / cosh^2(3 x / 4).
    """
    across, along = slip_stiffnesses(brush)
    limit = np.asarray(brush.friction) * data.load
    thrust = np.asarray(brush.camber_thrust) * data.camber
    side = -across * np.tan(data.slip_angle + np.asarray(brush.slip_angle_offset) + thrust)
    drive = along * (data.slip_ratio + np.asarray(brush.slip_ratio_offset))
    demand = np.hypot(side, drive)
    share = np.where(demand > 0.0, (drive if force == "Fx" else side) / np.maximum(demand, 1e-9), 0)
    x = demand / limit
    held = np.minimum(x, 3.0)
    if force == "Mz":
        arm = -np.asarray(brush.half_length) / 3.0
        excess = held * (1.0 - held / 3.0) ** 3 - x / np.cosh(np.minimum(0.75 * x, 50.0)) ** 2
        return np.asarray(arm * limit * share * excess)
    return np.asarray(limit * share * (held - held**2 / 3.0 + held**3 / 27.0 - np.tanh(x)))


def cell_numbers(data: ForceData) -> IntArray:
    """Return the number of each point's cell, from 0; at most 800 cells."""
    if len(data) <= MOST_OWN_CELLS:
        return np.arange(len(data))
    share = 1.0
    while True:
        number = numbered(
            levels(data.load),
            levels(data.pressure),
            np.round(data.camber / (_CAMBER * share)),
            _bins(data.slip_angle, share),
            _bins(data.slip_ratio, share),
        )
        if number.max() < MOST_CELLS:
            return number
        share *= 1.5


def _bins(values: FloatArray, share: float) -> FloatArray:
    span = float(np.ptp(values))
    return np.round(values / (span * share / _SLIPS)) if span > 0.0 else np.zeros_like(values)
