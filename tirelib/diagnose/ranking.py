"""The joint ranking: all candidates together, each scored by what returns when it alone is removed.

Strengths of every living candidate are fitted at once to the whitened residual, with a ridge of one
range, in the metric of what a ring leaves by itself (`tirelib.diagnose.structure`). The score of an
effect is the misfit that comes back without it. An effect with twins is scored without them in the
fit: two that look alike would else take each other's score away.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import stats

from tirelib.arrays import FloatArray
from tirelib.diagnose.candidates import Candidates
from tirelib.diagnose.refit import Refit
from tirelib.diagnose.structure import Normal, Structure

TAIL = 0.1
"""Share of the members whose scores tell the largest."""


@dataclass(frozen=True, slots=True)
class Scores:
    """Result of the joint fit.

    Attributes
    ----------
    score : shape (n,)
        Misfit that comes back without the effect.
    alone : shape (n,)
        Misfit that the effect alone takes away.
    strength : tuple of array
        Per candidate, in its unit.
    std : tuple of array
    misfit, after : float
        Misfit before and after the joint fit.
    """

    score: FloatArray
    alone: FloatArray
    strength: tuple[FloatArray, ...]
    std: tuple[FloatArray, ...]
    misfit: float
    after: float


class Ranking:
    """The joint fit of one model and its candidates, for any residual.

    Parameters
    ----------
    model : Refit
    found : Candidates
    structure : Structure
        What the model leaves by itself.
    """

    def __init__(self, model: Refit, found: Candidates, structure: Structure) -> None:
        self.model, self.found, self.structure = model, found, structure
        empty = np.zeros((0, model.waveform.size))
        self.rows = np.concatenate([c.own for c in found.living]) if found.living else empty
        self.slots: list[slice] = []
        first = 0
        for candidate in found.living:
            self.slots.append(slice(first, first + len(candidate.own)))
            first += len(candidate.own)
        names = [c.effect.name for c in found.living]
        self.twins = [[names.index(name) for name, _ in found.twins(k)] for k in range(len(names))]

    def scores(self, residual: FloatArray) -> Scores:
        """Return the scores for a residual of shape (n_runs, n_phi)."""
        white = self.model.whiten(residual).ravel()
        return self._scores(self.structure.normal(self.rows, white))

    @cached_property
    def normals(self) -> list[Normal]:
        """Normal equations of the measured variants, each by the structure without it."""
        return self.structure.of_members(self.rows)

    def of_members(self) -> tuple[Scores, ...]:
        """Return the scores of the measured variants."""
        return tuple(self._scores(normal) for normal in self.normals)

    def planted(self, index: int, strength: float, component: int = 0) -> FloatArray:
        """Return scores of the members with one effect planted, in shares of its range."""
        slot = self.slots[index]
        out = []
        for normal in self.normals:
            column = normal.gram[:, slot.start + component]
            moved = Normal(normal.gram, normal.right + strength * column, normal.square)
            out.append(self._score(moved, index)[0])
        return np.array(out)

    def power(self, index: int, alarm: float) -> float:
        """Return in which share of the variants a third of the range would reach a score.

        Of several components, of the one that shows best.
        """
        effect = self.found.living[index].effect
        third = effect.toward / effect.scale / 3.0
        each = [self.planted(index, third, k) for k in range(effect.components)]
        return float(max(np.mean(scores >= alarm) for scores in each))

    def _scores(self, normal: Normal) -> Scores:
        score, alone, strength, std = [], [], [], []
        for index, candidate in enumerate(self.found.living):
            returned, own, block = self._score(normal, index)
            scale = candidate.effect.scale
            score.append(returned)
            alone.append(_taken(normal, self.slots[index]))
            strength.append(own * scale)
            std.append(scale * np.sqrt(np.diag(block)))
        every = slice(0, len(normal.right))
        return Scores(
            np.array(score),
            np.array(alone),
            tuple(strength),
            tuple(std),
            normal.square,
            normal.square - _taken(normal, every),
        )

    def _score(self, normal: Normal, index: int) -> tuple[float, FloatArray, FloatArray]:
        """Return score, strength in ranges, and covariance of one effect, its twins left out."""
        out = self.twins[index]
        kept = [
            k
            for j, slot in enumerate(self.slots)
            if j not in out
            for k in range(slot.start, slot.stop)
        ]
        first = kept.index(self.slots[index].start)
        own = slice(first, first + self.slots[index].stop - self.slots[index].start)
        gram = normal.gram[np.ix_(kept, kept)]
        inverse = np.asarray(np.linalg.inv(gram + np.eye(len(kept))), dtype=np.float64)
        weights = (inverse @ normal.right[kept])[own]
        block = inverse[own, own]
        return float(weights @ np.linalg.solve(block, weights)), weights, block


def _taken(normal: Normal, slot: slice) -> float:
    """Return the misfit that some rows take away, with the ridge."""
    gram, right = normal.gram[slot, slot], normal.right[slot]
    if right.size == 0:
        return 0.0
    weights = np.linalg.solve(gram + np.eye(right.size), right)
    return float(2.0 * weights @ right - weights @ gram @ weights)


def limits(members: Sequence[Scores], components: Sequence[int]) -> FloatArray:
    """Return the largest score of each candidate that as many members are expected to have.

    The largest of a hundred happens to be half or twice as large with other draws; the upper tenth
    together tells it better. Their ratios are taken to be those of a chi-square with the
    candidate's components, which heavier tails exceed a little.

    Parameters
    ----------
    members : sequence of Scores
    components : sequence of int
        Of each candidate.
    """
    count = len(members)
    top = max(1, round(TAIL * count))
    ranks = (np.arange(1, top + 1) - 0.3) / (count + 0.4)  # median ranks, the largest first
    usual = np.asarray(stats.chi2.isf(ranks[:, None], np.asarray(components)))
    largest = np.sort([scores.score for scores in members], axis=0)[::-1][:top]
    expected: FloatArray = usual[0] * largest.sum(axis=0) / usual.sum(axis=0)
    return expected
