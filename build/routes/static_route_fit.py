"""A few parameters by least squares, with everything that must be said beside each number."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ConvergenceError

TOLD = 0.6
"""Share of the prior's deviation below which the data have told something."""
WIDEST = 0.3
"""Relative half-width of a 95 % interval up to which a number is called identifiable."""
LEVEL = 3.84
"""Rise of the cost (in variances) at the ends of a 95 % interval."""
PARAMETER_STEP = 1e-5
"""Step of difference quotients, in coordinates."""
UNEVEN = 0.3
"""Departure of a profile from the parabola, relative, from which it is called not quadratic."""


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter of a fit.

    Attributes
    ----------
    name, unit : str
        SI.
    start, lowest, highest : float
    scaled : bool
        Moves by factors (positive numbers), else by differences.
    prior_std : float
        Deviation of the logarithm for scaled ones, about the start; infinite is no prior.
    """

    name: str
    unit: str
    start: float
    lowest: float
    highest: float
    scaled: bool = True
    prior_std: float = np.inf

    def inward(self, value: float) -> float:
        """Return the coordinate that a fit moves."""
        return float(np.log(value)) if self.scaled else value

    def outward(self, coordinate: float) -> float:
        """Return the value of a coordinate."""
        return float(np.exp(coordinate)) if self.scaled else coordinate


@dataclass(frozen=True, slots=True)
class Quantity:
    """One number of a result, SI.

    Attributes
    ----------
    name, unit : str
    value, std : float
    low, high : float
        95 % interval.
    flags : tuple of str
        at_boundary, not_identifiable, not_quadratic.
    """

    name: str
    unit: str
    value: float
    std: float
    low: float
    high: float
    flags: tuple[str, ...] = ()

    @classmethod
    def of(cls, name: str, unit: str, value: float, std: float, *flags: str) -> "Quantity":
        """Return a number with a normal deviation."""
        return cls(name, unit, value, std, value - 1.96 * std, value + 1.96 * std, flags)


@dataclass(frozen=True, slots=True)
class FewFit:
    """Result of `fit_few`.

    Attributes
    ----------
    parameters : tuple of Parameter
    x : shape (n,)
        Coordinates at the solution.
    covariance, correlation : shape (n, n)
        Covariance and correlation of the coordinates.
    residual : shape (m,)
        At the solution, in standard deviations, without priors.
    cost : float
        Sum of squares, priors included.
    jacobian : shape (m, n)
        Slopes of the residuals, without priors.
    inverse : shape (n, n)
        Inverse of the normal matrix, priors included.
    """

    parameters: tuple[Parameter, ...]
    x: FloatArray
    covariance: FloatArray
    residual: FloatArray
    cost: float
    jacobian: FloatArray
    inverse: FloatArray

    @property
    def correlation(self) -> FloatArray:
        """Correlation of the coordinates, shape (n, n)."""
        deviation = np.sqrt(np.diag(self.covariance))
        out: FloatArray = self.covariance / np.outer(deviation, deviation)
        return out

    @property
    def values(self) -> dict[str, float]:
        """Values by name."""
        pairs = zip(self.parameters, self.x, strict=True)
        return {p.name: p.outward(float(x)) for p, x in pairs}

    def widened(self, common: FloatArray) -> "FewFit":
        """Return the fit with what inputs that all residuals share add to its covariance.

        Parameters
        ----------
        common : shape (k, m)
            Changes of the residuals by one deviation of each input.
        """
        moved = self.inverse @ self.jacobian.T @ common.T
        return replace(self, covariance=self.covariance + moved @ moved.T)

    def quantities(self) -> tuple[Quantity, ...]:
        """Return the numbers with deviations, intervals and flags."""
        return tuple(self._quantity(k) for k in range(len(self.parameters)))

    def _quantity(self, k: int) -> Quantity:
        p, x = self.parameters[k], float(self.x[k])
        std = float(np.sqrt(self.covariance[k, k]))
        value = p.outward(x)
        spread = value * std if p.scaled else std
        ends = (p.outward(x - 1.96 * std), p.outward(x + 1.96 * std))
        flags = _flags(p, x, std, ends)
        return Quantity(p.name, p.unit, value, spread, ends[0], ends[1], flags)


def fit_few(
    residual: Callable[[FloatArray], FloatArray],
    parameters: tuple[Parameter, ...],
    *,
    where: str,
    free_scale: bool = False,
    common: FloatArray | None = None,
    begin: FloatArray | None = None,
) -> FewFit:
    """Fit parameters to residuals in standard deviations.

    Parameters
    ----------
    residual : callable
        From values (n,), in the order of `parameters`, to residuals (m,).
    where : str
        For messages.
    free_scale : bool
        Estimate the residuals' deviation from the fit (no deviation is known beforehand).
    common : shape (k, m), optional
        Changes of the residuals by one deviation of inputs that all share; they widen intervals.
    begin : shape (n,), optional
        Values to begin with; the priors stand about the parameters' own start values.

    Raises
    ------
    ConvergenceError
        If the steps do not settle; carries the last coordinates.
    """
    start = np.array([p.inward(p.start) for p in parameters])
    low = np.array([p.inward(p.lowest) for p in parameters])
    high = np.array([p.inward(p.highest) for p in parameters])
    weight = np.array([1.0 / p.prior_std for p in parameters])
    informed = weight > 0.0
    first = start
    if begin is not None:
        first = np.array([p.inward(float(v)) for p, v in zip(parameters, begin, strict=True)])

    def everything(x: FloatArray) -> FloatArray:
        values = np.array([p.outward(float(c)) for p, c in zip(parameters, x, strict=True)])
        return np.concatenate([residual(values), ((x - start) * weight)[informed]])

    def slopes(x: FloatArray) -> FloatArray:
        return _slopes(everything, x, high)

    span = 1e-6 * (high - low)
    found = least_squares(
        everything,
        np.clip(first, low + span, high - span),
        bounds=(low, high),
        jac=slopes,
        x_scale=1.0 / np.maximum(weight, 1.0),
        max_nfev=60,
        xtol=1e-5,
        ftol=1e-6,
        gtol=1e-8,
    )
    if found.status <= 0:
        raise ConvergenceError(
            f"{where}: no minimum after {found.nfev} steps, cost {2 * found.cost:.4g}; give start "
            "values nearer to the tire, or fewer free parameters",
            found.x,
            float(2 * found.cost),
        )
    n_data = found.fun.size - int(informed.sum())
    whole = np.asarray(found.jac, dtype=float)
    rest, jacobian = found.fun[:n_data], whole[:n_data]
    scale = 1.0
    if free_scale:
        scale = float(np.sum(rest**2)) / max(n_data - len(parameters), 1)
    normal = whole.T @ whole
    inverse = np.linalg.pinv(normal, rcond=1e-14, hermitian=True)
    fit = FewFit(
        parameters, found.x, scale * inverse, rest, float(2.0 * found.cost), jacobian, inverse
    )
    return fit if common is None else fit.widened(common)


def profile(
    fit: FewFit,
    residual: Callable[[FloatArray], FloatArray],
    name: str,
    *,
    scale: float = 1.0,
    where: str = "profile",
) -> Quantity:
    """Return a parameter's 95 % interval from the cost with the others fitted anew at each value.

    An end that the cost does not reach within the parameter's bounds stands at the bound, with the
    flag not_identifiable; a profile that is no parabola has the flag not_quadratic.

    Parameters
    ----------
    scale : float
        Variance of the residuals.
    """
    k = [p.name for p in fit.parameters].index(name)
    p, at = fit.parameters[k], float(fit.x[k])
    std = max(float(np.sqrt(fit.covariance[k, k])), 1e-6)
    ends: list[float] = []
    flags: list[str] = []
    for sign, bound in ((-1.0, p.inward(p.lowest)), (1.0, p.inward(p.highest))):
        end, open_, bent = _walk(fit, residual, k, at, sign * std, bound, scale, where)
        ends.append(end)
        flags += ["not_identifiable"] * open_ + ["not_quadratic"] * bent
    values = [p.outward(e) for e in ends]
    value = p.outward(at)
    flags += list(_flags(p, at, (ends[1] - ends[0]) / 3.92, (values[0], values[1])))
    spread = (values[1] - values[0]) / 3.92
    return Quantity(
        p.name, p.unit, value, spread, values[0], values[1], tuple(dict.fromkeys(flags))
    )


def _walk(
    fit: FewFit,
    residual: Callable[[FloatArray], FloatArray],
    k: int,
    at: float,
    std: float,
    bound: float,
    scale: float,
    where: str,
) -> tuple[float, bool, bool]:
    """Go outward until the cost has risen enough; return the end, if it is open, if it is bent."""
    before, risen_before, bent = at, 0.0, False
    here = at
    for factor in (1.0, 2.0, 4.0, 8.0, 16.0, np.inf):
        here = float(np.clip(at + factor * std, min(at, bound), max(at, bound)))
        risen = max((_held(fit, residual, k, here, where) - fit.cost) / scale, 0.0)
        expected = ((here - at) / std) ** 2
        if factor == 1.0 and abs(here - at) > 0.5 * abs(std):
            bent = bool(abs(risen / expected - 1.0) > UNEVEN)
        if risen >= LEVEL:
            a, b = np.sqrt(risen_before), np.sqrt(risen)
            share = (np.sqrt(LEVEL) - a) / (b - a)
            return float(before + share * (here - before)), False, bent
        if here == bound:
            return here, True, bent
        before, risen_before = here, risen
    return here, True, bent


def _held(
    fit: FewFit, residual: Callable[[FloatArray], FloatArray], k: int, at: float, where: str
) -> float:
    """Return the cost with one coordinate held and the others fitted."""
    p = fit.parameters[k]
    others = [j for j in range(len(fit.parameters)) if j != k]
    rest = tuple(fit.parameters[j] for j in others)
    start = fit.x[others]
    prior = (at - p.inward(p.start)) / p.prior_std

    def inner(values: FloatArray) -> FloatArray:
        return residual(np.insert(values, k, p.outward(at)))

    low = np.array([q.inward(q.lowest) for q in rest])
    high = np.array([q.inward(q.highest) for q in rest])
    centre = np.array([q.inward(q.start) for q in rest])
    weight = np.array([1.0 / q.prior_std for q in rest])

    def everything(x: FloatArray) -> FloatArray:
        values = np.array([q.outward(float(c)) for q, c in zip(rest, x, strict=True)])
        return np.concatenate([inner(values), (x - centre) * weight])

    def slopes(x: FloatArray) -> FloatArray:
        return _slopes(everything, x, high)

    span = 1e-9 * (high - low)
    found = least_squares(
        everything,
        np.clip(start, low + span, high - span),
        bounds=(low, high),
        max_nfev=12,
        jac=slopes,
        xtol=1e-5,
        ftol=1e-6,
    )
    return float(2.0 * found.cost + prior**2)


def _slopes(
    residual: Callable[[FloatArray], FloatArray], x: FloatArray, high: FloatArray
) -> FloatArray:
    """Return difference quotients, inward where a bound is near."""
    base = residual(x)
    out = np.empty((base.size, x.size))
    for k in range(x.size):
        step = PARAMETER_STEP if x[k] + PARAMETER_STEP <= high[k] else -PARAMETER_STEP
        moved = x.copy()
        moved[k] += step
        out[:, k] = (residual(moved) - base) / step
    return out


def _flags(p: Parameter, x: float, std: float, ends: tuple[float, float]) -> tuple[str, ...]:
    flags: list[str] = []
    low, high = p.inward(p.lowest), p.inward(p.highest)
    edge = 2e-3 * (high - low)
    if x < low + edge or x > high - edge:
        flags.append("at_boundary")
    untold = np.isfinite(p.prior_std) and std > TOLD * p.prior_std
    wide = p.scaled and 0.5 * (ends[1] - ends[0]) > WIDEST * p.outward(x)
    if untold or wide:
        flags.append("not_identifiable")
    return tuple(flags)
