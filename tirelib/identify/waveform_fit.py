"""All runs at once: the base model's parameters from whole strain waveforms.

Gauss-Newton on whitened residuals (`random_effects`), with the structural misfit as part of the fit
(`discrepancy`), priors from the tire file, and the measured loaded radius where the rig has it. The
interval of a parameter therefore holds what noise, set points, structure and the other parameters
leave open.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from scipy import linalg

from tirelib.arrays import BoolArray, FloatArray
from tirelib.campaign import Tolerance
from tirelib.errors import ConvergenceError, TirelibError
from tirelib.identify.discrepancy import Discrepancy
from tirelib.identify.random_effects import Whitening, whitening
from tirelib.model.base import (
    FREE,
    Coordinate,
    Correction,
    CorrectionSlopes,
    Linear,
    correction_slopes,
    large_displacements,
    linearised,
    move,
    predict,
)
from tirelib.model.chain import Changes
from tirelib.model.state import Operating
from tirelib.signal import LowPass
from tirelib.waveforms import GRID

MAX_STEPS = 30
LONGEST_STEP = 0.5
TOLERANCE = 1e-4
OUTER = 10
"""Most times that correction, whitening and the misfit's shapes are brought up to the values."""
SETTLED = 0.01
"""Move by such an update, in standard deviations, below which it is the last."""
NEAR = 0.1
"""Move of a coordinate below which the correction keeps its slopes."""


@dataclass(frozen=True, slots=True)
class Data:
    """What is fitted: the waveforms of one gage and, where measured, the deflections.

    Attributes
    ----------
    strain : shape (n_runs, n_phi), [-]
    points : Operating
    angle_std : shape (n_runs,), [rad]
    tolerance : Tolerance
    noise : float, [-]
    low_pass : LowPass
    deflection : shape (n_runs,), [m]
        Free radius less measured loaded radius; NaN where not measured.
    deflection_std : float, [m]
        Random part of it.
    """

    strain: FloatArray
    points: Operating
    angle_std: FloatArray
    tolerance: Tolerance
    noise: float
    low_pass: LowPass
    deflection: FloatArray
    deflection_std: float = 1e-4

    @property
    def with_deflection(self) -> bool:
        """Whether enough deflections are known."""
        return int(np.isfinite(self.deflection).sum()) >= 3


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
    interval : shape (n_free, 2)
        95 % interval of each coordinate, relative to the solution, along the ridge that the other
        coordinates follow.
    quadratic : shape (n_free,)
        Whether the surface is a parabola there, so that the standard deviation tells all.
    error : float, [-]
        Rms of the whitened residual of the model alone, in noise units.
    rms : float, [-]
        Rms of the plain residual of the model alone.
    steps : int
    """

    values: Mapping[str, float | FloatArray]
    free: tuple[Coordinate, ...]
    covariance: FloatArray
    prior_std: FloatArray
    linear: Linear
    whiten: Whitening
    misfit: FloatArray
    interval: FloatArray
    quadratic: BoolArray
    error: float
    rms: float
    steps: int
    notes: Mapping[str, float] = field(default_factory=dict)


def fit_waveforms(
    data: Data,
    start: Mapping[str, float | FloatArray],
    prior: Prior,
    *,
    free: tuple[Coordinate, ...] = FREE,
    changes: Changes = (),
    discrepancy: Discrepancy | None = None,
    exact: bool = True,
    progress: Callable[[str], None] | None = None,
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

    Raises
    ------
    ConvergenceError
        If the steps do not settle; carries the last values.
    """
    solver = _Solver(data, start, prior, free, changes, discrepancy, exact)
    steps = 0
    for outer in range(OUTER):
        solver.refresh(slopes=outer > 0)
        before = solver.z
        for _ in range(MAX_STEPS):
            steps += 1
            moved = solver.step()
            if progress is not None:
                progress(f"error {solver.error:.2f}")
            if moved < (0.02 if outer == 0 else TOLERANCE):
                break
        else:
            raise ConvergenceError(
                f"waveform fit: after {steps} steps the parameters still move by {moved:.2e} "
                "(relative); fix parameters that the campaign cannot inform, or start nearer",
                solver.values,
                moved,
            )
        moved = solver.distance(before)
        if outer > 0 and moved < SETTLED:
            break
    else:
        raise ConvergenceError(
            f"waveform fit: after {OUTER} updates of the large displacements the parameters still "
            f"move by {moved:.2e} standard deviations; fix parameters that the campaign cannot "
            "inform, or start nearer",
            solver.values,
            moved,
        )
    return solver.result(steps)


