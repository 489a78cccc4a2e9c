"""What a ring leaves by itself, as a covariance: the metric in which effects are weighed.

Members of the structural ensemble are residuals that lack no effect. With M of them, e_m, and the
noise s between repeats, a residual without effect has the covariance

    C = s^2 I + sum_m e_m e_m' / M + sum_i f_i f_i'

so what structure does often counts little and what it never does counts by the noise alone. The
rows f_i are the parts in each run of an effect that the model has, times `FORM`: the law of an
effect is right to such a share, and may be off by another factor in each run.

A member is judged by the covariance of the others, as a measured residual is by that of all.
"""

from dataclasses import dataclass

import numpy as np

from tirelib.arrays import FloatArray

LEAST = 0.1
"""Least s, in whitened samples: a finite ensemble does not span everything that structure does."""
FORM = 0.2
"""Share of an effect's own part by which its law may be off from run to run."""


@dataclass(frozen=True, slots=True)
class Normal:
    """Normal equations of candidates' rows and one residual in the metric of C.

    Attributes
    ----------
    gram : shape (k, k)
        Rows C^-1 rows'.
    right : shape (k,)
        Rows C^-1 residual.
    square : float
        Residual' C^-1 residual: the misfit.
    """

    gram: FloatArray
    right: FloatArray
    square: float


class Structure:
    """The covariance, on the complement of what the fitted numbers of a model can do.

    Parameters
    ----------
    members : shape (n_members, n)
        Whitened residuals of the ensemble.
    noise : float, [-]
        Standard deviation of a whitened sample by noise alone.
    nuisance : shape (n_free, n)
        Whitened slopes of the model's fitted numbers.
    form : shape (n_form, n)
        Whitened rows f_i; none for a model without effects.
    """

    def __init__(
        self, members: FloatArray, noise: float, nuisance: FloatArray, form: FloatArray
    ) -> None:
        self.basis = np.linalg.qr(nuisance.T)[0]
        self.variance = max(noise, LEAST) ** 2
        self.count = len(members)
        self.members = self.projected(members)
        self.spread = np.concatenate(
            [self.members / np.sqrt(max(self.count, 1)), self.projected(form)]
        )
        self.overlap = self.spread @ self.spread.T

    def projected(self, rows: FloatArray) -> FloatArray:
        """Return rows (..., n) without what the fitted numbers can do."""
        out: FloatArray = rows - (rows @ self.basis) @ self.basis.T
        return out

    def normal(self, rows: FloatArray, residual: FloatArray) -> Normal:
        """Return the normal equations of rows (k, n) and a residual (n,)."""
        own, rest = self.projected(rows), self.projected(residual)
        return self._normal(
            np.arange(len(self.spread)), own @ own.T, own @ self.spread.T, own @ rest,
            self.spread @ rest, float(rest @ rest),
        )  # fmt: skip

    def beyond(self, rows: FloatArray) -> FloatArray:
        """Return what neither fitted numbers nor structure explain of rows (k, n): s^2 C^-1 rows.

        The best linear prediction of structure, given the rows, is taken off.
        """
        own = self.projected(rows)
        inner = self.overlap + self.variance * np.eye(len(self.spread))
        out: FloatArray = own - np.linalg.solve(inner, self.spread @ own.T).T @ self.spread
        return out

    def of_members(self, rows: FloatArray) -> list[Normal]:
        """Return the same for every member, each by the covariance of the others."""
        own = self.projected(rows)
        plain, across = own @ own.T, own @ self.spread.T
        right, mutual = own @ self.members.T, self.spread @ self.members.T
        every = np.arange(len(self.spread))
        return [
            self._normal(
                np.delete(every, m), plain, across, right[:, m], mutual[:, m],
                float(self.members[m] @ self.members[m]),
            )
            for m in range(self.count)
        ]  # fmt: skip

    def _normal(
        self, kept: np.ndarray, plain: FloatArray, across: FloatArray, right: FloatArray,
        mutual: FloatArray, square: float,
    ) -> Normal:  # fmt: skip
        """Return C^-1 by the matrix inversion lemma, for some of the covariance's rows."""
        inner = self.overlap[np.ix_(kept, kept)] + self.variance * np.eye(kept.size)
        columns = np.concatenate([across[:, kept], mutual[None, kept]]).T
        turned = np.linalg.solve(inner, columns)
        taken = columns.T @ turned
        k = len(right)
        return Normal(
            (plain - taken[:k, :k]) / self.variance,
            (right - taken[:k, k]) / self.variance,
            (square - float(taken[k, k])) / self.variance,
        )
