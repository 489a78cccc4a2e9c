"""Normal equations of everything that may explain a residual, and evidence in them.

With rows B and a residual r of unit noise, r = B' beta + e and beta ~ N(0, D), all that is ever
needed of thousands of samples is G = B B' and g = B r. The covariance of r is C = I + B' D B, and

    B C^-1 B' = G - G X G,   B C^-1 r = g - G X g,   X = D^1/2 (I + D^1/2 G D^1/2)^-1 D^1/2.

The log evidence that a block of rows a has the variance t more than D says is

    1/2 q' (Q + 1/t)^-1 q - 1/2 log det(1 + t Q),   Q = a C^-1 a',  q = a C^-1 r.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tirelib.arrays import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Normal:
    """Normal equations.

    Attributes
    ----------
    blocks : mapping of name to slice
        Of the rows.
    gram : shape (m, m)
    right : shape (m,)
    square : float
        Sum of squares of the residual.
    count : int
        Of its samples.
    """

    blocks: Mapping[str, slice]
    gram: FloatArray
    right: FloatArray
    square: float
    count: int

    @classmethod
    def of(
        cls,
        rows: Mapping[str, FloatArray],
        rest: FloatArray,
        whiten: Callable[[FloatArray], FloatArray],
    ) -> "Normal":
        """Return the normal equations of named rows (k, ...) and a residual (...)."""
        blocks, first = {}, 0
        for name, block in rows.items():
            blocks[name] = slice(first, first + len(block))
            first += len(block)
        every = whiten(np.concatenate(list(rows.values())))
        rest = whiten(rest)
        return cls(blocks, every @ every.T, every @ rest, float(rest @ rest), rest.size)

    def spread(self, variance: Mapping[str, float | FloatArray]) -> FloatArray:
        """Return the diagonal of D, shape (m,), from variances by block; absent ones are zero."""
        out = np.zeros(len(self.right))
        for name, block in self.blocks.items():
            out[block] = variance.get(name, 0.0)
        return out


class Weighed:
    """Normal equations in the metric of C.

    Parameters
    ----------
    normal : Normal
    spread : shape (m,)
        Diagonal of D.
    """

    def __init__(self, normal: Normal, spread: FloatArray) -> None:
        self.normal = normal
        root = np.sqrt(spread)
        inner = np.eye(root.size) + root[:, None] * normal.gram * root
        self.lower = np.linalg.cholesky(inner)
        half = np.linalg.solve(self.lower, np.diag(root))
        self.covariance = half.T @ half
        """Of beta, given the residual (X)."""
        self._turned = normal.gram @ self.covariance
        self.gram = normal.gram - self._turned @ normal.gram

    def right(self, right: FloatArray) -> FloatArray:
        """Return B C^-1 r of right-hand sides B r of shape (m,) or (m, k)."""
        out: FloatArray = right - self._turned @ right
        return out

    def mean(self, right: FloatArray) -> FloatArray:
        """Return the posterior mean of beta, shape (m,) or (m, k)."""
        out: FloatArray = self.covariance @ right
        return out

    def draw(self, random: np.random.Generator) -> FloatArray:
        """Return one draw of beta from its posterior, shape (m,)."""
        values, vectors = np.linalg.eigh(self.covariance)
        noise = np.sqrt(np.clip(values, 0.0, None)) * random.standard_normal(values.size)
        out: FloatArray = self.mean(self.normal.right) + vectors @ noise
        return out

    def gain(self, right: FloatArray) -> FloatArray:
        """Return the log density of residuals over that of unit noise alone, for (m, k)."""
        explained = 0.5 * np.sum(right * self.mean(right), axis=0)
        return np.asarray(explained - np.sum(np.log(np.diag(self.lower))))

    def log_likelihood(self) -> float:
        """Return the log density of the residual, up to a constant of the samples' number."""
        gain = self.gain(self.normal.right[:, None])[0]
        return float(gain - 0.5 * self.normal.square)


def evidence(
    weighed: Weighed, right: FloatArray, blocks: Sequence[slice], more: Sequence[FloatArray]
) -> FloatArray:
    """Return the log evidence of more variance in each block, for each right-hand side.

    Parameters
    ----------
    weighed : Weighed
    right : shape (m, k)
        B C^-1 r of k residuals (`Weighed.right`).
    blocks : sequence of slice
    more : sequence of shape (rows of the block,)
        Variance beyond D, larger than zero.

    Returns
    -------
    shape (n_blocks, k)
    """
    out = []
    for block, variance in zip(blocks, more, strict=True):
        root = np.sqrt(variance)
        inner = np.eye(root.size) + root[:, None] * weighed.gram[block, block] * root
        lower = np.linalg.cholesky(inner)
        turned = np.linalg.solve(lower, root[:, None] * right[block])
        out.append(0.5 * np.sum(turned**2, axis=0) - np.sum(np.log(np.diag(lower))))
    return np.array(out)
