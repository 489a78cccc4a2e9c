"""Errors on runs that took no part in a fit: the highest load, and one pressure."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from tirelib.arrays import BoolArray
from tirelib.diagnose.floor import ErrorUnit
from tirelib.diagnose.refit import Refit, refit
from tirelib.errors import TirelibError
from tirelib.identify.campaign_data import LEAST_RUNS
from tirelib.identify.error_bands import levels
from tirelib.identify.random_effects import whitening
from tirelib.identify.waveform_fit import Data
from tirelib.model.base import Correction, large_displacements, predict

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
        data, strain=data.strain[chosen], points=data.points.take(chosen),
        angle_std=data.angle_std[chosen], deflection=data.deflection[chosen],
    )  # fmt: skip


def held_out_errors(
    data: Data,
    model: Refit,
    chosen: Sequence[Fold],
    unit: ErrorUnit,
    *,
    progress: Callable[[str], None] | None = None,
) -> tuple[float, ...]:
    """Return a model's error on each fold's runs after a fit to the other runs.

    NaN where the fit does not settle or the model fails there.

    Parameters
    ----------
    data : Data
    model : Refit
        Its values and strengths are the start; effects that it has stay.
    chosen : sequence of Fold
    unit : ErrorUnit
    progress : callable, optional
    """
    errors = []
    for fold in chosen:
        try:
            trained = refit(
                part_of(data, ~fold.out), model.values, model.effects, model.strengths,
                delay=model.delay, near=_near(model.correction, ~fold.out), progress=progress,
            )  # fmt: skip
            near = _near(model.correction, fold.out)
            errors.append(unit.factor * error_on(part_of(data, fold.out), trained, near))
        except TirelibError:
            errors.append(float("nan"))
    return tuple(errors)


def _near(correction: Correction, chosen: BoolArray) -> Correction | None:
    """Return a correction of some of the runs, as a start for values nearby."""
    contact, rows = correction.contact, np.flatnonzero(chosen)
    if contact is None or len(contact) != chosen.size:
        return None
    old = contact.constants
    constants = replace(old, **{f.name: getattr(old, f.name)[rows] for f in fields(old)})
    per_point = ("radius", "even", "odd", "deflection", "half_angle", "load")
    part = replace(
        contact, **{name: getattr(contact, name)[rows] for name in per_point},
        tread=contact.tread.take(rows), constants=constants,
    )  # fmt: skip
    return Correction(correction.waveform[rows], correction.deflection[rows], part)


def error_on(data: Data, model: Refit, near: Correction | None = None) -> float:
    """Return the rms whitened residual of a fitted model on runs, which may be others'.

    `near` is a correction of these runs at values nearby; it saves time.
    """
    points = data.points
    correction = large_displacements(
        model.values, points, low_pass=data.low_pass, start=near.contact if near else None
    )
    wave = predict(
        model.values, points, model.changes, low_pass=data.low_pass, correction=correction
    ).wave
    whiten = whitening(
        wave, model.values, points, data.tolerance, data.angle_std, data.noise, data.low_pass
    )
    return float(np.sqrt(np.mean(whiten(data.strain - wave) ** 2)))


def pooled(errors: Sequence[float], chosen: Sequence[Fold]) -> float:
    """Return the rms over all left-out runs; NaN where a fold has none."""
    if not errors or not np.isfinite(errors).all():
        return float("nan")
    weights = np.array([int(fold.out.sum()) for fold in chosen], dtype=float)
    return float(np.sqrt(np.average(np.square(errors), weights=weights)))
