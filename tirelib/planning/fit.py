"""One rival fitted to the present runs, with the structure of the ring among the unknowns."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tirelib.arrays import BoolArray, FloatArray
from tirelib.diagnose.fitter import STRENGTH_WIDTH, changes_of, widths
from tirelib.diagnose.structure import FORM
from tirelib.effects import Effect
from tirelib.errors import ConvergenceError, TirelibError
from tirelib.identify.random_effects import Whitening
from tirelib.identify.waveform_fit import Data
from tirelib.model.base import Coordinate, coordinates, move, predict
from tirelib.model.chain import Changes
from tirelib.model.state import Operating
from tirelib.model.whole import Whole, solve_whole, whole_slopes

Values = Mapping[str, float | FloatArray]

STEPS = 20
SETTLED = 0.05
"""Fall of the chi-square by a full step below which the fit has settled."""
HALVINGS = 8
LONGEST = 0.4
"""Longest step of a coordinate."""
NEAR = 1e-6
"""Distance from its end, in ranges, at which a strength is held by it."""
HELD = 1e9
"""Weight of a strength that is held: what is ahead moves it no more."""
TRIAL = 1e-3
"""Trial step of a strength, relative to its range."""


@dataclass(frozen=True, slots=True)
class Guess:
    """Coordinates of a rival: where the base values have moved, and its strengths.

    Attributes
    ----------
    start : mapping
        Values of the tire at z = 0.
    effects : tuple of Effect
    z : shape (n_free + n_strengths,)
        Moves of the tire's coordinates, then strengths in units of their range.
    """

    start: Values
    effects: tuple[Effect, ...]
    z: FloatArray

    @property
    def values(self) -> dict[str, float | FloatArray]:
        """Of the tire."""
        return move(self.start, self.z[: len(self.free)], self.free)

    @property
    def strengths(self) -> tuple[FloatArray, ...]:
        """In their units, one array per effect."""
        counts = [effect.components for effect in self.effects]
        parts = np.split(self.z[len(self.free) :], np.cumsum(counts)[:-1]) if counts else []
        return tuple(e.scale * part for e, part in zip(self.effects, parts, strict=True))

    @property
    def free(self) -> tuple[Coordinate, ...]:
        """What moves of the tire."""
        return coordinates(self.start)

    @property
    def changes(self) -> Changes:
        """The effects at their strengths."""
        return changes_of(self.effects, self.strengths)

    def at(self, z: FloatArray) -> "Guess":
        """Return other coordinates."""
        return Guess(self.start, self.effects, z)

    def solved(self, data: Data, points: Operating, near: Whole | None = None) -> Whole:
        """Return the model at points."""
        # a law may leave its domain on the way of a step that is then taken back
        with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
            return solve_whole(
                self.values,
                points,
                self.changes,
                low_pass=data.low_pass,
                start=near.contact.x if near is not None and near.contact else None,
            )

    def slopes(self, found: Whole, data: Data, points: Operating) -> tuple[FloatArray, FloatArray]:
        """Return slopes by the coordinates, and by relative load and pressure."""
        values, changes = self.values, self.changes
        by = whole_slopes(
            found, values, points, self.free, changes, low_pass=data.low_pass
        ).waveform
        plain = predict(values, points, changes, low_pass=data.low_pass).wave
        rows = []
        for k in range(len(self.free), self.z.size):
            moved = self.z.copy()
            moved[k] += TRIAL if moved[k] <= 0.5 else -TRIAL
            wave = predict(values, points, self.at(moved).changes, low_pass=data.low_pass).wave
            rows.append((wave - plain) / (moved[k] - self.z[k]))
        strength = np.array(rows).reshape(-1, *plain.shape)
        return np.concatenate([by[:-2], strength]), by[-2:]

    @property
    def room(self) -> tuple[FloatArray, FloatArray]:
        """How far the coordinates may go down and up: strengths stay in their ranges.

        An end other than zero is as uncertain as the law.
        """
        low, high = np.full(self.z.size, -np.inf), np.full(self.z.size, np.inf)
        first = len(self.free)
        for effect in self.effects:
            rows = slice(first, first + effect.components)
            low[rows] = effect.low / effect.scale - FORM * (effect.low < 0.0) - self.z[rows]
            high[rows] = effect.high / effect.scale + FORM * (effect.high > 0.0) - self.z[rows]
            first += effect.components
        return np.minimum(low, 0.0), np.maximum(high, 0.0)

    @property
    def held(self) -> BoolArray:
        """Which coordinates are at an end of their range."""
        low, high = self.room
        return np.asarray(np.minimum(-low, high) < NEAR)

    @property
    def width(self) -> FloatArray:
        """Prior standard deviations."""
        more = self.z.size - len(self.free)
        return np.concatenate([widths(self.free), np.full(more, STRENGTH_WIDTH)])


@dataclass(frozen=True, slots=True)
class Fitted:
    """A rival at its minimum.

    Attributes
    ----------
    guess : Guess
    weights : shape (n_structure,)
        Structural unknowns, in standard deviations.
    covariance : shape (n, n)
        Of coordinates and structural unknowns.
    cost : float, [-]
        Chi-square left, priors included.
    """

    guess: Guess
    weights: FloatArray
    covariance: FloatArray
    cost: float


class Metric:
    """The chi-square of the present runs, structural unknowns eliminated.

    Parameters
    ----------
    data : Data
    whiten : Whitening
    shapes : shape (n_structure, n_points, n_phi)
        Each for one standard deviation.
    """

    def __init__(self, data: Data, whiten: Whitening, shapes: FloatArray) -> None:
        self.data, self.whiten = data, whiten
        self.rows = whiten(shapes).reshape(len(shapes), -1)
        self.precision = np.eye(len(shapes))
        self.inner = np.asarray(np.linalg.inv(self.rows @ self.rows.T + self.precision))

    def rest(self, waveform: FloatArray) -> FloatArray:
        """Return the whitened residual, flat."""
        flat: FloatArray = self.whiten(self.data.strain - waveform).ravel()
        return flat

    def weights(self, rest: FloatArray) -> FloatArray:
        """Return the structural unknowns that serve a residual best."""
        found: FloatArray = self.inner @ (self.rows @ rest)
        return found

    def cost(self, rest: FloatArray, guess: Guess) -> float:
        """Return the chi-square with its priors."""
        project = self.rows @ rest
        left = float(rest @ rest - project @ self.inner @ project)
        return left + float(np.sum((guess.z / guess.width) ** 2))

    def left(self, slopes: FloatArray, width: FloatArray, found: Whole) -> float:
        """Return the chi-square that unknowns with a prior leave, to first order.

        Parameters
        ----------
        slopes : shape (n, n_runs, n_phi)
        width : shape (n,)
            Prior standard deviations.
        found : Whole
            Where the slopes are taken.
        """
        flat, rest = self.whiten(slopes).reshape(len(slopes), -1), self.rest(found.waveform)
        cross, project = flat @ self.rows.T, self.rows @ rest
        normal = flat @ flat.T - cross @ self.inner @ cross.T + np.diag(width**-2.0)
        right = flat @ rest - cross @ (self.inner @ project)
        before = rest @ rest - project @ self.inner @ project
        return float(before - right @ np.linalg.solve(normal, right))

    def fit(self, guess: Guess) -> Fitted:
        """Return the minimum near a guess, by Gauss-Newton with backtracking.

        Raises
        ------
        ConvergenceError
            If the chi-square still falls after `STEPS` steps.
        """
        data = self.data
        found = guess.solved(data, data.points)
        cost = self.cost(self.rest(found.waveform), guess)
        for _ in range(STEPS):
            rows, normal, gradient = self._normal(guess, found)
            dz = np.clip(bounded(normal, gradient, *guess.room), -LONGEST, LONGEST)
            better = self._line(guess, found, dz, cost)
            if better is None or cost - better[2] < SETTLED:
                if better is not None:
                    guess, found, cost = better
                return self._result(guess, found, rows, cost)
            guess, found, cost = better
        raise ConvergenceError(
            f"after {STEPS} steps the chi-square still falls", guess.values, cost
        )

    def _normal(self, guess: Guess, found: Whole) -> tuple[FloatArray, FloatArray, FloatArray]:
        rows, _ = guess.slopes(found, self.data, self.data.points)
        flat = self.whiten(rows).reshape(len(rows), -1)
        rest = self.rest(found.waveform)
        cross = flat @ self.rows.T
        weight = guess.width**-2.0
        normal = flat @ flat.T - cross @ self.inner @ cross.T + np.diag(weight)
        gradient = flat @ rest - cross @ self.weights(rest) - weight * guess.z
        return flat, normal, gradient

    def _line(
        self, guess: Guess, found: Whole, dz: FloatArray, cost: float
    ) -> tuple[Guess, Whole, float] | None:
        """Return the first of ever shorter steps that lowers the cost, None without."""
        for k in range(HALVINGS):
            trial = guess.at(guess.z + dz * 0.5**k)
            try:
                there = trial.solved(self.data, self.data.points, found)
            except TirelibError:
                continue
            new = self.cost(self.rest(there.waveform), trial)
            if new < cost:
                return trial, there, new
        return None

    def _result(self, guess: Guess, found: Whole, rows: FloatArray, cost: float) -> Fitted:
        weights = self.weights(self.rest(found.waveform))
        every = np.concatenate([rows, self.rows])
        normal = every @ every.T
        size = len(rows)
        normal[:size, :size] += np.diag(guess.width**-2.0 + HELD * guess.held)
        normal[size:, size:] += self.precision
        return Fitted(guess, weights, np.asarray(np.linalg.inv(normal)), cost)


def bounded(
    normal: FloatArray, gradient: FloatArray, low: FloatArray, high: FloatArray
) -> FloatArray:
    """Return the step that solves normal equations within bounds.

    What would cross a bound is set to it, and the others are solved for again.

    Parameters
    ----------
    normal : shape (n, n)
    gradient : shape (n,)
    low, high : shape (n,)
        Bounds of the step, at most and at least zero.
    """
    step = np.zeros(gradient.size)
    free = np.ones(gradient.size, dtype=bool)
    while free.any():
        right = gradient[free] - normal[np.ix_(free, ~free)] @ step[~free]
        step[free] = np.linalg.solve(normal[np.ix_(free, free)], right)
        beyond = free & ((step < low) | (step > high))
        if not beyond.any():
            break
        step = np.where(beyond, np.clip(step, low, high), step)
        free &= ~beyond
    return step


def started(start: Values, effects: Sequence[Effect], strengths: Sequence[FloatArray]) -> Guess:
    """Return a guess at values and strengths."""
    parts = [np.atleast_1d(s) / e.scale for e, s in zip(effects, strengths, strict=True)]
    return Guess(start, tuple(effects), np.concatenate([np.zeros(len(coordinates(start))), *parts]))
