"""What a ring's structure may do to waveforms, as unknowns of variance one.

It is the covariance in whose metric a diagnosis ranks effects (`tirelib.diagnose.structure`): the
residuals of variants of the model, each over the root of their number; the parts that add in
proportion, every one of them; and what the laws of effects that the model has may be off by in a
run. One draw of variants and parts holds for all runs, so what the present runs tell of a tire's
structure is known at the possible ones too, and runs of the same condition share it. What an
effect's law is off by in a possible run, no other run tells.
"""

from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.campaign import Tolerance
from tirelib.diagnose.ensemble import smooth_part, variants
from tirelib.diagnose.refit import Refit
from tirelib.diagnose.shape import filled, finer, moved
from tirelib.diagnose.structure import FORM
from tirelib.identify.random_effects import Whitening
from tirelib.identify.waveform_fit import Data
from tirelib.model.base import coordinates, large_displacements, linearised, predict
from tirelib.model.state import Operating
from tirelib.model.whole import with_slopes
from tirelib.waveforms import GRID

MEMBERS = 60
"""Variants; more of them change a separation by a few percent."""


@dataclass(frozen=True, slots=True)
class Shapes:
    """Ways in which structure may show, each for one standard deviation.

    Attributes
    ----------
    present : shape (n_shapes, n_runs, n_phi)
        In the present runs.
    ahead : shape (n_shapes, n_points, n_phi)
        In the possible ones.
    """

    present: FloatArray
    ahead: FloatArray


def structure_shapes(
    data: Data,
    base: Refit,
    points: Operating | None = None,
    *,
    members: int = MEMBERS,
    seed: int = 0,
    progress: Callable[[str], None] | None = None,
) -> Shapes:
    """Return what structure leaves to a model, at the present runs and at possible ones.

    Parameters
    ----------
    data : Data
        The present runs.
    base : Refit
    points : Operating, optional
        Possible runs, at which the base model has a solution.
    members, seed : int
        Of the variants.
    progress : callable, optional

    Raises
    ------
    TirelibError
        If the base model has no solution at a point.
    """
    n = len(data.points)
    every = data.points if points is None else joined(data.points, points)
    quiet = replace(
        data,
        strain=np.zeros((len(every), GRID.size)),
        points=every,
        tolerance=Tolerance(0.0, 0.0, 0.0, 0.0),
        angle_std=np.zeros(len(every)),
        deflection=np.full(len(every), np.nan),
    )
    model = _at(base, data, every)
    rests = variants(quiet, model, members=members, seed=seed, progress=progress)
    rows = data.noise * rests.reshape(len(rests), len(every), -1) / np.sqrt(max(len(rests), 1))
    rows = np.concatenate([rows, smooth_part(quiet, model), _form_part(data, model, every, n)])
    return Shapes(rows[:, :n], rows[:, n:])


def _form_part(data: Data, model: Refit, points: Operating, present: int) -> FloatArray:
    """Return how the laws of a model's effects may be off, (n, n_points, n_phi).

    In each present run by itself, and in a possible one by itself, whichever it is.
    """
    rows = [np.zeros((0, len(points), GRID.size))]
    for k in range(len(model.effects)):
        others = [change for j, change in enumerate(model.changes) if j != k]
        without = predict(
            model.values, points, others, low_pass=data.low_pass, correction=model.correction
        ).wave
        change = filled(model.waveform - without)
        ways = FORM * np.stack([change, finer(change), moved(change)], axis=1)
        count = ways.shape[1]
        each = np.zeros((count * (present + 1), len(points), GRID.size))
        each[:-count, :present] = run_by_run(ways[:present]).reshape(-1, present, GRID.size)
        each[-count:, present:] = ways[present:].swapaxes(0, 1)
        rows.append(each)
    return np.concatenate(rows)


def run_by_run(changes: FloatArray) -> FloatArray:
    """Return k changes of each run, (n_runs, k, n_phi), as rows that act on it alone."""
    runs, k, samples = changes.shape
    each = np.zeros((runs, k, runs, samples))
    every = np.arange(runs)
    each[every, :, every] = changes
    return each.reshape(runs * k, runs * samples)


def joined(one: Operating, other: Operating) -> Operating:
    """Return the points of both, one after the other."""
    names = [field.name for field in fields(Operating)]
    return Operating(*[np.concatenate([getattr(one, k), getattr(other, k)]) for k in names])


def _at(base: Refit, data: Data, points: Operating) -> Refit:
    """Return a fitted model at other points, whitened by noise alone; residuals as they are."""
    correction = with_slopes(
        large_displacements(base.values, points, low_pass=data.low_pass),
        base.values,
        points,
        coordinates(base.values),
        low_pass=data.low_pass,
    )
    found = linearised(
        base.values,
        points,
        coordinates(base.values),
        base.changes,
        low_pass=data.low_pass,
        correction=correction,
    )
    n = len(points)
    white = Whitening(np.zeros((n, GRID.size, 4)), np.zeros((n, 4, 4)), data.noise)
    return replace(
        base,
        waveform=found.waveform,
        deflection=found.deflection,
        slopes=found.waveform_slopes,
        correction=correction,
        whiten=white,
    )
