"""The parameters of a tire model, and what each of them may be."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from difflib import get_close_matches
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ParameterError


class Field(NamedTuple):
    """One parameter: where it stands in a tire file, and its allowed range (SI, inclusive)."""

    group: str
    unit: str
    dimension: str
    lowest: float
    highest: float
    meaning: str


_ANY = math.inf
ROUNDING = 1e-12
"""Relative difference by which a value at a limit may leave it: a unit's conversion rounds."""

FIELDS: Mapping[str, Field] = MappingProxyType(
    {
        "ring_radius": Field("geometry", "mm", "length", 0.05, 2.0, "R, neutral line of the belt"),
        "free_radius": Field("geometry", "mm", "length", 0.05, 2.0, "R0, unloaded, inflated tire"),
        "belt_width": Field("geometry", "mm", "length", 0.01, 1.0, "b, carries the pressure"),
        "tread_thickness": Field(
            "geometry", "mm", "length", 1e-4, 0.1, "h0, rubber between belt and road"
        ),
        "innerliner_offset": Field(
            "geometry", "mm", "length", -0.05, -1e-6, "y, gages from the neutral line, inward"
        ),
        "bending_stiffness": Field(
            "belt", "N m^2", "bending_stiffness", 1e-3, 1e3, "EI, in the wheel plane"
        ),
        "mass": Field("belt", "kg/m", "line_density", 0.0, 100.0, "rho A, belt and tread"),
        "centrifugal_tension": Field(
            "belt", "1", "ratio", 0.5, 1.5, "tension that spinning makes, over rho A R^2 Omega^2"
        ),
        "extension_stiffness": Field(
            "belt", "N", "force", 1e4, _ANY, "EA; inf is the inextensible belt"
        ),
        "shear_stiffness": Field(
            "belt", "N", "force", 1e3, _ANY, "GA; inf is the Bernoulli-Euler belt"
        ),
        "rotary_inertia": Field("belt", "kg m", "rotary_inertia", 0.0, 1.0, "rho I"),
        "liner_share": Field(
            "belt", "1", "ratio", -2.0, 2.0, "part of y in layers that carry no shear force"
        ),
        "offset_pressure_slope": Field(
            "belt", "1", "ratio", -0.3, 0.3, "growth of y for a pressure that doubles"
        ),
        "section_pull": Field(
            "sidewall", "1", "ratio", -0.3, 0.5, "share of p b that the sidewalls take inward"
        ),
        "pressure": Field(
            "inflation", "bar", "pressure", 0.0, 2e6, "reference pressure of the sidewall values"
        ),
        "radial_stiffness": Field("sidewall", "N/m^2", "line_stiffness", 1e3, 1e8, "k_u"),
        "radial_pressure_slope": Field(
            "sidewall", "N/m^2/bar", "stiffness_per_pressure", -100.0, 100.0, "d k_u / d p"
        ),
        "radial_deflection_rate": Field(
            "sidewall", "1/m", "curvature", -100.0, 100.0, "B of k_u = A exp(B d0), softening < 0"
        ),
        "tangential_stiffness": Field("sidewall", "N/m^2", "line_stiffness", 0.0, 1e8, "k_v"),
        "tangential_pressure_slope": Field(
            "sidewall", "N/m^2/bar", "stiffness_per_pressure", -100.0, 100.0, "d k_v / d p"
        ),
        "damping": Field("sidewall", "1", "ratio", 0.0, 1.0, "lambda of c_n = 2 lambda sqrt(m k)"),
        "tread_stiffness": Field("tread", "N/m^2", "line_stiffness", 1e4, 1e11, "k_t, normal"),
        "tread_hardening": Field("tread", "1", "ratio", 0.0, 50.0, "growth of k_t over h0"),
        "tread_shear_stiffness": Field("tread", "N/m^2", "line_stiffness", 0.0, 1e11, "k_Gt"),
        "tread_poisson": Field(
            "tread", "1", "ratio", -1.0, 2.0, "nu / (1 - nu): thicker where the belt is bent flat"
        ),
        "contact_crown": Field(
            "tread", "1/m", "curvature", 0.0, 20.0, "curvature across that the belt keeps on a road"
        ),
        "tread_spread": Field(
            "tread", "1", "ratio", 0.0, 3.0, "sigma over which it spreads the pressure, over h0"
        ),
        "friction": Field("tread", "1", "ratio", 0.0, 5.0, "mu, tread on road"),
        "creep": Field(
            "tread", "1", "ratio", 0.0, 1.0, "slip at 71 % of full friction; 0 sticks fully"
        ),
        "crown_curvature": Field(
            "lateral", "1/m", "curvature", -20.0, 20.0, "curvature of the tread's crown"
        ),
        "lateral_bending": Field(
            "lateral", "N m^2", "bending_stiffness", 1e-2, 1e7, "EI_z of the belt in its own plane"
        ),
        "lateral_stiffness": Field(
            "lateral", "N/m^2", "line_stiffness", 1e2, 1e9, "k_l, sidewall, lateral"
        ),
        "lateral_shear": Field(
            "lateral", "N", "force", 1e-3, _ANY, "S, shear of the belt in its own plane"
        ),
        "roll_lever": Field(
            "lateral", "mm", "length", -0.5, 0.5, "height of the sidewalls' lateral force"
        ),
        "bristle_lateral": Field("brush", "N/m^2", "line_stiffness", 1e3, 1e11, "c_py"),
        "bristle_longitudinal": Field("brush", "N/m^2", "line_stiffness", 1e3, 1e11, "c_px"),
        "carcass_stiffness": Field("brush", "N/m", "stiffness", 1e2, _ANY, "lateral, whole tire"),
    }
)
"""Every parameter of `Tire`, in the order of a tire file."""

