"""Learn what turns of a tire look like, from conditions that were held out."""

from collections.abc import Mapping, Sequence

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray, IntArray
from tirelib.estimators.basis import G1, G2, L1, L2, ONE, P1, T1, T2, Powers, V, times
from tirelib.estimators.fit import design_for
from tirelib.estimators.likeness import AGREEMENT, DRIFT, Likeness
from tirelib.estimators.regressors import ODD, SIDED

FALSE_ALARM = 0.001
"""Probability with which a turn of the calibrated tire is taken for another's; at least the largest
D^2 of a held-out condition is allowed, though."""
TIRE = tuple(name for name in DRIFT if name not in AGREEMENT)
"""Regressors that say what tire it is."""
SPARE = 3
"""Conditions more than regressors without which their covariance says too little."""
CORNERING = 0.2
"""Share of the largest lateral distortion beyond which a wheel corners; and share of a condition's
range that it must cover there."""
PENALTY = 1e-6
"""Penalty of the least squares, relative: terms that the data cannot tell apart stay small."""


def fit_likeness(
    values: Mapping[str, FloatArray],
    groups: IntArray,
    varying: set[str],
    turns: Mapping[str, FloatArray],
    unit: IntArray,
    rows: BoolArray,
    names: Sequence[str] = TIRE,
) -> Likeness | None:
    """Return what the calibrated tire can show; None if there are too few conditions.

    Parameters
    ----------
    values : mapping of arrays, shape (n,)
        Regressors of each independent measurement.
    groups : shape (n,)
        Its condition.
    varying : set of str
        Conditions and regressors that were varied.
    turns : mapping of arrays, shape (n_turns,)
        Regressors of single turns.
    unit, rows : shape (n_turns,)
        Measurement of each turn, and whether it counts.
    names : sequence of str, optional
        Regressors of `tirelib.estimators.likeness.DRIFT` that are looked at.
    """
    from scipy.special import fdtri  # calibrating only; scipy.stats takes a second to import

    names = tuple(name for name in names if np.isfinite(values[name]).all())
    conditions = np.unique(groups).size
    freedom = conditions - len(names)
    if freedom < SPARE or not names:
        return None
    even, odd = _terms(varying, _with_side(values, varying))
    variables, terms, x = design_for(values, [*even, *odd], (*ODD, "camber", "traction"))
    share = np.zeros((len(terms), len(names)))
    held_out = np.empty((x.shape[0], len(names)))
    evens = np.arange(len(terms)) < len(even)
    for column, name in enumerate(names):
        use = ~evens if name in SIDED else evens
        share[use, column], held_out[:, column] = _left_out(x[:, use], values[name], groups)
    size = held_out.std(axis=0) + np.finfo(np.float64).tiny
    between = shrunk_covariance(held_out / size)
    known = Likeness(variables, terms, names, share, between * np.outer(size, size), 0.0)
    single = known.rest(turns)[rows]
    single -= _mean_of(single, unit[rows])
    covariance = known.covariance + np.cov(single.T)
    seen = np.einsum("ij,ij->i", held_out, np.linalg.solve(covariance, held_out.T).T) / len(names)
    edge = float(fdtri(len(names), freedom, 1.0 - FALSE_ALARM))
    limit = edge * (conditions - 1) / freedom
    limit = max(limit, float(seen.max()))
    return Likeness(variables, terms, names, share, covariance, limit)


def shrunk_covariance(errors: FloatArray) -> FloatArray:
    """Return the covariance of few errors about zero, drawn to a multiple of the identity.

    The share that is drawn makes the expected squared error least (Ledoit and Wolf, *A
    well-conditioned estimator for large-dimensional covariance matrices*, J. Multivariate Analysis
    88, 2004, equation 14).

    Parameters
    ----------
    errors : array, shape (n, k)
    """
    n, k = errors.shape
    sample = errors.T @ errors / n
    target = np.trace(sample) / k * np.eye(k)
    distance = float(np.sum((sample - target) ** 2))
    scatter = float(np.sum(np.sum(errors**2, axis=1) ** 2) / n - np.sum(sample**2)) / n
    share = min(scatter, distance) / distance if distance > 0.0 else 0.0
    return np.asarray(share * target + (1.0 - share) * sample, dtype=np.float64)


def _with_side(values: Mapping[str, FloatArray], varying: set[str]) -> set[str]:
    """Return the conditions that were varied while there was lateral distortion."""
    size = np.abs(values["cp1_slope"])
    cornering = size > CORNERING * size.max()
    return {
        name
        for name in varying & {"pressure", "speed_squared"}
        if np.ptp(values[name][cornering]) > CORNERING * np.ptp(values[name])
    }


def _terms(varying: set[str], with_side: set[str]) -> tuple[list[Powers], list[Powers]]:
    """Return even and odd terms in what says where a turn lies.

    A condition that was not varied with lateral distortion (`with_side`) has no odd terms.
    """
    s: Powers = {"cp1_slope": 1}  # stands for the lateral distortion
    even = [ONE, L1, L2, T1, times(s, s), times(s, s, L1)]
    odd = [s, times(s, L1), times(s, L2), times(s, s, s)]
    if "traction" in varying:
        even += [T2, times(T1, L1), times(T2, L1), times(T1, T2)]
        odd += [times(s, T1), times(s, T2)]
    if "camber" in varying:
        even += [G2, times(G1, s)]
        odd += [G1, times(G1, L1)]
    for name, term in (("pressure", P1), ("speed_squared", V)):
        if name in varying:
            even += [term, times(term, L1)]
        if name in with_side:
            odd += [times(term, s)]
    return even, odd


def _left_out(x: FloatArray, y: FloatArray, groups: IntArray) -> tuple[FloatArray, FloatArray]:
    """Return least-squares coefficients, and the errors of each condition by a fit without it."""
    inverse = np.linalg.inv(x.T @ x + PENALTY * len(y) * np.eye(x.shape[1]))
    found = inverse @ x.T @ y
    hat, rest = x @ inverse @ x.T, y - x @ found
    error = np.empty_like(rest)
    for group in np.unique(groups):
        rows = groups == group
        own = np.eye(int(rows.sum())) - hat[np.ix_(rows, rows)]
        error[rows] = np.linalg.solve(own, rest[rows])
    return found, error


def _mean_of(values: FloatArray, unit: IntArray) -> FloatArray:
    """Return for each row the mean of the rows of its unit."""
    _, index, count = np.unique(unit, return_inverse=True, return_counts=True)
    total = np.zeros((count.size, values.shape[1]))
    np.add.at(total, index, values)
    return np.asarray((total / count[:, None])[index], dtype=np.float64)
