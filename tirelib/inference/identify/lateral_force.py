"""Lateral force by the brush with the ring's pressure, against the parabola (section 6.6).

Both brushes have the same half lengths, the same constants to fit (c_py, mu, offsets) and the same
fit; only the pressure over the contact differs: that of the rolling ring at the point's load,
inflation pressure and speed, or the parabola with the same load and edges. Errors stand by load,
inflation pressure and slip angle (Fig. 6-38 to 6-42), once for the fit to all points and once with
every point predicted by a fit that has not seen it.

The bristle stiffness may differ from one load and pressure to the next, as Eq. (26) makes it from
the cornering stiffness of each; that leaves the pressure's shape as the only difference. Or it is
one for all: then the contact length's dependence on load and pressure is judged as well, and what
no bristle has, a carcass that yields, decides the errors.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

import numpy as np
from scipy.optimize import least_squares

from tirelib.core.arrays import BoolArray, FloatArray, IntArray
from tirelib.core.errors import CalibrationError, ParameterError
from tirelib.core.parameters import Tire
from tirelib.inference.identify.brush_fit import fit_brush
from tirelib.inference.identify.error_bands import bands, cells_of_load
from tirelib.inference.identify.force_data import ForceData
from tirelib.inference.identify.ring_patch import profiles
from tirelib.physics.brush.forces import brush_forces
from tirelib.physics.brush.parameters import BrushParameters
from tirelib.physics.contact.profiles import PressureProfile

MOST_POINTS = 2000
"""Profiles are solved and integrated point by point: take run means, or thin a sweep."""
SIGNIFICANT = 2.0
"""Standard errors of the mean difference from which one pressure counts as better."""
KINDS = ("ring", "parabola")
FITTED = (
    "lateral_stiffness",
    "friction",
    "slip_angle_offset",
    "Fy_offset",
    "camber_thrust",
)
"""Constants of the brush; the camber thrust only where camber varies."""
_FOLDS = 5
_SIZE = MappingProxyType({"slip_angle_offset": 0.01, "Fy_offset": 200.0, "camber_thrust": 0.5})


@dataclass(frozen=True, slots=True)
class PressureBand:
    """Errors of both pressures over one band, [N].

    Attributes
    ----------
    by, low, high : str, float, float
        Condition (all, load, pressure, slip_angle) and its range.
    ring_rmse, parabola_rmse : float
        Root mean square error of the fit to all points.
    ring_bias, parabola_bias : float
        Mean of abs(predicted) less abs(measured): positive overestimates.
    ring_rmse_unseen, parabola_rmse_unseen : float
        Root mean square error where the point was not in the fit.
    gain : float
        Mean difference of the unseen squared errors, parabola less ring, over its standard error,
        points taken as independent.
    better : str
        ring, parabola, or "no difference" for abs(gain) < 2.
    """

    by: str
    low: float
    high: float
    points: int
    ring_rmse: float
    parabola_rmse: float
    ring_bias: float
    parabola_bias: float
    ring_rmse_unseen: float
    parabola_rmse_unseen: float
    gain: float
    better: str


@dataclass(frozen=True, slots=True, eq=False)
class PressureComparison:
    """Lateral force by the ring's pressure and by the parabola.

    Attributes
    ----------
    values : mapping of kind to mapping of name to float
        Constants for "ring" and "parabola", SI, without the bristle stiffness.
    stiffness : mapping of kind to array, shape (n_conditions,), [N/m^2]
        c_py, one for each load and pressure or one for all.
    condition : array of int, shape (n,)
        Which of them each point has.
    predicted, unseen : mapping of kind to array, shape (n,), [N]
        Fy by the fit to all points, and by fits without the point.
    half_length : array, shape (n,), [m]
    table : tuple of PressureBand
        All points first.
    """

    values: Mapping[str, Mapping[str, float]]
    stiffness: Mapping[str, FloatArray]
    condition: IntArray
    predicted: Mapping[str, FloatArray]
    unseen: Mapping[str, FloatArray]
    half_length: FloatArray
    table: tuple[PressureBand, ...]


def compare_pressures(
    data: ForceData,
    tire: Tire,
    *,
    stiffness: Literal["each", "one"] = "each",
    held: Mapping[str, float] | None = None,
) -> PressureComparison:
    """Fit the brush with both pressures and compare their lateral forces.

    Parameters
    ----------
    data : ForceData
        Run means, freely rolling, at least two slip angles; at most 2000 points.
    tire : Tire
        Its ring gives pressure and contact length.
    stiffness : {"each", "one"}
        c_py for each load and pressure, or one for all. Points are predicted unseen by leaving out
        every fifth slip angle in turn ("each"), or the point's load and pressure altogether ("one",
        with several of them).
    held : mapping of name to value, optional
        Any of lateral_stiffness, friction, slip_angle_offset, Fy_offset, camber_thrust; not fitted.

    Raises
    ------
    CalibrationError
        If there are too many or too few points, or Fy or the slip angles do not suffice.
    ParameterError, ConvergenceError
        From fit, ring and contact.
    """
    _check(data)
    if stiffness not in ("each", "one"):
        raise ParameterError(
            f"lateral force: stiffness = {stiffness!r}; allowed are 'each' and 'one'"
        )
    ring, parabola = profiles(tire, data.load, data.pressure, data.omega)
    camber = bool(np.ptp(data.camber) > np.deg2rad(0.5))
    known = {**({} if camber else {"camber_thrust": 0.0}), **(held or {})}
    half = 0.5 * ring.length
    start = _start(data, half, known)
    free = tuple(name for name in start if name not in known)
    conditions = cells_of_load(data)
    group = conditions if stiffness == "each" else np.zeros_like(conditions)
    folds = _parts(data, group) if group.max() == conditions.max() else conditions
    values, constants, predicted, unseen = {}, {}, {}, {}
    for kind, profile in zip(KINDS, (ring, parabola), strict=True):
        model = _Model(data, profile, group, free, start)
        z = model.solve(model.start(), np.ones(len(data), dtype=np.bool_))
        values[kind], constants[kind] = model.values(z)
        predicted[kind] = model.force(z[None])[0]
        out = np.empty(len(data))
        for fold in np.unique(folds):
            here = folds == fold
            out[here] = model.force(model.solve(z, ~here)[None])[0, here]
        unseen[kind] = out
    table = _table(data, predicted, unseen)
    return PressureComparison(values, constants, group, predicted, unseen, half, table)


@dataclass(frozen=True, slots=True, eq=False)
class _Model:
    """The brush at all points as a function of z: logarithms, or numbers over their size.

    The logarithms of c_py, one per group, come first if it is free.
    """

    data: ForceData
    profile: PressureProfile
    group: IntArray
    free: tuple[str, ...]
    base: Mapping[str, float]

    @property
    def n_stiff(self) -> int:
        """Number of bristle stiffnesses in z."""
        return int(self.group.max()) + 1 if "lateral_stiffness" in self.free else 0

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the rest of z."""
        return tuple(name for name in self.free if name != "lateral_stiffness")

    def start(self) -> FloatArray:
        """Return z of the base."""
        rest = [self.base[n] / _SIZE[n] if n in _SIZE else np.log(self.base[n]) for n in self.names]
        first = np.log(self.base["lateral_stiffness"])
        return np.concatenate([np.full(self.n_stiff, first), rest])

    def values(self, z: FloatArray) -> tuple[dict[str, float], FloatArray]:
        """Return the constants, and the stiffness of each group."""
        count = int(self.group.max()) + 1
        stiff = np.exp(z[: self.n_stiff])
        if not self.n_stiff:
            stiff = np.full(count, self.base["lateral_stiffness"])
        return {name: float(value[0, 0]) for name, value in self._rest(z[None]).items()}, stiff

    def force(self, z: FloatArray) -> FloatArray:
        """Return Fy for several z, shape (m, p), at all points, shape (m, n)."""
        at = self._rest(z)
        stiff = np.exp(z[:, self.group]) if self.n_stiff else self.base["lateral_stiffness"]
        angle = self.data.slip_angle + at["slip_angle_offset"]
        angle = angle + at["camber_thrust"] * self.data.camber
        brush = BrushParameters(stiff, at["friction"])
        return brush_forces(self.profile, brush, angle).Fy + at["Fy_offset"]

    def solve(self, z: FloatArray, used: BoolArray) -> FloatArray:
        """Fit the points in use."""
        if not z.size:
            return z
        scale = 0.05 * float(np.sqrt(np.mean(self.data.Fy**2)))

        def residual(x: FloatArray) -> FloatArray:
            rest = self.force(x[None])[0] - self.data.Fy
            return np.asarray(rest[used] / scale, dtype=np.float64)

        def jacobian(x: FloatArray) -> FloatArray:
            return np.asarray(self.slopes(x)[used] / scale, dtype=np.float64)

        found = least_squares(residual, z, jacobian, xtol=1e-7, ftol=1e-9, max_nfev=60)
        return np.asarray(found.x, dtype=np.float64)

    def slopes(self, z: FloatArray) -> FloatArray:
        """Return dFy/dz, shape (n, p); all stiffnesses in one step, as each has its own points."""
        step, first = 1e-5, self.n_stiff
        moves = np.zeros((bool(first) + z.size - first, z.size))
        moves[:1, :first] = step
        moves[bool(first) :, first:] = step * np.eye(z.size - first)
        force = self.force(z + np.vstack([np.zeros(z.size), moves]))
        slope = (force[1:] - force[0]).T / step
        if not first:
            return np.asarray(slope)
        own = slope[:, :1] * (self.group[:, None] == np.arange(first))
        return np.concatenate([own, slope[:, 1:]], axis=1)

    def _rest(self, z: FloatArray) -> dict[str, FloatArray]:
        """Return the constants without stiffness, each shape (m, 1)."""
        columns = dict(zip(self.names, z[:, self.n_stiff :].T, strict=True))
        out = {}
        for name, base in self.base.items():
            if name == "lateral_stiffness":
                continue
            column = columns.get(name)
            if column is None:
                value = np.full(len(z), base)
            else:
                value = column * _SIZE[name] if name in _SIZE else np.exp(column)
            out[name] = value[:, None]
        return out


