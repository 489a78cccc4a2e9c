"""The library's ring models on the same tire, and how far they are from the finite elements."""

from dataclasses import dataclass

import numpy as np
from calculix import Floats
from cases import LOADS
from fields import State
from section import Section
from verify import edge, even

from tirelib.physics.contact.radial import RadialContact, load
from tirelib.physics.contact.static import StaticTire, press_to_load
from tirelib.physics.contact.tread import Tread
from tirelib.physics.ring.compliance import compliance
from tirelib.physics.ring.green import pressed_shape
from tirelib.physics.ring.ring import Ring
from tirelib.physics.strain.innerliner import strain_at

GRID = np.linspace(0.0, 0.8, 321)
N_MODES = 120
MASS = 3.0
"""rho A [kg/m]; without a bearing on a standing tire."""


@dataclass(frozen=True)
class Curves:
    """A ring's answer at the loads: rows are loads, columns are GRID."""

    strain: Floats
    pressure: Floats
    deflection: Floats
    edge: Floats


def tensioned(section: Section, *, extensible: bool) -> Curves:
    """Ring with the tension of the inflation pressure and radial tread springs."""
    target = section.target
    ring = Ring(
        target.ring_radius,
        section.bending,
        MASS,
        target.pressure * target.width,
        target.radial_stiffness,
        target.tangential_stiffness,
        extension_stiffness=section.stretching if extensible else np.inf,
    )
    tread = Tread(
        target.ring_radius + target.outer_offset, target.tread_stiffness, target.tread_thickness
    )
    solved: RadialContact = load(compliance(ring, 0.0, N_MODES), tread, np.array(LOADS))
    strain = strain_at(solved.displacement, target.ring_radius, target.liner_offset, GRID)
    return Curves(strain, solved.pressure_at(GRID), solved.deflection, solved.edges[:, 1])


def slack(section: Section, loads: tuple[float, ...]) -> Curves:
    """Ring on radial springs alone, without tension: the dissertation's static model."""
    target = section.target
    tire = StaticTire(
        ring_radius=target.ring_radius,
        free_radius=target.ring_radius + target.outer_offset,
        bending_stiffness=section.bending,
        radial_stiffness=target.radial_stiffness,
        tread_stiffness=target.tread_stiffness,
    )
    solved = press_to_load(tire, np.array(loads), nodes=721)
    u = pressed_shape(
        GRID,
        solved.angle,
        solved.pressure,
        ring_radius=target.ring_radius,
        bending_stiffness=section.bending,
        radial_stiffness=solved.radial_stiffness,
    )
    mirror = np.concatenate([u[:, :0:-1], u], axis=1)
    second = np.gradient(np.gradient(mirror, GRID[1], axis=1), GRID[1], axis=1)[:, GRID.size - 1 :]
    strain = -target.liner_offset / target.ring_radius**2 * (u + second)
    pressure = np.array(
        [np.interp(GRID, a, q) for a, q in zip(solved.angle, solved.pressure, strict=True)]
    )
    return Curves(strain, pressure, solved.deflection, solved.half_angle)


def distance(curves: Curves, loaded: list[State]) -> list[dict[str, float]]:
    """Ring minus finite elements, load by load; strains at the belt's own bending (beam)."""
    rows = []
    for k, s in enumerate(loaded):
        found = even(s.phi, s.beam_strain, GRID)
        pressure = even(s.phi_tread, s.pressure, GRID)
        end = edge(s, s.phi_tread)
        inside = end >= GRID
        apart = curves.strain[k] - found
        rows.append(
            {
                "centre_strain": float(curves.strain[k, 0] / found[0] - 1.0),
                "lowest_strain": float(curves.strain[k].min() / found.min() - 1.0),
                "rms_inside": float(np.sqrt(np.mean(apart[inside] ** 2))),
                "rms_outside": float(np.sqrt(np.mean(apart[~inside] ** 2))),
                "rms_of_largest": float(np.sqrt(np.mean(apart**2)) / found.max()),
                "deflection": float(curves.deflection[k] / s.deflection - 1.0),
                "edge": float(curves.edge[k] / end - 1.0),
                "centre_pressure": float(curves.pressure[k, 0] / pressure[0] - 1.0),
                "largest_pressure": float(curves.pressure[k].max() / pressure.max() - 1.0),
            }
        )
    return rows
