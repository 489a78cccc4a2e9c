"""Errors on points that took no part in a fit.

Of a sweep: blocks of time, each in turn; they hold what is told as the held-out error, and the
highest set points are shown beside. Of steady runs: the highest load, pressure, camber, temperature
and speed; where none of them can be spared, every fourth cell of conditions in turn.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tirelib.arrays import BoolArray, FloatArray, IntArray
from tirelib.diagnose.forces.fit import ForceFit, Problem, fit_force
from tirelib.effects import Effect
from tirelib.errors import TirelibError
from tirelib.identify.force_points import set_points
from tirelib.infer.forces import changes_at, varies

BLOCK = 11.0
"""Length of a held-out block of time, [s]."""
PARTS = 4
"""Fits by which every block is left out once."""
LEAST_POINTS = 12
_CONDITIONS = ("load", "pressure", "camber", "temperature", "speed")
_TOP = 0.8
"""Quantile from which a condition without set points counts as high."""


@dataclass(frozen=True, slots=True, eq=False)
class ForceFold:
    """Points that are left out of a fit.

    Attributes
    ----------
    name : str
        time, cell, or a condition.
    value : float
        Mean of the condition there, SI; number of the part for time and cell.
    out : shape (n,)
    main : bool
        Whether it counts in the held-out error.
    """

    name: str
    value: float
    out: BoolArray
    main: bool


def force_folds(problem: Problem) -> tuple[ForceFold, ...]:
    """Return what a campaign allows to leave out."""
    points = problem.bench.points
    found: list[ForceFold] = []
    swept = bool(points.sweep.all())
    if swept:
        part = _part(points.data.time, problem.block)
        for k in range(PARTS):
            found.append(ForceFold("time", float(k), part == k, main=True))
    for name in _CONDITIONS:
        if not varies(problem.bench.conditions, name):
            continue
        values = np.abs(getattr(problem.bench.conditions, name))
        found.append(ForceFold(name, 0.0, _highest(name, values), main=not swept))
        values = getattr(problem.bench.conditions, name)
        out = found[-1].out
        found[-1] = ForceFold(name, float(np.abs(values[out]).mean()), out, main=not swept)
    good = tuple(fold for fold in found if _usable(problem, fold))
    if any(fold.main for fold in good):
        return good
    _, cell = np.unique(points.cell, return_inverse=True)
    part = np.asarray(cell).ravel() % PARTS
    cells = (ForceFold("cell", float(k), part == k, main=True) for k in range(PARTS))
    return (*good, *(fold for fold in cells if _usable(problem, fold)))


def _usable(problem: Problem, fold: ForceFold) -> bool:
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


def _still(problem: Problem, fold: ForceFold) -> bool:
    """Whether the condition still varies without the fold: else a law over it would be free."""
    return varies(problem.bench.conditions.take(~fold.out), fold.name)


def held_out_errors(
    problem: Problem,
    values: Mapping[str, float],
    effects: Sequence[Effect],
    strengths: Sequence[FloatArray],
    folds: Sequence[ForceFold],
) -> tuple[float, ...]:
    """Return a model's rms on each fold's points after a fit to the others, [N] or [N m].

    NaN where the fit does not settle or the model fails there.
    """
    errors = []
    for fold in folds:
        try:
            trained = fit_force(problem.take(~fold.out), values, effects, strengths)
            seen = problem.take(fold.out)
            found = seen.predict(trained.values, changes_at(trained.effects, trained.strengths))
            errors.append(float(np.sqrt(np.mean((seen.measured - found) ** 2))))
        except TirelibError:
            errors.append(float("nan"))
    return tuple(errors)


def errors_of(problem: Problem, fit: ForceFit, folds: Sequence[ForceFold]) -> tuple[float, ...]:
    """Return `held_out_errors` of a fitted model, which is the start."""
    return held_out_errors(problem, fit.values, fit.effects, fit.strengths, folds)


def pooled(errors: Sequence[float], folds: Sequence[ForceFold]) -> float:
    """Return the rms over the points of the folds that count; NaN if one has none."""
    pairs = [(e, int(f.out.sum())) for e, f in zip(errors, folds, strict=True) if f.main]
    if not pairs or not all(np.isfinite(e) for e, _ in pairs):
        return float("nan")
    square = sum(e**2 * n for e, n in pairs) / sum(n for _, n in pairs)
    return float(np.sqrt(square))
