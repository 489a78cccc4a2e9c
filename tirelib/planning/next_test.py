"""The next test for strain and for forces: rivals, what they foretell, and the judged runs."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from tirelib.arrays import BoolArray, FloatArray
from tirelib.diagnose.forces.assess import ForceCase
from tirelib.diagnose.forces.fit import ForceFit, Problem
from tirelib.diagnose.refit import Refit
from tirelib.effects import Effect
from tirelib.errors import ParameterError, TirelibError
from tirelib.identify.waveform_fit import Data
from tirelib.planning.candidate_runs import forecasts, noise_of, possible
from tirelib.planning.criterion import NextTest, judged
from tirelib.planning.envelope import Envelope, operating_at
from tirelib.planning.fit import started
from tirelib.planning.force_rivals import (
    MEMBERS,
    force_forecasts,
    points_ahead,
    structure_rows,
    try_force_suspects,
)
from tirelib.planning.rivals import try_suspects
from tirelib.planning.structure import Shapes, structure_shapes
from tirelib.threads import one_thread


@one_thread()
def next_test(
    data: Data,
    base: Refit,
    suspects: Sequence[tuple[Effect, FloatArray]],
    envelope: Envelope,
    *,
    noise: float,
    with_nothing: bool = False,
    progress: Callable[[str], None] | None = None,
) -> NextTest:
    """Judge the runs of an envelope by how well they part suspects.

    Parameters
    ----------
    data : Data
    base : Refit
        The model without the suspects, fitted.
    suspects : sequence of (effect, start strength)
    envelope : Envelope
    noise : float, [-]
        Of a run's waveform, from repeats; NaN without.
    with_nothing : bool
        Whether that nothing is missing is a rival too.
    progress : callable, optional

    Raises
    ------
    ParameterError
        If no run in the envelope has a solution.
    """
    chosen, plain = envelope.grid(), started(base.values, base.effects, base.strengths)
    points = chosen[possible([plain], data, operating_at(chosen, data.points))]
    if not len(points):
        raise _hopeless(len(chosen))
    ahead = operating_at(points, data.points)
    shapes = structure_shapes(data, base, ahead, progress=progress)
    trial = try_suspects(
        data,
        base,
        suspects,
        noise=noise,
        shapes=shapes,
        with_nothing=with_nothing,
        progress=progress,
    )
    random = noise_of(trial, noise)
    try:
        told = forecasts(trial, data, ahead, progress=progress)
    except TirelibError:
        good = possible([rival.fitted.guess for rival in trial.rivals], data, ahead)
        if not good.any():
            raise _hopeless(len(chosen)) from None
        points = points[good]
        trial = replace(trial, shapes=Shapes(trial.shapes.present, trial.shapes.ahead[:, good]))
        told = forecasts(trial, data, ahead.take(good), progress=progress)
    return judged(envelope, points, trial, told, len(chosen) - len(points), random)


def _hopeless(count: int) -> ParameterError:
    return ParameterError(
        f"envelope: the model has no solution at any of its {count} runs (tread pressed through, "
        "or too large a patch); lower the loads of --load-range"
    )


def force_next_test(
    case: ForceCase,
    base: ForceFit,
    suspects: Sequence[tuple[Effect, FloatArray]],
    envelope: Envelope,
    *,
    with_nothing: bool = False,
    members: int = MEMBERS,
    seed: int = 0,
    progress: Callable[[str], None] | None = None,
) -> NextTest:
    """Judge further runs of a force by how well they part suspects: points, or sweeps.

    Parameters
    ----------
    case : ForceCase
        The present points.
    base : ForceFit
        The model without the suspects, fitted.
    suspects : sequence of (effect, start strength)
    envelope : Envelope
        Of `tirelib.planning.force_rivals.force_envelope`.
    with_nothing : bool
        Whether that nothing is missing is a rival too.
    members, seed : int
        Of the variants of the brush.
    progress : callable, optional

    Raises
    ------
    ParameterError
        If no point in the envelope has a solution.
    """
    tell = progress or (lambda label: None)
    chosen, n, size = envelope.grid(), len(case.problem), envelope.points
    joint = points_ahead(case, envelope, chosen)
    good = _solvable(joint, base, n).reshape(-1, size).all(axis=1)
    if not good.any():
        raise _hopeless(len(chosen))
    points = chosen[good]
    joint = points_ahead(case, envelope, points)
    tell("variants of the brush")
    structure = structure_rows(joint, n, base, members, seed)
    trial = try_force_suspects(
        case, base, suspects, structure[:, :n], with_nothing=with_nothing, progress=progress
    )
    tell(f"{len(points)} runs")
    ahead = joint.take(np.arange(n, len(joint)))
    told = force_forecasts(trial, ahead, structure[:, n:], size)
    return judged(envelope, points, trial, told, len(chosen) - len(points), trial.noise)


def _solvable(joint: Problem, base: ForceFit, present: int) -> BoolArray:
    """Return at which points ahead the base brush has a solution."""
    good = np.ones(len(joint) - present, dtype=bool)
    try:
        joint.predict(base.values, base.changes)
    except TirelibError:
        for k in range(good.size):
            try:
                joint.take(np.array([present + k])).predict(base.values, base.changes)
            except TirelibError:
                good[k] = False
    return good
