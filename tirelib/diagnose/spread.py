"""Rows whose squares add to a covariance: some over all runs, some in one run each.

The rows of one run are kept as they are, without the zeros in all others: with sixty runs that is
most of the numbers, and most of the time that products of rows would take.
"""

from dataclasses import dataclass

import numpy as np

from tirelib.arrays import FloatArray


@dataclass(frozen=True, slots=True)
class Spread:
    """Rows over n = n_runs * n_phi samples; those over all runs are the first.

    Attributes
    ----------
    every : shape (n_every, n)
        Over all runs.
    each : shape (n_runs, k, n_phi)
        k of each run, zero in the others.
    """

    every: FloatArray
    each: FloatArray

    def __len__(self) -> int:
        runs, k, _ = self.each.shape
        return len(self.every) + int(runs * k)

    def onto(self, rows: FloatArray) -> FloatArray:
        """Return the products with rows (m, n), of shape (len, m)."""
        runs, k, samples = self.each.shape
        by_run = rows.reshape(len(rows), runs, samples).transpose(1, 2, 0)
        apart = (self.each @ by_run).reshape(runs * k, len(rows))
        return np.concatenate([self.every @ rows.T, apart])

    def products(self) -> FloatArray:
        """Return the products of all rows with one another, of shape (len, len)."""
        first, (runs, k, _) = len(self.every), self.each.shape
        across = self.onto(self.every)
        out = np.zeros((len(self), len(self)))
        out[:, :first], out[:first, first:] = across, across[first:].T
        same = out[first:, first:].reshape(runs, k, runs, k)
        run = np.arange(runs)
        same[run, :, run] = self.each @ self.each.swapaxes(1, 2)
        return out

    def mixed(self, weights: FloatArray) -> FloatArray:
        """Return sums of the rows by weights (len, m), of shape (m, n)."""
        first, (runs, k, samples) = len(self.every), self.each.shape
        by_run = weights[first:].reshape(runs, k, weights.shape[1]).transpose(0, 2, 1)
        apart = (by_run @ self.each).swapaxes(0, 1).reshape(weights.shape[1], runs * samples)
        out: FloatArray = weights[:first].T @ self.every + apart
        return out
