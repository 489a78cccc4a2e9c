r"""Stiffness of ring and sidewall from many natural frequencies, by least squares on Eq. (109).

omega^2 is linear in EI, k_u and k_v, so many modes at many pressures give them by weighted linear
least squares, with intervals. See `tirelib.physics.ring.frequencies` for the model and its
validity.
"""

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt
from scipy.special import ndtri, stdtrit

from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.core.errors import ParameterError, ShapeError
from tirelib.physics.ring.frequencies import not_negative
from tirelib.physics.ring.green import positive, whole_orders

Law = Literal["constant", "linear", "each"]
_PASSES = 4
_RANK = 1e-10


@dataclass(frozen=True, slots=True)
class StiffnessFit:
    """EI and the sidewall's stiffness from natural frequencies, with what is known about them.

    Attributes
    ----------
    names : tuple of str
        Names of the parameters: bending_stiffness, then radial_stiffness and tangential_stiffness
        with .offset and .slope (per Pa) or @pressure, after the law.
    value, low, high : array, shape (p,)
        Estimate and interval; NaN and infinite where the modes do not hold the parameter at all.
    covariance : array, shape (p, p)
        Infinite variance where the value is NaN.
    identifiable : array of bool, shape (p,)
        False where half the interval exceeds `limit` of the parameter (of the stiffness at mean
        pressure, for offset and slope): such a value must not be used.
    condition : float
        Condition number of the weighted system with columns of unit length.
    freedom : int
        Observations minus parameters.
    misfit : float
        Residual over expected noise, squared, per degree of freedom; about 1 if the model and the
        given noise are right. NaN without freedom, or if the noise was estimated.
    noise : float
        Relative standard deviation of the frequencies estimated from the residuals; NaN if given.
    fitted : array, shape (m,), [rad/s]
        Frequencies of the fit; NaN where it gives a negative square.
    """

    names: tuple[str, ...]
    value: FloatArray
    low: FloatArray
    high: FloatArray
    covariance: FloatArray
    identifiable: BoolArray
    condition: float
    freedom: int
    misfit: float
    noise: float
    fitted: FloatArray


def fit_stiffness(
    order: npt.ArrayLike,
    frequency: npt.ArrayLike,
    pressure: npt.ArrayLike,
    *,
    ring_radius: float,
    belt_width: float,
    mass: float,
    law: Law = "linear",
    frequency_std: npt.ArrayLike | None = None,
    confidence: float = 0.95,
    limit: float = 0.5,
) -> StiffnessFit:
    r"""Fit EI, k_u, k_v to many modes and pressures by weighted linear least squares.

    .. math:: \rho A (1 + n^2) \omega^2 - \tfrac{p_0 b}{R} n^2 (n^2 - 1)
              = \tfrac{EI}{R^4} n^2 (n^2 - 1)^2 + k_u(p_0) n^2 + k_v(p_0)

    EI is the same at all pressures. Weights follow from the fitted frequencies, in a few passes:
    weights from the measured ones would favour those that came out low.

    Parameters
    ----------
    order, frequency, pressure : array, shape (m,), [-], [rad/s], [Pa]
        One entry per measured frequency; pressure is gauge, >= 0.
    ring_radius, belt_width, mass : float, [m], [m], [kg/m]
        R, b, rho A.
    law : {"linear", "constant", "each"}
        k_u and k_v linear in pressure, the same at all, or one value for each distinct pressure.
    frequency_std : array, shape (m,) or number, [rad/s], optional
        Known standard deviations: intervals are normal. Without: equal relative noise, estimated
        from the residuals; intervals are Student's.
    confidence : float
        Confidence level of the intervals, between 0 and 1.
    limit : float
        Half-width, relative, up to which a parameter counts as identifiable.

    Returns
    -------
    StiffnessFit

    Raises
    ------
    ParameterError
        If a value is out of range, or there are too few frequencies to estimate their noise.
    ShapeError
        If the arrays differ in length.
    """
    where = "stiffness from frequencies"
    n, omega, p, sigma = _observations(where, order, frequency, pressure, frequency_std)
    R, b, m = positive(where, ring_radius=ring_radius, belt_width=belt_width, mass=mass)
    if law not in get_args(Law):
        raise ParameterError(f"{where}: law = {law!r}; must be one of {get_args(Law)}")
    if not (0.0 < confidence < 1.0 and limit > 0.0):
        raise ParameterError(
            f"{where}: confidence = {confidence:g}, limit = {limit:g}; need 0 < confidence < 1 and "
            "limit > 0"
        )
    names, design = _design(n, p, law, float(R))
    freedom = n.size - len(names)
    if sigma is None and freedom < 1:
        raise ParameterError(
            f"{where}: {n.size} frequencies for {len(names)} parameters leave nothing to estimate "
            "the noise from; measure more modes or pressures, or give frequency_std"
        )
    inertia = m * (1.0 + n**2)
    right = inertia * omega**2 - p * b / R * n**2 * (n**2 - 1.0)
    square = omega**2  # squared frequencies by which the weights are set
    for _ in range(_PASSES):
        spread = 2.0 * inertia * (square if sigma is None else np.sqrt(square) * sigma)
        solved, cov, condition = _least_squares(design / spread[:, None], right / spread)
        rest = (right - design @ solved) / spread
        fitted = omega**2 - rest * spread / inertia
        square = np.where(fitted > 0.0, fitted, omega**2)
    misfit = float(rest @ rest) / freedom if freedom > 0 else np.nan
    level = 0.5 + 0.5 * confidence
    unknown = np.isinf(np.diag(cov))
    if sigma is None:
        cov = np.where(np.isinf(cov), cov, cov * misfit)
    wide = float(ndtri(level) if sigma is not None else stdtrit(freedom, level))
    half = np.sqrt(np.diag(cov)) * wide
    reference = np.abs(_reference(solved, law, float(p.mean())))
    return StiffnessFit(
        names,
        value=np.where(unknown, np.nan, solved),
        low=solved - half,
        high=solved + half,
        covariance=cov,
        identifiable=~unknown & (half <= limit * reference),
        condition=condition,
        freedom=freedom,
        misfit=np.nan if sigma is None else misfit,
        noise=float(np.sqrt(misfit)) if sigma is None else np.nan,
        fitted=np.sqrt(np.where(fitted > 0.0, fitted, np.nan)),
    )


