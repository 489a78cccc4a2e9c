"""The brush with some effects fitted to one force: parameters and strengths together."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from tirelib.core.arrays import BoolArray, FloatArray, IntArray
from tirelib.core.errors import ConvergenceError, TirelibError
from tirelib.effects import Effect
from tirelib.inference.identify.brush_law import SPECS
from tirelib.inference.identify.force_bench import Changes, ForceBench
from tirelib.inference.problems.forces import WIDTH, changes_at, fitted_constants, moved_constants

BEYOND = 0.5
"""Share of its range by which a strength may leave it in a fit."""
MISFIT = 0.02
"""Part of the measured rms that counts as noise of the brush itself when residuals are scaled."""
START_SHARE = 0.3
"""Start of a strength, as a share of either end of where it may lie."""
COORDINATE_STEP = 1e-5
"""Move of a coordinate by which slopes are taken."""
MOST_STEPS = 60
"""Steps of a fit, after which it is given up."""


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredForce:
    """One measured force at points, and the bench that predicts it.

    Attributes
    ----------
    quantity : str
        Fy, Fx or Mz.
    measured : shape (n,), [N] or [N m]
    scale : float
        By which residuals are divided.
    """

    bench: ForceBench
    quantity: str
    measured: FloatArray
    scale: float

    @classmethod
    def of(cls, bench: ForceBench, quantity: str, noise: float) -> "MeasuredForce":
        """Return one force of the bench's points; `noise` may be NaN."""
        measured = getattr(bench.points.data, quantity)
        size = MISFIT * float(np.sqrt(np.mean(measured**2)))
        scale = float(np.hypot(size, noise if np.isfinite(noise) else 0.0))
        return cls(bench, quantity, measured, max(scale, 1e-9))

    @property
    def block(self) -> IntArray:
        """Points whose errors may go together, (n,)."""
        return self.bench.points.data.block

    def __len__(self) -> int:
        return int(self.measured.size)

    def take(self, chosen: IntArray | BoolArray) -> "MeasuredForce":
        """Return some of the points, with the same scale."""
        return replace(self, bench=self.bench.take(chosen), measured=self.measured[chosen])

    def predict(self, values: Mapping[str, float], changes: Changes) -> FloatArray:
        """Return the force at the points."""
        found: FloatArray = getattr(self.bench.forces(values, changes), self.quantity)
        return found

    @property
    def names(self) -> tuple[str, ...]:
        """Parameters that are fitted."""
        return fitted_constants(self.bench, self.quantity)


@dataclass(frozen=True, slots=True, eq=False)
class ForceFit:
    """A fitted brush.

    Attributes
    ----------
    values : mapping
        Parameters of the brush, SI.
    strengths : tuple of array
        One array of components per effect.
    predicted : shape (n,)
    slopes : shape (p, n)
        By parameters (logarithms, or over their size) and by strengths over their range.
    covariance : shape (p, p)
        Covariance of these numbers, with errors that go together within a block.
    error : float
        Rms of measured less predicted, [N] or [N m].
    """

    values: Mapping[str, float]
    effects: tuple[Effect, ...]
    strengths: tuple[FloatArray, ...]
    predicted: FloatArray
    slopes: FloatArray
    covariance: FloatArray
    error: float
    names: tuple[str, ...]

    @property
    def changes(self) -> Changes:
        """The effects at their strengths."""
        return changes_at(self.effects, self.strengths)

    def strength_std(self, index: int) -> FloatArray:
        """Return standard deviations of an effect's strength, in its unit."""
        first = len(self.names) + sum(effect.components for effect in self.effects[:index])
        effect = self.effects[index]
        rows = slice(first, first + effect.components)
        deviation: FloatArray = effect.scale * np.sqrt(np.diag(self.covariance)[rows])
        return deviation

    def value_std(self, name: str) -> float:
        """Return the standard deviation of a fitted parameter, SI."""
        at = self.names.index(name)
        unit = self.values[name] if SPECS[name].log else SPECS[name].size
        return float(abs(unit) * np.sqrt(self.covariance[at, at]))