def _start(data: ForceData, half: FloatArray, known: Mapping[str, float]) -> dict[str, float]:
    """Return the constants of the parabola's closed form: the start for both pressures."""
    if all(name in known for name in FITTED):
        return {name: known[name] for name in FITTED}
    size = {"half_length": float(np.median(half)), "load_power": 0.5}
    free = () if "camber_thrust" in known else ("camber_thrust",)
    found = fit_brush(data, forces=("Fy",), free=free, held={**size, **known}, robust=None).values
    return {name: found[name] for name in FITTED}


def _check(data: ForceData) -> None:
    if len(data) > MOST_POINTS:
        raise CalibrationError(
            f"lateral force: {len(data)} points; allowed are {MOST_POINTS}: every point has its "
            "own pressure; take run means, or thin the sweep (`every` of force_data)"
        )
    missing = int((~np.isfinite(data.Fy)).sum())
    if missing:
        raise CalibrationError(
            f"lateral force: Fy is not measured at {missing} of {len(data)} points; leave them out"
        )
    if np.abs(data.slip_ratio).max() > 0.01:
        raise CalibrationError(
            f"lateral force: a slip ratio of {float(np.abs(data.slip_ratio).max()):.3g}; freely "
            "rolling points are needed, up to 0.01; leave drive and brake runs out"
        )


