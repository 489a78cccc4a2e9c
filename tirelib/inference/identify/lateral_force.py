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
from typing import Literal

import numpy as np
from scipy.optimize import least_squares

from tirelib.core.arrays import BoolArray, FloatArray, IntArray
from tirelib.core.errors import CalibrationError, ParameterError
from tirelib.core.parameters import Tire
from tirelib.inference.identify.brush_fit import fit_brush
from tirelib.inference.identify.brush_law import SPECS
from tirelib.inference.identify.error_bands import bands, cells_of_load
from tirelib.inference.identify.force_checks import ANGLE_SPAN
from tirelib.inference.identify.force_data import ForceData
from tirelib.inference.identify.ring_patch import profiles
from tirelib.physics.brush.forces import brush_forces
from tirelib.physics.brush.parameters import BrushParameters
from tirelib.physics.contact.profiles import PressureProfile

MOST_POINTS = 300
"""Points that are compared; each has its own pressure profile."""
LEAST_POINTS = 4
"""Points of one load and pressure from which its stiffness can be fitted and points left out."""
STILL = 0.01
"""Slip ratio up to which a point rolls freely."""
SIGNIFICANT = 2.0
"""Standard errors of the mean difference from which one pressure counts as better."""
KINDS = ("ring", "parabola")
_FOLDS = 5
_STEP = 1e-5


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
class PressureFit:
    """The brush with one pressure; arrays of shape (n,).

    Attributes
    ----------
    values : mapping of name to float
        Constants, SI, without the bristle stiffness.
    stiffness : [N/m^2]
        c_py at each point.
    predicted, unseen : [N]
        Fy by the fit to all points, and by fits without the point.
    """

    values: Mapping[str, float]
    stiffness: FloatArray
    predicted: FloatArray
    unseen: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class PressureComparison:
    """Lateral force by the ring's pressure and by the parabola (`KINDS`).

    Attributes
    ----------
    table : tuple of PressureBand
        All points first.
    notes : tuple of str
        Which points were left out, and why.
    """

    fits: Mapping[str, PressureFit]
    table: tuple[PressureBand, ...]
    notes: tuple[str, ...]


def compare_pressures(
    data: ForceData, tire: Tire, *, stiffness: Literal["each", "one"] = "each"
) -> PressureComparison:
    """Fit the brush with both pressures and compare their lateral forces.

    Parameters
    ----------
    data : ForceData
        Those are compared that roll freely and have Fy, at loads and pressures with enough slip
        angles for a stiffness; of more than 300 some are left out evenly.
    tire : Tire
        Its ring gives pressure and contact length.
    stiffness : {"each", "one"}
        c_py for each load and pressure, or one for all. Points are predicted unseen by leaving out
        every fifth slip angle in turn ("each"), or the point's load and pressure altogether ("one",
        with several of them).

    Raises
    ------
    CalibrationError
        If no points or slip angles are left.
    ParameterError, ConvergenceError
        From fit, ring and contact.
    """
    if stiffness not in ("each", "one"):
        raise ParameterError(
            f"lateral force: stiffness = {stiffness!r}; allowed are 'each' and 'one'"
        )
    chosen, notes = _chosen(data)
    data = data.take(chosen)
    pair = profiles(tire, data.load, data.pressure, data.omega)
    conditions = cells_of_load(data)
    group = conditions if stiffness == "each" else np.zeros_like(conditions)
    folds = _parts(data, group) if group.max() == conditions.max() else conditions
    start = _start(data, float(np.median(0.5 * pair[0].length)))
    fits = {
        kind: _Brush(data, profile, group, tuple(start)[1:]).fit(start, folds)
        for kind, profile in zip(KINDS, pair, strict=True)
    }
    return PressureComparison(fits, _table(data, fits), notes)


def _start(data: ForceData, half: float) -> dict[str, float]:
    """Return the constants of the parabola's closed form: the start for both pressures."""
    camber = ("camber_thrust",) if np.ptp(data.camber) > np.deg2rad(0.5) else ()
    size = {"half_length": half, "load_power": 0.5}
    found = fit_brush(data, forces=("Fy",), free=camber, held=size, robust=None).values
    names = ("lateral_stiffness", "friction", "slip_angle_offset", "Fy_offset", *camber)
    return {name: found[name] for name in names}


