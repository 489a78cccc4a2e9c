"""Errors on what took no part in a fit; of strain: on runs of the highest load, of one pressure."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tirelib.core.arrays import BoolArray
from tirelib.core.errors import TirelibError
from tirelib.core.quantities import QUANTITIES
from tirelib.inference.compare.error import ModelError, Yardstick
from tirelib.inference.diagnose.fitted import Fitted
from tirelib.inference.identify.campaign_data import LEAST_RUNS, Data
from tirelib.inference.identify.error_bands import levels

LEAST_LOADS, LEAST_PRESSURES = 3, 2


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

    @property
    def told(self) -> tuple[float, str]:
        """What its runs have in common, with its unit; parts of time by their number."""
        if self.name in ("time", "cell"):
            return self.value + 1.0, "1"
        known = QUANTITIES[self.name]
        return float(known.told(self.value)), known.unit


def folds(data: Data) -> tuple[Fold, ...]:
    """Return what a campaign allows to leave out: its highest load, its highest pressure."""
    found = []
    for name, least in (("load", LEAST_LOADS), ("pressure", LEAST_PRESSURES)):
        values = getattr(data.points, name)
        level = levels(values)
        out = level == level[int(np.argmax(values))]
        if level.max() + 1 >= least and int((~out).sum()) >= LEAST_RUNS:
            found.append(Fold(name, float(values[out].mean()), out))
    return tuple(found)


def held_out(model: Fitted, fold: Fold, yardstick: Yardstick) -> ModelError | None:
    """Return a model's error on a fold's runs after a fit to the other runs, with its residual.

    None where the fit does not settle or the model fails there.

    Parameters
    ----------
    model : Fitted
        Its effects stay.
    fold : Fold
    yardstick : Yardstick
        Yardstick of the campaign: the unit is that of every other error of it.
    """
    try:
        trained, delay = model.without_runs(fold.out)
        start = model.rolling.take(fold.out)
        return yardstick.take(fold.out).error(trained, delay, start=start)
    except TirelibError:
        return None


def values_of_errors(errors: Sequence[ModelError | None]) -> tuple[float, ...]:
    """Return the values of errors, NaN for none."""
    return tuple(float("nan") if error is None else error.value for error in errors)


def fold_entry(fold: Fold, before: float, after: float) -> dict[str, Any]:
    """Return what is left out with its errors as documents tell them."""
    value, unit = fold.told
    return {
        "condition": fold.name,
        "value": value,
        "unit": unit,
        fold.of: int(fold.out.sum()),
        **({"counted": fold.main} if fold.of == "points" else {}),
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
