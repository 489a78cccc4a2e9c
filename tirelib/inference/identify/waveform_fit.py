"""All runs at once: the base model's parameters from whole strain waveforms.

The inference (`tirelib.inference.statistics.posterior`) fits the problem of `waveform_problem`:
residuals whitened by noise and set points (`whiten_runs`), delay of the day (`delay`) and
structural misfit (`discrepancy`) as parts of the fit, priors from the tire file, and the measured
loaded radius where the rig has it. The interval of a parameter therefore holds what noise, set
points, delay, structure and the other parameters leave open.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.core.errors import TirelibError
from tirelib.core.forked import forked
from tirelib.inference.identify.campaign_data import Data
from tirelib.inference.identify.discrepancy import Discrepancy
from tirelib.inference.identify.waveform_problem import MISFIT, WaveformProblem, WaveformSolved
from tirelib.inference.identify.whiten_runs import RunWhitening
from tirelib.inference.statistics.normal import Normal, Weighed
from tirelib.inference.statistics.plain import BASE
from tirelib.inference.statistics.posterior import ROUGH, Posterior, posterior
from tirelib.inference.statistics.problem import Point
from tirelib.inference.statistics.quadratic import cost_of
from tirelib.model.base import FREE, Coordinate, move
from tirelib.model.solution import Solution

SETTLED = 1e-3
"""Fall of the cost that a step has to promise, in units of a chi-square, or the fit has settled: as
much as a number that moves by a thirtieth of its standard deviation."""
FIRST = 1.0
"""Damping to begin with. With a tenth of it or none the costs of four campaigns of 66 runs, three
of which hide an effect, change by less than 2 %, and fits take more steps or fewer at random."""
SPREAD = {MISFIT: 1.0}
"""Variance of the coefficients of the structural misfit's rows."""
PROBE = 2.0
"""Distance along a ridge at which the surface is compared with its parabola, in deviations."""


@dataclass(frozen=True, slots=True)
class WaveformFit:
    """Result of a fit.

    Attributes
    ----------
    values : mapping
        Every value of the tire, the free ones fitted.
    whiten : RunWhitening
        About the solution.
    """

    values: Mapping[str, float | FloatArray]
    found: Posterior
    problem: WaveformProblem
    whiten: RunWhitening
    steps: int

    @property
    def free(self) -> tuple[Coordinate, ...]:
        """The coordinates that were fitted."""
        return self.problem.free

    @property
    def covariance(self) -> FloatArray:
        """Covariance of the free coordinates, (n_free, n_free)."""
        return self.found.covariance[:-1, :-1]

    @property
    def prior_std(self) -> FloatArray:
        """Standard deviations of their priors, (n_free,)."""
        return self.problem.widths[:-1]

    @property
    def model(self) -> Solution:
        """The model at the solution, without the delay."""
        model: Solution = self.found.solved.model
        return model

    @property
    def delay(self) -> float:
        """Delay of the gages against the trigger, [s]."""
        return float(self.found.solved.delay)

    @property
    def rest(self) -> FloatArray:
        """Measured less model alone, the delay taken out, (n_runs, n_phi), [-]."""
        return np.asarray(self.problem.data.strain - self.found.solved.waveform)

    @property
    def error(self) -> float:
        """Rms of the whitened rest, in noise units."""
        return float(np.sqrt(np.mean(self.whiten.strain(self.rest) ** 2)))

    @property
    def rms(self) -> float:
        """Rms of the rest, [-]."""
        return float(np.sqrt(np.mean(self.rest**2)))


