"""The Magic Formula 6.1 fitted to forces: pure slips first, then their combination.

Each stage fits the coefficients of one force with all others held, by least squares on
`tirelib.physics.brush.mf`. A coefficient that changes linearly with load is fitted as its values at
the lowest and the highest load, so that a bound, such as E <= 1, holds at every load between them.
What the data do not vary (load, camber, pressure) and forces that they lack are not fitted.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
from scipy.optimize import least_squares

from tirelib.core.arrays import BoolArray, FloatArray, rms
from tirelib.core.errors import CalibrationError
from tirelib.inference.identify.force_data import ForceData
from tirelib.physics.brush.mf import magic_forces
from tirelib.physics.brush.mf_tire import Coefficients, MagicTire

PURE_RATIO, PURE_ANGLE = 0.005, float(np.deg2rad(0.25))
"""Slip ratio and slip angle [rad] up to which the other slip counts as none: there a force of the
brush has changed by less than one percent of its peak (at half of them .3 %, at double 1.5 % of Fy
and 3 % of Fx; `build/export_constants.py`)."""
POINTS_PER_COEFFICIENT = 2
"""Points that a stage needs for each coefficient; with one, the error would always be zero. With a
noise of 1 % the curve is up to 9 % off with half as many points, 1.6 % with these, 1.3 % with
double (`build/export_constants.py`)."""
VARIED = 1.05
"""Ratio of the highest to the lowest load or pressure from which its coefficients are fitted. With
a noise of 1 % these lower the error of Fy from .98 to .72 % at a ratio of 1.1, and no longer at
1.025 (.72 and .73 %; `build/export_constants.py`)."""
FORCES = ("Fx", "Fy", "Mz")
VARIED_CAMBER = float(np.deg2rad(0.5))


@dataclass(frozen=True, slots=True)
class ForceError:
    """How far the formula is from the points of one force, [N] or [N m].

    Attributes
    ----------
    rms, largest : float
    peak : float
        Largest force of the points, without sign.
    points : int
    """

    rms: float
    largest: float
    peak: float
    points: int


@dataclass(frozen=True, slots=True, eq=False)
class MagicFit:
    """A tire of the Magic Formula 6.1 and how well it fits.

    Attributes
    ----------
    tire : MagicTire
        Its limits are the range of the points.
    fitted : tuple of str
        Coefficients that were fitted.
    at_limit : tuple of str
        Those that ended at a bound.
    assumed : mapping of str to str
        Coefficients that the formula needs and no point informs, with where each is from.
    errors : mapping of str to ForceError
        By force, over all points.
    """

    tire: MagicTire
    fitted: tuple[str, ...]
    at_limit: tuple[str, ...]
    assumed: Mapping[str, str]
    errors: Mapping[str, ForceError]


@dataclass(frozen=True, slots=True)
class _Term:
    """One coefficient, or two: that at the nominal load and its slope over dfz."""

    name: str
    start: float
    low: float = -np.inf
    high: float = np.inf
    slope: str = ""
    needs: str = ""  # load, camber or pressure, which must vary


@dataclass(frozen=True, slots=True)
class _Stage:
    force: str
    combined: bool
    terms: tuple[_Term, ...]


def _free(needs: str, *names: str) -> tuple[_Term, ...]:
    return tuple(_Term(name, 0.0, needs=needs) for name in names)


def _curve(axis: str, shape: float, *stiffness: _Term) -> tuple[_Term, ...]:
    """Return the terms of a pure force: shape, peak, curvature, stiffness, shifts."""
    return (
        _Term(f"PC{axis}1", shape, 1.0, 2.0),
        _Term(f"PD{axis}1", 1.0, 0.05, 3.0, f"PD{axis}2"),
        _Term(f"PE{axis}1", -0.5, -20.0, 1.0, f"PE{axis}2"),
        *stiffness,
        _Term(f"PH{axis}1", 0.0, slope=f"PH{axis}2"),
        _Term(f"PV{axis}1", 0.0, slope=f"PV{axis}2"),
    )


def _weight(axis: str, slope: float, *more: _Term) -> tuple[_Term, ...]:
    """Return the terms of the weight that the other slip gives a force."""
    return (
        _Term(f"RB{axis}1", slope, 0.1, 200.0),
        _Term(f"RB{axis}2", 8.0, -200.0, 200.0),
        *more,
        _Term(f"RC{axis}1", 1.0, 0.5, 1.5),
        _Term(f"RE{axis}1", 0.0, -50.0, 1.0, f"RE{axis}2"),
        _Term(f"RH{axis}1", 0.0),
    )


STAGES = (
    _Stage(
        "Fy",
        False,
        (
            *_curve(
                "Y",
                1.3,
                _Term("PKY1", -20.0, -200.0, -0.5),
                _Term("PKY2", 1.8, 0.2, 10.0, needs="load"),
            ),
            *_free("camber", "PDY3", "PKY3", "PKY6", "PVY3"),
            *_free("pressure", "PPY1", "PPY2", "PPY3", "PPY4"),
        ),
    ),
    _Stage(
        "Fx",
        False,
        (
            *_curve("X", 1.5, _Term("PKX1", 20.0, 0.5, 200.0, "PKX2")),
            *_free("camber", "PDX3"),
            *_free("pressure", "PPX1", "PPX2", "PPX3", "PPX4"),
        ),
    ),
    _Stage(
        "Mz",
        False,
        (
            _Term("QBZ1", 8.0, 0.1, 100.0, "QBZ2"),
            _Term("QCZ1", 1.1, 0.5, 2.0),
            _Term("QDZ1", 0.1, -0.5, 1.0, "QDZ2"),
            _Term("QEZ1", -1.0, -50.0, 1.0, "QEZ2"),
            _Term("QHZ1", 0.0, slope="QHZ2"),
            _Term("QDZ6", 0.0, slope="QDZ7"),
            *_free("camber", "QDZ8", "QHZ3"),
            *_free("pressure", "PPZ1"),
        ),
    ),
    _Stage("Fx", True, _weight("X", 10.0)),
    _Stage("Fy", True, _weight("Y", 8.0, _Term("RBY3", 0.0))),
    _Stage("Mz", True, (_Term("SSZ1", 0.0), _Term("SSZ2", 0.0))),
)
"""In the order of the fit: what a stage finds, the later ones hold."""


def fit_magic(points: ForceData, *, radius: float, nominal_load: float | None = None) -> MagicFit:
    """Fit the Magic Formula 6.1.

    Parameters
    ----------
    points : ForceData
        Where the pressure is not known at every point, no coefficient of it is fitted.
    radius : float, [m]
        Unloaded radius.
    nominal_load : float, [N], optional
        FNOMIN; by default the middle of the range of loads.

    Raises
    ------
    CalibrationError
        If there are too few points of lateral force in pure side slip.
    """
    load = points.load
    nominal = nominal_load or 0.5 * float(load.min() + load.max())
    known = bool(np.isfinite(points.pressure).all())
    pressure = float(np.median(points.pressure)) if known else None
    names = ("load", "slip_ratio", "slip_angle", "camber", *(("pressure",) if known else ()))
    limits = {}
    for name in names:
        x = getattr(points, name)
        limits[name] = float(x.min()), float(x.max())
    values: dict[str, float] = {"PKY2": 1.8, "PKY4": 2.0}
    fitted: list[str] = []
    at_limit: list[str] = []

    def tire() -> MagicTire:
        return MagicTire(
            61,
            Coefficients(values),
            radius,
            nominal,
            pressure,
            pressure,
            MappingProxyType(limits),
        )

    for stage in STAGES:
        taken = points.take(_rows(points, stage))
        found = _Fit(taken, stage, (load.min() / nominal - 1, load.max() / nominal - 1))
        if len(taken) < POINTS_PER_COEFFICIENT * found.size:
            if stage is STAGES[0]:
                raise CalibrationError(
                    f"Magic Formula: {len(taken)} points with Fy and without longitudinal "
                    f"slip; {POINTS_PER_COEFFICIENT * found.size} are needed for "
                    f"{found.size} coefficients; record more slip angles and loads"
                )
            continue
        found.run(tire, values)
        fitted += found.names
        at_limit += found.at_limit
    assumed = _assume(values, tire, nominal)
    return MagicFit(
        tire(),
        tuple(fitted),
        tuple(at_limit),
        MappingProxyType(assumed),
        MappingProxyType(_errors(points, tire())),
    )


def _rows(points: ForceData, stage: _Stage) -> BoolArray:
    """Return the points that a stage is fitted to."""
    along = np.abs(points.slip_ratio) > PURE_RATIO
    across = np.abs(points.slip_angle) > PURE_ANGLE
    pure = ~across if stage.force == "Fx" else ~along
    chosen = along & across if stage.combined else pure
    return np.asarray(chosen & np.isfinite(getattr(points, stage.force)))


def _forces(points: ForceData, tire: MagicTire, combined: bool) -> FloatArray:
    """Return Fx, Fy, Mz of the formula, shape (3, n)."""
    at = magic_forces(
        tire,
        points.load,
        points.slip_angle,
        points.slip_ratio,
        points.camber,
        points.pressure if tire.nominal_pressure is not None else None,
        combined=combined,
    )
    return np.stack([at.Fx, at.Fy, at.Mz])


class _Fit:
    """The fit of one stage, to points whose loads end at `ends` [dfz] over the whole campaign."""

    def __init__(self, points: ForceData, stage: _Stage, ends: tuple[float, float]) -> None:
        self.points, self.stage, self.ends = points, stage, ends
        varied = _varied(points)
        terms = [term for term in stage.terms if not term.needs or term.needs in varied]
        self.terms = [
            term if "load" in varied else replace(term, slope="")  # a slope needs two loads
            for term in terms
        ]
        self.size = sum(1 + bool(term.slope) for term in self.terms)
        self.at_limit: list[str] = []

    @property
    def names(self) -> list[str]:
        """Coefficients that are fitted."""
        return [name for term in self.terms for name in (term.name, term.slope) if name]

    def _column(self, what: str) -> FloatArray:
        return np.repeat(
            [getattr(term, what) for term in self.terms],
            [1 + bool(term.slope) for term in self.terms],
        )

    def _put(self, x: FloatArray, values: dict[str, float]) -> None:
        """Set the coefficients of a vector of values at the ends of the range of loads."""
        low, high = self.ends
        rest = iter(x.tolist())
        for term in self.terms:
            first = next(rest)
            if term.slope:
                values[term.slope] = float((next(rest) - first) / (high - low))
                first -= values[term.slope] * low
            values[term.name] = float(first)

    def run(self, tire: Callable[[], MagicTire], values: dict[str, float]) -> None:
        """Fit, and leave the coefficients in `values`."""
        number = FORCES.index(self.stage.force)
        wanted = getattr(self.points, self.stage.force)
        size = float(np.abs(wanted).max()) or 1.0

        def residuals(x: FloatArray) -> FloatArray:
            self._put(x, values)
            found = _forces(self.points, tire(), self.stage.combined)
            return np.asarray((found[number] - wanted) / size)

        low, high = self._column("low"), self._column("high")
        done = least_squares(
            residuals, self._column("start"), bounds=(low, high), x_scale="jac", max_nfev=200
        )
        self._put(done.x, values)
        self.at_limit = [self.names[k] for k in np.flatnonzero(done.active_mask)]


def _varied(points: ForceData) -> set[str]:
    """Return which conditions vary enough for coefficients of their own."""
    if not len(points):
        return set()
    found = {"camber"} if np.ptp(points.camber) > VARIED_CAMBER else set()
    for name in ("load", "pressure"):
        x = getattr(points, name)
        if np.isfinite(x).all() and x.max() > VARIED * x.min():
            found.add(name)
    return found


def _assume(
    values: dict[str, float], tire: Callable[[], MagicTire], nominal: float
) -> dict[str, str]:
    """Set what the formula needs for Fx where no Fx was measured."""
    if "PKX1" in values:
        return {}
    values |= {"PCX1": 1.5, "PDX1": values["PDY1"], "PKX1": 1.0}
    stiffness = float(magic_forces(tire(), nominal, 0.0).cornering_stiffness)
    values["PKX1"] = abs(stiffness) / nominal
    return {
        "PCX1": "a usual value",
        "PDX1": "the lateral friction PDY1",
        "PKX1": "the cornering stiffness at the nominal load",
    }


def _errors(points: ForceData, tire: MagicTire) -> dict[str, ForceError]:
    found = {}
    for name, force in zip(FORCES, _forces(points, tire, True), strict=True):
        measured = getattr(points, name)
        known = np.isfinite(measured)
        if known.any():
            off = (force - measured)[known]
            found[name] = ForceError(
                rms(off),
                float(np.abs(off).max()),
                float(np.abs(measured[known]).max()),
                int(known.sum()),
            )
    return found
