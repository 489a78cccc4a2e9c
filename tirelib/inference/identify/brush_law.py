"""The brush over a campaign: which numbers it has, what they mean at each point, and its file.

    a(Fz, p) = a0 (Fz/Fz0)^n (p/p0)^m

is the half contact length, unless a tire's ring gives it. A file states the brush as ordinary
numbers: bristles, friction, the law of the half contact length with its reference load and
pressure, offsets and compliances of the carcass. Without a half length the file's ring gives it.
Files with bristles and friction alone are read as well.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import CalibrationError, ParameterError
from tirelib.core.parameters import Number, Tire, TireFile
from tirelib.inference.identify.force_data import ForceData
from tirelib.inference.identify.ring_patch import ring_half
from tirelib.physics.brush.predict import (
    PointConditions,
    PointForces,
    PointParameters,
    predict_forces,
)


class Spec(NamedTuple):
    """A parameter: unit, allowed range, and the size by which its uncertainty is judged.

    `log` parameters are fitted by their logarithm and judged by their own size. Fits move a
    coordinate z, the logarithm or the number over its size.
    """

    unit: str
    low: float
    high: float
    size: float
    log: bool = False

    def value(self, z: FloatArray) -> FloatArray:
        """Return the parameter at coordinates, SI."""
        return np.asarray(np.exp(z) if self.log else z * self.size)

    def z(self, value: float) -> float:
        """Return the coordinate of the parameter."""
        return float(np.log(value) if self.log else value / self.size)

    def slope(self, value: float) -> float:
        """Return the derivative of the parameter by its coordinate."""
        return value if self.log else self.size

    def moved(self, value: float, move: float) -> float:
        """Return the parameter after a move of its coordinate."""
        return value * float(np.exp(move)) if self.log else value + self.size * float(move)


SPECS: Mapping[str, Spec] = MappingProxyType(
    {
        "lateral_stiffness": Spec("N/m^2", 1e4, 1e10, 1.0, log=True),
        "longitudinal_stiffness": Spec("N/m^2", 1e4, 1e10, 1.0, log=True),
        "friction": Spec("1", 0.02, 5.0, 1.0, log=True),
        "half_length": Spec("m", 0.005, 0.5, 1.0, log=True),
        "load_power": Spec("1", -0.5, 1.5, 0.5),
        "pressure_power": Spec("1", -2.0, 1.0, 0.5),
        "camber_thrust": Spec("1", -2.0, 2.0, 0.5),
        "slip_angle_offset": Spec("rad", -0.05, 0.05, 0.01),
        "slip_ratio_offset": Spec("1", -0.05, 0.05, 0.01),
        "Fx_offset": Spec("N", -2e3, 2e3, 200.0),
        "Fy_offset": Spec("N", -2e3, 2e3, 200.0),
        "Mz_offset": Spec("N m", -200.0, 200.0, 20.0),
        "yaw_compliance": Spec("rad/(N m)", 0.0, 5e-4, 1e-4),
        "lateral_compliance": Spec("m/N", 0.0, 5e-5, 1e-5),
    }
)
"""Every number of the law; meanings in `tirelib.physics.brush.predict.PointParameters`.

Those that are not fitted by their logarithm change nothing at zero.

