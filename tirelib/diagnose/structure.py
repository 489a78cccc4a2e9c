"""What a ring leaves by itself, as a covariance: the metric in which effects are weighed.

With the residuals e_m of M variants of the model, the parts d_k that add in proportion
(`tirelib.diagnose.ensemble`) and noise s, a residual that lacks no effect has the covariance

    C = s^2 I + sum_m e_m e_m' / M + sum_k d_k d_k' + sum_i f_i f_i'

so what structure does often counts little and what it never does counts by the noise alone. A
sample of everything would leave most directions out, for there are more set points and smooth
shapes than variants. The rows f_i are the parts in each run of an effect that the model has, times
`FORM`: the law of an effect is right to such a share, and may be off by another factor in each run.

A measured variant is judged by the covariance without it, as a residual is by that of all.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy import linalg

from tirelib.arrays import FloatArray
from tirelib.diagnose.spread import Spread
from tirelib.identify.span import span

LEAST, ALIKE = 0.1, 15
"""Least s, in whitened samples, for no ensemble spans everything that structure does; and the
number of runs from which on more runs tell no more of that, for it repeats in like runs."""
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


def spread_of(noise: float, runs: int) -> float:
    """Return s for runs with a noise, both of a whitened sample."""
    return max(noise, LEAST * float(np.sqrt(max(1.0, runs / ALIKE))))


class Structure:
    """The covariance, on the complement of what the fitted numbers of a model can do.

    Parameters
    ----------
    variants : shape (n_members, n)
        Whitened residuals e_m of variants as they are.
    measured : shape (n_members, n)
        The same as they would be measured.
    noise : float, [-]
        Standard deviation s of a whitened sample.
    nuisance : shape (n_free, n)
        Whitened slopes of the model's fitted numbers.
    parts : shape (n_parts, n)
        Whitened rows d_k over all runs.
    each : shape (n_runs, n_each, n_phi)
        Whitened rows d_k and f_i of one run each.
    """

    def __init__(
        self,
        variants: FloatArray,
        measured: FloatArray,
        noise: float,
        nuisance: FloatArray,
        parts: FloatArray,
        each: FloatArray,
    ) -> None:
        self.basis = span(nuisance.T)
        self.variance = noise**2
        self.members = self.projected(measured)
        shared = np.concatenate([variants / np.sqrt(max(len(variants), 1)), parts])
        # rows as they are: their products with what is projected are those of projected ones
        self.spread = Spread(shared, each)

    def projected(self, rows: FloatArray) -> FloatArray:
        """Return rows (..., n) without what the fitted numbers can do."""
        out: FloatArray = rows - (rows @ self.basis) @ self.basis.T
        return out

    def normal(self, rows: FloatArray, residual: FloatArray) -> Normal:
        """Return the normal equations of rows (k, n) and a residual (n,)."""
        own, rest = self.projected(rows), self.projected(residual)
        across, mutual = self.spread.onto(own), self.spread.onto(rest[None])[:, 0]
        turned = linalg.cho_solve(self._inner, np.column_stack([across, mutual]))
        return Normal(
            (own @ own.T - across.T @ turned[:, :-1]) / self.variance,
            (own @ rest - across.T @ turned[:, -1]) / self.variance,
            float(rest @ rest - mutual @ turned[:, -1]) / self.variance,
        )

    def beyond(self, rows: FloatArray) -> FloatArray:
        """Return what neither fitted numbers nor structure explain of rows (k, n): s^2 C^-1 rows.

        The best linear prediction of structure, given the rows, is taken off.
        """
        own = self.projected(rows)
        weights = linalg.cho_solve(self._inner, self.spread.onto(own))
        return own - self.projected(self.spread.mixed(weights))

    def of_members(self, rows: FloatArray) -> list[Normal]:
        """Return the same for every measured variant, each by the covariance without it."""
        own = self.projected(rows)
        across, mutual = self.spread.onto(own), self.spread.onto(self.members)
        inverse = linalg.cho_solve(self._inner, np.eye(len(self.spread)))
        turned, met = inverse @ across, inverse @ mutual
        gram = own @ own.T - across.T @ turned
        right = own @ self.members.T - across.T @ met
        square = np.sum(self.members**2, axis=1) - np.sum(mutual * met, axis=0)
        found = []
        for m in range(len(self.members)):
            # the inverse without a row and column, by the row of the whole one
            lost, own_met = turned[m] / inverse[m, m], float(met[m, m])
            found.append(
                Normal(
                    (gram + np.outer(lost, turned[m])) / self.variance,
                    (right[:, m] + lost * own_met) / self.variance,
                    (float(square[m]) + own_met**2 / float(inverse[m, m])) / self.variance,
                )
            )
        return found

    @cached_property
    def _inner(self) -> tuple[Any, bool]:
        """Cholesky factor of what the matrix inversion lemma inverts in place of C."""
        taken = self.spread.onto(self.basis.T)
        inner = self.spread.products() - taken @ taken.T
        inner[np.diag_indices_from(inner)] += self.variance
        factor, lower = linalg.cho_factor(inner, lower=True)
        return factor, lower
