"""Normal equations of everything that may explain a residual, and evidence in them.

With rows B and a residual r of unit noise, r = B' beta + e and beta ~ N(0, D), all that is ever
needed of thousands of samples is G = B B' and g = B r. The covariance of r is C = I + B' D B, and

    B C^-1 B' = G - G X G,   B C^-1 r = g - G X g,   X = D^1/2 (I + D^1/2 G D^1/2)^-1 D^1/2.

A block of rows a with the prior variance t, at its likeliest, raises the log density of r by

    1/2 q' (Q + 1/t)^-1 q,   Q = a C^-1 a',  q = a C^-1 r.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import linalg

from tirelib.core.arrays import FloatArray

LEAST_VARIANCE = 1e-11
"""Variance that stands for none: so little that no sample tells it from zero."""


def blocks_of(rows: Mapping[str, FloatArray]) -> dict[str, slice]:
    """Return where the rows (k, ...) of each name stand if they are put one after the other."""
    ends = np.cumsum([len(block) for block in rows.values()]).tolist()
    return dict(zip(rows, map(slice, [0, *ends], ends), strict=False))


@dataclass(frozen=True, slots=True, eq=False)
class Normal:
    """Normal equations.

    Attributes
    ----------
    blocks : mapping of name to slice
        Where the rows of each block stand.
    gram : shape (m, m)
    right : shape (m,)
    square : float
        Sum of squares of the residual.
    count : int
        How many samples it has.
    mean : shape (m,)
        Coefficients that have been taken off the residual.
    """

    blocks: Mapping[str, slice]
    gram: FloatArray
    right: FloatArray
    square: float
    count: int
    mean: FloatArray

    @classmethod
    def of(
        cls,
        rows: Mapping[str, FloatArray],
        rest: FloatArray,
        whiten: Callable[[FloatArray], FloatArray] | None = None,
    ) -> "Normal":
        """Return the normal equations of named rows (k, ...) and a residual (...).

        Without `whiten` they are white already, of shapes (k, n) and (n,).
        """
        every = np.concatenate(list(rows.values()))
        if whiten is not None:
            every, rest = whiten(every), whiten(rest)
        return cls.stacked(blocks_of(rows), every, rest)

    @classmethod
    def stacked(cls, blocks: Mapping[str, slice], white: FloatArray, rest: FloatArray) -> "Normal":
        """Return the normal equations of white rows (m, n), all in one, and a residual (n,)."""
        none = np.zeros(len(white))
        return cls(blocks, white @ white.T, white @ rest, float(rest @ rest), rest.size, none)

    def about(self, means: Mapping[str, float]) -> "Normal":
        """Return the normal equations of what is left once blocks have these coefficients."""
        mean = np.zeros(len(self.right))
        for name, value in means.items():
            if name in self.blocks:
                mean[self.blocks[name]] = value
        turned = self.gram @ mean
        square = self.square - float(mean @ (2.0 * self.right - turned))
        return replace(self, right=self.right - turned, square=square, mean=self.mean + mean)

    def spread(self, variance: Mapping[str, float | FloatArray]) -> FloatArray:
        """Return the diagonal of D, shape (m,), from variances by block; absent ones are zero."""
        out = np.zeros(len(self.right))
        for name, block in self.blocks.items():
            out[block] = variance.get(name, 0.0)
        return out


class Weighed:
    """Normal equations in the metric of C.

    With R = D^1/2 and A = I + R G R, everything is made of one inverse: X = R A^-1 R,
    G - G X G = R^-1 (I - A^-1) R^-1 and g - G X g = R^-1 A^-1 R g.

    Parameters
    ----------
    normal : Normal
    spread : shape (m,)
        Diagonal of D. A variance below `LEAST_VARIANCE` counts as `LEAST_VARIANCE`.
    """

    def __init__(self, normal: Normal, spread: FloatArray) -> None:
        self.normal = normal
        self.root = np.sqrt(np.maximum(spread, LEAST_VARIANCE))
        inner = self.root[:, None] * normal.gram * self.root
        inner.flat[:: self.root.size + 1] += 1.0
        # the routines without their wrappers: a diagnosis factors tens of thousands of these
        lower, failed = linalg.lapack.dpotrf(inner.T, lower=1, overwrite_a=1)
        if failed:
            raise linalg.LinAlgError("the products of the rows are not positive definite")
        self.lower: FloatArray = lower

    @cached_property
    def _inverse(self) -> FloatArray:
        below, failed = linalg.lapack.dpotri(self.lower, lower=1)
        assert not failed  # noqa: S101 - the factor has a positive diagonal
        out: FloatArray = below + np.tril(below, -1).T  # above the diagonal the factor is zero
        return out

    @cached_property
    def covariance(self) -> FloatArray:
        """Covariance X of beta, given the residual, shape (m, m)."""
        out: FloatArray = self.root[:, None] * self._inverse * self.root
        return out

    @cached_property
    def gram(self) -> FloatArray:
        """B C^-1 B', shape (m, m)."""
        out: FloatArray = -self._inverse
        out.flat[:: self.root.size + 1] += 1.0
        out /= self.root[:, None] * self.root
        return out

    def right(self, right: FloatArray) -> FloatArray:
        """Return B C^-1 r of right-hand sides B r of shape (m,) or (m, k)."""
        out: FloatArray = ((self._inverse @ (self.root * right.T).T).T / self.root).T
        return out

    def mean(self, right: FloatArray) -> FloatArray:
        """Return the posterior mean of beta, shape (m,) or (m, k)."""
        out: FloatArray = self.covariance @ right
        return out

    def draws(self, random: np.random.Generator, count: int = 1) -> FloatArray:
        """Return draws of beta from its posterior, shape (count, m)."""
        values, vectors = np.linalg.eigh(self.covariance)
        noise = np.sqrt(np.clip(values, 0.0, None)) * random.standard_normal((count, values.size))
        out: FloatArray = self.mean(self.normal.right) + noise @ vectors.T
        return out

    def gain(self, right: FloatArray) -> FloatArray:
        """Return the log density of residuals over that of unit noise alone, for (m, k)."""
        turned, _ = linalg.lapack.dtrtrs(self.lower, (self.root * right.T).T, lower=1)
        return np.asarray(0.5 * np.sum(turned**2, axis=0) - np.sum(np.log(np.diag(self.lower))))

    def log_likelihood(self) -> float:
        """Return the log density of the residual, up to a constant of the samples' number."""
        gain = self.gain(self.normal.right[:, None])[0]
        return float(gain - 0.5 * self.normal.square)


