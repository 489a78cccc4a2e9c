"""What a rival predicts at runs that nobody has made, and how sure it is there."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tirelib.arrays import BoolArray, FloatArray, IntArray
from tirelib.errors import TirelibError
from tirelib.identify.random_effects import SMALLEST_TOLERANCE, angle_slope
from tirelib.identify.waveform_fit import Data
from tirelib.model.state import Operating
from tirelib.model.whole import Whole, solve_whole
from tirelib.planning.fit import Guess, started
from tirelib.planning.rivals import Rival, Trial
from tirelib.planning.structure import structure_shapes


@dataclass(frozen=True, slots=True)
class Noise:
    """Random parts of a run's waveform, [-], as white noise that counts as much.

    Attributes
    ----------
    random : float
        Between repeated runs.
    staying : float
        Small-scale misfit of the ring's structure, which repeats do not average.
    """

    random: float
    staying: float

    @classmethod
    def of(cls, trial: Trial, repeats: float) -> "Noise":
        """Return the split of a trial's noise; `repeats` is the rms noise between repeated runs.

        Without repeats (NaN) all of it is taken as random.
        """
        random = min(repeats * trial.spread, trial.noise) if np.isfinite(repeats) else trial.noise
        return cls(random, float(np.sqrt(trial.noise**2 - random**2)))


@dataclass(frozen=True, slots=True)
class Forecast:
    """What a rival says of candidate runs.

    Attributes
    ----------
    wave : shape (n_points, n_phi), [-]
        Best guess, structural misfit included.
    slopes : shape (n_unknowns, n_points, n_phi)
        By free coordinates and by the misfit.
    tangents : shape (n_points, n_phi, 4)
        By set points, gain and angle zero, times their tolerance.
    covariance : shape (n_unknowns, n_unknowns)
    """

    wave: FloatArray
    slopes: FloatArray
    tangents: FloatArray
    covariance: FloatArray

    def separation(self, other: FloatArray, noise: Noise, repeats: float) -> FloatArray:
        """Return the chi-square by which this rival misses waveforms, after it adapts to them.

        d' (S + J C J')^-1 d: S holds noise and set points, over the number of repeats, and what
        repeats do not average; J C J' is what the present runs leave open of this rival.

        Parameters
        ----------
        other : shape (n_points, n_phi), [-]
        noise : Noise
        repeats : float
            Runs at each point.

        Returns
        -------
        shape (n_points,), [-]
        """
        root = np.linalg.cholesky(self.covariance)
        open_ = np.einsum("kpn,kj->pnj", self.slopes, root, optimize=True)
        low = np.concatenate([open_, self.tangents / np.sqrt(repeats)], axis=2)
        white = noise.staying**2 + noise.random**2 / repeats
        difference = other - self.wave
        inside = np.einsum("pnj,pn->pj", low, difference)
        core = np.einsum("pnj,pnk->pjk", low, low, optimize=True) + white * np.eye(low.shape[2])
        taken = np.einsum("pj,pj->p", inside, np.linalg.solve(core, inside[..., None])[..., 0])
        out: FloatArray = (np.sum(difference**2, axis=1) - taken) / white
        return np.maximum(out, 0.0)


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
    shapes = structure_shapes(
        base.values, base.changes, data, points, plain.waveform, plain.deflection, trial.barred
    )
    told = []
    for rival in trial.rivals:
        if progress is not None:
            progress(f"{len(points)} runs with {rival.name}")
        told.append(_forecast(rival, shapes, data, points, plain))
    return told


def _forecast(
    rival: Rival, shapes: FloatArray, data: Data, points: Operating, near: Whole
) -> Forecast:
    guess = rival.fitted.guess
    found = guess.solved(data, points, near)
    slopes, by_set_point = guess.slopes(found, data, points)
    tolerance = data.tolerance
    scale = [max(x, SMALLEST_TOLERANCE) for x in (tolerance.load, tolerance.pressure,
                                                  tolerance.gain)]  # fmt: skip
    scale.append(float(np.mean(np.minimum(data.angle_std, 1.0))))
    random = [*by_set_point, found.waveform, angle_slope(found.waveform)]
    return Forecast(
        found.waveform + np.tensordot(rival.fitted.weights, shapes, axes=1),
        np.concatenate([slopes, shapes]),
        np.stack(random, axis=2) * np.array(scale),
        rival.fitted.covariance,
    )


def possible(trial: Trial, data: Data, points: Operating) -> BoolArray:
    """Return at which points every rival has a solution (tread not pressed through and so on)."""
    base = trial.base
    guesses = [
        started(base.values, base.effects, base.strengths),
        *(rival.fitted.guess for rival in trial.rivals),
    ]
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
