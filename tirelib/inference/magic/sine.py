"""Fit of the sine version of the Magic Formula to one cornering curve (Fig. 4-20, 4-23).

The fit gives the cornering stiffness and the peak force with standard deviations. A curve that
stops before its peak leaves D and C to chance; the fit says so instead of handing out an
extrapolation. The formula is `tirelib.physics.brush.magic_formula`.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
import numpy.typing as npt
from scipy.optimize import OptimizeResult, least_squares

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ParameterError
from tirelib.physics.brush.magic_formula import lateral_curve

NAMES = ("C_alpha", "D", "C", "E", "S_h", "S_v")
LOWEST = MappingProxyType({"C": 1.0, "E": -20.0})
HIGHEST = MappingProxyType({"C": 2.0, "E": 1.0})
MOST_STD = 0.05
LEAST_REACH = 0.9
"""Share of the fitted peak that the data must have seen."""


@dataclass(frozen=True, slots=True, eq=False)
class SineFit:
    """Coefficients of one cornering curve.

    Attributes
    ----------
    coefficients : mapping
        C_alpha [N/rad], D [N], C, E, S_h [rad], S_v [N].
    covariance : array, shape (6, 6)
        In the order of `NAMES`; zero for what was held. From the residuals, or from the force's
        standard deviation where that was given.
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