def taken(
    gram: FloatArray, right: FloatArray, blocks: Sequence[slice], more: FloatArray
) -> FloatArray:
    """Return by how much blocks, each at its likeliest, raise the log density, (n_blocks, k).

    Parameters
    ----------
    gram : shape (m, m)
        B C^-1 B' (`Weighed.gram`).
    right : shape (m, k)
        B C^-1 r of k residuals (`Weighed.right`).
    blocks : sequence of slice
    more : shape (m,)
        Variance of each row beyond D, larger than zero: the prior of its coefficient.
    """
    first = [block.start for block in blocks]
    # most effects have one strength, and a division costs least
    out = right[first] ** 2 / (gram[first, first] + 1.0 / more[first])[:, None]
    for j, block in enumerate(blocks):
        if block.stop - block.start > 1:
            inner = gram[block, block] + np.diag(1.0 / more[block])
            here = right[block]
            _, solved, failed = linalg.lapack.dposv(inner, here, lower=1)
            assert not failed  # noqa: S101 - more than a positive diagonal was added
            out[j] = np.sum(here * solved, axis=0)
    return np.asarray(0.5 * out)


def beside(
    gram: FloatArray, right: FloatArray, block: slice, more: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return B C^-1 B' and B C^-1 r where C has more variance in one block.

    The arguments are those of `taken`, for one block.
    """
    inner = gram[block, block] + np.diag(1.0 / more[block])
    share = np.linalg.solve(inner, gram[block])
    return gram - gram[:, block] @ share, right - share.T @ right[block]
