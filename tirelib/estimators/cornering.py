r"""Cornering stiffness and peak lateral force against contact length (Fig. 4-20, 4-23).

Each load's cornering curve is fitted by the sine version of the Magic Formula,

.. math:: F_y = D \sin\{C \arctan[B\alpha - E(B\alpha - \arctan B\alpha)]\},
          \qquad C_\alpha = B C D, \quad F_{yp} = D,

in ISO signs (a positive slip angle gives a negative force), and both are regressed quadratically on
the centre contact length at zero slip angle. Where the measured slip angles do not reach the peak,
D is an extrapolation: its standard deviation says so.
"""

import warnings
from dataclasses import dataclass

import numpy as np
from scipy.optimize import OptimizeWarning, curve_fit

from tirelib.core.arrays import FloatArray
from tirelib.estimators.dissertation import Means

FEWEST_ANGLES = 6
FEWEST_LOADS = 3
LEAST_SHARE = 0.01
"""Floor of the relative standard deviation with which the fits of a load are weighed."""
SHAPE = 1.3
"""Shape factor C, held: it cannot be distinguished from E without data beyond the peak."""


@dataclass(frozen=True, slots=True)
class CorneringTrend:
    """One row per load.

    Attributes
    ----------
    load : array, shape (n,), [N]
    contact_length : array, shape (n,), [mm]
        Centre gage, mean over the slip angles.
    stiffness, stiffness_std : arrays, shape (n,), [N/deg]
    peak, peak_std : arrays, shape (n,), [N]
    stiffness_fit, peak_fit : arrays, shape (3,)
        Quadratic in the contact length, constant first.
    """

    load: FloatArray
    contact_length: FloatArray
    stiffness: FloatArray
    stiffness_std: FloatArray
    peak: FloatArray
    peak_std: FloatArray
    stiffness_fit: FloatArray
    peak_fit: FloatArray


def magic_formula(angle: FloatArray, stiffness: float, peak: float, bend: float) -> FloatArray:
    """Return the size of the lateral force, [N], at slip angles [deg]; stiffness in N/deg."""
    b = stiffness / (SHAPE * peak) * angle
    return np.asarray(
        peak * np.sin(SHAPE * np.arctan(b - bend * (b - np.arctan(b)))), dtype=np.float64
    )


def cornering_trend(means: Means) -> CorneringTrend | None:
    """Fit the trend; None where fewer than three loads have six slip angles without camber."""
    centre = int(np.argmin(np.abs(means.lateral)))
    upright = ~(np.abs(means.camber) > 0.5)
    load_step = 0.1 * float(np.mean(means.load))
    level = np.round(means.load / load_step)
    rows = []
    for step in np.unique(level):
        near = upright & (np.abs(means.load - step * load_step) <= load_step)
        near &= level == step
        angles = np.unique(np.round(means.slip_angle[near], 0))
        if angles.size < FEWEST_ANGLES:
            continue
        angle, force = means.slip_angle[near], -means.lateral_force[near]
        fitted = _fit_one(angle, force)
        if fitted is not None:
            length = float(np.mean(means.contact_length[near, centre]))
            rows.append((float(np.mean(means.load[near])), length, *fitted))
    if len(rows) < FEWEST_LOADS:
        return None
    table = np.array(rows).T
    load, length, stiffness, stiffness_std, peak, peak_std = table
    degree = min(2, len(rows) - 1)

    def quadratic(y: FloatArray, std: FloatArray) -> FloatArray:
        weight = 1.0 / np.hypot(std, LEAST_SHARE * np.abs(y))
        found = np.polynomial.polynomial.polyfit(length, y, degree, w=weight)
        return np.pad(found, (0, 2 - degree))

    return CorneringTrend(
        load,
        length,
        stiffness,
        stiffness_std,
        peak,
        peak_std,
        quadratic(stiffness, stiffness_std),
        quadratic(peak, peak_std),
    )


def _fit_one(angle: FloatArray, force: FloatArray) -> tuple[float, float, float, float] | None:
    """Fit one load: stiffness, its std, peak, its std."""
    top = float(np.abs(force).max())
    small = np.abs(angle) < 2.5
    slope = float((angle[small] @ force[small]) / (angle[small] @ angle[small]))
    with warnings.catch_warnings():
        warnings.simplefilter("error", OptimizeWarning)
        try:
            found, covariance = curve_fit(
                magic_formula,
                angle,
                force,
                p0=(slope, 1.1 * top, 0.0),
                bounds=([0.2 * slope, 0.8 * top, -10.0], [5.0 * slope, 3.0 * top, 1.0]),
            )
        except (RuntimeError, OptimizeWarning):
            return None
    std = np.sqrt(np.diag(covariance))
    return float(found[0]), float(std[0]), float(found[1]), float(std[1])
