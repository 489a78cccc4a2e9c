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


@dataclass(frozen=True, slots=True, eq=False)
class Remedy:
    """What would be measured, and how wide the intervals would then be.

    Attributes
    ----------
    half_width : shape (n_free,)
        Half the 95 % intervals, in coordinates (relative to the value for one that is scaled).
    effort : int
        Runs, or quantities to be measured.
    """

    words: str
    half_width: FloatArray
    effort: int

    @classmethod
    def of(cls, words: str, variance: FloatArray, effort: int) -> "Remedy":
        """Return what leaves these variances of the coordinates."""
        return cls(words, np.asarray(1.96 * np.sqrt(variance)), effort)


@dataclass(frozen=True, slots=True, eq=False)
class NextRun:
    """What every candidate would leave open.

    Attributes
    ----------
    half_width : shape (n_free,)
        Half of each 95 % interval now, in coordinates.
    """

    half_width: FloatArray
    runs: tuple[Remedy, ...]
    tests: tuple[Remedy, ...]

    def best(self, k: int) -> Remedy | None:
        """Return what narrows coordinate k most, for the least effort; None when nothing does."""
        return self._least_effort((*self.runs, *self.tests), k)

    def best_run(self, k: int) -> Remedy | None:
        """Return the same of the runs alone."""
        return self._least_effort(self.runs, k)

    def _least_effort(self, found: Sequence[Remedy], k: int) -> Remedy | None:
        halves = [float(remedy.half_width[k]) for remedy in found]
        narrowest, enough = min(halves, default=np.inf), LEAST_GAIN * float(self.half_width[k])
        if narrowest > enough:
            return None
        good = [
            i for i, half in enumerate(halves) if half <= min(ABOUT_AS_MUCH * narrowest, enough)
        ]
        return found[min(good, key=lambda i: (found[i].effort, halves[i]))]


def next_run(fit: WaveformFit, structure: FloatArray) -> NextRun:
    """Weigh runs inside a moderately extended envelope of the campaign, and laboratory tests.

    `structure` (n_free,) is the structural standard deviation of each coordinate.
    """
    problem, rows, apart = fit.problem, fit.found.rows, structure**2
    every = fit.whiten(np.concatenate([rows[BASE], rows[MISFIT]]))
    prior = np.concatenate([problem.widths**-2, np.ones(len(rows[MISFIT]))])
    information = every @ every.T + np.diag(prior)

    def covariance(more: FloatArray | float = 0.0) -> FloatArray:
        """Return the covariance of the coordinates by the fit, after runs."""
        return np.asarray(np.linalg.inv(information + more)[: apart.size, : apart.size])

    points, series = _candidates(problem.data.points)
    each = [points.take([i]) for i in range(len(points))]
    added = forked([partial(_information, fit, point) for point in each])
    runs = []
    for words, which in series:
        parts = [part for part in (added[i] for i in which) if part is not None]
        if len(parts) == len(which):
            left = np.diag(covariance(np.sum(parts, axis=0))) + apart
            runs.append(Remedy.of(words, left, len(parts)))
    pressure, now = problem.data.points.pressure, covariance()
    span = (BELOW * float(pressure.min()), ABOVE * float(pressure.max()))
    tests = [*laboratory_tests(fit.values, fit.free, span), *_press_test(fit)]
    return NextRun(
        np.asarray(1.96 * np.sqrt(np.diag(now) + apart)),
        tuple(runs),
        tuple(Remedy.of(t.words, _after(t, now, apart), len(t.rows)) for t in tests),
    )


def _after(test: Test, fit: FloatArray, structure: FloatArray) -> FloatArray:
    """Return the variances after an observation of z, or of z + d for a test by definition.

    The fit's covariance (n_free, n_free) is of z, the structural variances (n_free,) are of d.
    """
    k = structure.size
    whole = np.zeros((2 * k, 2 * k))
    whole[:k, :k], whole[k:, k:] = fit, np.diag(structure)
    seen = np.concatenate([test.rows, test.rows * test.by_definition], axis=1)
    gain = whole @ seen.T @ np.linalg.inv(seen @ whole @ seen.T + test.covariance)
    whole = whole - gain @ seen @ whole
    return np.asarray(np.diag(whole)[:k] + np.diag(whole)[k:] + 2.0 * np.diag(whole[:k, k:]))


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


def _press_test(fit: WaveformFit) -> list[Test]:
    """Return the vertical stiffness in the middle of the campaign, from two loads, if there is."""
    have = fit.problem.data.points
    load, pressure = float(np.median(have.load)), float(np.median(have.pressure))
    points = replace(
        have.take(np.zeros(2, dtype=int)),
        load=load * np.array([1.0 - PRESS_SPAN, 1.0 + PRESS_SPAN]),
        pressure=np.full(2, pressure),
    )
    at = _solved(fit, points)
    if at is None:
        return []
    model, slopes = at
    row = -np.diff(slopes.deflection[: len(fit.free)], axis=1).T / np.diff(model.deflection)
    words = f"a press test (vertical stiffness to {PRESS:.0%}) at {load:.0f} N"
    return [Test(words, row, PRESS**2 * np.eye(1), False)]
