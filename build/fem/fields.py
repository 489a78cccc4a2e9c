"""From CalculiX tables to what a ring model can be compared with.

Strain is the change of length from the inflated, unloaded state, L / L_inflated - 1.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from calculix import Floats, Table, contact_nodes, tables
from cases import Case
from deck import middle_line
from mesh import Mesh

GAUSS = 1.0 / np.sqrt(3.0)


@dataclass(frozen=True)
class State:
    """One load step, for phi from 0 to pi (the other half is the mirror image)."""

    load: float
    """Vertical force on the road, both halves, from the sidewall springs, [N]."""
    road_load: float
    """The same from the contact stresses, [N]."""
    deflection: float
    """Deflection of the inflated tire at its outer radius, [m]."""
    phi: Floats
    """Material angles of the strains, [rad]."""
    strain: Floats
    """At the innerliner's surface, from the continuum there."""
    beam_strain: Floats
    """At the same place, from stretch and curvature of the belt's core."""
    phi_line: Floats
    """Material angles of the middle line's nodes, [rad]."""
    u: Floats
    """Radial displacement of the middle line from the inflated state, [m]."""
    v: Floats
    """Tangential displacement, the same, [m]."""
    phi_tread: Floats
    """Material angles of the tread surface's nodes, [rad]."""
    x: Floats
    """Their place on the road, [m]."""
    pressure: Floats
    """Contact pressure times width, per length of road, [N/m]."""
    shear: Floats
    """Force of the road on the tire along x, per length of road, [N/m]."""
    gap: Floats
    """Height of the tread's surface over the road, [m]; slightly negative in contact."""


def states(out: Path, case: Case) -> list[State]:
    """Return the states of a case under its loads."""
    path = out / case.name
    found = tables(path)
    steps = _by_step(found)
    touched = contact_nodes(path)
    road = next(t.rows for t in found if t.what == "total force")
    if np.abs(road).max() > 1e-6:
        raise SystemExit(
            f"fem: {path} touches the road with {np.abs(road).max():.3g} N when inflated, so it "
            "has no free state to compare with; widen Touch.gap"
        )
    return [
        _state(case, step, steps[0], nodes)
        for step, nodes in zip(steps[-len(case.loads) :], touched[-len(case.loads) :], strict=True)
    ]


def middle_displacement(mesh: Mesh, displacement: Floats) -> tuple[Floats, Floats]:
    """Radial and tangential displacement of the middle line's nodes, [m]."""
    ids, phi, _ = middle_line(mesh)
    ux, uy = displacement[ids - 1, 1], displacement[ids - 1, 2]
    return ux * np.sin(phi) - uy * np.cos(phi), ux * np.cos(phi) + uy * np.sin(phi)


def displacements(path: Path) -> list[Floats]:
    """Return the nodal displacements of each step of a job, rows (id, ux, uy, uz)."""
    return [t.rows for t in tables(path) if t.what == "displacements"]


def stretches(mesh: Mesh, strain: Floats, row: int) -> tuple[Floats, Floats, Floats]:
    """Stretch along the circumference at the Gauss points of a row of elements.

    Returns the angles (2 n,), the two distances y (2,) and the stretches (2, 2 n), the inner
    points first. The tables hold Green's strain E in material axes; the stretch is sqrt(1 + 2 E).
    """
    n, m = mesh.elements.shape[:2]
    green = strain[:, 3].reshape(n, m, 8)[:, row, :4].reshape(n, 2, 2)  # outer, inner points
    stretch = np.sqrt(1.0 + 2.0 * green)
    center, half = mesh.phi[1::2], np.diff(mesh.phi[::2]) / 2.0
    phi = (center[:, None] + GAUSS * half[:, None] * np.array([-1.0, 1.0])).ravel()
    low, high = mesh.y[2 * row], mesh.y[2 * row + 2]
    y = (low + high) / 2.0 + GAUSS * (high - low) / 2.0 * np.array([-1.0, 1.0])
    return phi, y, np.stack([stretch[:, 1].ravel(), stretch[:, 0].ravel()])


def _by_step(found: list[Table]) -> list[dict[str, Floats]]:
    steps: dict[float, dict[str, Floats]] = {}
    for table in found:
        steps.setdefault(table.time, {})[table.what] = table.rows
    return [steps[t] for t in sorted(steps)]


def _fibre(radius: float, y: Floats, stretch: Floats, at: float) -> Floats:
    """Stretch at a distance `at` when cross-sections stay plane: linear in lengths."""
    length = stretch * (1.0 + y[:, None] / radius)
    slope = (length[1] - length[0]) / (y[1] - y[0])
    return (length[0] + slope * (at - y[0])) / (1.0 + at / radius)


def _state(
    case: Case, step: dict[str, Floats], first: dict[str, Floats], nodes: dict[int, Floats]
) -> State:
    section, mesh = case.section, case.mesh
    target = section.target
    at, core = target.liner_offset, mesh.layers.index("core")

    def strain(row: int) -> tuple[Floats, Floats]:
        phi, y, now = stretches(mesh, step["strains"], row)
        before = stretches(mesh, first["strains"], row)[2]
        now, before = (_fibre(mesh.radius, y, s, at) for s in (now, before))
        return phi, now / before - 1.0

    phi, surface = strain(0)
    u, v = middle_displacement(mesh, step["displacements"])
    u0, v0 = middle_displacement(mesh, first["displacements"])
    _, phi_line, weight = middle_line(mesh)
    up = target.tangential_stiffness * v * np.sin(phi_line)
    up = up - target.radial_stiffness * u * np.cos(phi_line)
    x, y, pressure, shear = _road(mesh, step["displacements"], target.width, nodes)
    road = y[0] + pressure[0] / (target.width * case.contact.normal)
    _, y0, _, _ = _road(mesh, first["displacements"], target.width, {})
    return State(
        load=2.0 * float(up @ weight),
        road_load=2.0 * float(np.trapezoid(pressure, x)),
        deflection=float(road - y0[0]),
        phi=phi,
        strain=surface,
        beam_strain=strain(core)[1],
        phi_line=phi_line,
        u=u - u0,
        v=v - v0,
        phi_tread=mesh.phi,
        x=x,
        pressure=pressure,
        shear=shear,
        gap=y - road,
    )


def _road(
    mesh: Mesh, displacement: Floats, width: float, nodes: dict[int, Floats]
) -> tuple[Floats, Floats, Floats, Floats]:
    """Place, pressure and shear per length of road at the tread's outer nodes."""
    ids = mesh.ids[:, -1]
    points = mesh.points()[ids - 1] + displacement[ids - 1, 1:3]
    stress = np.array([nodes.get(int(i), np.zeros(6))[3:6] for i in ids])
    return points[:, 0], points[:, 1], stress[:, 0] * width, stress[:, 1] * width