BRUSH_FIELDS: Mapping[str, Field] = MappingProxyType(
    {
        "half_length": Field(
            "brush", "mm", "length", 0.005, 0.5, "a0, half the contact; absent: the ring gives it"
        ),
        "load_power": Field("brush", "1", "ratio", -0.5, 1.5, "n of a = a0 (Fz/Fz0)^n (p/p0)^m"),
        "pressure_power": Field("brush", "1", "ratio", -2.0, 1.0, "m of the same law"),
        "reference_load": Field("brush", "N", "force", 1.0, 1e6, "Fz0 of the same law"),
        "reference_pressure": Field("brush", "bar", "pressure", 1e3, 2e6, "p0 of the same law"),
        "camber_thrust": Field("brush", "1", "ratio", -2.0, 2.0, "slip angle worth of camber"),
        "slip_angle_offset": Field("brush", "deg", "angle", -0.05, 0.05, "added to the slip angle"),
        "slip_ratio_offset": Field("brush", "1", "ratio", -0.05, 0.05, "added to the slip ratio"),
        "Fx_offset": Field("brush", "N", "force", -2e3, 2e3, "added to Fx"),
        "Fy_offset": Field("brush", "N", "force", -2e3, 2e3, "added to Fy"),
        "Mz_offset": Field("brush", "Nm", "moment", -200.0, 200.0, "added to Mz"),
        "yaw_compliance": Field(
            "brush", "deg/Nm", "compliance", 0.0, 5e-4, "turn of the contact under Mz; 0 is rigid"
        ),
    }
)
"""Numbers of a tire file that only the brush has; the identification of a brush reads them."""

NUMBERS: Mapping[str, Field] = MappingProxyType({**FIELDS, **BRUSH_FIELDS})
"""Every number that a tire file may hold."""


