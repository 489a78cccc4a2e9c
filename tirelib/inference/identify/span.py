"""The space that columns span, as far as they are known."""

import numpy as np
from scipy import linalg

from tirelib.core.arrays import FloatArray

KNOWN = 1e-5
"""Singular value, of columns of length one and over the largest, below which a direction is that of
finite differences and rounding: two pressures are needed to tell a stiffness from its slope."""


def span(columns: FloatArray) -> FloatArray:
    """Return an orthonormal basis of columns (n, k), of shape (n, <= k).

    Columns of zeros, and what depends on the others but for the errors of finite differences, add
    nothing: a basis that holds such a direction would differ with the number of threads.

    Examples
    --------
    >>> span(np.array([[1.0, 2.0, 0.0], [0.0, 1e-9, 0.0], [0.0, 0.0, 0.0]])).shape
    (3, 1)
    """
    size = np.sqrt(np.sum(columns**2, axis=0))
    if not size.any():
        return np.zeros((len(columns), 0))
    basis: FloatArray = linalg.orth(columns[:, size != 0.0] / size[size != 0.0], rcond=KNOWN)
    return basis
