"""All runs at once: the base model's parameters from whole strain waveforms.

Gauss-Newton on the cost of `fit_cost`: residuals whitened by noise and set points
(`random_effects`), delay of the day (`delay`) and structural misfit (`discrepancy`) as parts of the
fit, priors from the tire file, and the measured loaded radius where the rig has it. The interval of
a parameter therefore holds what noise, set points, delay, structure and the other parameters leave
open.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from tirelib.arrays import BoolArray, FloatArray
from tirelib.errors import ConvergenceError, TirelibError
from tirelib.forked import forked
from tirelib.identify.delay import earlier
from tirelib.identify.discrepancy import Discrepancy
from tirelib.identify.fit_cost import Cost, Data
from tirelib.identify.random_effects import Whitening
from tirelib.infer.bounded import bounded_step
from tirelib.model.base import FREE, Coordinate, Linear, move
from tirelib.model.chain import Changes
from tirelib.model.slopes import SolutionSlopes, slopes_of
from tirelib.model.solution import Solution, solved

__all__ = ["Data", "Prior", "Solver", "WaveformFit", "fit_waveforms"]

MAX_STEPS = 60
LONGEST_STEP = 0.5
SETTLED = 0.01
"""Gauss-Newton step, in standard deviations, below which the fit has settled."""
KEPT_WITHIN = 1.0
"""The same, below which whitening and the misfit's shapes are kept: they hardly change any more."""
FOLLOWED = 25
"""Steps after which the cost is kept in any case: following the solution, it may go in circles."""
LEAST_FALL = 1e-3
"""Fall of the cost below which a step is the last: the bottom may have an edge, where an
integration node of the contact meets its end."""
IDLE, LITTLE = 4, 0.1
"""Steps in a row that lower the cost by less than `LITTLE`, in units of a chi-square, after which a
fit has settled whatever a slope promises: at the edge of a sliding tread a slope holds on one side
only, and a fit goes on along the edge for ever."""
FIRST, LARGEST_DAMPING = 1.0, 1e8
"""Damping to begin with, and the largest one. A fit that begins with whole Gauss-Newton steps far
away ends in another valley now and then: of two tires of the ring with a crowned tread, at a cost
of 66 and 30 instead of 24 and 22. With .5 the second one still does; 2 changes neither."""
PROBE = 2.0
"""Distance along a ridge at which the surface is compared with its parabola, in deviations."""


@dataclass(frozen=True, slots=True)
class Prior:
    """Normal prior of the free coordinates, about the start values."""

    std: FloatArray


@dataclass(frozen=True, slots=True)
class WaveformFit:
    """Result of a fit.

    Attributes
    ----------
    values : mapping
        Every value of the tire, the free ones fitted.
    free : tuple of Coordinate
    covariance : shape (n_free, n_free)
        Of the free coordinates.
    prior_std : shape (n_free,)
    linear : Linear
        The model at the solution.
    whiten : Whitening
    misfit : shape (n_runs, n_phi), [-]
        The structural misfit that was fitted.
    delay : float, [s]
        Delay of the gages against the trigger.
    interval : shape (n_free, 2)
        95 % interval of each coordinate, relative to the solution, along the ridge that the other
        coordinates follow.
    quadratic : shape (n_free,)
        Whether the surface is a parabola there, so that the standard deviation tells all.
    error : float, [-]
        Rms of the whitened residual of the model alone, the delay taken out, in noise units.
    rms : float, [-]
        Rms of the plain residual of the model alone, the delay taken out.
    steps : int
    cost : Cost
        About the solution.
    """

    values: Mapping[str, float | FloatArray]
    free: tuple[Coordinate, ...]
    covariance: FloatArray
    prior_std: FloatArray
    linear: Linear
    whiten: Whitening
    misfit: FloatArray
    delay: float
    interval: FloatArray
    quadratic: BoolArray
    error: float
    rms: float
    steps: int
    cost: Cost
    notes: Mapping[str, float] = field(default_factory=dict)


