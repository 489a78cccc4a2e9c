"""Noise of forces as it counts: of a point, of set points that are off in a block, and the rest."""

from dataclasses import dataclass, replace

import numpy as np

from tirelib.arrays import FloatArray, IntArray
from tirelib.diagnose.forces.assess import ForceCase
from tirelib.diagnose.forces.fit import ForceFit, Problem
from tirelib.planning.criterion import Noise
from tirelib.problems.forces import ANGLE, SET_POINTS

SHARES = (0.0, *(2.0 ** np.arange(-3.0, 0.5, 0.5)).tolist())
"""Sizes of set-point errors that are tried, over those of a diagnosis."""


class BlockWhitening:
    """Makes forces independent numbers of one variance, one for noise and set points as known.

    Parameters
    ----------
    noise : float, [N] or [N m]
        Of a point.
    tangents : shape (n, k), [N] or [N m]
        Change by one standard deviation of each set point, which is off alike in a block.
    block : shape (n,)

    Attributes
    ----------
    volume : float
        Logarithm of the determinant of the covariance.
    """

    def __init__(self, noise: float, tangents: FloatArray, block: IntArray) -> None:
        order = np.argsort(block, kind="stable")
        cuts = np.flatnonzero(np.diff(block[order])) + 1
        self.parts: list[tuple[IntArray, FloatArray]] = []
        self.volume = 0.0
        for index in np.split(order, cuts):
            own = tangents[index]
            inside = noise**2 * np.eye(index.size) + own @ own.T
            root = np.linalg.cholesky(inside)
            self.volume += 2.0 * float(np.sum(np.log(np.diag(root))))
            self.parts.append((index, np.linalg.inv(root)))

    def __call__(self, rows: FloatArray) -> FloatArray:
        """Return whitened rows (..., n)."""
        out = np.empty_like(rows)
        for index, root in self.parts:
            out[..., index] = rows[..., index] @ root.T
        return out


@dataclass(frozen=True, slots=True, eq=False)
class Counted:
    """Noise that counts in the present points.

    Attributes
    ----------
    whiten : BlockWhitening
    excess : float
        By which it is larger than noise and set points.
    share : float
        How far set points are off, over what a diagnosis has.
    """

    whiten: BlockWhitening
    excess: float
    share: float

    def __call__(self, rows: FloatArray) -> FloatArray:
        """Return rows (..., n) in standard deviations."""
        return self.whiten(rows) / self.excess


def counted_noise(
    case: ForceCase, base: ForceFit, structure: FloatArray, suspected: FloatArray | None = None
) -> tuple[Noise, Counted]:
    """Return the noise of a further point, and that which counts in the present ones.

    How far set points are off, the present points tell: the share that makes them likeliest.
    What neither structure nor all suspects together span is left by repeats: what an effect does
    is no noise. Where what is left goes together in a block
    beyond its set points, noise counts as much larger as the square of their sum exceeds the sum of
    their squares; so does that of a further point, of which no more is known.

    Parameters
    ----------
    case : ForceCase
    base : ForceFit
        The model without any of the suspects, fitted.
    structure : shape (m, n)
    suspected : shape (n_strengths, n), optional
        Slopes by the strengths of all suspects, over their ranges.
    """
    problem = case.problem
    random = float(case.noise if np.isfinite(case.noise) else problem.scale)
    tangents = set_points(problem, base)
    rest = problem.measured - base.predicted
    unknown = [base.slopes, structure] if suspected is None else [base.slopes, structure, suspected]
    rows = np.concatenate(unknown)
    tried = [BlockWhitening(random, x * tangents, problem.block) for x in SHARES]
    lefts = [_left(whiten, rows, rest) for whiten in tried]
    likely = [float(np.sum(left**2)) + w.volume for w, left in zip(tried, lefts, strict=True)]
    best = int(np.argmin(likely))
    left = lefts[best]
    spread = max(float(np.sqrt(np.mean(left**2))), 1.0)
    _, block = np.unique(problem.block, return_inverse=True)
    sums = np.bincount(np.ravel(block), left)
    together = float(np.sqrt(max(np.sum(sums**2) / np.sum(left**2), 1.0)))
    staying = float(np.sqrt(spread**2 - 1.0))
    return (
        Noise(together * random, together * staying * random),
        Counted(tried[best], spread * together, SHARES[best]),
    )


def _left(whiten: BlockWhitening, rows: FloatArray, rest: FloatArray) -> FloatArray:
    """Return what unknowns of variance one leave of a residual, whitened."""
    flat, white = whiten(rows), whiten(rest)
    out: FloatArray = (
        white - np.linalg.solve(flat @ flat.T + np.eye(len(flat)), flat @ white) @ flat
    )
    return out


def set_points(ahead: Problem, fit: ForceFit) -> FloatArray:
    """Return the change of the force for one standard deviation of each set point, (n, 4)."""
    at, here = ahead.bench.conditions, ahead.predict(fit.values, fit.changes)
    steps = {
        "load": SET_POINTS["load"] * at.load,
        "pressure": SET_POINTS["pressure"] * at.pressure,
        "slip_angle": np.full(len(at), ANGLE),
        "slip_ratio": SET_POINTS["slip_ratio"] * at.slip_ratio,
    }
    columns = []
    for name, step in steps.items():
        moved = getattr(at, name) + step
        data = replace(ahead.bench.points.data, **{name: moved})
        bench = replace(
            ahead.bench,
            points=replace(ahead.bench.points, data=data),
            conditions=replace(at, **{name: moved}),
        )
        there = replace(ahead, bench=bench).predict(fit.values, fit.changes)
        columns.append(np.nan_to_num(there - here))
    return np.stack(columns, axis=1)
