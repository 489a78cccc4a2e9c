"""Sectors of the wheel turn by the model's contact, and the table of differences in them."""

from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray, IntArray
from tirelib.inference.compare.runs import Factor
from tirelib.inference.compare.set_points import SetPoints
from tirelib.inference.identify.noise import RepeatNoise
from tirelib.measured.waveforms import GRID

SECTORS = (
    "contact",
    "entry edge",
    "exit edge",
    "entry flank",
    "exit flank",
    "far side",
)
BOUNDS = (0.7, 1.3, 3.0)
"""Ends of contact, edge and flank, in half contact angles."""


def sectors_of(edges: FloatArray) -> IntArray:
    """Return the sector of every angle of `GRID` as its number in `SECTORS`, (n_runs, n_phi).

    Parameters
    ----------
    edges : shape (n_runs, 2), [rad]
        Entry < 0 < exit.
    """
    return sector_at(GRID / np.where(GRID < 0.0, -edges[:, :1], edges[:, 1:]))


def sector_at(x: FloatArray) -> IntArray:
    """Return the number in `SECTORS` of angles in units of the half contact on their side."""
    size = np.abs(x)
    exit_side = (x > 0.0).astype(np.int64)
    inner, edge, flank = BOUNDS
    conditions = [size <= inner, size <= edge, size <= flank]
    numbers = [np.zeros_like(exit_side), 1 + exit_side, 3 + exit_side]
    return np.asarray(np.select(conditions, numbers, 5), dtype=np.int64)


@dataclass(frozen=True, slots=True)
class Cell:
    """Difference, model less measured, in one sector at one level of a condition.

    Attributes
    ----------
    by : str
        Condition, or "all".
    value : float
        Value of the level, SI; NaN for "all".
    rms, mean : float, [-]
    std : float, [-]
        Standard deviation of the mean, from repeats and set points; NaN without repeats.
    """

    by: str
    value: float
    sector: str
    runs: int
    rms: float
    mean: float
    std: float


def cells(
    difference: FloatArray,
    sector: IntArray,
    counted: BoolArray,
    factors: tuple[Factor, ...],
    noise: RepeatNoise,
    points: SetPoints,
) -> tuple[Cell, ...]:
    """Return the table: every sector, over all counted runs and at every level.

    Parameters
    ----------
    difference : shape (n_runs, n_phi), [-]
        Model less measured, set points taken out.
    sector : shape (n_runs, n_phi)
    counted : shape (n_runs,)
        Runs of the row "all".
    """
    groups: list[tuple[str, float, BoolArray]] = [("all", np.nan, counted)]
    for factor in factors:
        for k, value in enumerate(factor.values):
            groups.append((factor.name, float(value), factor.level == k))
    out = []
    for number, name in enumerate(SECTORS):
        weights = (sector == number).astype(float)
        count = weights.sum(axis=1)
        weights /= np.maximum(count, 1.0)[:, None]
        mean = np.sum(weights * difference, axis=1)
        square = np.sum(weights * difference**2, axis=1)
        variance = weighted_variance(weights, noise, points)
        for by, value, member in groups:
            here = member & (count > 0)
            n = int(here.sum())
            if n:
                out.append(
                    Cell(
                        by,
                        value,
                        name,
                        n,
                        float(np.sqrt(square[here].mean())),
                        float(mean[here].mean()),
                        float(np.sqrt(variance[here].sum()) / n),
                    )
                )
    return tuple(out)


def weighted_variance(weights: FloatArray, noise: RepeatNoise, points: SetPoints) -> FloatArray:
    """Return the variance of each run's weighted sum, by noise and by its set points."""
    if not noise.known:
        return np.full(len(weights), np.nan)
    slope = np.einsum("rn,rnk->rk", weights, points.tangent, optimize=True)
    by_points = np.einsum("rk,rkl,rl->r", slope, points.covariance, slope)
    return np.asarray(noise.variance(weights) + by_points)
