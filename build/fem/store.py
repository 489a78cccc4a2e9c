"""Write the reference: one table per case, and one recipe with the checks."""

from pathlib import Path

import numpy as np
import tomli_w
from cases import TARGETS, Case
from fields import State
from section import section
from verify import even

GRID = np.concatenate([np.linspace(0.0, 0.6, 121), np.linspace(0.6, np.pi, 61)[1:]])
OUT = Path(__file__).resolve().parents[2] / "build" / "out" / "fem"
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
            "road's normal; half of a symmetric section. shear_N_per_m has the solver's sign, "
            "that of the tire on the road: its negative is the road on the tire, positive outward. "
            "road_reaction_N holds the road, per load: along x and up. solver_seconds is the "
            "wall time of the job, two jobs at a time on two cores; seconds_per_load_step "
            "shares it out by Newton iterations."
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
        "road_reaction_N": road_reaction(OUT / f"{case.name}.dat")[-len(case.loads) :],
        **times(OUT / case.name, len(case.loads)),
    }


def road_reaction(path: Path) -> list[list[float]]:
    """Return the force that holds the road, (along x, up) per step, [N]."""
    lines = path.read_text().splitlines()
    found = [k for k, line in enumerate(lines) if "total force" in line and "ROAD" in line]
    return [[float(x) for x in lines[k + 2].split()[:2]] for k in found]


def times(job: Path, n_loads: int) -> dict[str, float]:
    """Return the wall time of a job and of one of its load steps, [s].

    The log has the time of the job; it is shared out by the Newton iterations that the status
    file counts. Two jobs ran at a time on two cores.
    """
    log = job.with_suffix(".log").read_text().splitlines()
    whole = float(next(x for x in reversed(log) if "Total CalculiX Time" in x).split(":")[1])
    rows = [line.split() for line in job.with_suffix(".sta").read_text().splitlines()[2:]]
    steps = np.array([int(row[0]) for row in rows])
    iterations = np.array([int(row[3]) for row in rows])
    loading = iterations[steps > steps.max() - n_loads].sum()
    return {
        "solver_seconds": whole,
        "seconds_per_load_step": round(whole * float(loading / iterations.sum()) / n_loads, 2),
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
