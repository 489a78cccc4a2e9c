"""Write the reference: one table per case, and one recipe with the checks."""

from pathlib import Path

import numpy as np
import tomli_w
from cases import TARGETS, Case
from fields import State
from section import section
from verify import even

GRID = np.concatenate([np.linspace(0.0, 0.6, 121), np.linspace(0.6, np.pi, 61)[1:]])
COLUMNS = "load_N,phi_rad,strain,beam_strain,u_m,v_m,x_m,pressure_N_per_m,shear_N_per_m"


def table(path: Path, loads: tuple[float, ...], loaded: list[State]) -> None:
    """Write phi from 0 to pi; strain, u and pressure are even in phi, v, x and shear odd."""
    lines = [COLUMNS]
    for load, s in zip(loads, loaded, strict=True):
        columns = [
            even(s.phi, s.strain, GRID),
            even(s.phi, s.beam_strain, GRID),
            even(s.phi_line, s.u, GRID),
            even(s.phi_line, s.v, GRID, -1.0),
            even(s.phi_tread, s.x, GRID, -1.0),
            even(s.phi_tread, s.pressure, GRID),
            even(s.phi_tread, s.shear, GRID, -1.0),
        ]
        for phi, *row in zip(GRID, *columns, strict=True):
            lines.append(
                f"{load:.0f},{phi:.6g}," + ",".join(f"{round(x, 12) + 0.0:.6g}" for x in row)
            )
    path.write_text("\n".join(lines) + "\n")


def recipe(path: Path, solver: str, results: dict[str, object], checks: dict[str, object]) -> None:
    """Write what was computed, how, and how far it can be trusted."""
    document = {
        "format": "tirelib-finite-elements/1",
        "note": (
            "A static tire section pressed on a flat road; strains relative to the inflated, "
            "unloaded tire. Remake with `make fem`. SI; phi is the material angle, 0 at the "
            "road's normal; half of a symmetric section."
        ),
        "solver": solver,
        "tires": {name: _tire(name) for name in TARGETS},
        "cases": results,
        "checks": checks,
    }
    path.write_text(tomli_w.dumps(document))


def mesh_note(case: Case) -> dict[str, float]:
    """Return the numbers that describe a case's mesh and contact."""
    fine, contact, touch = case.fineness, case.contact, case.touch
    elements = case.mesh.elements
    return {
        "friction": case.friction,
        "elements": int(elements.shape[0] * elements.shape[1]),
        "element_length_in_contact_m": fine.contact_length,
        "element_length_at_the_top_m": fine.free_length,
        "elements_through_tread": fine.tread,
        "contact_penalty_Pa_per_m": contact.normal,
        "stick_penalty_Pa_per_m": contact.stick,
        "load_increment_N": touch.load_increment,
    }


def _tire(name: str) -> dict[str, object]:
    target = TARGETS[name]
    whole = section(target)
    return {
        "ring_radius_m": target.ring_radius,
        "free_radius_m": target.ring_radius + target.outer_offset,
        "innerliner_offset_m": target.liner_offset,
        "tread_thickness_m": target.tread_thickness,
        "belt_width_m": target.width,
        "inflation_pressure_Pa": target.pressure,
        "radial_stiffness_N_per_m2": target.radial_stiffness,
        "tangential_stiffness_N_per_m2": target.tangential_stiffness,
        "bending_stiffness_N_m2": whole.bending,
        "extension_stiffness_N": whole.stretching,
        "tread_stiffness_N_per_m2": whole.tread_stiffness,
        "tread_shear_stiffness_N_per_m2": whole.shear_stiffness,
        "tread_share_of_bending": whole.share("tread"),
        "layers": [
            {
                "name": layer.name,
                "inner_m": layer.inner,
                "outer_m": layer.outer,
                "modulus_Pa": layer.modulus,
                "modulus_along_Pa": layer.along * layer.modulus,
                "shear_modulus_Pa": layer.shear,
                "poisson": layer.poisson,
            }
            for layer in whole.layers
        ],
    }