def fit_waveforms(
    data: Data,
    start: Mapping[str, float | FloatArray],
    prior: Prior,
    *,
    free: tuple[Coordinate, ...] = FREE,
    changes: Changes = (),
    discrepancy: Discrepancy | None = None,
    progress: Callable[[str], None] | None = None,
    found: Callable[[Mapping[str, float | FloatArray]], None] | None = None,
) -> WaveformFit:
    """Fit the free coordinates.

    Parameters
    ----------
    data : Data
    start : mapping
        Values of a tire, by name of `Tire`.
    prior : Prior
        Of `free`, about `start`.
    free : tuple of Coordinate
    changes : sequence of (stage, change)
        Effects that the model has.
    discrepancy : Discrepancy or None
        None leaves the structural misfit out: smallest residual, intervals of noise alone.
    progress : callable, optional
        Called with a label after each step.
    found : callable, optional
        Called with the fitted values before their intervals are computed.

    Raises
    ------
    ConvergenceError
        If the steps do not settle; carries the last values.
    """
    solver = Solver(data, start, prior, free, changes, discrepancy)
    moved = np.inf
    for steps in range(1, MAX_STEPS + 1):
        solver.refresh(renew=moved > KEPT_WITHIN and steps <= FOLLOWED)
        moved = solver.step()
        if progress is not None:
            progress(f"error {solver.cost.error(solver.model):.2f}")
        if moved < SETTLED:
            if found is not None:
                found(solver.values)
            return solver.result(steps)
    raise ConvergenceError(
        f"waveform fit: after {MAX_STEPS} steps the parameters still move by {moved:.2g} standard "
        "deviations; fix parameters that the campaign cannot inform, or start nearer",
        solver.values,
        moved,
    )


