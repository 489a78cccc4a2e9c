"""A tire for the steady-state Magic Formula: its coefficients, and the checked inputs of a call."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.core.errors import ParameterError, ShapeError

NAME = re.compile(r"([PQRS])[A-Z]{1,3}\d{1,2}|L[A-Z]{1,6}")
"""What a coefficient or a scaling factor is called."""


class Coefficients:
    """Coefficients by name; an absent scaling factor (L...) is 1, PKY4 is 2, all else is 0."""

    __slots__ = ("values",)

    def __init__(self, values: Mapping[str, float]) -> None:
        self.values = MappingProxyType(dict(values))

    def __getattr__(self, name: str) -> float:
        if not NAME.fullmatch(name):
            raise AttributeError(name)
        neutral = 2.0 if name == "PKY4" else float(name.startswith("L"))
        return self.values.get(name, neutral)


@dataclass(frozen=True, slots=True, eq=False)
class MagicTire:
    """Coefficients of one tire for the Magic Formula, in SI.

    Attributes
    ----------
    fit_type : int
        5, 6, 52: MF 5 and PAC2002; 60, 61, 62: MF 6.
    coefficients : Coefficients
    radius : float, [m]
        Unloaded radius R0.
    nominal_load : float, [N]
    nominal_pressure, pressure : float or None, [Pa]
        Reference pressure of the pressure terms, and the one that holds when none is given.
    limits : mapping
        (low, high) of load [N], slip_ratio, slip_angle [rad], camber [rad], pressure [Pa], as far
        as the file names them.
    """

    fit_type: int
    coefficients: Coefficients
    radius: float
    nominal_load: float
    nominal_pressure: float | None
    pressure: float | None
    limits: Mapping[str, tuple[float, float]]


@dataclass(frozen=True, slots=True, eq=False)
class MagicForces:
    """Steady-state forces of the Magic Formula, ISO 8855, one per operating point.

    Attributes
    ----------
    Fx, Fy, Mz : arrays, [N], [N], [N m]
    cornering_stiffness, slip_stiffness : arrays, [N/rad], [N]
        K_y (negative in ISO) and K_x.
    friction_x, friction_y : arrays
        Peak friction mu_x, mu_y.
    in_range : array of bool
        Every input lies within the file's limits. Nothing is clamped: outside, the numbers are
        extrapolations.
    curved_well : array of bool
        The curvature factors are at most 1, as the formula asks; above 1 a curve is not to be
        trusted, although it is given.
    """

    Fx: FloatArray
    Fy: FloatArray
    Mz: FloatArray
    cornering_stiffness: FloatArray
    slip_stiffness: FloatArray
    friction_x: FloatArray
    friction_y: FloatArray
    in_range: BoolArray
    curved_well: BoolArray


@dataclass(frozen=True, slots=True, eq=False)
class Inputs:
    """Checked inputs of one call, all of one shape."""

    Fz: FloatArray
    alpha: FloatArray
    kappa: FloatArray
    gamma: FloatArray
    dpi: FloatArray
    in_range: BoolArray


LIMITS = MappingProxyType(
    {
        "load": ("FZMIN", "FZMAX"),
        "slip_ratio": ("KPUMIN", "KPUMAX"),
        "slip_angle": ("ALPMIN", "ALPMAX"),
        "camber": ("CAMMIN", "CAMMAX"),
        "pressure": ("PRESMIN", "PRESMAX"),
    }
)


def impossible(values: Mapping[str, float]) -> list[str]:
    """Return what is wrong with coefficients that the formula divides by."""
    problems = [
        f"{name} = {values[name]:g}; the formula divides by it; it must be > 0, 1 is neutral"
        for name in ("LFZO", "LMUY")
        if not values.get(name, 1.0) > 0.0
    ]
    if values.get("PKY2") == 0.0:
        problems.append(
            "PKY2 = 0; the cornering stiffness is largest at PKY2 times the nominal load; it must "
            "not be zero"
        )
    return problems


def check_inputs(
    tire: MagicTire,
    load: npt.ArrayLike,
    slip_angle: npt.ArrayLike,
    slip_ratio: npt.ArrayLike,
    camber: npt.ArrayLike,
    pressure: npt.ArrayLike | None,
) -> Inputs:
    """Check and broadcast the inputs of a call.

    Raises
    ------
    ParameterError, ShapeError
        If an input is out of what the formula can take, or shapes do not broadcast.
    """
    if problems := impossible(tire.coefficients.values):
        raise ParameterError("Magic Formula: " + "; ".join(problems))
    given = {"load": load, "slip_angle": slip_angle, "slip_ratio": slip_ratio, "camber": camber}
    nominal = tire.nominal_pressure
    if pressure is None:
        pressure = tire.pressure if tire.pressure is not None else nominal
    elif nominal is None:
        raise ParameterError(
            "a pressure is given but the file has no NOMPRES; leave it out or add NOMPRES"
        )
    if pressure is not None:
        given["pressure"] = pressure
    arrays = [np.asarray(value, dtype=np.float64) for value in given.values()]
    try:
        arrays = [np.array(a) for a in np.broadcast_arrays(*arrays)]
    except ValueError:
        shapes = ", ".join(f"{n} {a.shape}" for n, a in zip(given, arrays, strict=True))
        raise ShapeError(f"shapes {shapes} do not broadcast") from None
    values = dict(zip(given, arrays, strict=True))
    for name, array in values.items():
        if not np.all(np.isfinite(array)):
            raise ParameterError(f"a {name} is not finite")
    if not np.all(values["load"] > 0.0):
        raise ParameterError(f"load = {float(values['load'].min()):.6g} N; it must be > 0")
    if not np.all(np.abs(values["slip_angle"]) < 0.5 * np.pi):
        raise ParameterError("a slip angle is not between -pi/2 and pi/2 rad; give it in radians")
    in_range = np.ones(values["load"].shape, dtype=np.bool_)
    for name, array in values.items():
        low, high = tire.limits.get(name, (-np.inf, np.inf))
        in_range &= (array >= low) & (array <= high)
    dpi = np.zeros_like(values["load"])  # (4.E2b)
    if nominal is not None and "pressure" in values:
        dpi = (values["pressure"] - nominal) / nominal
    return Inputs(
        values["load"], values["slip_angle"], values["slip_ratio"], values["camber"], dpi, in_range
    )
