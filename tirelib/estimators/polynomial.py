"""A polynomial in standardised regressors, with the covariance of its coefficients.

Predicting needs numpy only, so the same code runs in a script, in a stream and inside an FMU.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray, IntArray
from tirelib.estimators.border import Border
from tirelib.estimators.pulled import pull_share


@dataclass(frozen=True, slots=True)
class Variable:
    """One regressor, standardised: ``z = (x - centre) / scale``, all in SI."""

    name: str
    centre: float
    scale: float

    def standardise(self, x: FloatArray) -> FloatArray:
        """Return z."""
        return (x - self.centre) / self.scale


@dataclass(frozen=True, slots=True)
class Range:
    """The calibrated range of a regressor, and how far beyond it may still lie, in SI.

    `needed` is False for a condition that no model uses: then it may be unknown (NaN), but a known
    one must lie in the range all the same.
    """

    name: str
    low: float
    high: float
    slack: float
    needed: bool = True


def all_inside(ranges: tuple[Range, ...], columns: Sequence[FloatArray]) -> BoolArray:
    """Tell which rows lie in every range, shape (n,); one column of n values a range."""
    low, high, optional = _limits(ranges)
    x = np.array(columns)
    within = (x >= low) & (x <= high)
    return np.asarray((within | (optional & np.isnan(x))).all(axis=0), dtype=np.bool_)


@lru_cache(maxsize=256)
def _limits(ranges: tuple[Range, ...]) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Return lower and upper ends with their slack and what may be unknown, each (k, 1)."""
    low = np.array([[known.low - known.slack] for known in ranges])
    high = np.array([[known.high + known.slack] for known in ranges])
    return low, high, np.array([[not known.needed] for known in ranges])


@dataclass(frozen=True, slots=True)
class Cloud:
    """Combinations of two regressors that were calibrated: what lies near none of them was not.

    A combination counts as calibrated if one that was lies within `reach`, or if it lies between
    some that are within `around`: in their convex hull. Two arms of a cross, cornering and braking
    apart, so do not calibrate what lies between the arms.

    Attributes
    ----------
    names : tuple of two str
        An even and an odd regressor.
    scale : array, shape (2,), SI
        Half of each regressor's range.
    points : array, shape (m, 2), in units of `scale`
    reach, around : float
        Distances, in the same units; `around` = 0: nothing counts that lies between.
    mirrored : bool
        True: a combination was calibrated as well when its mirror image was.
    """

    names: tuple[str, str]
    scale: FloatArray
    points: FloatArray
    reach: float
    around: float = 0.0
    mirrored: bool = False

    def inside(self, values: Mapping[str, FloatArray]) -> BoolArray:
        """Tell which rows lie near calibrated combinations, or between them, shape (n,)."""
        x = np.stack([values[name] for name in self.names], axis=1) / self.scale
        points = self.points
        if self.mirrored:
            points = np.concatenate((points, points * np.array([1.0, -1.0])))
        away = points - x[:, None, :]
        square = np.einsum("ijk,ijk->ij", away, away)
        near = square.min(axis=1) <= self.reach**2
        if self.around == 0.0:
            return np.asarray(near, dtype=np.bool_)
        rows = np.flatnonzero(~near & np.isfinite(x).all(axis=1))
        near[rows] = _surrounded(away[rows], square[rows] <= self.around**2)
        return np.asarray(near, dtype=np.bool_)


def _surrounded(away: FloatArray, counts: BoolArray) -> BoolArray:
    """Tell whether the origin lies in the convex hull of the vectors that count.

    It does when no half-plane is free of them: no gap between their directions exceeds pi.

    Parameters
    ----------
    away : array, shape (n, m, 2)
    counts : bool array, shape (n, m)
    """
    angle = np.where(counts, np.arctan2(away[..., 1], away[..., 0]), np.nan)
    angle.sort(axis=1)  # what does not count comes last
    known = counts.sum(axis=1)
    last = angle[np.arange(len(angle)), np.maximum(known - 1, 0)]
    gaps = np.fmax.reduce(np.diff(angle, axis=1), axis=1, initial=0.0)
    largest = np.fmax(gaps, angle[:, 0] + 2.0 * np.pi - last)
    return np.asarray((known > 0) & (largest <= np.pi), dtype=np.bool_)


Term = tuple[int, ...]
"""Exponents of the variables, in their order."""


