"""The virtual tire: every structural constant of the rig in one place.

A hidden effect is planted by replacing a field (`dataclasses.replace`): sidewall damping and
softening, tread hardening, friction and tread thickness (wear) are fields already. Softening of
rubber with temperature would scale `sidewall_*`, `tread_*`; run-out and gage faults are part of
the measurement (`tirelib.rig.measure`).
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tirelib.core.errors import ParameterError
from tirelib.rig.mesh import Mesh

Array = NDArray[np.float64]
BeltLaw = Callable[["RigTire", "Condition", float, Mesh, Array], Array]
"""(tire, condition, Omega, mesh, fields) -> residual density, shape (n_gauss, 32)."""
RoadLaw = Callable[["RigTire", "Condition", Array, Any], Any]
"""(tire, condition, angles of the contact points, contact) -> contact with changed tractions; the
contact is a `tirelib.rig.road.Road`, which this module does not know."""

N_STRIPS = 5

_MAY_BE_ZERO = frozenset(
    {
        "crown_curvature",
        "sidewall_radial_offset",
        "sidewall_tangential_offset",
        "sidewall_lateral_offset",
        "sidewall_damping",
        "sidewall_softening",
        "roll_lever",
        "transverse_bending",
        "belt_shear_coupling",
        "tread_hardening",
        "tread_cubic",
        "tread_roughness",
        "road_curvature",
        "friction",
        "mass",
    }
)


@dataclass(frozen=True)
class RigTire:
    """Constants of the virtual tire, SI units, for the whole belt width unless stated otherwise.

    Attributes
    ----------
    name : str
        Goes into the campaign.
    ring_radius, belt_width, innerliner_offset : float
        Radius of the belt's neutral line when unloaded and not inflated; width that carries the
        pressure and the tread; position of the gages from the neutral line, outward positive [m].
    tread_thickness, tread_base : float
        Bristle height, and distance from the neutral line to the bristle's root [m].
    crown_curvature : float
        Curvature of the tread's crown across the width [1/m]: a strip at y is lower by y^2 c / 2.
    extension, shear, bending : float
        EA [N], GA [N], EI [N m^2] of the belt.
    mass : float
        Belt and tread mass per length [kg/m].
    sidewall_radial, sidewall_radial_offset : float
        k_u = sidewall_radial * p + sidewall_radial_offset [N/m^2], p gauge [Pa];
        likewise tangential (k_v) and lateral (k_w).
    sidewall_share : tuple of float
        Share of k_u and k_v that each strip carries; adds up to one, symmetric.
    sidewall_damping : float
        lambda in c = 2 lambda sqrt(k rho A), for the three directions [1].
    sidewall_softening, softening_length : float
        Radial force k_u u (1 - s u^2 / (u^2 + L^2)): share s of the stiffness that is lost at
        deflections well above L [1], [m].
    roll_lever : float
        Height over the tread at which the sidewalls carry lateral force; it makes the load
        transfer between the strips [m].
    transverse_bending : float
        Bending stiffness across the belt per length of circumference [N m].
    belt_shear_coupling : float
        In-plane shear stiffness of the belt between strips, G t [N/m].
    tread_normal, tread_hardening : float
        Bristle pressure q = k d (1 + c d / H), d compression, H bristle height: k [N/m^3], c [1].
    tread_cubic : float
        Further hardening: c_3 (d / H)^2 is added to 1 + c d / H [1].
    tread_roughness : float
        Half height of asperities, evenly spread: they touch before the smooth tread would [m].
    road_curvature : float
        Curvature of the road along the direction of travel, a drum's; zero is the flat belt [1/m].
    tread_shear_x, tread_shear_y : float
        Bristle shear stiffness per area [N/m^3].
    friction : float
        Coulomb coefficient between tread and road [1].
    belt_laws, road_laws : tuple
        Further laws of the belt and its sidewall, and of the road (`tirelib.rig.laws`).
    """

    name: str = "numerical tire, 215/60R16 class"
    ring_radius: float = 0.3030
    belt_width: float = 0.168
    innerliner_offset: float = -0.003
    tread_thickness: float = 0.0115
    tread_base: float = 0.0015
    crown_curvature: float = 0.7
    extension: float = 4.6e6
    shear: float = 7.0e4
    bending: float = 2.6
    mass: float = 3.6
    sidewall_radial: float = 1.1
    sidewall_radial_offset: float = 2.3e5
    sidewall_tangential: float = 0.35
    sidewall_tangential_offset: float = 1.1e5
    sidewall_lateral: float = 0.8
    sidewall_lateral_offset: float = 1.8e5
    sidewall_share: tuple[float, ...] = (0.26, 0.16, 0.16, 0.16, 0.26)
    sidewall_damping: float = 0.03
    sidewall_softening: float = 0.0
    softening_length: float = 0.02
    roll_lever: float = 0.005
    transverse_bending: float = 2.0
    belt_shear_coupling: float = 1.0e5
    tread_normal: float = 3.2e8
    tread_hardening: float = 1.0
    tread_shear_x: float = 1.0e8
    tread_shear_y: float = 1.0e8
    friction: float = 0.95
    tread_cubic: float = 0.0
    tread_roughness: float = 0.0
    road_curvature: float = 0.0
    belt_laws: tuple[BeltLaw, ...] = ()
    road_laws: tuple[RoadLaw, ...] = ()

    def __post_init__(self) -> None:
        for f in fields(self):
            value = getattr(self, f.name)
            if not isinstance(value, float) or f.name == "innerliner_offset":
                continue
            if (
                not np.isfinite(value)
                or value < 0.0
                or (value == 0.0 and f.name not in _MAY_BE_ZERO)
            ):
                raise ParameterError(
                    f"rig tire, {f.name} = {value}; allowed are finite numbers, "
                    f"{'zero or above' if f.name in _MAY_BE_ZERO else 'above zero'}; "
                    "give another value"
                )
        if len(self.sidewall_share) != N_STRIPS or abs(sum(self.sidewall_share) - 1.0) > 1e-9:
            raise ParameterError(
                f"rig tire, sidewall_share = {self.sidewall_share}; allowed are {N_STRIPS} numbers "
                "that add up to 1; give the share of each strip"
            )
        if not 0.0 <= self.sidewall_softening < 1.0:
            raise ParameterError(
                f"rig tire, sidewall_softening = {self.sidewall_softening}; allowed is 0 to below "
                "1; give the share of the stiffness that is lost"
            )

    @property
    def free_radius(self) -> float:
        """Radius of the tread's crown, not inflated [m]."""
        return self.ring_radius + self.tread_base + self.tread_thickness

    @property
    def lateral(self) -> Array:
        """Lateral positions of strips and gages, y to the left, shape (5,) [m]."""
        return np.array([-0.06, -0.03, 0.0, 0.03, 0.06])

    @property
    def surface(self) -> Array:
        """Height of each strip's tread surface over the neutral line, shape (5,) [m]."""
        drop = 0.5 * self.crown_curvature * self.lateral**2
        return np.asarray(self.tread_base + self.tread_thickness - drop, dtype=np.float64)

    def radial_stiffness(self, pressure: float) -> float:
        """Return k_u [N/m^2] at a gauge pressure [Pa]."""
        return self.sidewall_radial * pressure + self.sidewall_radial_offset

    def tangential_stiffness(self, pressure: float) -> float:
        """Return k_v [N/m^2] at a gauge pressure [Pa]."""
        return self.sidewall_tangential * pressure + self.sidewall_tangential_offset

    def lateral_stiffness(self, pressure: float) -> float:
        """Return k_w [N/m^2] at a gauge pressure [Pa]."""
        return self.sidewall_lateral * pressure + self.sidewall_lateral_offset


