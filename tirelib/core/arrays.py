"""Array types used throughout the library, the root mean square and R squared."""

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]
IntArray = npt.NDArray[np.int64]


def rms(values: FloatArray) -> float:
    """Return the root mean square; NaN of no values, and where one is NaN."""
    return float(np.sqrt(np.mean(values**2))) if values.size else float("nan")


def r_squared(measured: FloatArray, error: FloatArray) -> float:
    """Return the share of the squares about the mean that an estimate explains; NaN without any."""
    squares = float(np.sum((measured - measured.mean()) ** 2)) if measured.size else 0.0
    return 1.0 - float(np.sum(error**2)) / squares if squares > 0.0 else float("nan")