@dataclass(frozen=True, slots=True)
class Polynomial:
    """``y = sum of coefficient * product of z^exponent``, with Gaussian uncertainty.

    Attributes
    ----------
    variables : tuple of Variable
    terms : tuple of exponents, length k
    coefficients : array, shape (k,), in the unit of y
    covariance : array, shape (k, k), unit of y squared
    residual : float
        Standard deviation of what the polynomial leaves, unit of y, cross-validated.
    floor : float
        Standard deviation of one turn about the mean of its run, unit of y.
    border : Border or None
        Where the data end; None: not known.
    pulled : float
        Further standard deviation of a wheel that is braked or driven, unit of y.
    """

    variables: tuple[Variable, ...]
    terms: tuple[Term, ...]
    coefficients: FloatArray
    covariance: FloatArray
    residual: float
    floor: float
    border: Border | None = None
    pulled: float = 0.0

    def design(self, values: Mapping[str, FloatArray]) -> FloatArray:
        """Return the terms' values, shape (n, k)."""
        return design(self.variables, self.terms, values)

    def predict(self, values: Mapping[str, FloatArray]) -> tuple[FloatArray, FloatArray]:
        """Return value and standard deviation (one turn), each of shape (n,)."""
        value, std, _ = self.judge(values)
        return value, std

    def judge(self, values: Mapping[str, FloatArray]) -> tuple[FloatArray, FloatArray, BoolArray]:
        """Return value, standard deviation (one turn) and whether a row lies near the data.

        A row is near that lies no further from the data than held-out ones did; each of shape (n,).
        """
        x = self.design(values)
        uncertain = leverage(x, self.covariance)
        near = np.ones(uncertain.shape, dtype=np.bool_)
        if self.border is not None:
            near = np.asarray(uncertain <= self.border.far, dtype=np.bool_)
            uncertain = self.border.grown(uncertain)
        if self.pulled:
            uncertain = uncertain + self.pulled**2 * pull_share(values["traction"])
        std = np.sqrt(self.residual**2 + self.floor**2 + uncertain)
        return x @ self.coefficients, std, near

    def slope(self, values: Mapping[str, FloatArray], name: str) -> FloatArray:
        """Return the derivative of y by the regressor `name`, shape (n,), unit of y per SI."""
        index = [variable.name for variable in self.variables].index(name)
        lowered = exponents(self.terms).copy()
        factor = lowered[:, index] / self.variables[index].scale
        lowered[:, index] = np.maximum(lowered[:, index] - 1, 0)
        return _products(self.variables, lowered, values) @ (factor * self.coefficients)

    def names(self) -> list[str]:
        """Return a readable name of each term."""
        return [term_name(self.variables, term) for term in self.terms]


def design(
    variables: Sequence[Variable], terms: Sequence[Term], values: Mapping[str, FloatArray]
) -> FloatArray:
    """Return the terms' values for each row, shape (n, k)."""
    return _products(variables, exponents(tuple(terms)), values)


@lru_cache(maxsize=256)
def exponents(terms: tuple[Term, ...]) -> IntArray:
    """Return the exponents as a matrix, shape (k, n_variables); not to be written to."""
    return np.asarray(terms, dtype=np.int64).reshape(len(terms), -1)


def _products(
    variables: Sequence[Variable], powers_of: IntArray, values: Mapping[str, FloatArray]
) -> FloatArray:
    """Multiply the standardised variables, each to its power; shape (n, k)."""
    n, count = next(iter(values.values())).shape[0], len(variables)
    powers = np.ones((n, count, int(powers_of.max(initial=0)) + 1))
    if count:
        x = np.array([values[variable.name] for variable in variables]).T
        centre = np.array([variable.centre for variable in variables])
        scale = np.array([variable.scale for variable in variables])
        powers[:, :, 1:] = ((x - centre) / scale)[:, :, None]
    np.multiply.accumulate(powers, axis=2, out=powers)
    products = np.multiply.reduce(powers[:, np.arange(count), powers_of], axis=2)
    return np.asarray(products, dtype=np.float64)


def leverage(x: FloatArray, covariance: FloatArray) -> FloatArray:
    """Return the variance that uncertain coefficients leave in each row's value, shape (n,)."""
    return np.asarray(np.einsum("ij,ij->i", x @ covariance, x), dtype=np.float64)


def term_name(variables: Sequence[Variable], term: Term) -> str:
    """Return a term's name, for example ``contact_angle^2 pressure``."""
    parts = [
        v.name if e == 1 else f"{v.name}^{e}" for v, e in zip(variables, term, strict=True) if e
    ]
    return " ".join(parts) or "constant"