class Solver:
    """Levenberg-Marquardt over the free coordinates z within their ranges; the cost follows."""

    def __init__(
        self,
        data: Data,
        start: Mapping[str, float | FloatArray],
        prior: Prior,
        free: tuple[Coordinate, ...],
        changes: Changes,
        discrepancy: Discrepancy | None,
    ) -> None:
        self.data, self.prior, self.free, self.changes = data, prior, free, changes
        self.discrepancy = discrepancy
        self.start = dict(start)
        self.z = np.zeros(len(free))
        ends = [c.ends(float(np.max(self.start[c.name]))) for c in free]
        self.low, self.high = np.array(ends).reshape(-1, 2).T
        self.delay = 0.0
        self.damping = FIRST
        self.idle = 0
        self.slopes: SolutionSlopes | None = None
        self.model = self.at(self.z)

    @property
    def values(self) -> dict[str, float | FloatArray]:
        """The tire's values at z."""
        return move(self.start, self.z, self.free)

    def at(self, z: FloatArray) -> Solution:
        """Return the model at coordinates, from the solution at hand where there is one."""
        start = None
        if self.slopes is not None:
            start = self.slopes.start(self.model, z - self.z)
        return solved(
            move(self.start, z, self.free),
            self.data.points,
            self.changes,
            low_pass=self.data.low_pass,
            start=start,
        )

    def refresh(self, *, renew: bool = True) -> None:
        """Bring the slopes up to the present solution, and if asked for the cost as well."""
        self.slopes = slopes_of(self.model, self.free)
        if renew:
            self.renew(self.slopes)
        self.normal, self.gradient, self.height = self.cost.normal(self.model, self.slopes, self.z)

    def renew(self, slopes: SolutionSlopes) -> None:
        """Take the cost about the present solution, after what is known of the delay."""
        radius = float(np.max(self.start["free_radius"]))

        def about() -> Cost:
            strain = earlier(self.data.strain, np.asarray(self.data.points.omega), self.delay)
            data = replace(self.data, strain=strain)
            return Cost.about(data, self.prior.std, self.discrepancy, radius, self.model, slopes)

        self.cost = about()
        self.delay += self.cost.delay(self.model)
        self.cost = about()

    def step(self) -> float:
        """Take one step that lowers the cost.

        Returns
        -------
        Largest component of the Gauss-Newton step, in standard deviations; zero at the bottom.

        Raises
        ------
        TirelibError
            If the model has no solution anywhere near.
        """
        deviation = np.minimum(np.sqrt(np.diag(np.linalg.inv(self.normal))) + 1e-6, 1.0)
        within = self.low - self.z, self.high - self.z
        wanted = bounded_step(self.normal, self.gradient, *within)
        far = float(np.abs(wanted / deviation).max())
        if far < SETTLED:
            return far
        refused: TirelibError | None = None
        while self.damping < LARGEST_DAMPING:
            damped = self.normal + self.damping * np.diag(np.diag(self.normal))
            dz = bounded_step(damped, self.gradient, *within)
            dz = dz * min(1.0, LONGEST_STEP / max(float(np.abs(dz).max()), 1e-300))
            try:
                model = self.at(self.z + dz)
            except TirelibError as error:
                refused = error
                self.damping = max(10.0 * self.damping, 1e-2)
                continue
            refused = None
            fall = self.height - self.cost.value(model, self.z + dz)
            if fall >= 0.0:
                self.z, self.model = self.z + dz, model
                self.damping = max(self.damping / 10.0, 1e-9)
                self.idle = self.idle + 1 if fall < LITTLE else 0
                return far if fall > LEAST_FALL and self.idle < IDLE else 0.0
            self.damping *= 10.0
        if refused is not None:
            raise refused
        return 0.0  # no way down: the bottom to rounding

    def result(self, steps: int) -> WaveformFit:
        """Return what was found."""
        self.refresh(renew=False)
        assert self.slopes is not None  # noqa: S101 - set by refresh
        k = len(self.free)
        covariance = np.asarray(np.linalg.inv(self.normal), dtype=np.float64)
        interval, quadratic = self.ridges(covariance)
        self.delay += self.cost.delay(self.model)
        strain = earlier(self.data.strain, np.asarray(self.data.points.omega), self.delay)
        rest = strain - self.model.waveform
        linear = Linear(
            self.model.waveform,
            self.model.deflection,
            self.slopes.waveform[:k],
            self.slopes.deflection[:k],
        )
        return WaveformFit(
            self.values,
            self.free,
            covariance,
            self.prior.std,
            linear,
            self.cost.whiten,
            self.cost.misfit(self.model),
            self.delay,
            interval,
            quadratic,
            float(np.sqrt(np.mean(self.cost.whiten(rest) ** 2))),
            float(np.sqrt(np.mean(rest**2))),
            steps,
            self.cost,
        )

    def rise(self, dz: FloatArray) -> float:
        """Return how much higher the cost is after a move; infinite where the model fails."""
        try:
            model = self.at(self.z + dz)
        except TirelibError:
            return float("inf")
        return self.cost.value(model, self.z + dz) - self.height

    def ridges(self, covariance: FloatArray) -> tuple[FloatArray, BoolArray]:
        """Return 95 % intervals along the ridges, and where the surface is quadratic."""
        size = len(self.free)
        moves = covariance / np.sqrt(np.diag(covariance))
        found = forked(
            [
                partial(self.rise, sign * PROBE * moves[:, k])
                for k in range(size)
                for sign in (-1.0, 1.0)
            ]
        )
        interval = np.zeros((size, 2))
        quadratic = np.ones(size, dtype=bool)
        for (k, side), rise in zip(np.ndindex(size, 2), found, strict=True):
            root = np.sqrt(max(rise, 0.0))
            # a side that hardly rises is open to three deviations at least
            reach = 1.96 * PROBE / max(root, 1.96 * PROBE / 3.0)
            interval[k, side] = (2 * side - 1) * np.sqrt(covariance[k, k]) * reach
            quadratic[k] &= bool(abs(root - PROBE) < 0.3)
        return interval, quadratic
