"""Tires side by side: which one stands out, and which one changes with time.

A value stands out when it lies farther from the others than its own interval and the scatter of
the tires explain. A change counts when the line over time is steeper than the scatter about it
explains. Both are tested once over everything that a page shows, at one false-alarm level.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtr, stdtrit

from tirelib.core.arrays import BoolArray, FloatArray

FALSE_ALARM = 0.05
"""Chance that a page of tires that differ by chance alone marks any value as standing out, and the
same for changes. Among 200 pages of 12 equal tires 7 % mark one; with half of this chance 3.5, with
double 9.5 %, and a tire 5 scatters away is found in 65, 52 and 78 %
(``python build/fleet_constants.py``)."""
FEWEST_SPREAD = 5
"""Values among which one can stand out: of four, one may differ from three by anything."""
LARGEST_SHARE = 0.3
"""Share of the values that may stand out. Each step tests at a part of the level: with half of it
82 instead of 65 % of tires 5 scatters away are found among 12, with double 49 %."""
LARGE_SAMPLE = 100
"""Values from which one of them no longer changes mean and scatter of the others."""
FEWEST_IN_TIME = 5
"""Recordings over time from which a change is judged: two for the line, three for its scatter."""


@dataclass(frozen=True, slots=True, eq=False)
class Spread:
    """Values of one number over the tires.

    Attributes
    ----------
    centre, scatter : float
        Mean of the tires and standard deviation between them, without those that stand out.
    score : array, shape (n,)
        Distance from the others, in standard deviations of what explains it.
    outlier : bool array, shape (n,)
    """

    centre: float
    scatter: float
    score: FloatArray
    outlier: BoolArray


def spread_of(values: FloatArray, stds: FloatArray, tests: int = 1) -> Spread:
    """Return how values scatter, and which stand out.

    The value farthest from the others is taken away, then the next, up to `LARGEST_SHARE`, and the
    last one that is too far for a Student's t of those that are left stands out with all before it,
    so that two of them cannot hide each other (B. Rosner, Technometrics 25 (1983) 165). Each value
    has its own variance beside that between the tires.

    Parameters
    ----------
    values, stds : array, shape (n,)
        Finite.
    tests : int
        Numbers that are tested beside this one.
    """
    n = values.size
    kept = np.ones(n, dtype=np.bool_)
    order: list[int] = []
    last = 0
    steps = int(LARGEST_SHARE * n) if n >= FEWEST_SPREAD else 0
    level = 0.5 * FALSE_ALARM / (max(steps, 1) * max(tests, 1))
    for step in range(steps):
        left = int(kept.sum())
        worst = _worst(values, stds, kept)
        others = kept.copy()
        others[worst] = False
        score = _scores(values[worst : worst + 1], stds[worst : worst + 1], values, stds, others)[0]
        limit = stdtrit(left - 2, 1.0 - level / left)
        kept[worst] = False
        order.append(worst)
        if abs(score) > limit:
            last = step + 1
    outlier = np.zeros(n, dtype=np.bool_)
    outlier[order[:last]] = True
    centre, scatter, _ = centre_of(values[~outlier], stds[~outlier])
    if n > LARGE_SAMPLE:
        score = _scores(values, stds, values, stds, ~outlier)
    else:
        score = np.array([_own_score(i, values, stds, ~outlier) for i in range(n)])
    return Spread(centre, scatter, score, outlier)


def _own_score(i: int, values: FloatArray, stds: FloatArray, usual: BoolArray) -> float:
    others = usual.copy()
    others[i] = False
    if others.sum() < 2:
        return 0.0
    return float(_scores(values[i : i + 1], stds[i : i + 1], values, stds, others)[0])


def _worst(values: FloatArray, stds: FloatArray, kept: BoolArray) -> int:
    centre, scatter, _ = centre_of(values[kept], stds[kept])
    score = np.abs(values - centre) / np.sqrt(stds**2 + scatter**2 + np.finfo(float).tiny)
    return int(np.argmax(np.where(kept, score, -1.0)))


def _scores(
    value: FloatArray, std: FloatArray, values: FloatArray, stds: FloatArray, others: BoolArray
) -> FloatArray:
    centre, scatter, doubt = centre_of(values[others], stds[others])
    return np.asarray(
        (value - centre) / np.sqrt(std**2 + scatter**2 + doubt**2 + np.finfo(float).tiny)
    )


def centre_of(values: FloatArray, stds: FloatArray) -> tuple[float, float, float]:
    """Return mean, scatter between the values beyond their own, and the mean's standard deviation.

    The scatter solves ``sum (y - mean)^2 / (s^2 + scatter^2) = n - 1`` (R. C. Paule and J. Mandel,
    J. Res. Natl. Bur. Stand. 87 (1982) 377); it is zero where the intervals explain everything.
    """
    n = values.size
    if n == 1:
        return float(values[0]), 0.0, float(stds[0])
    variance = np.maximum(stds**2, np.finfo(float).tiny)

    def left(between: float) -> tuple[float, float]:
        weight = 1.0 / (variance + between)
        mean = float((weight * values).sum() / weight.sum())
        return float((weight * (values - mean) ** 2).sum()) - (n - 1), mean

    low, high = 0.0, float(np.var(values, ddof=1)) * n + float(variance.max())
    if left(0.0)[0] > 0.0:
        for _ in range(48):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if left(middle)[0] > 0.0 else (low, middle)
    else:
        high = 0.0
    weight = 1.0 / (variance + high)
    return left(high)[1], float(np.sqrt(high)), float(1.0 / np.sqrt(weight.sum()))


@dataclass(frozen=True, slots=True)
class Change:
    """A number of one tire over time.

    Attributes
    ----------
    slope, slope_std : float, [unit/s]
    change : float
        Slope times the time between the first and the last recording, in the number's unit.
    p : float
        Chance of such a slope without any change.
    """

    slope: float
    slope_std: float
    change: float
    p: float


def change_of(
    time: FloatArray, values: FloatArray, given: Sequence[FloatArray] = ()
) -> Change | None:
    """Return the change of values with time; None where there are too few, or no time between them.

    Parameters
    ----------
    time : array, shape (n,), [s]
    values : array, shape (n,)
    given : sequence of arrays, shape (n,)
        Conditions whose linear influence is taken out, such as pressure and load; one that did not
        vary is left out.
    """
    known = np.isfinite(time) & np.isfinite(values)
    columns = [each for each in given if np.isfinite(each[known]).all()]
    time, values = time[known], values[known]
    columns = [each[known] for each in columns if np.ptp(each[known]) > 0.0]
    if time.size < FEWEST_IN_TIME + len(columns) or np.ptp(time) <= 0.0:
        return None
    span = float(np.ptp(time))
    x = np.stack([np.ones_like(time), (time - time.mean()) / span, *map(_scaled, columns)], axis=1)
    if np.linalg.matrix_rank(x) < x.shape[1]:
        return None
    beta, *_ = np.linalg.lstsq(x, values)
    free = time.size - x.shape[1]
    variance = float(((values - x @ beta) ** 2).sum()) / free
    # a value that never varies has no scatter but that of its digits
    variance = max(variance, (np.finfo(np.float32).eps * float(np.abs(values).max())) ** 2)
    std = float(np.sqrt(variance * np.linalg.inv(x.T @ x)[1, 1]))
    p = 2.0 * float(stdtr(free, -abs(beta[1]) / std)) if std > 0.0 else 1.0
    return Change(float(beta[1]) / span, std / span, float(beta[1]), p)


def _scaled(values: FloatArray) -> FloatArray:
    return np.asarray((values - values.mean()) / np.ptp(values))
