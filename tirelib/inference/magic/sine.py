"""Fit of the sine version of the Magic Formula to one cornering curve (Fig. 4-20, 4-23).

The fit gives the cornering stiffness and the peak force with standard deviations. A curve that
stops before its peak leaves D and C to chance; the fit says so instead of handing out an
extrapolation. The formula is `tirelib.physics.brush.magic_formula`.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from types import MappingProxyType

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ParameterError
from tirelib.physics.brush.magic_formula import lateral_curve

NAMES = ("C_alpha", "D", "C", "E", "S_h", "S_v")
_LOWEST = (0.05, 0.05, 1.0, -20.0, -np.inf, -np.inf)
_HIGHEST = (50.0, 50.0, 2.0, 1.0, np.inf, np.inf)
"""Bounds of the coefficients over their sizes; only with C from 1 to 2 is D the peak."""
MOST_STD = 0.05
LEAST_REACH = 0.9
"""Share of the fitted peak that the data must have seen."""
_WEAK = 1e-10
"""Singular value over the largest at which a direction counts as known no better."""


@dataclass(frozen=True, slots=True, eq=False)
class SineFit:
    """Coefficients of one cornering curve.

    Attributes
    ----------
    coefficients : mapping
        C_alpha [N/rad], D [N], C, E, S_h [rad], S_v [N].
    covariance : array, shape (6, 6)
        In the order of `NAMES`, from the residuals.
    stiffness, stiffness_std : float, [N/rad]
        Cornering stiffness C_alpha.
    peak, peak_std : float, [N]
        Peak lateral force F_yp = D (C >= 1), offset S_v left out.
    reach : float
        Largest offset-free force in the data, as a share of the peak.
    peak_determined : bool
        The data reach at least 0.9 of the peak and determine it within 5 %.
    residual_std : float, [N]
        Residual standard deviation of the fit.
    at_limit : tuple of str
        Coefficients that ended at their bound.
    """

    coefficients: Mapping[str, float]
    covariance: FloatArray
    stiffness: float
    stiffness_std: float
    peak: float
    peak_std: float
    reach: float
    peak_determined: bool
    residual_std: float
    at_limit: tuple[str, ...]


def fit_sine(slip_angle: npt.ArrayLike, Fy: npt.ArrayLike) -> SineFit:
    """Fit one cornering curve at one load.

    Parameters
    ----------
    slip_angle : array, shape (n,), [rad]
    Fy : array, shape (n,), [N]
        ISO 8855.

    Raises
    ------
    ParameterError
        If there are too few angles, something is not finite, or the force does not fall with the
        slip angle (then the axes are not ISO 8855).
    """
    alpha, force = np.asarray(slip_angle, np.float64), np.asarray(Fy, np.float64)
    slope, top = _slope(alpha, force), float(np.abs(force).max())
    size = np.array([slope, top, 1.0, 1.0, 0.01, 0.02 * top])

    def coefficients(z: FloatArray) -> dict[str, float]:
        return dict(zip(NAMES, (z * size).tolist(), strict=True))

    def residual(z: FloatArray) -> FloatArray:
        return (lateral_curve(alpha, coefficients(z)) - force) / top

    runs = [
        least_squares(
            residual,
            [1.2, peak, shape, 0.0, 0.0, 0.0],
            bounds=(_LOWEST, _HIGHEST),
            xtol=1e-13,
            ftol=1e-13,
            gtol=1e-13,
            max_nfev=2000,
        )
        for peak, shape in product((1.02, 1.5), (1.2, 1.6))
    ]
    best = min(runs, key=lambda run: float(run.cost))
    found = coefficients(best.x)
    spread = float(np.sqrt(2.0 * best.cost / (alpha.size - len(NAMES)))) * top
    _, s, vt = np.linalg.svd(np.asarray(best.jac), full_matrices=False)
    root = vt.T / np.maximum(s, _WEAK * s[0]) * (size[:, None] * spread / top)
    covariance = np.asarray(root @ root.T)
    std = dict(zip(NAMES, np.sqrt(np.diag(covariance)).tolist(), strict=True))
    reach = float(np.abs(force - found["S_v"]).max()) / found["D"]
    return SineFit(
        MappingProxyType(found),
        covariance,
        found["C_alpha"],
        std["C_alpha"],
        found["D"],
        std["D"],
        reach,
        std["D"] <= MOST_STD * found["D"] and reach >= LEAST_REACH,
        spread,
        tuple(name for name, side in zip(NAMES, best.active_mask, strict=True) if side),
    )


def _slope(alpha: FloatArray, force: FloatArray) -> float:
    """Check the data; return a first guess of C_alpha."""
    if alpha.ndim != 1 or alpha.shape != force.shape:
        raise ParameterError(
            f"slip_angle has shape {alpha.shape}, Fy {force.shape}; both must be one-dimensional "
            "and of the same length"
        )
    if not np.all(np.isfinite(alpha) & np.isfinite(force)):
        raise ParameterError("a slip angle or a force is not finite; leave such samples out")
    distinct = np.unique(alpha).size
    if distinct < len(NAMES) + 1:
        raise ParameterError(
            f"{distinct} different slip angles for {len(NAMES)} coefficients; at least "
            f"{len(NAMES) + 1} are needed; measure more"
        )
    near = np.abs(alpha) <= np.quantile(np.abs(alpha), 0.4)
    slope = float(np.polynomial.polynomial.polyfit(alpha[near], force[near], 1)[1])
    if not slope < 0.0:
        raise ParameterError(
            "Fy grows with the slip angle; in ISO 8855 a positive slip angle gives a negative "
            "force; convert the axes (tirelib.core.axes)"
        )
    return -slope
