"""Errors on runs that took no part in a fit: the highest load, and one pressure."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tirelib.arrays import BoolArray
from tirelib.compare.error import ModelError, Yardstick
from tirelib.diagnose.fitted import Fitted
from tirelib.errors import TirelibError
from tirelib.identify.campaign_data import LEAST_RUNS
from tirelib.identify.error_bands import levels
from tirelib.identify.waveform_fit import Data
from tirelib.quantities import QUANTITIES

LEAST_LOADS, LEAST_PRESSURES = 3, 2


@dataclass(frozen=True, slots=True)
class Fold:
    """Runs that are left out of a fit.

    Attributes
    ----------
    name : str
        Condition, load or pressure.
    value : float
        Mean of the left-out runs, [N] or [Pa].
    out : shape (n_runs,)
    """

    name: str
    value: float
    out: BoolArray


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


def held_out(
    model: Fitted, chosen: Sequence[Fold], yardstick: Yardstick
) -> tuple[ModelError | None, ...]:
    """Return a model's error on each fold's runs after a fit to the other runs, with its residual.

    None where the fit does not settle or the model fails there.

    Parameters
    ----------
    model : Fitted
        Its effects stay.
    chosen : sequence of Fold
    yardstick : Yardstick
        Of the campaign: the unit is that of every other error of it.
    """
    errors: list[ModelError | None] = []
    for fold in chosen:
        try:
            trained, delay = model.without_runs(fold.out)
            start = model.rolling.take(fold.out)
            errors.append(yardstick.take(fold.out).error(trained, delay, start=start))
        except TirelibError:
            errors.append(None)
    return tuple(errors)


def values_of_errors(errors: Sequence[ModelError | None]) -> tuple[float, ...]:
    """Return the values of errors, NaN for none."""
    return tuple(float("nan") if error is None else error.value for error in errors)


def fold_entry(fold: Fold, before: float, after: float) -> dict[str, Any]:
    """Return a left-out part with its errors as documents tell them."""
    known = QUANTITIES[fold.name]
    return {
        "condition": fold.name,
        "value": float(known.told(fold.value)),
        "unit": known.unit,
        "runs": int(fold.out.sum()),
        "error_before": before,
        "error_after": after,
    }


def pooled(errors: Sequence[float], chosen: Sequence[Fold]) -> float:
    """Return the rms over all left-out runs; NaN where a fold has none."""
    if not errors or not np.isfinite(errors).all():
        return float("nan")
    weights = np.array([int(fold.out.sum()) for fold in chosen], dtype=float)
    return float(np.sqrt(np.average(np.square(errors), weights=weights)))
