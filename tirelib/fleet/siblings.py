"""Tires of one size in one hierarchical fit: a tire with few runs borrows from its siblings.

Each number of a tire is one of a population, ``theta_i ~ N(mu, tau^2)``, and was identified as
``y_i ~ N(theta_i, s_i^2)``. Mean and scatter of the population are unknown and are integrated
out, tau on a grid, with flat priors on both (A. Gelman, Bayesian Analysis 1 (2006) 515). Numbers
that are positive are taken as logarithms. The correlations between the numbers of one tire are not
used.
"""

from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import FloatArray

FEWEST_SIBLINGS = 4
"""Tires that can be siblings: with a flat prior three leave the scatter without an upper bound."""
POINTS = 200
WIDEST = 10.0
"""Largest scatter on the grid, in standard deviations of the values. With half of it the joined
numbers of five tires move by 0.08 of their standard deviation at most, with double by 0.04
(``python build/fleet_constants.py``)."""


@dataclass(frozen=True, slots=True, eq=False)
class Joined:
    """Numbers of several tires after the join, in the unit of the values.

    Attributes
    ----------
    value, low, high : array, shape (n,)
        With 95 % intervals.
    gain : array, shape (n,)
        Ratio of the standard deviation before to that after; its square is the factor of runs that
        the siblings are worth.
    mean, scatter : float
        Mean and scatter of the population; the scatter is relative where numbers are logarithms.
    """

    value: FloatArray
    low: FloatArray
    high: FloatArray
    gain: FloatArray
    mean: float
    scatter: float


def join(values: FloatArray, stds: FloatArray) -> Joined | None:
    """Return the numbers of tires after the join; None with too few of them.

    Parameters
    ----------
    values, stds : array, shape (n,)
        One number of each tire, finite, with its own standard deviation above zero.
    """
    if values.size < FEWEST_SIBLINGS:
        return None
    positive = bool((values > 0.0).all())
    y = np.log(values) if positive else values
    s = stds / values if positive else stds
    mean, std, centre, scatter = _posterior(y, s)
    back = np.exp if positive else _same
    return Joined(
        back(mean),
        back(mean - 1.96 * std),
        back(mean + 1.96 * std),
        s / std,
        float(back(np.array(centre))),
        scatter,
    )


def _same(values: FloatArray) -> FloatArray:
    return values


def _posterior(y: FloatArray, s: FloatArray) -> tuple[FloatArray, FloatArray, float, float]:
    """Return mean and standard deviation of each theta, of mu its mean, of tau its mean."""
    widest = WIDEST * max(float(np.std(y, ddof=1)), float(s.min()))
    tau = widest * (np.arange(POINTS) + 0.5) ** 2 / POINTS**2  # denser where it is small
    width = np.gradient(tau)
    variance = s**2 + tau[:, None] ** 2
    weight = 1.0 / variance
    total = weight.sum(axis=1)
    mu = (weight * y).sum(axis=1) / total
    log = -0.5 * (np.log(variance) + weight * (y - mu[:, None]) ** 2).sum(axis=1)
    log += -0.5 * np.log(total) + np.log(width)
    p = np.exp(log - log.max())
    p /= p.sum()
    share = tau[:, None] ** 2 / variance  # how much each tire is believed itself
    mean = share * y + (1.0 - share) * mu[:, None]
    spread = share * s**2 + (1.0 - share) ** 2 / total[:, None]
    middle = p @ mean
    std = np.sqrt(p @ spread + p @ (mean - middle) ** 2)
    return middle, std, float(p @ mu), float(p @ tau)
