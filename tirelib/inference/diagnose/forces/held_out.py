"""Errors on points that took no part in a fit.

In a sweep, blocks of time are held out, each in turn. Their error is the held-out error of the
diagnosis; the error on the highest set points is shown as well. In steady runs, the points of the
highest load, pressure, camber, temperature and speed are held out. Where none of these can be
spared, every fourth cell of conditions is held out in turn.
"""

from collections.abc import Sequence

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray, IntArray
from tirelib.core.errors import TirelibError
from tirelib.inference.diagnose.forces.fit import ForceFit, MeasuredForce, fit_force
from tirelib.inference.diagnose.held_out import Fold
from tirelib.inference.identify.force_points import set_points
from tirelib.inference.problems.force_plan import varies

BLOCK = 11.0
"""Length of a held-out block of time, [s]."""
PARTS = 4
"""Fits by which every block is left out once."""
LEAST_POINTS = 12
_CONDITIONS = ("load", "pressure", "camber", "temperature", "speed")
_TOP = 0.8
"""Quantile from which a condition without set points counts as high."""


def force_folds(problem: MeasuredForce) -> tuple[Fold, ...]:
    """Return what a campaign allows to leave out."""
    points = problem.bench.points
    found: list[Fold] = []
    swept = bool(points.sweep.all())
    if swept:
        part = _part(points.data.time, problem.block)
        for k in range(PARTS):
            found.append(Fold("time", float(k), part == k, of="points"))
    for name in _CONDITIONS:
        if not varies(problem.bench.conditions, name):
            continue
        values = np.abs(getattr(problem.bench.conditions, name))
        out = _highest(name, values)
        found.append(Fold(name, float(values[out].mean()), out, not swept, "points"))
    good = tuple(fold for fold in found if _usable(problem, fold))
    if any(fold.main for fold in good):
        return good
    _, cell = np.unique(points.cell, return_inverse=True)
    part = np.asarray(cell).ravel() % PARTS
    cells = (Fold("cell", float(k), part == k, of="points") for k in range(PARTS))
    return (*good, *(fold for fold in cells if _usable(problem, fold)))


def _usable(problem: MeasuredForce, fold: Fold) -> bool:
    """Whether enough is left out, and enough is left to fit."""
    out, n = int(fold.out.sum()), len(problem)
    if out < 3 or n - out < LEAST_POINTS:
        return False
    return fold.name in ("time", "cell") or _still(problem, fold)


def _part(time: FloatArray, block: IntArray) -> IntArray:
    """Return the part of each point: blocks of time that take turns."""
    if np.isfinite(time).all():
        block = np.floor((time - time.min()) / BLOCK).astype(np.int64)
    _, number = np.unique(block, return_inverse=True)
    return np.asarray(np.asarray(number).ravel() % PARTS, dtype=np.int64)


def _highest(name: str, values: FloatArray) -> BoolArray:
    """Return which points have the highest set point of a condition."""
    if name in ("load", "pressure", "speed"):
        level = set_points(values)
        return np.asarray(level == level[int(np.argmax(values))])
    if name == "camber":
        return np.asarray(values > values.max() - np.deg2rad(0.5))
    return np.asarray(values >= np.quantile(values, _TOP))


def _still(problem: MeasuredForce, fold: Fold) -> bool:
    """Whether the condition still varies without the fold: else a law over it would be free."""
    return varies(problem.bench.conditions.take(~fold.out), fold.name)


def errors_of(problem: MeasuredForce, fit: ForceFit, folds: Sequence[Fold]) -> tuple[float, ...]:
    """Return a model's rms on each fold's points after a fit to the others, [N] or [N m].

    The fitted model is the start. NaN where the fit does not settle or the model fails there.
    """
    errors = []
    for fold in folds:
        try:
            trained = fit_force(problem.take(~fold.out), fit.values, fit.effects, fit.strengths)
            seen = problem.take(fold.out)
            found = seen.predict(trained.values, trained.changes)
            errors.append(float(np.sqrt(np.mean((seen.measured - found) ** 2))))
        except TirelibError:
            errors.append(float("nan"))
    return tuple(errors)
