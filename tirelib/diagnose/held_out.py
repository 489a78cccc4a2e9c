"""Errors on runs that took no part in a fit: the highest load, and one pressure."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tirelib.arrays import BoolArray
from tirelib.compare.error import ModelError, Yardstick
from tirelib.diagnose.refit import Refit, refit
from tirelib.errors import TirelibError
from tirelib.identify.campaign_data import LEAST_RUNS
from tirelib.identify.error_bands import levels
from tirelib.identify.waveform_fit import Data
from tirelib.model.base import Correction
from tirelib.units import from_si

_TOLD = {"load": ("N", "force"), "pressure": ("bar", "pressure")}
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


def part_of(data: Data, chosen: BoolArray) -> Data:
    """Return some of the runs."""
    return replace(
        data,
        strain=data.strain[chosen],
        points=data.points.take(chosen),
        angle_std=data.angle_std[chosen],
        deflection=data.deflection[chosen],
    )


def held_out_errors(
    data: Data,
    model: Refit,
    chosen: Sequence[Fold],
    yardstick: Yardstick,
    *,
    progress: Callable[[str], None] | None = None,
) -> tuple[float, ...]:
    """Return a model's error on each fold's runs after a fit to the other runs.

    Parameters as of `held_out`; NaN where the fit does not settle or the model fails there.
    """
    found = held_out(data, model, chosen, yardstick, progress=progress)
    return tuple(float("nan") if error is None else error.value for error in found)


def held_out(
    data: Data,
    model: Refit,
    chosen: Sequence[Fold],
    yardstick: Yardstick,
    *,
    progress: Callable[[str], None] | None = None,
) -> tuple[ModelError | None, ...]:
    """Return a model's error on each fold's runs after a fit to the other runs, with its residual.

    None where the fit does not settle or the model fails there.

    Parameters
    ----------
    data : Data
    model : Refit
        Its values and strengths are the start; effects that it has stay.
    chosen : sequence of Fold
    yardstick : Yardstick
        Of the campaign: the unit is that of every other error of it.
    progress : callable, optional
    """
    errors: list[ModelError | None] = []
    for fold in chosen:
        try:
            trained = refit(
                part_of(data, ~fold.out),
                model.values,
                model.effects,
                model.strengths,
                delay=model.delay,
                near=_near(model.correction, ~fold.out),
                progress=progress,
            )
            seen = yardstick.take(fold.out)
            near = _near(model.correction, fold.out)
            start = near.contact if near is not None else None
            errors.append(seen.error(trained.model, trained.delay, start=start))
        except TirelibError:
            errors.append(None)
    return tuple(errors)


def _near(correction: Correction, chosen: BoolArray) -> Correction | None:
    """Return a correction of some of the runs, as a start for values nearby."""
    contact, rows = correction.contact, np.flatnonzero(chosen)
    if contact is None or len(contact) != chosen.size:
        return None
    return Correction(correction.waveform[rows], correction.deflection[rows], contact.take(rows))


def fold_entry(fold: Fold, before: float, after: float) -> dict[str, Any]:
    """Return a left-out part with its errors as documents tell them."""
    unit, dimension = _TOLD[fold.name]
    return {
        "condition": fold.name,
        "value": float(from_si(fold.value, unit, dimension)),
        "unit": unit,
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
