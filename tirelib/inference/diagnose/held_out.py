"""Errors on what took no part in a fit: what can be left out, and how documents tell it.

Of strain, the runs of the highest load and of the highest pressure are held out. In a sweep of
forces, blocks of time are held out, each in turn; their error is the held-out error, and the error
on the highest set points is shown as well. In steady runs, the points of the highest load,
pressure, camber, temperature and speed are held out. Where none of these can be spared, every
fourth cell of conditions is held out in turn.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray, IntArray
from tirelib.core.quantities import QUANTITIES
from tirelib.inference.identify.campaign_data import Data
from tirelib.inference.identify.error_bands import levels
from tirelib.inference.identify.force_bench import ForceBench
from tirelib.inference.identify.force_points import set_points
from tirelib.inference.identify.strain_notes import LEAST_RUNS
from tirelib.inference.problems.force_plan import varies

LEAST_LOADS, LEAST_PRESSURES = 3, 2
NO_RUNS = "nothing can be held out: three loads or two pressures, and four other runs, are needed"
NO_POINTS = "nothing can be held out: too few conditions vary"
BLOCK = 11.0
"""Length of a held-out block of time, [s]."""
PARTS = 4
"""Fits by which every block is left out once."""
LEAST_POINTS = 12
_CONDITIONS = ("load", "pressure", "camber", "temperature", "speed")
_TOP = 0.8
"""Quantile from which a condition without set points counts as high."""


@dataclass(frozen=True, slots=True, eq=False)
class Fold:
    """Runs of strain, or points of a force, that are left out of a fit.

    Attributes
    ----------
    name : str
        time, cell, or a condition.
    value : float
        Mean of the condition there, SI; number of the part for time and cell.
    out : shape (n,)
    main : bool
        Whether it counts in the held-out error.
    of : str
        runs or points.
    """

    name: str
    value: float
    out: BoolArray
    main: bool = True
    of: str = "runs"

    def entry(self, before: float, after: float) -> dict[str, Any]:
        """Return what is left out with its errors as documents tell them."""
        value, unit = self.value + 1.0, "1"  # parts of time by their number
        if self.name not in ("time", "cell"):
            known = QUANTITIES[self.name]
            value, unit = float(known.told(self.value)), known.unit
        return {
            "condition": self.name,
            "value": value,
            "unit": unit,
            self.of: int(self.out.sum()),
            **({"counted": self.main} if self.of == "points" else {}),
            "error_before": before,
            "error_after": after,
        }


def pooled(errors: Sequence[float], folds: Sequence[Fold]) -> float:
    """Return the rms over the folds that count; NaN if there is none, or one has no error."""
    if not errors:
        return float("nan")
    counted = [(e, int(f.out.sum())) for e, f in zip(errors, folds, strict=True) if f.main]
    if not counted or not all(np.isfinite(e) for e, _ in counted):
        return float("nan")
    values, weights = np.array(counted).T
    return float(np.sqrt(np.average(values**2, weights=weights)))


def strain_folds(data: Data) -> tuple[Fold, ...]:
    """Return what a campaign allows to leave out: its highest load, its highest pressure."""
    found = []
    for name, least in (("load", LEAST_LOADS), ("pressure", LEAST_PRESSURES)):
        values = getattr(data.points, name)
        level = levels(values)
        out = level == level[int(np.argmax(values))]
        if level.max() + 1 >= least and int((~out).sum()) >= LEAST_RUNS:
            found.append(Fold(name, float(values[out].mean()), out))
    return tuple(found)


def force_folds(bench: ForceBench) -> tuple[Fold, ...]:
    """Return what the points of a force allow to leave out."""
    points, at = bench.points, bench.conditions
    found: list[Fold] = []
    swept = bool(points.sweep.all())
    if swept:
        found += _parts("time", _blocks(points.data.time, points.data.block))
    for name in (each for each in _CONDITIONS if varies(at, each)):
        values = np.abs(getattr(at, name))
        out = _highest(name, values)
        found.append(Fold(name, float(values[out].mean()), out, not swept, "points"))
    good = tuple(fold for fold in found if _usable(bench, fold))
    if any(fold.main for fold in good):
        return good
    return (*good, *(fold for fold in _parts("cell", points.cell) if _usable(bench, fold)))


def _parts(name: str, number: IntArray) -> list[Fold]:
    """Return blocks or cells that take turns."""
    part = np.asarray(np.unique(number, return_inverse=True)[1]).ravel() % PARTS
    return [Fold(name, float(k), part == k, of="points") for k in range(PARTS)]


def _blocks(time: FloatArray, block: IntArray) -> IntArray:
    """Return the block of time of each point; the run or stretch where no time is known."""
    if np.isfinite(time).all():
        return np.asarray(np.floor((time - time.min()) / BLOCK), dtype=np.int64)
    return block


def _usable(bench: ForceBench, fold: Fold) -> bool:
    """Whether enough is left out, enough is left to fit, and the condition still varies there."""
    out, n = int(fold.out.sum()), len(bench.points)
    if out < 3 or n - out < LEAST_POINTS:
        return False
    # else a law over the condition would be free
    at = bench.conditions
    return fold.name in ("time", "cell") or varies(at.take(~fold.out), fold.name)


def _highest(name: str, values: FloatArray) -> BoolArray:
    """Return which points have the highest set point of a condition."""
    if name in ("load", "pressure", "speed"):
        level = set_points(values)
        return np.asarray(level == level[int(np.argmax(values))])
    if name == "camber":
        return np.asarray(values > values.max() - np.deg2rad(0.5))
    return np.asarray(values >= np.quantile(values, _TOP))