class _Solver:
    """Levenberg-Marquardt over parameters, with misfit coefficients eliminated linearly."""

    def __init__(
        self,
        data: Data,
        start: Mapping[str, float | FloatArray],
        prior: Prior,
        free: tuple[Coordinate, ...],
        changes: Changes,
        discrepancy: Discrepancy | None,
        exact: bool,
    ) -> None:
        self.data, self.prior, self.free, self.changes = data, prior, free, changes
        self.discrepancy = discrepancy
        self.z = np.zeros(len(free))
        self.start = dict(start)
        self.values = dict(start)
        self.exact = exact
        self.corrected: tuple[FloatArray, Correction, CorrectionSlopes] | None = None
        self.linear = self._linearise(self.z)
        self.slopes_at: FloatArray | None = None
        self.damping = 1e-3

    def _linearise(self, z: FloatArray) -> Linear:
        linear = linearised(
            move(self.start, z, self.free), self.data.points, self.free, self.changes,
            low_pass=self.data.low_pass, correction=self._correction(z[None]),
        )  # fmt: skip
        if self.corrected is None:
            return linear
        slopes = self.corrected[2]
        return replace(
            linear,
            waveform_slopes=linear.waveform_slopes + slopes.waveform,
            deflection_slopes=linear.deflection_slopes + slopes.deflection,
        )

    def _correction(self, z: FloatArray) -> Correction | None:
        """Return the correction at coordinates (n_moves, n_free), one after the other."""
        if self.corrected is None:
            return None
        at, correction, slopes = self.corrected
        return slopes.moved(correction, z - at)

    def refresh(self, *, slopes: bool = True) -> None:
        """Bring correction, whitening and misfit shapes up to the present parameters.

        Far from the solution the correction is better held than followed along its slopes.
        """
        data = self.data
        if self.exact:
            fresh = large_displacements(self.values, data.points, low_pass=data.low_pass)
            self.corrected = (self.z, fresh, self._slopes(fresh) if slopes else self._none(fresh))
            self.linear = self._linearise(self.z)
        self.whiten = whitening(
            self.linear.waveform, self.values, data.points, data.tolerance, data.angle_std,
            data.noise, data.low_pass,
        )  # fmt: skip
        self.shapes = np.zeros((0, *data.strain.shape))
        if self.discrepancy is not None:
            half = np.sqrt(2.0 * self.linear.deflection / float(np.max(self.start["free_radius"])))
            self.shapes = self.discrepancy.columns(
                self.linear.waveform, 0.6 * half, data.points, GRID
            )
        flat = self.whiten(self.shapes).reshape(len(self.shapes), data.strain.size)
        self.white_shapes = flat
        inner = flat @ flat.T + np.eye(len(flat))
        self.inner = linalg.cho_factor(inner) if len(flat) else None

    def _none(self, fresh: Correction) -> CorrectionSlopes:
        shape = (len(self.free), *fresh.waveform.shape)
        return CorrectionSlopes(np.zeros(shape), np.zeros(shape[:2]))

    def _slopes(self, fresh: Correction) -> CorrectionSlopes:
        """Return the correction's slopes; those at hand while the parameters are near."""
        if self.slopes_at is not None and np.abs(self.z - self.slopes_at).max() < NEAR:
            assert self.corrected is not None  # noqa: S101 - set with the slopes
            return self.corrected[2]
        self.slopes_at = self.z
        return correction_slopes(
            self.values, self.data.points, self.free, fresh, low_pass=self.data.low_pass
        )

    def _project(self, white: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return misfit coefficients that serve rows of whitened residuals best."""
        if self.inner is None:
            return np.zeros((len(white), 0)), white
        return linalg.cho_solve(self.inner, self.white_shapes @ white.T).T, white

    def _normal(self, linear: Linear) -> tuple[FloatArray, FloatArray, float]:
        """Return normal matrix, gradient and cost with the misfit eliminated."""
        rows = self.whiten(linear.waveform_slopes).reshape(len(self.free), -1)
        rest = self.whiten(self.data.strain - linear.waveform).reshape(1, -1)
        every = np.concatenate([rows, rest])
        gram = every @ every.T
        if self.inner is not None:
            cross = self.white_shapes @ every.T
            gram = gram - cross.T @ linalg.cho_solve(self.inner, cross)
        gram = gram + self._deflection_gram(linear)
        weight = 1.0 / self.prior.std**2
        normal = gram[:-1, :-1] + np.diag(weight)
        gradient = gram[:-1, -1] - weight * self.z
        return normal, gradient, float(gram[-1, -1] + np.sum(weight * self.z**2))

    def _deflection_gram(self, linear: Linear) -> FloatArray:
        """Return the part of measured deflections; their zero is free to half a millimetre."""
        size = len(linear.waveform_slopes) + 1
        if not self.data.with_deflection:
            return np.zeros((size, size))
        known = np.isfinite(self.data.deflection)
        rest = (self.data.deflection - linear.deflection)[known]
        rows = np.concatenate([linear.deflection_slopes[:, known], rest[None]])
        # random part, a common zero, and a structural part in proportion to the deflection
        depth = linear.deflection[known]
        speed = np.nan_to_num(self.data.points.speed[known]) / 30.0
        common = np.stack([np.full(depth.size, 5e-4), 0.03 * depth, 5e-4 * speed**2])
        covariance = self.data.deflection_std**2 * np.eye(depth.size) + common.T @ common
        white = linalg.solve_triangular(
            linalg.cholesky(covariance, lower=True), rows.T, lower=True
        ).T
        gram: FloatArray = white @ white.T
        return gram

    def step(self) -> float:
        """Take one step that lowers the cost; return its length."""
        normal, gradient, cost = self._normal(self.linear)
        while self.damping < 1e8:
            damped = normal + self.damping * np.diag(np.diag(normal))
            dz = np.clip(np.linalg.solve(damped, gradient), -LONGEST_STEP, LONGEST_STEP)
            try:
                linear = self._linearise(self.z + dz)
            except TirelibError:
                self.damping = max(10.0 * self.damping, 1e-2)
                continue
            if self._normal_at(linear, self.z + dz) <= cost * (1.0 + 1e-12):
                self.z = self.z + dz
                self.linear, self.values = linear, move(self.start, self.z, self.free)
                self.damping = max(self.damping / 10.0, 1e-9)
                return float(np.abs(dz / self._scale(normal)).max())
            self.damping *= 10.0
        self.damping = 1e-3
        return 0.0

    def distance(self, before: FloatArray) -> float:
        """Return how far the coordinates are from others, in standard deviations."""
        normal, _, _ = self._normal(self.linear)
        return float(np.abs((self.z - before) / self._scale(normal)).max())

    def _normal_at(self, linear: Linear, z: FloatArray) -> float:
        before = self.z
        self.z = z
        try:
            return self._normal(linear)[2]
        finally:
            self.z = before

    def _scale(self, normal: FloatArray) -> FloatArray:
        """Return a change of each coordinate that matters: its standard deviation, at most 1."""
        deviation: FloatArray = np.minimum(np.sqrt(np.diag(np.linalg.inv(normal))) + 1e-6, 1.0)
        return deviation

    @property
    def error(self) -> float:
        """Rms of the whitened residual of the model alone."""
        rest = self.whiten(self.data.strain - self.linear.waveform)
        return float(np.sqrt(np.mean(rest**2)))

    def result(self, steps: int) -> WaveformFit:
        """Return what was found."""
        normal, _, _ = self._normal(self.linear)
        covariance = np.asarray(np.linalg.inv(normal), dtype=np.float64)
        interval, quadratic = self._ridges(covariance)
        rest = self.data.strain - self.linear.waveform
        misfit: FloatArray = np.zeros(rest.shape)
        if self.inner is not None:
            weights, _ = self._project(self.whiten(rest).reshape(1, -1))
            misfit = np.tensordot(weights[0], self.shapes, axes=1)
        return WaveformFit(
            self.values, self.free, covariance, self.prior.std, self.linear, self.whiten, misfit,
            interval, quadratic, self.error, float(np.sqrt(np.mean(rest**2))), steps,
        )  # fmt: skip

    def _ridges(self, covariance: FloatArray) -> tuple[FloatArray, BoolArray]:
        """Return 95 % intervals along the ridges, and where the surface is quadratic."""
        size = len(self.free)
        best = self._cost(self.linear.waveform, self.linear.deflection, self.z)
        steps = np.array([-3.0, -2.0, -1.0, 1.0, 2.0, 3.0])
        interval = np.zeros((size, 2))
        quadratic = np.ones(size, dtype=bool)
        for k in range(size):
            deviation = np.sqrt(covariance[k, k])
            path = steps[:, None] * covariance[:, k] / deviation
            rise = self._costs(self.z + path) - best
            root = np.sign(steps) * np.sqrt(np.maximum(rise, 0.0))
            around = np.concatenate([root[:3], [0.0], root[3:]])
            at = np.concatenate([steps[:3], [0.0], steps[3:]])
            grows = bool((np.diff(around) > 0).all())
            ends = np.interp([-1.96, 1.96], around, at) if grows else np.array([-3.0, 3.0])
            interval[k] = deviation * ends
            quadratic[k] = grows and bool((np.abs(around[[1, 5]] - [-2.0, 2.0]) < 0.3).all())
        return interval, quadratic

    def _costs(self, points: FloatArray) -> FloatArray:
        """Return the cost at several coordinates, in one batch; infinite where the model fails."""
        n, count = len(self.data.points), len(points)
        columns = dict(self.start)
        for j, coordinate in enumerate(self.free):
            moved = coordinate.moved(self.start[coordinate.name], points[:, j])
            columns[coordinate.name] = np.repeat(np.asarray(moved), n)
        try:
            state = predict(
                columns, self.data.points.tiled(count), self.changes,
                low_pass=self.data.low_pass,
                correction=self._correction(points),
            )  # fmt: skip
        except TirelibError:
            return np.full(count, np.inf)
        waves = state.wave.reshape(count, n, -1)
        depth = state.deflection.reshape(count, n)
        return np.array([self._cost(waves[i], depth[i], points[i]) for i in range(count)])

    def _cost(self, waveform: FloatArray, deflection: FloatArray, z: FloatArray) -> float:
        empty = np.zeros((0, *waveform.shape))
        linear = Linear(waveform, deflection, empty, np.zeros((0, deflection.size)))
        rest = self.whiten(self.data.strain - waveform).reshape(1, -1)
        cost = float(np.sum(rest**2) + np.sum((z / self.prior.std) ** 2))
        if self.inner is not None:
            cross = self.white_shapes @ rest[0]
            cost -= float(cross @ linalg.cho_solve(self.inner, cross))
        return cost + float(self._deflection_gram(linear)[-1, -1])
