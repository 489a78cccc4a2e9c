"""Where the model and the measurement differ: angles and conditions, each tested against repeats.

Every interval of the wheel turn and every one-sided range of a condition is a candidate. Its mean
difference d over runs and angles is tested by t = d / std(d) with the repeats' degrees of freedom;
the level is divided by the number of candidates. Those that pass stand in the order of the squares
that they hold, each clear of the ones before it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import special

from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.inference.compare.runs import Factor
from tirelib.inference.compare.set_points import SetPoints
from tirelib.inference.identify.noise import RepeatNoise
from tirelib.measured.waveforms import GRID

LEVEL = 0.01
"""Chance of one false statement or more when only noise and set points differ."""
MOST_REGIONS = 6
LEAST_SHARE = 0.02
"""Share of the differences' squares below which a region is not worth a sentence."""
LEAST_RUNS = 2
WIDEST = 14
"""Bins in the longest interval."""
SLIPS = ("slip_angle", "camber", "slip_ratio")


@dataclass(frozen=True, slots=True)
class Region:
    """Angles and runs in which the model differs from the measurement.

    Attributes
    ----------
    start, stop : float, [rad]
    by : str
        Condition that bounds it, or "all".
    side : str
        "above", "below" or "".
    value : float
        Least (above) or largest (below) value of the condition, SI; NaN for "all".
    mean : float, [-]
        Model less measured.
    std : float, [-]
    p : float
        Chance that noise and set points alone give such a difference somewhere.
    share : float
        Share of the squares of all differences.
    measured : float, [-]
        Mean measured strain there.
    member : shape (n_runs,)
    """

    start: float
    stop: float
    by: str
    side: str
    value: float
    runs: int
    mean: float
    std: float
    p: float
    share: float
    measured: float
    member: BoolArray


def bin_edges() -> FloatArray:
    """Return the ends of the angle bins: 0.05 rad near the contact, wider far from it."""
    near = np.linspace(0.0, 0.5, 11)
    middle = np.linspace(0.6, 1.2, 7)
    far = np.linspace(1.5, np.pi, 6)
    half = np.concatenate([near, middle, far])
    return np.concatenate([-half[:0:-1], half])


@dataclass(frozen=True, slots=True)
class _Subset:
    by: str
    side: str
    value: float
    member: BoolArray


def subsets(counted: BoolArray, factors: Sequence[Factor]) -> list[_Subset]:
    """Return all counted runs, and those above and below each level of each condition.

    Signed slips give the ranges away from zero on either side; with them alone there is no subset
    of all runs.
    """
    every = _Subset("all", "", np.nan, counted)
    out = [] if factors and all(factor.name in SLIPS for factor in factors) else [every]
    for factor in factors:
        signed = factor.name in SLIPS
        for k, value in enumerate(factor.values):
            known = factor.level >= 0
            if k > 0 and not (signed and value <= 0.0):
                out.append(_Subset(factor.name, "above", float(value), factor.level >= k))
            if k < factor.values.size - 1 and not (signed and value >= 0.0):
                low = known & (factor.level <= k)
                out.append(_Subset(factor.name, "below", float(value), low))
    return [subset for subset in out if subset.member.sum() >= LEAST_RUNS]


def find_regions(
    difference: FloatArray,
    strain: FloatArray,
    counted: BoolArray,
    factors: Sequence[Factor],
    noise: RepeatNoise,
    points: SetPoints,
) -> tuple[Region, ...]:
    """Return the regions that stand out, the largest first; none without repeats.

    Parameters
    ----------
    difference : shape (n_runs, n_phi), [-]
        Model less measured, set points taken out.
    strain : shape (n_runs, n_phi), [-]
        Measured.
    counted : shape (n_runs,)
    """
    if not noise.known:
        return ()
    groups = subsets(counted, factors)
    if not groups:
        return ()
    starts, stops, weights = _intervals()
    mean = difference @ weights.T
    slope = np.einsum("kn,rnj->rkj", weights, points.tangent, optimize=True)
    variance = noise.variance(weights) + np.einsum(
        "rki,rij,rkj->rk", slope, points.covariance, slope, optimize=True
    )
    members = np.stack([group.member for group in groups]).astype(float)
    count = members.sum(axis=1)[:, None]
    of_group = members @ mean / count
    std = np.sqrt(members @ variance) / count
    t = np.abs(of_group) / std
    p = np.minimum(2.0 * special.stdtr(noise.local_freedom, -t) * t.size, 1.0)
    samples = (weights > 0).sum(axis=1)[None, :] * count
    total = float(np.sum(difference[members.any(axis=0)] ** 2))
    share = of_group**2 * samples / max(total, 1e-300)
    good = (p < LEVEL) & (share >= LEAST_SHARE)
    out: list[Region] = []
    order = np.argsort(np.where(good, -share, np.inf), axis=None, kind="stable")
    for flat in order[: int(good.sum())]:
        g, k = np.unravel_index(flat, good.shape)
        if len(out) == MOST_REGIONS:
            break
        group = groups[int(g)]
        start, stop = float(starts[k]), float(stops[k])
        if any(
            start < other.stop - 1e-9
            and stop > other.start + 1e-9
            and (group.member & other.member).any()
            for other in out
        ):
            continue
        out.append(
            Region(
                start,
                stop,
                group.by,
                group.side,
                group.value,
                int(count[g, 0]),
                float(of_group[g, k]),
                float(std[g, k]),
                float(p[g, k]),
                float(share[g, k]),
                float(np.mean(strain[group.member] @ weights[k])),
                group.member,
            )
        )
    return tuple(out)


def _intervals() -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return start, stop and weights (n_intervals, n_phi) of all intervals of the turn."""
    ends = bin_edges()
    starts, stops, rows = [], [], []
    for i in range(ends.size - 1):
        for j in range(i + 1, min(i + 1 + WIDEST, ends.size)):
            inside = (ends[i] <= GRID) & (ends[j] > GRID)
            if inside.any():
                starts.append(ends[i])
                stops.append(ends[j])
                rows.append(inside / inside.sum())
    return np.array(starts), np.array(stops), np.array(rows, dtype=float)
