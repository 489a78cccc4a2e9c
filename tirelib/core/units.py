"""Conversions at the edges: units of files, buses and people to SI and radians, and back.

One literal table holds every unit met in the field. Inside the library nothing has a unit in its
name; here, and only here, a unit has a number: ``si = factor * value + offset``.
"""

import math
from types import MappingProxyType
from typing import NamedTuple, overload

import numpy as np
import numpy.typing as npt

from tirelib.core.errors import Fault, UnitError

FloatArray = npt.NDArray[np.float64]


class UnitRow(NamedTuple):
    """One spelling of one unit: ``si = factor * value + offset``."""

    unit: str
    dimension: str
    factor: float
    offset: float = 0.0


_LBF = 4.4482216152605
_KGF = 9.80665
_POUND = 0.45359237
_INCH = 0.0254
_FOOT = 0.3048
_PSI = _LBF / _INCH**2
_DEG = math.pi / 180.0
_RPM = 2.0 * math.pi / 60.0

TABLE: tuple[UnitRow, ...] = (
    UnitRow("N", "force", 1.0),
    UnitRow("daN", "force", 10.0),
    UnitRow("kN", "force", 1e3),
    UnitRow("lbf", "force", _LBF),
    UnitRow("lb", "force", _LBF),
    UnitRow("kgf", "force", _KGF),
    UnitRow("kp", "force", _KGF),
    UnitRow("Pa", "pressure", 1.0),
    UnitRow("hPa", "pressure", 1e2),
    UnitRow("mbar", "pressure", 1e2),
    UnitRow("kPa", "pressure", 1e3),
    UnitRow("bar", "pressure", 1e5),
    UnitRow("MPa", "pressure", 1e6),
    UnitRow("psi", "pressure", _PSI),
    UnitRow("PSI", "pressure", _PSI),
    UnitRow("kgf/cm2", "pressure", _KGF * 1e4),
    UnitRow("m/s", "speed", 1.0),
    UnitRow("km/h", "speed", 1.0 / 3.6),
    UnitRow("kmh", "speed", 1.0 / 3.6),
    UnitRow("kph", "speed", 1.0 / 3.6),
    UnitRow("mph", "speed", 0.44704),
    UnitRow("rad", "angle", 1.0),
    UnitRow("mrad", "angle", 1e-3),
    UnitRow("deg", "angle", _DEG),
    UnitRow("degree", "angle", _DEG),
    UnitRow("degrees", "angle", _DEG),
    UnitRow("°", "angle", _DEG),
    UnitRow("1", "ratio", 1.0),
    UnitRow("-", "ratio", 1.0),
    UnitRow("none", "ratio", 1.0),  # tire test consortium
    UnitRow("%", "ratio", 1e-2),
    UnitRow("rad/s", "angular_speed", 1.0),
    UnitRow("deg/s", "angular_speed", _DEG),
    UnitRow("rpm", "angular_speed", _RPM),
    UnitRow("1/min", "angular_speed", _RPM),
    UnitRow("Hz", "angular_speed", 2.0 * math.pi),  # turns per second, as rigs mean it
    UnitRow("Hz", "frequency", 1.0),
    UnitRow("kHz", "frequency", 1e3),
    UnitRow("m", "length", 1.0),
    UnitRow("cm", "length", 1e-2),
    UnitRow("mm", "length", 1e-3),
    UnitRow("um", "length", 1e-6),
    UnitRow("in", "length", _INCH),
    UnitRow("ft", "length", _FOOT),
    UnitRow("Nm", "moment", 1.0),
    UnitRow("N.m", "moment", 1.0),
    UnitRow("N·m", "moment", 1.0),
    UnitRow("N*m", "moment", 1.0),
    UnitRow("N-m", "moment", 1.0),
    UnitRow("kNm", "moment", 1e3),
    *(UnitRow(f"N{dot}mm", "moment", 1e-3) for dot in ("", ".", "·", "*", "-")),
    UnitRow("lbf.ft", "moment", _LBF * _FOOT),
    UnitRow("ft-lb", "moment", _LBF * _FOOT),
    UnitRow("s", "time", 1.0),
    UnitRow("sec", "time", 1.0),
    UnitRow("ms", "time", 1e-3),
    UnitRow("us", "time", 1e-6),
    UnitRow("min", "time", 60.0),
    UnitRow("h", "time", 3600.0),
    UnitRow("K", "temperature", 1.0),
    UnitRow("degC", "temperature", 1.0, 273.15),
    UnitRow("°C", "temperature", 1.0, 273.15),
    UnitRow("deg C", "temperature", 1.0, 273.15),
    UnitRow("degF", "temperature", 5.0 / 9.0, 273.15 - 32.0 * 5.0 / 9.0),
    UnitRow("deg F", "temperature", 5.0 / 9.0, 273.15 - 32.0 * 5.0 / 9.0),
    UnitRow("°F", "temperature", 5.0 / 9.0, 273.15 - 32.0 * 5.0 / 9.0),
    UnitRow("1", "strain", 1.0),
    UnitRow("strain", "strain", 1.0),
    UnitRow("m/m", "strain", 1.0),
    UnitRow("%", "strain", 1e-2),
    UnitRow("mm/m", "strain", 1e-3),
    UnitRow("ustrain", "strain", 1e-6),
    UnitRow("microstrain", "strain", 1e-6),
    UnitRow("um/m", "strain", 1e-6),
    UnitRow("uE", "strain", 1e-6),
    UnitRow("ue", "strain", 1e-6),
    UnitRow("m/s2", "acceleration", 1.0),
    UnitRow("m/s^2", "acceleration", 1.0),
    UnitRow("g", "acceleration", 9.80665),
    UnitRow("kg", "mass", 1.0),
    UnitRow("g", "mass", 1e-3),  # after acceleration, which a channel in "g" is
    UnitRow("tonne", "mass", 1e3),
    UnitRow("lb", "mass", _POUND),
    UnitRow("slug", "mass", _LBF / _FOOT),
    UnitRow("V", "voltage", 1.0),
    UnitRow("mV", "voltage", 1e-3),
    UnitRow("N/m", "stiffness", 1.0),
    UnitRow("N/mm", "stiffness", 1e3),
    UnitRow("kN/m", "stiffness", 1e3),
    UnitRow("N/m^2", "line_stiffness", 1.0),
    UnitRow("kN/m^2", "line_stiffness", 1e3),
    UnitRow("N/m^2/bar", "stiffness_per_pressure", 1e-5),
    UnitRow("N/m^2/Pa", "stiffness_per_pressure", 1.0),
    UnitRow("N m^2", "bending_stiffness", 1.0),
    UnitRow("Nm^2", "bending_stiffness", 1.0),
    UnitRow("kg/m", "line_density", 1.0),
    UnitRow("kg m", "rotary_inertia", 1.0),
    UnitRow("1/m", "curvature", 1.0),
    UnitRow("1/mm", "curvature", 1e3),
    UnitRow("rad/Nm", "compliance", 1.0),
    UnitRow("deg/Nm", "compliance", _DEG),
)
"""Every unit that files may carry. A unit in two dimensions stands in two rows."""