def _parts(data: ForceData, group: IntArray) -> IntArray:
    """Return five parts, each with every fifth slip angle of every group."""
    order = np.lexsort((data.slip_angle, group))
    first = np.searchsorted(group[order], group[order], side="left")
    part = np.empty_like(group)
    part[order] = (np.arange(group.size) - first + group[order]) % _FOLDS
    return part


def _table(
    data: ForceData, predicted: Mapping[str, FloatArray], unseen: Mapping[str, FloatArray]
) -> tuple[PressureBand, ...]:
    size = np.abs(data.Fy)
    error = {kind: predicted[kind] - data.Fy for kind in KINDS}
    blind = {kind: unseen[kind] - data.Fy for kind in KINDS}
    over = {kind: np.abs(predicted[kind]) - size for kind in KINDS}
    out = []
    for band in bands(data):
        m = band.member
        lead = blind["parabola"][m] ** 2 - blind["ring"][m] ** 2
        spread = float(lead.std(ddof=1) / np.sqrt(lead.size)) if lead.size > 2 else np.inf
        gain = float(lead.mean()) / spread if spread > 0.0 else 0.0
        better = "no difference"
        if abs(gain) >= SIGNIFICANT:
            better = KINDS[0] if gain > 0.0 else KINDS[1]
        sizes = {f"{kind}_rmse": _rms(error[kind][m]) for kind in KINDS}
        sizes |= {f"{kind}_bias": float(over[kind][m].mean()) for kind in KINDS}
        sizes |= {f"{kind}_rmse_unseen": _rms(blind[kind][m]) for kind in KINDS}
        points = int(m.sum())
        out.append(
            PressureBand(band.by, band.low, band.high, points, **sizes, gain=gain, better=better)
        )
    return tuple(out)


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))
