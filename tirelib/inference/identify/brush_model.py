"""The brush of a tire or model file: one place that reads it, and one that writes it.

A file states the brush as ordinary numbers: bristles, friction, the law of the half contact length
with its reference load and pressure, offsets and compliances of the carcass. Without a half length
the file's ring gives it. Files with bristles and friction alone are read as well.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import CalibrationError
from tirelib.core.parameters import Number, Tire, TireFile
from tirelib.inference.identify.brush_law import SPECS, Reference, point_parameters, predict
from tirelib.inference.identify.force_data import ForceData
from tirelib.inference.identify.ring_patch import ring_half
from tirelib.physics.brush.predict import PointForces, PointParameters

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
NEEDED = ("lateral_stiffness", "friction")


@dataclass(frozen=True, slots=True, eq=False)
class BrushModel:
    """The brush of a file.

    Attributes
    ----------
    name : str
        Name of the file's tire.
    values : mapping of str to float
        Parameters by name of `tirelib.inference.identify.brush_law.SPECS`, SI; those that the file
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

    def half_length(self, data: ForceData) -> FloatArray:
        """Return half the contact length at the points, shape (n,), [m]."""
        return np.broadcast_to(
            np.asarray(self.parameters(data).half_length, dtype=np.float64), (len(data),)
        )

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
    missing = [STORED[name] for name in NEEDED if STORED[name] not in file.numbers]
    if missing:
        raise CalibrationError(
            f"model {file.name} states no {' and no '.join(missing)}: it says nothing about "
            "forces; identify it from a campaign with slip, or give [brush.bristle_lateral] and "
            "[tread.friction]"
        )
    values: dict[str, float] = {}
    for name, stored in STORED.items():
        if stored in file.numbers:
            value = file.numbers[stored].value
            values[name] = 1.0 / value if name == "lateral_compliance" else value
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
    """Return name and number of a parameter of `SPECS` as a file holds it.

    Parameters
    ----------
    name : str
        One of `SPECS`.
    value, std : float
        SI; a standard deviation that is not finite is left out.
    kind, source, notes : str, str, mapping
        As in `Number`.
    """
    if name == "lateral_compliance":
        std = std / value**2 if value > 0.0 else math.nan
        value = 1.0 / value if value > 0.0 else math.inf
    spread = std if math.isfinite(std) else math.nan
    return STORED[name], Number(value, spread, kind, source, dict(notes or {}))