DIMENSIONS: tuple[str, ...] = tuple(dict.fromkeys(row.dimension for row in TABLE))

_ROWS = MappingProxyType({(row.unit, row.dimension): row for row in TABLE})

QUANTITIES = MappingProxyType(
    {
        "time": "time",
        "Fx": "force",
        "Fy": "force",
        "Fz": "force",
        "Mx": "moment",
        "My": "moment",
        "Mz": "moment",
        "slip_angle": "angle",
        "camber": "angle",
        "slip_ratio": "ratio",
        "speed": "speed",
        "omega": "angular_speed",
        "pressure": "pressure",
        "loaded_radius": "length",
        "effective_radius": "length",
        "deflection": "length",
        "friction": "ratio",
        "tread_depth": "length",
        "load": "force",
        "trigger": "ratio",
    }
)
"""Dimension of each quantity that the library knows by name."""


def dimension_of(quantity: str) -> str | None:
    """Return the dimension of a quantity by its name, or None for a name without a fixed dimension.

    ``strain_3`` is a strain and ``tread_temperature`` a temperature.
    """
    if quantity.startswith("strain_"):
        return "strain"
    if quantity == "temperature" or quantity.endswith("_temperature"):
        return "temperature"
    return QUANTITIES.get(quantity)


def units_of(dimension: str) -> tuple[str, ...]:
    """Return the units allowed for a dimension, in the order of the table.

    Raises
    ------
    UnitError
        If the dimension is unknown.
    """
    units = tuple(row.unit for row in TABLE if row.dimension == dimension)
    if not units:
        raise UnitError(
            Fault(
                "",
                f"dimension {dimension!r} is unknown",
                f"allowed are {', '.join(DIMENSIONS)}",
                "name one",
            )
        )
    return units


