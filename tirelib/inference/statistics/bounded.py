"""A step of least squares whose coordinates have ends."""

import numpy as np
from scipy import optimize

from tirelib.core.arrays import FloatArray


def bounded_step(
    gram: FloatArray, gradient: FloatArray, low: FloatArray, high: FloatArray
) -> FloatArray:
    """Return the step to the bottom of a quadratic cost between ends.

    Parameters
    ----------
    gram : shape (n, n)
        Half of the cost's second derivative.
    gradient : shape (n,)
        Half of its fall by each coordinate.
    low, high : shape (n,)
        Steps to the ends of each coordinate.
    """
    free = np.asarray(np.linalg.solve(gram, gradient))
    if ((free >= low) & (free <= high)).all():
        return free
    lower = np.linalg.cholesky(gram)
    target = np.linalg.solve(lower, gradient)
    low, high = np.minimum(low, 0.0), np.maximum(high, 0.0)
    room = np.maximum(high, low + 1e-12)  # the solver wants some
    found = optimize.lsq_linear(lower.T, target, (low, room), method="bvls").x
    return np.asarray(np.clip(found, low, high))