def fit_sine(
    slip_angle: npt.ArrayLike,
    Fy: npt.ArrayLike,
    *,
    Fy_std: float | None = None,
    held: Mapping[str, float] | None = None,
) -> SineFit:
    """Fit one cornering curve at one load.

    Parameters
    ----------
    slip_angle : array, shape (n,), [rad]
    Fy : array, shape (n,), [N]
        ISO 8855.
    Fy_std : float, [N], optional
        Standard deviation of one force; by default the residuals' own.
    held : mapping, optional
        Coefficients that are not fitted, e.g. ``{"S_h": 0.0, "S_v": 0.0}``. What is held carries
        no uncertainty into the result: holding C makes any peak look certain.

    Raises
    ------
    ParameterError
        If there are too few angles, something is not finite, a name is unknown, or the force does
        not fall with the slip angle (then the axes are not ISO 8855).
    """
    alpha, force = np.asarray(slip_angle, np.float64), np.asarray(Fy, np.float64)
    fixed = dict(held or {})
    free = [name for name in NAMES if name not in fixed]
    slope = _check(alpha, force, fixed, free)
    search = _Search(alpha, force, fixed, free, slope)
    best = search.best()
    found, top = search.unpack(best.x), search.top
    spread = float(np.sqrt(2.0 * best.cost / (alpha.size - len(free)))) * top
    noise = spread if Fy_std is None else Fy_std
    jacobian = np.asarray(best.jac, dtype=np.float64)
    covariance = _covariance(jacobian, np.array(search.scales), free, noise / top)
    std = dict(zip(NAMES, np.sqrt(np.diag(covariance)), strict=True))
    reach = float(np.abs(force - found["S_v"]).max()) / found["D"]
    sure = bool(std["D"] <= MOST_STD * found["D"])
    return SineFit(
        MappingProxyType({n: found[n] for n in NAMES}),
        covariance,
        found["C_alpha"],
        float(std["C_alpha"]),
        found["D"],
        float(std["D"]),
        reach,
        sure and reach >= LEAST_REACH,
        spread,
        search.at_limit(best.x),
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Search:
    """Least squares for the free coefficients, each divided by its typical size."""

    alpha: FloatArray
    force: FloatArray
    held: Mapping[str, float]
    free: list[str]
    slope: float

    @property
    def top(self) -> float:
        return float(np.abs(self.force).max())

    @property
    def scales(self) -> list[float]:
        top = self.top
        sizes = {
            "C_alpha": self.slope,
            "D": top,
            "C": 1.0,
            "E": 1.0,
            "S_h": 0.01,
            "S_v": 0.02 * top,
        }
        return [sizes[name] for name in self.free]

    @property
    def bounds(self) -> tuple[list[float], list[float]]:
        low = [LOWEST.get(n, 0.05 if n in ("C_alpha", "D") else -np.inf) for n in self.free]
        high = [HIGHEST.get(n, 50.0 if n in ("C_alpha", "D") else np.inf) for n in self.free]
        return low, high

    def unpack(self, values: FloatArray) -> dict[str, float]:
        """Return all coefficients."""
        sized = zip(self.free, values, self.scales, strict=True)
        return {**{n: float(v) * scale for n, v, scale in sized}, **self.held}

    def best(self) -> OptimizeResult:
        """Return the best of four searches."""

        def residual(values: FloatArray) -> FloatArray:
            return (lateral_curve(self.alpha, self.unpack(values)) - self.force) / self.top

        starts = (
            {"C_alpha": 1.2, "D": d, "C": c, "E": 0.0, "S_h": 0.0, "S_v": 0.0}
            for d in (1.02, 1.5)
            for c in (1.2, 1.6)
        )
        runs = [
            least_squares(
                residual,
                [start[n] for n in self.free],
                bounds=self.bounds,
                xtol=1e-13,
                ftol=1e-13,
                gtol=1e-13,
                max_nfev=2000,
            )
            for start in starts
        ]
        return min(runs, key=lambda run: float(run.cost))

    def at_limit(self, values: FloatArray) -> tuple[str, ...]:
        """Return the coefficients at their bounds."""
        ends = zip(self.free, values, *self.bounds, strict=True)
        return tuple(n for n, v, a, b in ends if abs(v - a) < 1e-6 or abs(v - b) < 1e-6)


def _covariance(
    jacobian: FloatArray, scale: FloatArray, free: list[str], noise: float
) -> FloatArray:
    """Return the covariance of all six; infinite where the data do not determine a coefficient."""
    _, s, vt = np.linalg.svd(jacobian, full_matrices=False)
    weak = s <= s[0] * 1e-10
    inverse = np.where(weak, 0.0, 1.0 / np.where(weak, 1.0, s))
    part = (vt.T * inverse**2) @ vt * noise**2 * np.outer(scale, scale)
    lost = (np.abs(vt[weak]) > 1e-6).any(axis=0)
    part[lost, lost] = np.inf
    whole = np.zeros((len(NAMES), len(NAMES)))
    index = [NAMES.index(name) for name in free]
    whole[np.ix_(index, index)] = part
    return whole


def _check(
    alpha: FloatArray, force: FloatArray, held: Mapping[str, float], free: list[str]
) -> float:
    """Check the data; return a first guess of C_alpha."""
    unknown = sorted(set(held) - set(NAMES))
    if unknown:
        raise ParameterError(f"held {', '.join(unknown)}; allowed are {', '.join(NAMES)}")
    if not 1.0 <= held.get("C", 1.0) <= 2.0:
        raise ParameterError(
            f"C held at {held['C']}; allowed is 1 .. 2, because only there D is the peak"
        )
    if alpha.ndim != 1 or alpha.shape != force.shape:
        raise ParameterError(
            f"slip_angle has shape {alpha.shape}, Fy {force.shape}; both must be one-dimensional "
            "and of the same length"
        )
    if not np.all(np.isfinite(alpha) & np.isfinite(force)):
        raise ParameterError("a slip angle or a force is not finite; leave such samples out")
    distinct = np.unique(alpha).size
    if distinct < len(free) + 1:
        raise ParameterError(
            f"{distinct} different slip angles for {len(free)} coefficients; at least "
            f"{len(free) + 1} are needed; measure more or hold some"
        )
    near = np.abs(alpha) <= np.quantile(np.abs(alpha), 0.4)
    slope, _ = np.polynomial.polynomial.polyfit(alpha[near], force[near], 1)[::-1]
    if not slope < 0.0:
        raise ParameterError(
            "Fy grows with the slip angle; in ISO 8855 a positive slip angle gives a negative "
            "force; convert the axes (tirelib.core.axes)"
        )
    return -float(slope)