@dataclass(frozen=True, slots=True)
class Tire:
    """A tire as the models see it; SI units, meanings and ranges in `FIELDS`.

    The sidewall's values hold at the reference pressure and follow the actual one along a line.

    Raises
    ------
    ParameterError
        If a value is not a number, outside its range, or contradicts another.
    """

    ring_radius: float
    free_radius: float
    belt_width: float
    tread_thickness: float
    innerliner_offset: float
    bending_stiffness: float
    mass: float
    pressure: float
    radial_stiffness: float
    tangential_stiffness: float
    tread_stiffness: float
    extension_stiffness: float = math.inf
    shear_stiffness: float = math.inf
    rotary_inertia: float = 0.0
    liner_share: float = 0.0
    offset_pressure_slope: float = 0.0
    section_pull: float = 0.0
    centrifugal_tension: float = 1.0
    radial_pressure_slope: float = 0.0
    radial_deflection_rate: float = 0.0
    tangential_pressure_slope: float = 0.0
    damping: float = 0.0
    tread_hardening: float = 0.0
    tread_shear_stiffness: float = 0.0
    tread_poisson: float = 0.0
    contact_crown: float = 0.0
    tread_spread: float = 0.0
    friction: float = 1.0
    creep: float = 0.0
    crown_curvature: float = 0.7
    lateral_bending: float = 8000.0
    lateral_shear: float = 1.2e4
    lateral_stiffness: float = 2.0e5
    roll_lever: float = 0.005
    bristle_lateral: float = 1.0e7
    bristle_longitudinal: float = 1.5e7
    carcass_stiffness: float = math.inf

    def __post_init__(self) -> None:
        found = [
            fault
            for field in fields(self)
            if (fault := range_fault(field.name, getattr(self, field.name))) is not None
        ]
        if not found and (fault := radii_fault(self.ring_radius, self.free_radius)) is not None:
            found.append(fault)
        if found:
            raise ParameterError("tire: " + "; ".join(found))

    def offset_at(self, pressure: FloatArray | float) -> FloatArray:
        """Return the gages' offset y < 0 at a gauge pressure [Pa], in the pressure's shape, [m]."""
        return offset_at(
            self.innerliner_offset, self.offset_pressure_slope, pressure, self.pressure
        )

    def changed(self, **values: float) -> "Tire":
        """Return the tire with some values replaced.

        Raises
        ------
        ParameterError
            If a name is unknown or a value not allowed.
        """
        for name in values:
            if name not in FIELDS:
                raise ParameterError(unknown_name(name))
        return replace(self, **values)


def offset_at(
    offset: FloatArray | float,
    slope: FloatArray | float,
    pressure: FloatArray | float,
    reference: FloatArray | float,
) -> FloatArray:
    """Return y (1 + s (p / p0 - 1)): inflation presses the liner between belt and gage together."""
    return np.asarray(offset * (1.0 + slope * (np.asarray(pressure) / reference - 1.0)))


def unknown_name(name: str) -> str:
    """Return the message for a parameter that no tire has."""
    near = get_close_matches(name, NUMBERS, n=2)
    hint = f"did you mean {' or '.join(near)}?" if near else f"known are {', '.join(NUMBERS)}"
    return f"tire parameter {name!r} is unknown; {hint}"


def radii_fault(ring_radius: float, free_radius: float) -> str | None:
    """Return what is wrong with the two radii, or None."""
    if ring_radius < free_radius:
        return None
    return (
        f"ring_radius = {1e3 * ring_radius:g} mm is not below free_radius = "
        f"{1e3 * free_radius:g} mm; the belt lies inside the tread; exchange or correct them"
    )


def range_fault(name: str, value: float) -> str | None:
    """Return what is wrong with a value, or None."""
    field = NUMBERS[name]
    if not isinstance(value, int | float) or math.isnan(value):
        return f"{name} = {value!r} is not a number; give it in {field.unit} ({field.meaning})"
    at_limit = any(
        math.isclose(value, limit, rel_tol=ROUNDING) for limit in (field.lowest, field.highest)
    )
    inside = at_limit or field.lowest <= value <= field.highest
    if not inside or (math.isinf(value) and not math.isinf(field.highest)):
        return (
            f"{name} = {value:g} (SI) is outside {field.lowest:g} to {field.highest:g}; "
            f"check value and unit ({field.unit}, {field.meaning})"
        )
    return None