@dataclass(frozen=True)
class Condition:
    """A steady rolling condition, SI and ISO 8855.

    Attributes
    ----------
    load : float
        Vertical force Fz [N].
    pressure : float
        Gauge pressure [Pa].
    speed : float
        Speed of the road [m/s].
    slip_angle, camber : float
        tan(slip angle) = v_y / v_x; a positive camber leans the top to the right [rad].
    slip_ratio : float or None
        kappa = (Omega R_e - v_x) / v_x; None lets the wheel roll freely (no torque).
    friction : float or None
        Coulomb coefficient of this road [1]; None is the tire's own.
    tread_depth : float or None
        Depth of the grooves that is left of `NEW_DEPTH` [m]; None is a new tread.
    """

    load: float
    pressure: float
    speed: float
    slip_angle: float = 0.0
    camber: float = 0.0
    slip_ratio: float | None = None
    friction: float | None = None
    tread_depth: float | None = None


NEW_DEPTH = 0.008
"""Depth of the grooves of a new tread; what is below them does not wear [m]."""
TREAD_DENSITY = 800.0
"""Density of the tread that wears, its grooves included: 1,150 kg/m^3 of rubber on 70 % of it
[kg/m^3]."""


def on_road(tire: RigTire, cond: Condition) -> RigTire:
    """Return the tire with the road's friction and the remaining tread.

    The bristles' stiffness is a modulus over their height: a worn tread is stiffer, thinner and
    lighter.
    """
    if cond.friction is not None:
        tire = replace(tire, friction=cond.friction)
    if cond.tread_depth is None:
        return tire
    worn = NEW_DEPTH - cond.tread_depth
    left = tire.tread_thickness - worn
    stiffer = tire.tread_thickness / left
    return replace(
        tire,
        tread_thickness=left,
        tread_normal=tire.tread_normal * stiffer,
        tread_shear_x=tire.tread_shear_x * stiffer,
        tread_shear_y=tire.tread_shear_y * stiffer,
        mass=tire.mass - TREAD_DENSITY * tire.belt_width * worn,
    )


TIRES: Mapping[str, RigTire] = MappingProxyType(
    {
        "reference": RigTire(),
        "stiff": RigTire(
            name="numerical tire, stiff belt",
            extension=5.2e6,
            shear=1.1e5,
            bending=3.4,
            sidewall_radial=1.25,
            sidewall_radial_offset=2.7e5,
            belt_shear_coupling=1.3e5,
            tread_thickness=0.0095,
            tread_normal=3.9e8,
            mass=3.9,
        ),
        "soft": RigTire(
            name="numerical tire, soft belt",
            extension=4.2e6,
            shear=5.0e4,
            bending=2.0,
            sidewall_radial=1.0,
            sidewall_radial_offset=1.9e5,
            belt_shear_coupling=0.8e5,
            tread_thickness=0.013,
            tread_normal=2.8e8,
            mass=3.4,
        ),
    }
)
"""Tires by name, for the command line."""


def tire(name: str) -> RigTire:
    """Return a tire by name.

    Raises
    ------
    ParameterError
        If there is none of this name.
    """
    try:
        return TIRES[name]
    except KeyError:
        raise ParameterError(
            f"rig tire {name!r} is unknown; allowed are {', '.join(TIRES)}; choose one of them"
        ) from None
