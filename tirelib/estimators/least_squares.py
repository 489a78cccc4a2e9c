"""Ordinary least squares with the statistics of its coefficients."""

from dataclasses import dataclass

import numpy as np
from scipy.special import stdtr

from tirelib.core.arrays import FloatArray


@dataclass(frozen=True, slots=True)
class LeastSquares:
    """A fit of y = x b by ordinary least squares.

    Attributes
    ----------
    coefficients, std_errors, p_values : arrays, shape (k,)
        Each p-value is that of a two-sided t-test against a coefficient of zero.
    fitted : array, shape (n,), unit of y
    r2 : float
        Share of the variance of y about its mean that the fit takes away.
    """

    coefficients: FloatArray
    std_errors: FloatArray
    p_values: FloatArray
    fitted: FloatArray
    r2: float


def least_squares(x: FloatArray, y: FloatArray) -> LeastSquares:
    """Fit a linear regression, one of whose columns is constant.

    Parameters
    ----------
    x : array, shape (n, k), with n > k
    y : array, shape (n,)
    """
    inverse = np.linalg.pinv(x)
    coefficients = inverse @ y
    fitted = x @ coefficients
    freedom = y.size - np.linalg.matrix_rank(x)
    squares = float(np.sum((y - fitted) ** 2))
    errors = np.sqrt(squares / freedom * np.sum(inverse**2, axis=1))
    return LeastSquares(
        coefficients,
        errors,
        np.asarray(2.0 * stdtr(freedom, -np.abs(coefficients / errors)), dtype=np.float64),
        fitted,
        1.0 - squares / float(np.sum((y - y.mean()) ** 2)),
    )
