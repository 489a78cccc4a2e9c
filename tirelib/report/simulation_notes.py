"""What a reader of a simulation must know: effects that do not act, and limits of the model."""

import numpy as np

from tirelib.core.errors import ConvergenceError, ParameterError
from tirelib.core.parameters import TireFile
from tirelib.inference.compare.model import TireModel, UsedEffect
from tirelib.report.simulation import Simulation, simulate
from tirelib.report.simulation_series import MOST_MODES, bending_length, wanted_modes

LARGEST_DEFLECTION = 0.2
"""Share of the free radius: half of a passenger car's sidewall, which is about 0.4 of it high."""


def acting_effects(model: TireModel) -> list[UsedEffect]:
    """Return the effects of a model that act on the ring."""
    return [used for used in model.used if used.effect.hook != "brush"]


def effects_left_out(file: TireFile, chosen: TireModel | None) -> list[str]:
    """Return the names of effects that a file has and this simulation does not."""
    names = [str(e.get("effect", e)) for e in file.extra.get("effects", []) if isinstance(e, dict)]
    acting = [] if chosen is None else [used.effect.name for used in acting_effects(chosen)]
    return [name for name in names if name not in acting]


def notes_on(file: TireFile, done: Simulation, chosen: TireModel | None) -> list[str]:
    """Return the notes that a reader of the figures needs."""
    notes, tire = [], done.tire
    if left_out := effects_left_out(file, chosen):
        which = (
            "effects are left out of this simulation"
            if chosen is None
            else "brush effects do not act in this simulation"
        )
        notes.append(f"the model's {which}: {', '.join(left_out)}")
    if chosen is None and "model" in file.extra:
        notes.append(
            "the contact with tread shear is that of the linear ring; identify fitted the ring "
            "with large displacements, which `--contact radial` simulates"
        )
    if done.contact == "shear" and not tire.tread_shear_stiffness:
        notes.append(
            "the file states no tread shear stiffness (0): the tread carries no shear, and the "
            "result is that of a frictionless road"
        )
    slopes = tire.radial_pressure_slope, tire.tangential_pressure_slope
    if not any(slopes) and not np.allclose(done.inflation, tire.pressure, rtol=1e-9):
        notes.append(
            "the tire file does not state how the sidewall stiffens with inflation (the slopes of "
            "k_u and k_v are 0), so that inflation acts through the belt tension only"
        )
    if chosen is None and wanted_modes(tire, done.inflation) > MOST_MODES:
        length = 1e3 * bending_length(tire, done.inflation)
        notes.append(
            f"the belt bends within {length:.1f} mm, too little for {MOST_MODES} harmonics: strain "
            "rates are off by more than 0.5 %, angles of peaks by more than 1 mrad; check EI"
        )
    return notes + _overload(done)


def _overload(done: Simulation) -> list[str]:
    """Return a note where the deflection is larger than a tire would bear, with the load."""
    tire = done.tire
    largest = LARGEST_DEFLECTION * tire.free_radius
    too_deep = np.flatnonzero(done.deflection > largest)
    if not too_deep.size:
        return []
    point = int(too_deep[np.argmax(done.deflection[too_deep])])
    note = (
        f"{done.load[point]:.0f} N press this tire by {1e3 * done.deflection[point]:.0f} mm, more "
        f"than {100 * LARGEST_DEFLECTION:.0f} % of its free radius ({1e3 * largest:.0f} mm): the "
        "tire would hardly carry this load"
    )
    try:
        bearable = simulate(
            tire,
            deflection=largest,
            inflation=done.inflation[point],
            turn_rate=done.turn_rate[point],
            contact=done.contact,
        )
    except (ParameterError, ConvergenceError):
        return [note]  # the model ends before: no range to name
    return [f"{note}; the model's range ends at {bearable.load[0]:.0f} N for this inflation"]
