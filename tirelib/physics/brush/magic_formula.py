r"""The sine version of the Magic Formula for one cornering curve (Fig. 4-20, 4-23).

.. math:: F_y = -D \sin\{C \arctan[B x - E (B x - \arctan B x)]\} + S_v, \qquad x = \alpha + S_h

with C_alpha = B C D > 0, ISO 8855: a positive slip angle gives a negative force.
"""

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from tirelib.core.arrays import FloatArray


def sine_curve(
    x: npt.ArrayLike, B: npt.ArrayLike, C: npt.ArrayLike, D: npt.ArrayLike, E: npt.ArrayLike
) -> FloatArray:
    """Return D sin(C atan(B x - E (B x - atan(B x)))); arguments broadcast.

    Examples
    --------
    >>> float(sine_curve(1e3, 1.0, 1.0, 4000.0, 0.0))
    3999.998
    """
    angle = magic_angle(np.asarray(x, np.float64), np.asarray(B, np.float64), np.asarray(E))
    return np.asarray(np.asarray(D) * np.sin(np.asarray(C) * angle), dtype=np.float64)


def magic_angle(x: FloatArray, B: FloatArray, E: FloatArray) -> FloatArray:
    """Return the angle under the sine or cosine of the Magic Formula, over C."""
    b = B * x
    return np.asarray(np.arctan(b - E * (b - np.arctan(b))))


def lateral_curve(slip_angle: npt.ArrayLike, coefficients: Mapping[str, float]) -> FloatArray:
    """Return Fy, [N], of fitted coefficients at slip angles [rad]."""
    c = coefficients
    B = c["C_alpha"] / (c["C"] * c["D"])
    x = np.asarray(slip_angle, dtype=np.float64) + c["S_h"]
    return -sine_curve(x, B, c["C"], c["D"], c["E"]) + c["S_v"]
