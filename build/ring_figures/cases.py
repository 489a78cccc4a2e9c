"""The operating points of the dissertation's figures of chapters 5 and 6."""

from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.parameters import Tire
from tirelib.physics.contact.static import StaticContact, StaticTire, press_to_load
from tirelib.physics.ring.green import pressed_shape
from tirelib.report.simulation import Simulation, simulate

STATIC_LOADS = (1416.0, 3541.0, 5666.0, 7791.0)
"""25, 62.5, 100 and 137.5 % of 5666 N, table 3-1, [N]."""
LUMPED_STIFFNESS = 20.0
"""Assumed bending stiffness of the standing ring, which has no tension, [N m^2]."""
DEFLECTIONS = (0.025, 0.035, 0.045)
"""Section 6.4, [m]."""
TURN_RATE = 59.0
"""Table 6-1, [rad/s]."""
LOADS = (1706.4, 4265.9, 6825.4)
"""40, 100 and 160 % of 4265.9 N, section 6.5.2, [N]."""
REFERENCE_LOAD = 4265.9
INFLATIONS = (1.3e5, 1.7e5, 2.1e5, 2.5e5)
"""Table 6-2, [Pa]."""
SPEEDS = (10.0 / 3.6, 65.0 / 3.6, 100.0 / 3.6, 150.0 / 3.6)
"""[m/s]."""
DAMPINGS = (0.0, 0.05, 0.1)
DYNAMIC_DAMPING = 0.09
"""Identified in section 6.5.2.2."""
DYNAMIC_SPEED = 65.0 / 3.6
EQUAL_DEFLECTION = 0.025
EQUAL_INFLATIONS = (1.28e5, 2.13e5)
"""Section 6.5.2.2 names them for Fig. 6-7 (b), [Pa]."""
_ANGLES = 1441


@dataclass(frozen=True, slots=True)
class StaticRing:
    """The standing ring on Winkler springs over a whole turn.

    Attributes
    ----------
    contact : StaticContact
    phi : shape (n_phi,), [rad]
    u : shape (n_points, n_phi), [m]
    strain : shape (n_points, n_phi)
        Eq. (35) at the innerliner.
    """

    tire: Tire
    contact: StaticContact
    phi: FloatArray
    u: FloatArray
    strain: FloatArray


def standing(tire: Tire, loads: tuple[float, ...] = STATIC_LOADS) -> StaticRing:
    """Press the standing ring of chapter 5 onto the road."""
    solid = StaticTire(
        ring_radius=tire.ring_radius,
        free_radius=tire.free_radius,
        bending_stiffness=tire.bending_stiffness,
        radial_stiffness=tire.radial_stiffness,
        tread_stiffness=tire.tread_stiffness,
        softening=tire.radial_deflection_rate,
    )
    contact = press_to_load(solid, np.array(loads))
    phi = np.linspace(-np.pi, np.pi, _ANGLES)
    u, bend = (
        pressed_shape(
            phi,
            contact.angle,
            contact.pressure,
            ring_radius=tire.ring_radius,
            bending_stiffness=tire.bending_stiffness,
            radial_stiffness=contact.radial_stiffness,
            derivative=k,
        )
        for k in (0, 2)
    )
    strain: FloatArray = -tire.innerliner_offset / tire.ring_radius**2 * (u + bend)
    return StaticRing(tire, contact, phi, u, strain)


def by_deflection(tire: Tire, contact: str = "radial") -> Simulation:
    """Return Fig. 6-9 to 6-12: three deflections of the rolling tire of Table 6-1."""
    return simulate(tire, deflection=DEFLECTIONS, turn_rate=TURN_RATE, contact=contact)


def by_load(
    tire: Tire, contact: str = "radial", damping: float = 0.0, speed: float = 0.0
) -> Simulation:
    """Return Fig. 6-22, 6-24, 6-26, 6-34, 6-36: three loads at the tire's inflation."""
    return simulate(
        tire.changed(damping=damping),
        load=LOADS,
        turn_rate=speed / tire.ring_radius,
        contact=contact,
    )


def by_inflation(tire: Tire, damping: float = 0.0, speed: float = 0.0) -> Simulation:
    """Return Fig. 6-23, 6-28, 6-35: four inflation pressures at the reference load."""
    return simulate(
        tire.changed(damping=damping),
        load=REFERENCE_LOAD,
        inflation=INFLATIONS,
        turn_rate=speed / tire.ring_radius,
    )


def by_inflation_at_equal_deflection(tire: Tire) -> Simulation:
    """Return Fig. 6-7 (b): two inflation pressures at one deflection."""
    return simulate(tire, deflection=EQUAL_DEFLECTION, inflation=EQUAL_INFLATIONS)


def by_speed(tire: Tire, damping: float) -> Simulation:
    """Return a column of Fig. 6-29: the speeds at the reference load."""
    turn_rate = np.array(SPEEDS) / tire.ring_radius
    return simulate(tire.changed(damping=damping), load=REFERENCE_LOAD, turn_rate=turn_rate)
