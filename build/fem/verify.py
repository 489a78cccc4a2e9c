"""Checks of the finite-element model itself, none of which needs the library.

Small harmonic loads find the stiffness of the section order by order; inflation finds its tensile
stiffness; the loaded tire must balance; and three meshes, each half as fine as the next, give the
discretization's error.
"""

from pathlib import Path

import calculix
import numpy as np
from calculix import Floats
from cases import CHECKS, STORED, Case
from deck import harmonic_deck, middle_line
from fields import State, displacements, middle_displacement, states
from scipy.interpolate import PchipInterpolator

ORDERS = (2, 3, 5, 8, 12, 16, 20)
KEYS = (
    "centre_strain",
    "centre_beam_strain",
    "lowest_strain",
    "deflection_m",
    "edge_rad",
    "centre_pressure_N_per_m",
)
"""What meshes are compared by."""


def harmonics(out: Path, case: Case, *, inflated: bool) -> dict[str, list[float]]:
    """Compliance to cos(n phi) on the middle line over that of the inextensible ring, less 1."""
    section, mesh, target = case.section, case.mesh, case.section.target
    load = 50.0 if inflated else 0.1  # [N/m]: displacements of some micrometers or less
    path = out / f"{case.tire}_harmonics_{'inflated' if inflated else 'plain'}"
    calculix.run(harmonic_deck(section, mesh, ORDERS, load, inflated=inflated), path)
    radial = [middle_displacement(mesh, d)[0] for d in displacements(path)]
    phi = middle_line(mesh)[1]
    tension = target.pressure * target.width * target.ring_radius if inflated else 0.0
    result: list[float] = []
    for n, u in zip(ORDERS, radial[1:], strict=True):
        found = 2.0 / np.pi * float(np.trapezoid((u - radial[0]) * np.cos(n * phi), phi))
        stiffness = (
            (section.bending * (n**2 - 1) + tension * target.ring_radius**2)
            * (n**2 - 1)
            / target.ring_radius**4
            + target.radial_stiffness
            + target.tangential_stiffness / n**2
        )
        result.append(found * stiffness / load - 1.0)
    return {"order": [float(n) for n in ORDERS], "relative_excess_of_compliance": result}


def inflation(out: Path, case: Case) -> dict[str, float]:
    """Hoop strain of the middle line from inflation, found and expected."""
    target, mesh = case.section.target, case.mesh
    u, _ = middle_displacement(mesh, displacements(out / case.name)[0])
    inner = target.ring_radius + target.liner_offset
    hold = case.section.stretching / target.ring_radius
    hold += target.radial_stiffness * target.ring_radius
    return {
        "hoop_strain": float(np.mean(u)) / target.ring_radius,
        "hoop_strain_expected": target.pressure * target.width * inner / target.ring_radius / hold,
        "p0_b_R_over_EA": target.pressure
        * target.width
        * target.ring_radius
        / case.section.stretching,
    }


def balance(found: dict[str, list[State]]) -> dict[str, float]:
    """Largest relative difference of the forces on tire and on road from the load."""
    loaded = [
        (s, load) for case in STORED for s, load in zip(found[case.name], case.loads, strict=True)
    ]
    return {
        "sidewalls": max(abs(s.load / load - 1.0) for s, load in loaded),
        "contact_stress": max(abs(s.road_load / load - 1.0) for s, load in loaded),
    }


def convergence(out: Path) -> dict[str, dict[str, dict[str, list[float]]]]:
    """Relative differences of key numbers from the stored ones, and the order of three meshes.

    Meshes: element length and tread rows halve from coarse to stored to fine. `path` and `stiff`
    are on the coarse mesh and are compared with it.
    """
    keys = {c.name: summary(states(out, c)) for c in (*CHECKS, *STORED)}
    result: dict[str, dict[str, dict[str, list[float]]]] = {}
    for case in CHECKS:
        stored = f"{case.tire}_mu{100 * case.friction:03.0f}"
        base = stored if case.label in ("coarse", "fine") else f"{stored}_coarse"
        result[f"{case.name}_over_{base}"] = {
            "relative_difference": {
                name: [
                    a / b - 1.0
                    for a, b in zip(keys[case.name][name], keys[base][name], strict=False)
                ]
                for name in KEYS
            }
        }
    meshes = [keys[f"solid_mu000{label}"] for label in ("_coarse", "", "_fine")]
    order = {}
    for name in KEYS:
        coarse, stored, fine = (np.array(m[name][:2]) for m in meshes)
        order[name] = np.log2(np.abs((coarse - stored) / (stored - fine))).tolist()
    result["solid_mu000"] = {"order": order}
    return result


def summary(loaded: list[State]) -> dict[str, list[float]]:
    """One list over the loads of each number that a reader asks for first."""
    keys: dict[str, list[float]] = {}
    for s in loaded:
        one = {
            "load_N": s.load,
            "deflection_m": s.deflection,
            "edge_rad": edge(s, s.phi_tread),
            "edge_m": edge(s, s.x),
            "centre_strain": float(even(s.phi, s.strain, np.zeros(1))[0]),
            "centre_beam_strain": float(even(s.phi, s.beam_strain, np.zeros(1))[0]),
            "largest_strain": float(s.strain.max()),
            "lowest_strain": float(s.strain.min()),
            "lowest_strain_rad": float(s.phi[np.argmin(s.strain)]),
            "centre_pressure_N_per_m": float(s.pressure[0]),
            "largest_pressure_N_per_m": float(s.pressure.max()),
            "largest_shear_N_per_m": float(np.abs(s.shear).max()),
        }
        for name, value in one.items():
            keys.setdefault(name, []).append(value)
    return keys


def edge(state: State, place: Floats) -> float:
    """Where contact ends, in the measure of `place`: phi_tread or x.

    Beyond the rim of a contact the gap to an elastic layer grows like the distance to the power
    3/2; so gap^(2/3), between 0.05 and 0.4 mm, is drawn back to zero. Nodal pressures would give
    the rim to a node's spacing only.
    """
    near = (state.gap > 5.0e-5) & (state.gap < 4.0e-4) & (state.phi_tread < np.pi / 2.0)
    slope, rest = np.polyfit(place[near], state.gap[near] ** (2.0 / 3.0), 1)
    return float(-rest / slope)


def even(phi: Floats, values: Floats, at: Floats, sign: float = 1.0) -> Floats:
    """Interpolate a field that is even (or odd) about phi = 0 and pi."""
    inside = (phi > 1e-9) & (phi < np.pi - 1e-9)
    p, f = phi[inside], values[inside]
    whole = np.concatenate([-p[::-1], p, 2.0 * np.pi - p[::-1]])
    return PchipInterpolator(whole, np.concatenate([sign * f[::-1], f, sign * f[::-1]]))(at)
