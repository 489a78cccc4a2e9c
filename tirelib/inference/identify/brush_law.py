"""The brush over a campaign: which numbers it has, and what they mean at each point.

    a(Fz, p) = a0 (Fz/Fz0)^n (p/p0)^m

is the half contact length, unless a tire's ring gives it.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ParameterError
from tirelib.inference.identify.force_data import ForceData
from tirelib.physics.brush.predict import (
    PointConditions,
    PointForces,
    PointParameters,
    predict_forces,
)


class Spec(NamedTuple):
    """A parameter: unit, allowed range, and the size by which its uncertainty is judged.

    `log` parameters are fitted by their logarithm and judged by their own size.
    """

    unit: str
    low: float
    high: float
    size: float
    log: bool = False


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

half_length is a0 at the reference load and pressure; load_power is n, pressure_power is m.
"""

NEUTRAL: Mapping[str, float] = MappingProxyType(
    {name: 0.0 for name, spec in SPECS.items() if not spec.log}
)
"""Values that change nothing."""


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

    Parameters
    ----------
    values : mapping
        By name of `SPECS`; those left out are neutral, c_px as c_py.
    data : ForceData
    reference : Reference
    half_length : array, shape (n,), [m], optional
        a at the points, from a tire's ring; then a0, n and m have no part.

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
    half = half_length
    if half is None:
        half = values["half_length"] * (data.load / reference.load) ** values.get("load_power", 0.0)
        power = values.get("pressure_power", 0.0)
        if power != 0.0:
            if not np.isfinite(data.pressure).all():
                raise ParameterError(
                    "brush law: pressure_power is given but the pressure is not known at all "
                    "points; record it, or leave pressure_power out"
                )
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
