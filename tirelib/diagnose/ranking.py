"""The joint ranking: all candidates together, each scored by what returns when it alone is removed.

Base coordinates and the strengths of every living candidate are fitted at once to the whitened
residual, strengths with a ridge of one range. The score of an effect is the misfit that comes back
without it, per sample, over the rms that the whole fit leaves: between an absolute measure, which
grows with any structural floor, and a relative one, which a floor hides.
"""

from dataclasses import dataclass

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.diagnose.candidates import Candidates
from tirelib.diagnose.refit import Refit

_LOOSE = 1e-8


@dataclass(frozen=True, slots=True)
class Scores:
    """Result of the joint fit.

    Attributes
    ----------
    score : shape (n,)
    share : shape (n,)
        Misfit that comes back over the misfit that is left.
    strength : tuple of array
        Per candidate, in its unit.
    std : tuple of array
    before, after : float, [-]
        Rms of the whitened residual before and after the joint fit.
    """

    score: FloatArray
    share: FloatArray
    strength: tuple[FloatArray, ...]
    std: tuple[FloatArray, ...]
    before: float
    after: float


class Ranking:
    """The joint fit of one model and its candidates, for any residual."""

    def __init__(self, model: Refit, found: Candidates) -> None:
        self.model, self.found = model, found
        base = model.whiten(model.slopes).reshape(len(model.slopes), -1)
        self.rows = np.concatenate([base, *[c.rows for c in found.living]])
        ridge = np.ones(len(self.rows))
        ridge[: len(base)] = _LOOSE
        self.inverse = np.linalg.inv(self.rows @ self.rows.T + np.diag(ridge))
        first = len(base)
        self.slots: list[slice] = []
        for candidate in found.living:
            self.slots.append(slice(first, first + len(candidate.rows)))
            first += len(candidate.rows)

    def scores(self, residual: FloatArray) -> Scores:
        """Return the scores for a residual of shape (n_runs, n_phi)."""
        white = self.model.whiten(residual).ravel()
        weights = self.inverse @ (self.rows @ white)
        rest = white - weights @ self.rows
        left = float(rest @ rest)
        score, share, strength, std = [], [], [], []
        for candidate, slot in zip(self.found.living, self.slots, strict=True):
            own = weights[slot]
            block = self.inverse[slot, slot]
            returned = float(own @ np.linalg.solve(block, own))
            score.append(returned / white.size / np.sqrt(left / white.size))
            share.append(returned / left)
            strength.append(own * candidate.effect.scale)
            std.append(candidate.effect.scale * np.sqrt(np.diag(block)))
        size = white.size
        return Scores(
            np.array(score), np.array(share), tuple(strength), tuple(std),
            float(np.sqrt(white @ white / size)), float(np.sqrt(left / size)),
        )  # fmt: skip
