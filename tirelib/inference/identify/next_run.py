"""What to measure next for a number that a campaign does not tell, computed at the fitted model.

With the slopes J of the whitened waveforms by the coordinates z and S by the coefficients of the
structural misfit, the information of the campaign is

    G = [J S]' [J S] + priors,

and a run adds its own [J S]' [J S]: more of what the misfit can mimic does not help. What a
laboratory finds is z + d with d the structural error (`structure`), which no run reduces but a test
by definition does: G and the structural variances give one normal distribution, which the test's
observation narrows.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Self

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import TirelibError
from tirelib.core.forked import forked
from tirelib.effects.state import Operating
from tirelib.inference.identify.laboratory import Test, laboratory_tests
from tirelib.inference.identify.random_effects import scales, tangents, whitening_of
from tirelib.inference.identify.waveform_fit import WaveformFit
from tirelib.inference.identify.waveform_problem import MISFIT
from tirelib.inference.statistics.plain import BASE
from tirelib.model.slopes import SolutionSlopes, slopes_of
from tirelib.model.solution import Solution, solved

BELOW, ABOVE = 0.8, 1.2
"""How far the envelope of loads, pressures and speeds is extended."""
PRESS = 0.02
"""Accuracy of the vertical stiffness of a press test, the ring's own error of it included."""
PRESS_SPAN = 0.1
LEAST_GAIN = 0.9
"""What leaves more of the half-width than this share is no advice."""
ABOUT_AS_MUCH = 1.6
"""Tests whose intervals differ by less than this factor are equal; the least effort is named."""


@dataclass(frozen=True, slots=True)
class Remedy:
    """What would be measured, and how wide the interval of one number would then be.

    Attributes
    ----------
    half_width : float
        Half the 95 % interval, in the coordinate (relative to the value for one that is scaled).
    effort : int
        Runs, or quantities to be measured.
    """

    words: str
    half_width: float
    effort: int


@dataclass(frozen=True, slots=True)
class NextRun:
    """What every candidate would leave open.

    Attributes
    ----------
    half_width : shape (n_free,)
        Half of each 95 % interval now, in coordinates.
    runs, tests : tuple of tuple of Remedy
        Per coordinate, the best first.
    """

    half_width: FloatArray
    runs: tuple[tuple[Remedy, ...], ...]
    tests: tuple[tuple[Remedy, ...], ...]

    def best(self, k: int) -> Remedy | None:
        """Return what narrows coordinate k most, for the least effort; None when nothing does."""
        return _least_effort([*self.runs[k], *self.tests[k]], float(self.half_width[k]))

    def best_run(self, k: int) -> Remedy | None:
        """Return the same of the runs alone."""
        return _least_effort(self.runs[k], float(self.half_width[k]))


def _least_effort(found: Sequence[Remedy], now: float) -> Remedy | None:
    narrowest = min((remedy.half_width for remedy in found), default=np.inf)
    if narrowest > LEAST_GAIN * now:
        return None
    good = [r for r in found if r.half_width <= min(ABOUT_AS_MUCH * narrowest, LEAST_GAIN * now)]
    return min(good, key=lambda remedy: (remedy.effort, remedy.half_width))


@dataclass(frozen=True, slots=True)
class _State:
    """Information of coordinates and misfit coefficients, and structural variances."""

    information: FloatArray
    structure: FloatArray

    @classmethod
    def of(cls, fit: WaveformFit, structure: FloatArray) -> Self:
        problem, rows = fit.problem, fit.found.rows
        every = fit.whiten(np.concatenate([rows[BASE], rows[MISFIT]]))
        prior = np.concatenate([problem.widths**-2, np.ones(len(rows[MISFIT]))])
        return cls(every @ every.T + np.diag(prior), structure**2)

    def covariance(self, more: FloatArray | None = None) -> FloatArray:
        """Return the covariance of the coordinates by the fit, after a run."""
        k = self.structure.size
        total = self.information if more is None else self.information + more
        return np.asarray(np.linalg.inv(total)[:k, :k])

    def after_run(self, words: str, effort: int, more: FloatArray) -> list[Remedy]:
        """Return what every coordinate has left after runs with this information."""
        total = np.diag(self.covariance(more)) + self.structure
        return [Remedy(words, float(half), effort) for half in 1.96 * np.sqrt(total)]

    def after_test(self, test: Test) -> list[Remedy]:
        """Return the same after an observation of z, or of z + d for a test by definition."""
        k = self.structure.size
        fit = self.covariance()
        whole = np.zeros((2 * k, 2 * k))
        whole[:k, :k], whole[k:, k:] = fit, np.diag(self.structure)
        seen = np.concatenate([test.rows, test.rows * test.by_definition], axis=1)
        gain = whole @ seen.T @ np.linalg.inv(seen @ whole @ seen.T + test.covariance)
        whole = whole - gain @ seen @ whole
        total = np.diag(whole)[:k] + np.diag(whole)[k:] + 2.0 * np.diag(whole[:k, k:])
        return [Remedy(test.words, float(h), len(test.rows)) for h in 1.96 * np.sqrt(total)]