@dataclass(frozen=True, slots=True, eq=False)
class _Brush:
    """The brush at all points as a function of z: logarithms, or numbers over their size.

    The logarithms of c_py come first, one per group, and then the constants with `names`.
    """

    data: ForceData
    profile: PressureProfile
    group: IntArray
    names: tuple[str, ...]

    @property
    def groups(self) -> int:
        return int(self.group.max()) + 1

    def fit(self, start: Mapping[str, float], folds: IntArray) -> PressureFit:
        """Return the fit to all points, with each fold predicted by the others."""
        first, *rest = (SPECS[name].z(value) for name, value in start.items())
        begin = np.array([first] * self.groups + rest)
        z = self.solve(begin, np.ones(len(self.data), dtype=np.bool_))
        unseen = np.empty(len(self.data))
        for fold in np.unique(folds):
            out = folds == fold
            unseen[out] = self.force(self.solve(z, ~out)[None])[0, out]
        values = {name: float(value[0, 0]) for name, value in self._constants(z[None]).items()}
        stiffness = np.exp(z[: self.groups])[self.group]
        return PressureFit(values, stiffness, self.force(z[None])[0], unseen)

    def force(self, z: FloatArray) -> FloatArray:
        """Return Fy for several z, shape (m, p), at all points, shape (m, n)."""
        at = self._constants(z)
        angle = self.data.slip_angle + at["slip_angle_offset"]
        angle = angle + at.get("camber_thrust", 0.0) * self.data.camber
        brush = BrushParameters(np.exp(z[:, self.group]), at["friction"])
        return brush_forces(self.profile, brush, angle).Fy + at["Fy_offset"]

    def _constants(self, z: FloatArray) -> dict[str, FloatArray]:
        """Return the constants without stiffness, each shape (m, 1)."""
        columns = zip(self.names, z[:, self.groups :].T, strict=True)
        return {name: SPECS[name].value(column)[:, None] for name, column in columns}

    def solve(self, z: FloatArray, used: BoolArray) -> FloatArray:
        """Fit the points in use."""
        scale = 0.05 * _rms(self.data.Fy)

        def residual(x: FloatArray) -> FloatArray:
            rest = self.force(x[None])[0] - self.data.Fy
            return np.asarray(rest[used] / scale, dtype=np.float64)

        def jacobian(x: FloatArray) -> FloatArray:
            return np.asarray(self.slopes(x)[used] / scale, dtype=np.float64)

        found = least_squares(residual, z, jacobian, xtol=1e-7, ftol=1e-9, max_nfev=60)
        return np.asarray(found.x, dtype=np.float64)

    def slopes(self, z: FloatArray) -> FloatArray:
        """Return dFy/dz, shape (n, p); all stiffnesses in one step, as each has its own points."""
        first = self.groups
        moves = np.zeros((2 + len(self.names), z.size))  # the first one stays
        moves[1, :first] = _STEP
        moves[2:, first:] = _STEP * np.eye(len(self.names))
        force = self.force(z + moves)
        slope = (force[1:] - force[0]).T / _STEP
        own = slope[:, :1] * (self.group[:, None] == np.arange(first))
        return np.concatenate([own, slope[:, 1:]], axis=1)


def _chosen(data: ForceData) -> tuple[IntArray, tuple[str, ...]]:
    """Return the points whose load and pressure hold enough slip angles for a stiffness."""
    free = np.flatnonzero(np.isfinite(data.Fy) & (np.abs(data.slip_ratio) <= STILL))
    angle = data.slip_angle[free]
    if not free.size or np.ptp(angle) < ANGLE_SPAN:
        raise CalibrationError("no freely rolling runs over slip angle with Fy")
    cell = cells_of_load(data.take(free))
    members = [angle[cell == k] for k in range(int(cell.max()) + 1)]
    told = [each.size >= LEAST_POINTS and np.ptp(each) >= ANGLE_SPAN for each in members]
    enough = np.array(told)[cell]
    notes: tuple[str, ...] = ()
    if not enough.all():
        note = (
            f"{int((~enough).sum())} of {enough.size} points are left out, their load and pressure "
            f"hold fewer than {LEAST_POINTS} points or less than {np.rad2deg(ANGLE_SPAN):.0f} deg "
            "of slip angle"
        )
        if not enough.any():
            raise CalibrationError(note)
        notes = (note,)
    chosen = free[enough]
    return chosen[:: -(-chosen.size // MOST_POINTS)], notes


def _parts(data: ForceData, group: IntArray) -> IntArray:
    """Return five parts, each with every fifth slip angle of every group."""
    order = np.lexsort((data.slip_angle, group))
    first = np.searchsorted(group[order], group[order], side="left")
    part = np.empty_like(group)
    part[order] = (np.arange(group.size) - first + group[order]) % _FOLDS
    return part


def _table(data: ForceData, fits: Mapping[str, PressureFit]) -> tuple[PressureBand, ...]:
    unseen = {kind: fit.unseen - data.Fy for kind, fit in fits.items()}
    out = []
    for band in bands(data):
        m = band.member
        lead = unseen["parabola"][m] ** 2 - unseen["ring"][m] ** 2
        spread = float(lead.std(ddof=1) / np.sqrt(lead.size)) if lead.size > 2 else np.inf
        gain = float(lead.mean()) / spread if spread > 0.0 else 0.0
        better = "no difference"
        if abs(gain) >= SIGNIFICANT:
            better = KINDS[0] if gain > 0.0 else KINDS[1]
        sizes = {}
        for kind, fit in fits.items():
            over = np.abs(fit.predicted) - np.abs(data.Fy)
            sizes[f"{kind}_rmse"] = _rms((fit.predicted - data.Fy)[m])
            sizes[f"{kind}_bias"] = float(over[m].mean())
            sizes[f"{kind}_rmse_unseen"] = _rms(unseen[kind][m])
        out.append(
            PressureBand(
                band.by, band.low, band.high, int(m.sum()), **sizes, gain=gain, better=better
            )
        )
    return tuple(out)


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))
