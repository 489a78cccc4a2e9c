"""What a rival predicts at runs that nobody has made, and how sure it is there."""

from collections.abc import Callable, Sequence

import numpy as np

from tirelib.arrays import BoolArray, FloatArray, IntArray
from tirelib.errors import TirelibError
from tirelib.identify.random_effects import SMALLEST_TOLERANCE, angle_slope
from tirelib.identify.waveform_fit import Data
from tirelib.model.state import Operating
from tirelib.model.whole import Whole, solve_whole
from tirelib.planning.criterion import Forecast, Noise
from tirelib.planning.fit import Guess
from tirelib.planning.rivals import Rival, Trial


def noise_of(trial: Trial, repeats: float) -> Noise:
    """Return the split of a trial's noise; `repeats` is that between repeated runs.

    Without repeats (NaN) all of it is taken as random.
    """
    known = repeats * max(trial.size, 1.0) if np.isfinite(repeats) else trial.noise
    random = min(known, trial.noise)
    return Noise(random, float(np.sqrt(trial.noise**2 - random**2)))


def forecasts(
    trial: Trial,
    data: Data,
    points: Operating,
    *,
    progress: Callable[[str], None] | None = None,
) -> list[Forecast]:
    """Return what every rival says of points.

    Parameters
    ----------
    trial : Trial
    data : Data
        The present runs.
    points : Operating
    progress : callable, optional

    Raises
    ------
    TirelibError
        If a model has no solution at one of the points.
    """
    base = trial.base
    plain = solve_whole(base.values, points, base.changes, low_pass=data.low_pass)
    told = []
    for rival in trial.rivals:
        if progress is not None:
            progress(f"{len(points)} runs with {rival.name}")
        told.append(_forecast(rival, trial.shapes.ahead, data, points, plain))
    return told


def _forecast(
    rival: Rival, shapes: FloatArray, data: Data, points: Operating, near: Whole
) -> Forecast:
    guess = rival.fitted.guess
    found = guess.solved(data, points, near)
    slopes, by_set_point = guess.slopes(found, data, points)
    tolerance = data.tolerance
    scale = [
        max(x, SMALLEST_TOLERANCE) for x in (tolerance.load, tolerance.pressure, tolerance.gain)
    ]
    scale.append(float(np.mean(np.minimum(data.angle_std, 1.0))))
    random = [*by_set_point, found.waveform, angle_slope(found.waveform)]
    return Forecast(
        found.waveform + np.tensordot(rival.fitted.weights, shapes, axes=1),
        np.concatenate([slopes, shapes]),
        np.stack(random, axis=2) * np.array(scale),
        rival.fitted.covariance,
    )


def possible(guesses: Sequence[Guess], data: Data, points: Operating) -> BoolArray:
    """Return at which points every guess has a solution (tread not pressed through and so on)."""
    good = np.ones(len(points), dtype=bool)
    for guess in guesses:
        if good.any():
            good[_impossible(guess, data, points, np.flatnonzero(good))] = False
    return good


def _impossible(guess: Guess, data: Data, points: Operating, index: IntArray) -> list[int]:
    """Return points without a solution, by halving what fails."""
    try:
        guess.solved(data, points.take(index))
    except TirelibError:
        if len(index) == 1:
            return [int(index[0])]
        half = len(index) // 2
        return [
            *_impossible(guess, data, points, index[:half]),
            *_impossible(guess, data, points, index[half:]),
        ]
    return []
