"""Contact pressure of the rolling tire at given load, pressure and speed, Eq. (114).

The identified tire is pressed until it carries the load. Two contacts are known: radial tread
springs (the dissertation's simple contact), and tread elements that are sheared as well and slide
where friction ends (its advanced contact).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from routes.damped_ring import SHEAR_SHARE, Law, damped_compliance
from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ParameterError
from tirelib.physics.contact import radial, shear
from tirelib.physics.contact.shear_law import Shear
from tirelib.physics.contact.tread import Tread
from tirelib.physics.ring.compliance import Compliance
from tirelib.physics.ring.ring import Ring

SETTLE = 4
"""Passes that let k_u follow the deflection, Eq. (54)."""
GRID_POINTS = 201

ContactModel = Literal["radial", "sheared"]


@dataclass(frozen=True, slots=True)
class PressureMap:
    """Pressure under the rolling tire, one row per operating point.

    Attributes
    ----------
    model : str
        "radial" or "sheared".
    load : shape (n_points,), [N]
    deflection : shape (n_points,), [m]
    edges : shape (n_points, 2), [rad]
        Leading (negative) and trailing contact angle.
    phi : shape (n_points, n), [rad]
        Wheel angle from edge to edge.
    pressure : shape (n_points, n), [N/m]
        Per length of belt, inward positive.
    traction : shape (n_points, n), [N/m]
        Traction of the road on the tread along +phi; zero for the radial contact.
    centre : shape (n_points,), [m]
        Centre of pressure along the belt, negative toward the entry.
    length : shape (n_points,), [m]
        Contact length along the belt, R (phi_trail - phi_lead).
    """

    model: ContactModel
    load: FloatArray
    deflection: FloatArray
    edges: FloatArray
    phi: FloatArray
    pressure: FloatArray
    traction: FloatArray
    centre: FloatArray
    length: FloatArray


def dynamic_pressure(
    values: Mapping[str, float],
    load: float | FloatArray,
    pressure: float | FloatArray,
    omega: float | FloatArray,
    *,
    model: ContactModel = "radial",
    law: Law = "sidewall",
) -> PressureMap:
    """Return the pressure distribution at operating points.

    Parameters
    ----------
    values : mapping
        Names of `Tire`, as `DynamicRoute.values` or `asdict(tire)`; k_u = A exp(B d0) with the
        solution's deflection.
    load, pressure, omega : float or shape (n_points,), [N], [Pa], [rad/s]
    model : str
        "radial" or "sheared"; without a tread shear stiffness a third of the normal one is taken.
    law : str
        Damping law that `values["damping"]` belongs to.

    Raises
    ------
    ParameterError
        If the model is unknown, a condition is not positive, or the sidewall's line leads to a
        stiffness that is not.
    ConvergenceError
        From the contact.
    """
    if model not in ("radial", "sheared"):
        raise ParameterError(
            f"dynamic pressure: contact {model!r} is unknown; known are 'radial' and 'sheared'"
        )
    Fz, p, w = (
        np.array(a, dtype=float)
        for a in np.broadcast_arrays(*(np.atleast_1d(x) for x in (load, pressure, omega)))
    )
    if not (np.isfinite(Fz) & (Fz > 0) & (p >= 0) & np.isfinite(p) & np.isfinite(w)).all():
        raise ParameterError(
            f"dynamic pressure: load {Fz.min():g} N, pressure {p.min() / 1e5:g} bar; finite "
            "numbers, a load > 0 and a pressure >= 0 are needed"
        )
    tread = Tread(
        values["free_radius"],
        values["tread_stiffness"],
        values["tread_thickness"],
        values["tread_hardening"],
    )
    deflection = np.zeros(Fz.size)
    for _ in range(SETTLE if values["radial_deflection_rate"] else 1):
        ring = damped_compliance(_ring(values, p, deflection), w, values["damping"], law)
        contact = radial.load(ring, tread, Fz)
        deflection = contact.deflection
    if model == "radial":
        return _radial_map(contact, Fz)
    return _sheared_map(values, ring, tread, Fz)


def _ring(values: Mapping[str, float], pressure: FloatArray, deflection: FloatArray) -> Ring:
    above = pressure - values["pressure"]
    k_u = values["radial_stiffness"] + values["radial_pressure_slope"] * above
    return Ring(
        radius=values["ring_radius"],
        bending_stiffness=values["bending_stiffness"],
        mass=values["mass"],
        inflation=pressure * values["belt_width"],
        radial_stiffness=k_u * np.exp(values["radial_deflection_rate"] * deflection),
        tangential_stiffness=values["tangential_stiffness"]
        + values["tangential_pressure_slope"] * above,
    )


def _radial_map(contact: radial.RadialContact, load: FloatArray) -> PressureMap:
    share = np.linspace(0.0, 1.0, GRID_POINTS)
    span = np.diff(contact.edges, axis=1)
    phi = contact.edges[:, :1] + share * span
    pressure = contact.pressure_at(phi)
    return PressureMap(
        "radial",
        load,
        contact.deflection,
        contact.edges,
        phi,
        pressure,
        np.zeros_like(pressure),
        contact.pressure_centre,
        contact.compliance.radius * span[:, 0],
    )


def _sheared_map(
    values: Mapping[str, float], ring: Compliance, tread: Tread, load: FloatArray
) -> PressureMap:
    stiffness = values["tread_shear_stiffness"] or SHEAR_SHARE * values["tread_stiffness"]
    contact = shear.load(ring, tread, Shear(stiffness, values["friction"]), load, torque=0.0)
    weight = contact.weights * contact.pressure
    centre = np.sum(weight * contact.phi, axis=1) / np.sum(weight, axis=1)
    radius = contact.compliance.radius
    return PressureMap(
        "sheared",
        load,
        contact.deflection,
        contact.edges,
        contact.phi,
        contact.pressure,
        contact.shear_traction,
        radius * centre,
        radius * np.diff(contact.edges, axis=1)[:, 0],
    )