def _observations(
    where: str,
    order: npt.ArrayLike,
    frequency: npt.ArrayLike,
    pressure: npt.ArrayLike,
    frequency_std: npt.ArrayLike | None,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray | None]:
    """Return checked n, omega, p and standard deviations (None if not known), shape (m,)."""
    n = whole_orders(where, order)
    (omega,) = positive(where, frequency=frequency)
    p = not_negative(where, pressure)
    if n.ndim != 1 or omega.shape != n.shape or p.shape != n.shape:
        raise ShapeError(
            f"{where}: order has shape {n.shape}, frequency {omega.shape}, pressure {p.shape}; "
            "one entry per measured frequency in each"
        )
    if frequency_std is None:
        return n, omega, p, None
    (sigma,) = positive(where, frequency_std=frequency_std)
    return n, omega, p, np.broadcast_to(sigma, n.shape)


def _design(n: FloatArray, p: FloatArray, law: Law, R: float) -> tuple[tuple[str, ...], FloatArray]:
    """Return parameter names and the columns that multiply them."""
    if law == "constant":
        tails, basis = [""], np.ones((n.size, 1))
    elif law == "linear":
        tails, basis = [".offset", ".slope"], np.stack((np.ones(n.size), p), axis=1)
    else:
        pressures = np.unique(p)
        tails = [f"@{value:g}" for value in pressures]
        basis = (p[:, None] == pressures).astype(np.float64)
    names = ["bending_stiffness"]
    names += [f"{k}{tail}" for k in ("radial_stiffness", "tangential_stiffness") for tail in tails]
    bending = n**2 * (1.0 - n**2) ** 2 / R**4
    columns = (bending[:, None], (n**2)[:, None] * basis, basis)
    return tuple(names), np.concatenate(columns, axis=1)


def _least_squares(A: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """Return solution, covariance for unit noise, condition number of unit columns.

    A parameter with a part in the null space has an infinite variance.
    """
    norms = np.linalg.norm(A, axis=0)
    scale = np.where(norms > 0.0, norms, 1.0)
    left, s, right = np.linalg.svd(A / scale, full_matrices=True)
    size = A.shape[1]
    values = np.zeros(size)
    values[: s.size] = s
    held = values > _RANK * values[0]
    inverse = np.where(held, 1.0 / np.where(held, values, 1.0), 0.0)
    x = right.T @ (inverse * np.pad(left.T @ y, (0, max(size - y.size, 0)))[:size]) / scale
    cov = (right.T * inverse**2) @ right / np.outer(scale, scale)
    lost = (right[~held] ** 2).sum(axis=0) > _RANK
    cov[lost, lost] = np.inf
    condition = float(values[0] / values[-1]) if held.all() else float("inf")
    return x, cov, condition


def _reference(solved: FloatArray, law: Law, mean: float) -> FloatArray:
    """Return the size by which the interval of each parameter is judged."""
    if law != "linear":
        return solved
    k_u, k_v = solved[1] + solved[2] * mean, solved[3] + solved[4] * mean
    per_pressure = 1.0 / mean if mean > 0.0 else np.inf
    return np.array([solved[0], k_u, k_u * per_pressure, k_v, k_v * per_pressure])