def next_run(fit: WaveformFit, structure: FloatArray) -> NextRun:
    """Weigh runs inside a moderately extended envelope of the campaign, and laboratory tests.

    `structure` (n_free,) is the structural standard deviation of each coordinate.
    """
    state = _State.of(fit, structure)
    points, series = _candidates(fit.problem.data.points)
    each = [points.take([i]) for i in range(len(points))]
    added = forked([partial(_information, fit, point) for point in each])
    runs = []
    for words, which in series:
        parts = [added[i] for i in which]
        known = [part for part in parts if part is not None]
        if len(known) == len(parts):
            runs.append(state.after_run(words, len(parts), np.sum(known, axis=0)))
    pressure = fit.problem.data.points.pressure
    span = (BELOW * float(pressure.min()), ABOVE * float(pressure.max()))
    tests = list(laboratory_tests(fit.values, fit.free, span))
    press = _press_test(fit)
    tests += [press] if press is not None else []
    half = 1.96 * np.sqrt(np.diag(state.covariance()) + state.structure)
    return NextRun(
        half,
        _sorted(runs, len(fit.free)),
        _sorted([state.after_test(test) for test in tests], len(fit.free)),
    )


def _sorted(found: Sequence[list[Remedy]], size: int) -> tuple[tuple[Remedy, ...], ...]:
    return tuple(
        tuple(sorted((row[k] for row in found), key=lambda r: r.half_width)) for k in range(size)
    )


def _candidates(have: Operating) -> tuple[Operating, list[tuple[str, tuple[int, ...]]]]:
    """Return points, and named sets of them: single runs, and series over load or pressure."""

    def levels(values: FloatArray) -> FloatArray:
        low, high = BELOW * float(np.nanmin(values)), ABOVE * float(np.nanmax(values))
        return np.array([low, 0.5 * (low + high), high])

    loads, pressures = levels(have.load), levels(have.pressure)
    speeds = levels(have.speed)[[0, 2]]
    grid = np.stack(np.meshgrid(speeds, pressures, loads, indexing="ij"), axis=-1)
    speed, pressure, load = grid.reshape(-1, 3).T
    n = load.size
    warm = float(np.nanmean(have.temperature)) if np.isfinite(have.temperature).any() else np.nan
    given = {
        "load": load,
        "pressure": pressure,
        "speed": speed,
        "omega": speed * float(np.nanmedian(have.omega / have.speed)),
        "temperature": np.full(n, warm),
    }
    points = Operating(**(dict.fromkeys(Operating.__slots__, np.zeros(n)) | given))
    index = np.arange(n).reshape(grid.shape[:-1])
    sets: list[tuple[int, ...]] = [(i,) for i in range(n)]
    for plane in index:
        sets += [tuple(int(i) for i in row) for row in (*plane, *plane.T)]
    return points, [(_run(points, which), which) for which in sets]


def _run(points: Operating, which: Sequence[int]) -> str:
    """Return the words for straight runs."""

    def told(values: FloatArray, factor: float, digits: int) -> str:
        several = [f"{factor * v:.{digits}f}" for v in np.unique(values[list(which)])]
        return " and ".join([", ".join(several[:-1]), several[-1]] if several[1:] else several)

    what = "a straight run" if len(which) == 1 else "straight runs"
    return (
        f"{what} at {told(points.load, 1.0, 0)} N, {told(points.pressure, 1e-5, 1)} bar, "
        f"{told(points.speed, 3.6, 0)} km/h"
    )


def _solved(fit: WaveformFit, points: Operating) -> tuple[Solution, SolutionSlopes] | None:
    """Return the fitted model at points; None where it has no solution."""
    low_pass = fit.problem.data.low_pass
    start = fit.model.rolling.take(fit.problem.data.points.nearest(points))
    try:
        model = solved(fit.values, points, low_pass=low_pass, start=start)
        return model, slopes_of(model, fit.free)
    except TirelibError:
        return None


def _information(fit: WaveformFit, points: Operating) -> FloatArray | None:
    """Return what one run would add, over coordinates and misfit; None without a solution."""
    at = _solved(fit, points)
    if at is None:
        return None
    model, slopes = at
    problem, data = fit.problem, fit.problem.data
    known = data.angle_std[np.isfinite(data.angle_std)]
    angle = float(np.median(known)) if known.size else np.inf
    whiten = whitening_of(
        tangents(model.waveform, slopes.waveform[-2], slopes.waveform[-1]),
        scales(data.tolerance, np.full(len(points), angle)),
        data.noise,
    )
    strain = problem.by_coordinates(model, slopes, fit.delay)
    shapes = problem.misfit(model.waveform, model.deflection, points)
    each = whiten(np.concatenate([strain, shapes])).reshape(-1, data.strain.shape[1])
    return np.asarray(each @ each.T)


def _press_test(fit: WaveformFit) -> Test | None:
    """Return the vertical stiffness in the middle of the campaign, from two loads."""
    have = fit.problem.data.points
    load, pressure = float(np.median(have.load)), float(np.median(have.pressure))
    points = replace(
        have.take(np.zeros(2, dtype=int)),
        load=load * np.array([1.0 - PRESS_SPAN, 1.0 + PRESS_SPAN]),
        pressure=np.full(2, pressure),
    )
    at = _solved(fit, points)
    if at is None:
        return None
    model, slopes = at
    row = -np.diff(slopes.deflection[: len(fit.free)], axis=1).T / np.diff(model.deflection)
    words = f"a press test (vertical stiffness to {PRESS:.0%}) at {load:.0f} N"
    return Test(words, row, PRESS**2 * np.eye(1), False)
