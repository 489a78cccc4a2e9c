r"""How much less certain a value is on a wheel that is braked or driven.

Most runs of a calibration roll freely, so one standard deviation of all held-out errors is theirs:
too wide for them, and far too narrow under traction, where the contact is bent along the wheel. So
the variance has two parts, of which one comes with the traction T = (CP1 - CP2) / TP,

.. math:: \sigma^2 = a + b\,\frac{T^2}{T^2 + T_0^2},

both those that make the held-out errors most likely.
"""

import numpy as np

from tirelib.core.arrays import FloatArray

PULL = 0.03
"""Traction at which half of it counts, T0. The rig's tires show up to 0.01 when they roll freely
and 0.07 to 0.18 at a slip ratio of 0.015; `docs/theory/estimate_numbers.md` has half and double."""
FEWEST_PULLED = 6
"""Runs with traction, and without, below which both count alike."""


def pull_share(traction: FloatArray) -> FloatArray:
    """Return which share of the traction's variance counts, shape (n,)."""
    square = np.square(traction)
    return np.asarray(square / (square + PULL**2))


def parted(
    error: FloatArray, uncertain: FloatArray, traction: FloatArray
) -> tuple[float, float] | None:
    """Return the roots of a and b; None where too few runs have traction, or none.

    Parameters
    ----------
    error, uncertain, traction : arrays, shape (n,)
        Held-out errors, the variance that uncertain coefficients leave, and the traction.
    """
    from scipy.optimize import minimize  # calibrating only

    share = pull_share(traction)
    if min((share > 0.5).sum(), (share <= 0.5).sum()) < FEWEST_PULLED:
        return None
    unit = float(np.mean(error**2))

    def surprise(logs: FloatArray) -> float:
        a, b = np.exp(logs)
        variance = uncertain / unit + a + b * share
        return float(np.sum(np.log(variance) + error**2 / unit / variance))

    found = minimize(
        surprise, np.array([-1.0, -1.0]), method="Nelder-Mead", bounds=[(-9.0, 9.0)] * 2
    )
    a, b = np.sqrt(np.exp(found.x) * unit)
    return float(a), float(b)