half_length is a0 at the reference load and pressure; load_power is n, pressure_power is m.
"""


@dataclass(frozen=True, slots=True, eq=False)
class Reference:
    """Load and pressure at which a0 holds, [N] and [Pa] (NaN where no pressure is known)."""

    load: float
    pressure: float


def point_parameters(
    values: Mapping[str, float],
    data: ForceData,
    reference: Reference,
    half_length: FloatArray | None = None,
) -> PointParameters:
    """Return the brush at every point of the data.

    Values by name of `SPECS` that are left out are neutral, c_px as c_py. With the half length at
    the points from a tire's ring, shape (n,), [m], a0, n and m have no part.

    Raises
    ------
    ParameterError
        If a name is unknown or the law needs a pressure that is not known.
    """
    unknown = [name for name in values if name not in SPECS]
    if unknown:
        raise ParameterError(
            f"brush law: {unknown[0]!r} is no parameter; allowed are {', '.join(SPECS)}"
        )
    half, power = half_length, values.get("pressure_power", 0.0)
    if half is None:
        half = values["half_length"] * (data.load / reference.load) ** values.get("load_power", 0.0)
        if power != 0.0 and not np.isfinite(data.pressure).all():
            raise ParameterError(
                "brush law: pressure_power is given but the pressure is not known at all points; "
                "record it, or leave pressure_power out"
            )
        if power != 0.0:
            half = half * (data.pressure / reference.pressure) ** power
    law = ("half_length", "load_power", "pressure_power")
    return PointParameters(
        half_length=half, **{name: value for name, value in values.items() if name not in law}
    )


def predict(
    values: Mapping[str, float],
    data: ForceData,
    reference: Reference,
    half_length: FloatArray | None = None,
) -> PointForces:
    """Return Fx, Fy and Mz at every point; arguments and errors as `point_parameters`."""
    at = PointConditions(data.load, data.slip_angle, data.slip_ratio, data.camber)
    return predict_forces(point_parameters(values, data, reference, half_length), at)


STORED: Mapping[str, str] = MappingProxyType(
    {
        name: {
            "lateral_stiffness": "bristle_lateral",
            "longitudinal_stiffness": "bristle_longitudinal",
            "lateral_compliance": "carcass_stiffness",
        }.get(name, name)
        for name in SPECS
    }
)
"""Name in a file of each parameter of the law; the carcass stands there as a stiffness."""


@dataclass(frozen=True, slots=True, eq=False)
class BrushModel:
    """The brush of a file.

    Attributes
    ----------
    name : str
        Name of the file's tire.
    values : mapping of str to float
        Parameters by name of `SPECS`, SI; those that the file
        does not state are absent and neutral (c_px as c_py).
    reference : Reference
        Load and pressure at which `half_length` holds; NaN where the file states none.
    tire : Tire or None
        The ring that gives the half length, if the file states no half length of its own.
    """

    name: str
    values: Mapping[str, float]
    reference: Reference
    tire: Tire | None

    def parameters(self, data: ForceData) -> PointParameters:
        """Return the brush at the points of data.

        Raises
        ------
        ParameterError
            If ring or law need a pressure that is not known.
        """
        return point_parameters(self.values, data, self.reference, ring_half(self.tire, data))

    def predict(self, data: ForceData) -> PointForces:
        """Return Fx, Fy and Mz at the points of data; errors as `parameters`."""
        return predict(self.values, data, self.reference, ring_half(self.tire, data))


def brush_of(file: TireFile) -> BrushModel:
    """Return the brush of a file.

    Raises
    ------
    CalibrationError
        If the file states no bristles or no friction, or neither a half length nor a ring.
    """
    missing = [name for name in ("bristle_lateral", "friction") if name not in file.numbers]
    if missing:
        raise CalibrationError(
            f"model {file.name} states no {' and no '.join(missing)}: it says nothing about "
            "forces; identify it from a campaign with slip, or give [brush.bristle_lateral] and "
            "[tread.friction]"
        )
    known = {name: file.numbers[s].value for name, s in STORED.items() if s in file.numbers}
    values = {k: 1.0 / v if k == "lateral_compliance" else v for k, v in known.items()}
    tire = None
    if "half_length" not in values:
        if file.missing:
            raise CalibrationError(
                f"model {file.name} states neither a half contact length nor a complete ring "
                f"({', '.join(file.missing)} missing); give [brush.half_length], or identify it "
                "from a campaign with slip"
            )
        tire = file.tire
    for name, power in (("reference_load", "load_power"), ("reference_pressure", "pressure_power")):
        if tire is None and values.get(power, 0.0) != 0.0 and name not in file.numbers:
            raise CalibrationError(
                f"model {file.name} states {power} but no {name}, at which its half length holds; "
                f"give [brush.{name}]"
            )
    reference = Reference(
        *(
            file.numbers[name].value if name in file.numbers else math.nan
            for name in ("reference_load", "reference_pressure")
        )
    )
    return BrushModel(file.name, MappingProxyType(values), reference, tire)


def stored_number(
    name: str,
    value: float,
    std: float,
    kind: str,
    source: str,
    notes: Mapping[str, Any] | None = None,
) -> tuple[str, Number]:
    """Return name and number of a parameter of `SPECS` as a file holds it; value and std are SI.

    A standard deviation that is not finite is left out.
    """
    if name == "lateral_compliance":
        std = std / value**2 if value > 0.0 else math.nan
        value = 1.0 / value if value > 0.0 else math.inf
    spread = std if math.isfinite(std) else math.nan
    return STORED[name], Number(value, spread, kind, source, dict(notes or {}))
