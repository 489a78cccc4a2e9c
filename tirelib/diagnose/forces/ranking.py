"""The joint ranking: all candidates at once, each scored by what returns when it alone is removed.

Parameters of the brush and the strengths of every living candidate are fitted at once to the scaled
residual, strengths with a ridge of one range and within their ranges: what could not be true must
not hide what is. The score of an effect is the misfit that comes back without it, per point, over
the rms that the whole fit leaves. An effect with twins is scored without them in the fit: two that
look alike would else take each other's score away.
"""

from dataclasses import dataclass

import numpy as np
from scipy import linalg
from scipy.optimize import lsq_linear

from tirelib.arrays import BoolArray, FloatArray
from tirelib.diagnose.forces.candidates import ForceCandidates
from tirelib.diagnose.forces.fit import ForceFit, Problem

_LOOSE = 1e-8
_NEAR = 1e-6
"""Distance from its bound, relative to the range, at which a strength is held by it."""


@dataclass(frozen=True, slots=True, eq=False)
class ForceScores:
    """Result of the joint fit.

    Attributes
    ----------
    score : shape (n,)
    share : shape (n,)
        Misfit that comes back over the misfit that is left.
    strength, std : tuple of array
        Per candidate, in its unit; std as if errors were independent.
    inside : shape (n,)
        Whether the strength is held by no end of its range but zero.
    before, after : float, [-]
        Rms of the scaled residual before and after the joint fit.
    """

    score: FloatArray
    share: FloatArray
    strength: tuple[FloatArray, ...]
    std: tuple[FloatArray, ...]
    inside: BoolArray
    before: float
    after: float


class ForceRanking:
    """The joint fit of one model and its candidates, for any residual."""

    def __init__(self, problem: Problem, model: ForceFit, found: ForceCandidates) -> None:
        self.found, self.scale = found, problem.scale
        base = model.slopes / problem.scale
        self.rows = np.concatenate([base, *[c.rows for c in found.living]])
        self.ridge = np.ones(len(self.rows))
        self.ridge[: len(base)] = _LOOSE
        self.normal = self.rows @ self.rows.T + np.diag(self.ridge)
        self.low, self.high = np.full(len(self.rows), -np.inf), np.full(len(self.rows), np.inf)
        first = len(base)
        self.slots: list[slice] = []
        for candidate in found.living:
            slot = slice(first, first + len(candidate.rows))
            effect = candidate.effect
            self.low[slot], self.high[slot] = effect.low / effect.scale, effect.high / effect.scale
            self.slots.append(slot)
            first = slot.stop
        self.spread = np.sqrt(np.diag(np.linalg.inv(self.normal)))
        names = found.names
        self.twins = [[names.index(twin) for twin, _ in found.twins(k)] for k in range(len(names))]

    def scores(self, residual: FloatArray) -> ForceScores:
        """Return the scores for a residual, measured less predicted, shape (n,)."""
        white = residual / self.scale
        n, whole = white.size, float(white @ white)
        slope = self.rows @ white
        every, least = self._fit(slope, whole, np.ones(slope.size, dtype=bool))
        least = max(least, 1e-30)
        rms = np.sqrt(least / n)
        score, share, strength, std, inside = [], [], [], [], []
        for candidate, slot, twins in zip(self.found.living, self.slots, self.twins, strict=True):
            keep = np.ones(slope.size, dtype=bool)
            for twin in twins:
                keep[self.slots[twin]] = False
            weights, left = self._fit(slope, whole, keep) if twins else (every, least)
            left = max(left, 1e-30)
            keep[slot] = False
            own = weights[slot]
            returned = max(self._fit(slope, whole, keep)[1] - left, 0.0) if np.any(own) else 0.0
            score.append(returned / n / rms)
            share.append(returned / left)
            strength.append(own * candidate.effect.scale)
            std.append(candidate.effect.scale * self.spread[slot] * max(rms, 1.0))
            free = (own > self.low[slot] + _NEAR) & (own < self.high[slot] - _NEAR)
            inside.append(bool((free | (np.abs(own) <= _NEAR)).all()))
        return ForceScores(
            np.array(score),
            np.array(share),
            tuple(strength),
            tuple(std),
            np.array(inside, dtype=bool),
            float(np.sqrt(whole / n)),
            float(rms),
        )

    def _fit(self, slope: FloatArray, whole: float, keep: BoolArray) -> tuple[FloatArray, float]:
        """Return weights within their bounds and the squares with ridge that they leave."""
        normal, right = self.normal[np.ix_(keep, keep)], slope[keep]
        low, high = self.low[keep], self.high[keep]
        root = linalg.cholesky(normal)
        goal = linalg.solve_triangular(root, right, trans="T")
        found = linalg.solve_triangular(root, goal)
        if (found < low).any() or (found > high).any():
            found = lsq_linear(root, goal, bounds=(low, high), method="bvls").x
        left = whole - 2.0 * float(right @ found) + float(found @ normal @ found)
        weights = np.zeros(slope.size)
        weights[keep] = found
        return weights, left