def fit_waveforms(
    data: Data,
    start: Mapping[str, float | FloatArray],
    std: FloatArray,
    *,
    free: tuple[Coordinate, ...] = FREE,
    discrepancy: Discrepancy | None = None,
    progress: Callable[[str], None] | None = None,
) -> WaveformFit:
    """Fit the free coordinates.

    Parameters
    ----------
    start : mapping
        Values of a tire, by name of `Tire`.
    std : shape (n_free,)
        Standard deviations of the coordinates' priors, which are normal, about the start.
    discrepancy : Discrepancy or None
        None leaves the structural misfit out: smallest residual, intervals of noise alone.

    Raises
    ------
    ConvergenceError
        If the steps do not settle; carries the last point.
    """
    problem = WaveformProblem(data, start, std, free, discrepancy)
    few, steps = problem.thinned(), 0

    def step(label: str) -> None:
        nonlocal steps
        steps += 1
        if progress is not None:
            progress(label)

    begin = problem.start
    if len(few.starts) > 1:
        if progress is not None:
            count, starts = len(few.data.points), len(few.starts)
            progress(f"fitting the base model to {count} of the runs first, from {starts} starts")
        begun = forked([partial(_valley, few, each) for each in few.starts])
        begin = min(begun, key=lambda each: each[0])[1]
    fit, whiten = _settled(problem, begin, SETTLED, step)
    return WaveformFit(move(problem.values, fit.point.base[:-1], free), fit, problem, whiten, steps)


def _valley(few: WaveformProblem, start: Point) -> tuple[float, Point]:
    """Return the cost of a fit from a start, and where it ends; infinite if it does not settle."""
    try:
        fit, _ = _settled(few, start, ROUGH)
    except TirelibError:
        return float("inf"), start
    return fit.cost, fit.point


def _settled(
    problem: WaveformProblem,
    start: Point,
    settled: float,
    progress: Callable[[str], None] | None = None,
) -> tuple[Posterior, RunWhitening]:
    """Return the fit from a start, and its whitening, which follows it."""
    whiten = problem.whitening(problem.solve(start))

    def follow(solved: WaveformSolved) -> RunWhitening:
        nonlocal whiten
        whiten = problem.whitening(solved)
        return whiten

    fit = posterior(
        problem,
        (),
        SPREAD,
        whiten,
        follow=follow,
        start=start,
        damping=FIRST,
        settled=settled,
        progress=progress,
    )
    return fit, whiten


def ridges(fit: WaveformFit) -> tuple[FloatArray, BoolArray]:
    """Return intervals of the coordinates, and whether their standard deviations tell all.

    The 95 % intervals (n_free, 2) are relative to the solution, along the ridge that the other
    coordinates follow; the surface is a parabola there, or not (n_free,).
    """
    problem, found, whiten = fit.problem, fit.found, fit.whiten
    white = {name: whiten(found.rows[name]) for name in (BASE, MISFIT)}
    normal = Normal.of(white, whiten(found.solved.rest))
    metric, every = Weighed(normal, normal.spread(SPREAD)), np.concatenate(list(white.values()))

    def cost(base: FloatArray) -> float:
        solved = found.solved
        if base is not found.point.base:
            solved = problem.solve(Point(base), found.solved)
        rest = whiten(solved.rest)
        return cost_of(metric, every @ rest, float(rest @ rest), base, problem.widths)

    def rise(move: FloatArray) -> float:
        """Return how much higher the cost is after a move; infinite where the model fails."""
        try:
            return cost(found.point.base + move) - bottom
        except TirelibError:
            return float("inf")

    bottom, size = cost(found.point.base), len(problem.free)
    deviation = np.sqrt(np.diag(found.covariance))
    moves = found.covariance / deviation
    rises = forked(
        [partial(rise, sign * PROBE * moves[:, k]) for k in range(size) for sign in (-1.0, 1.0)]
    )
    interval = np.zeros((size, 2))
    quadratic = np.ones(size, dtype=bool)
    for (k, side), risen in zip(np.ndindex(size, 2), rises, strict=True):
        root = np.sqrt(max(risen, 0.0))
        # a side that hardly rises is open to three deviations at least
        reach = 1.96 * PROBE / max(root, 1.96 * PROBE / 3.0)
        interval[k, side] = (2 * side - 1) * deviation[k] * reach
        quadratic[k] &= bool(abs(root - PROBE) < 0.3)
    return interval, quadratic