def fit_force(
    problem: MeasuredForce,
    values: Mapping[str, float],
    effects: Sequence[Effect] = (),
    strengths: Sequence[FloatArray] = (),
) -> ForceFit:
    """Fit parameters and strengths to one force.

    Parameters
    ----------
    values : mapping
        Start, and the parameters that stay.
    effects, strengths
        Effects of the model and their start strengths.

    Raises
    ------
    ConvergenceError
        If the fit does not settle.
    ParameterError
        If an effect cannot be computed at the points.
    """
    names, chosen = problem.names, tuple(effects)
    scale = np.concatenate([np.ones(len(names)), *[np.full(e.components, e.scale) for e in chosen]])
    first = [np.zeros(e.components) for e in chosen] if not strengths else list(strengths)
    start = np.concatenate([np.zeros(len(names)), *first]) / scale
    low, high = _bounds(problem, values, names, chosen, scale)
    start = np.clip(start, low + 1e-9, high - 1e-9)

    def split(z: FloatArray) -> tuple[FloatArray, ...]:
        flat = (z * scale)[len(names) :]
        cuts = np.cumsum([e.components for e in chosen])[:-1]
        return tuple(np.split(flat, cuts)) if chosen else ()

    def predicted(z: FloatArray) -> FloatArray:
        at = moved_constants(values, names, z[: len(names)])
        return problem.predict(at, changes_at(chosen, split(z)))

    def residual(z: FloatArray) -> FloatArray:
        rest = (predicted(z) - problem.measured) / problem.scale
        return np.concatenate([rest, z / WIDTH])

    def slopes(z: FloatArray) -> FloatArray:
        here = predicted(z)
        rows = []
        for k in range(z.size):
            step = np.zeros_like(z)
            step[k] = COORDINATE_STEP if z[k] + COORDINATE_STEP < high[k] else -COORDINATE_STEP
            rows.append((predicted(z + step) - here) / step[k])
        return np.stack(rows)

    def jacobian(z: FloatArray) -> FloatArray:
        return np.concatenate([slopes(z).T / problem.scale, np.eye(z.size) / WIDTH])

    found = least_squares(
        residual,
        start,
        jacobian,
        bounds=(low, high),
        xtol=1e-8,
        ftol=1e-9,
        gtol=1e-9,
        max_nfev=MOST_STEPS,
    )
    if found.status == 0:
        raise ConvergenceError(
            f"brush with {', '.join(e.name for e in chosen) or 'no effect'}: the fit does not "
            f"settle in {MOST_STEPS} steps; the model does not fit these data: look at them with "
            "`tirelib compare`",
            moved_constants(values, names, found.x[: len(names)]),
            float(found.optimality),
        )
    z = np.asarray(found.x, dtype=np.float64)
    here, rows = predicted(z), slopes(z)
    rest = problem.measured - here
    return ForceFit(
        moved_constants(values, names, z[: len(names)]),
        chosen,
        split(z),
        here,
        rows,
        _covariance(rows / problem.scale, rest / problem.scale, problem.block),
        float(np.sqrt(np.mean(rest**2))),
        names,
    )


def with_effect(problem: MeasuredForce, model: ForceFit, effect: Effect) -> ForceFit:
    """Return the fit with one effect more: the better of two starts, one to each side.

    Raises
    ------
    TirelibError
        If neither settles.
    """
    found, troubles = [], []
    for end in dict.fromkeys(room(problem, model.values, effect)):
        start = np.full(effect.components, START_SHARE * end)
        both = [*model.effects, effect], [*model.strengths, start]
        try:
            found.append(fit_force(problem, model.values, *both))
        except TirelibError as error:
            troubles.append(error)
    if not found:
        raise troubles[-1]
    return min(found, key=lambda fit: fit.error)


def _covariance(rows: FloatArray, rest: FloatArray, block: IntArray) -> FloatArray:
    """Return the covariance of the parameters, with errors that go together within a block."""
    p = len(rows)
    normal = rows @ rows.T + np.eye(p) / WIDTH**2
    inverse = np.linalg.inv(normal)
    number = np.asarray(np.unique(block, return_inverse=True)[1]).ravel()
    blocks = int(number.max()) + 1
    if blocks > 2 * p:
        score = np.stack([np.bincount(number, row * rest) for row in rows])
        inside = score @ score.T * blocks / (blocks - p)
    else:
        inside = rows @ rows.T * float(rest @ rest) / max(rest.size - p, 1)
    return np.asarray(inverse @ inside @ inverse, dtype=np.float64)


def _bounds(
    problem: MeasuredForce,
    values: Mapping[str, float],
    names: Sequence[str],
    effects: Sequence[Effect],
    scale: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    low, high = np.full(scale.size, -np.inf), np.full(scale.size, np.inf)
    for k, name in enumerate(names):
        spec, old = SPECS[name], values.get(name, 0.0)
        ends = np.array([spec.low, spec.high])
        low[k], high[k] = np.log(ends / old) if spec.log else (ends - old) / spec.size
        # a stored number at its bound is no reason to fail
        low[k], high[k] = min(low[k], -1e-6), max(high[k], 1e-6)
    first = len(names)
    for effect in effects:
        rows = slice(first, first + effect.components)
        ends = np.array(room(problem, values, effect)) / effect.scale
        low[rows], high[rows] = ends
        first += effect.components
    return low, high


def room(
    problem: MeasuredForce, values: Mapping[str, float], effect: Effect
) -> tuple[float, float]:
    """Return strengths between which an effect is fitted: its range, and beyond if computable."""
    ends = []
    for end, sign in ((effect.low, -1.0), (effect.high, 1.0)):
        wide = end + sign * BEYOND * effect.scale
        try:
            for k in range(effect.components):
                found = problem.predict(values, [effect.at(effect.along(k, wide))])
                if not np.isfinite(found).all():
                    wide = end
        except TirelibError:
            wide = end
        ends.append(wide)
    return ends[0], ends[1]