def dimensions_of_unit(unit: str) -> tuple[str, ...]:
    """Return the dimensions in which a unit may stand; empty when the unit is unknown."""
    spelling = _spelling(unit)
    return tuple(row.dimension for row in TABLE if row.unit == spelling)


@overload
def to_si(value: float, unit: str, quantity_dimension: str) -> float: ...
@overload
def to_si(value: FloatArray, unit: str, quantity_dimension: str) -> FloatArray: ...
def to_si(value: float | FloatArray, unit: str, quantity_dimension: str) -> float | FloatArray:
    """Convert a value from a unit to SI: ``factor * value + offset``.

    Parameters
    ----------
    value : float or array
    unit : str
        As the file writes it; blanks around it and the Greek mu are tolerated.
    quantity_dimension : str
        ``force``, ``pressure``, ``speed``, ``angle``, ... (`DIMENSIONS`).

    Raises
    ------
    UnitError
        If the unit is missing, unknown, or of another dimension.

    Examples
    --------
    >>> to_si(2.3, "bar", "pressure"), to_si(25.0, "degC", "temperature")
    (230000.0, 298.15)
    """
    row = _row(unit, quantity_dimension)
    if row.offset == 0.0:
        return value if row.factor == 1.0 else value * row.factor
    return value * row.factor + row.offset


@overload
def from_si(value: float, unit: str, quantity_dimension: str) -> float: ...
@overload
def from_si(value: FloatArray, unit: str, quantity_dimension: str) -> FloatArray: ...
def from_si(value: float | FloatArray, unit: str, quantity_dimension: str) -> float | FloatArray:
    """Convert a value from SI to a unit; the inverse of `to_si`, same arguments and errors.

    Examples
    --------
    >>> from_si(3.141592653589793, "deg", "angle"), from_si(0.0025, "ustrain", "strain")
    (180.0, 2500.0)
    """
    row = _row(unit, quantity_dimension)
    return (value - row.offset) / row.factor


def _spelling(unit: str) -> str:
    """Return the table's spelling: no blanks around, both mu signs and epsilon in ASCII."""
    plain = unit.strip().replace("\u00b5", "u").replace("\u03bc", "u")
    return plain.replace("\u03b5", "e").replace("\u00b2", "2")


def _row(unit: str, dimension: str) -> UnitRow:
    row = _ROWS.get((unit, dimension)) or _ROWS.get((_spelling(unit), dimension))
    if row is not None:
        return row
    allowed = ", ".join(units_of(dimension))
    if not unit.strip():
        raise UnitError(
            Fault("", f"no unit is given for a {dimension}", f"allowed are {allowed}", "add it")
        )
    others = dimensions_of_unit(unit)
    given = f"a unit of {' or '.join(others)}" if others else "not a unit that is known here"
    raise UnitError(
        Fault(
            "",
            f"unit {unit!r} is {given}",
            f"allowed for {dimension} are {allowed}",
            "correct it at the source of the data",
        )
    )
