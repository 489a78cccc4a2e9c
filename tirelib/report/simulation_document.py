"""Output of `tirelib simulate`: the keys of its JSON, and the curves as CSV."""

import csv
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tirelib.core.arrays import FloatArray
from tirelib.core.documents import new_file
from tirelib.report.simulation import MICRO, Simulation

FORMAT = "tirelib-simulation/1"


def point_document(done: Simulation, point: int) -> dict[str, Any]:
    """Return the keys of one operating point as `tirelib simulate --json` has them."""
    per_second = float(done.turn_rate[point])

    def peak(name: str, **factors: float) -> dict[str, float]:
        value, angle = (getattr(done.peaks, key)[point] for key in (name, f"{name}_angle"))
        told = {unit: MICRO * factor * float(value) for unit, factor in factors.items()}
        return told | {"angle_rad": float(angle)}

    rates = {"ustrain_per_rad": 1.0, "ustrain_per_s": per_second}

    return {
        "Fz_N": float(done.load[point]),
        "deflection_mm": 1e3 * float(done.deflection[point]),
        "pressure_bar": 1e-5 * float(done.inflation[point]),
        "omega_rad_s": per_second,
        "speed_kmh": 3.6 * per_second * done.tire.ring_radius,
        "edges_rad": [float(x) for x in done.edges[point]],
        "contact_length_mm": 1e3 * float(done.contact_length[point]),
        "q_center_N_per_m": float(done.middle_pressure[point]),
        "q_max_N_per_m": float(done.largest_pressure[point]),
        "pressure_center_mm": 1e3 * float(done.pressure_centre[point]),
        "strain_peaks": {name: peak(name, ustrain=1.0) for name in ("cp1", "tp", "cp2")},
        "strain_rate_peaks": {side: peak(f"rate_{side}", **rates) for side in ("lead", "trail")},
        "effective_radius_mm": _known(done.effective_radius, point, 1e3),
        "torque_Nm": _known(done.torque, point, 1.0),
        "sliding_from_rad": _known(done.sliding_onset, point, 1.0),
    }


def _known(values: FloatArray | None, point: int, factor: float) -> float | None:
    return None if values is None else factor * float(values[point])


def columns(done: Simulation) -> Mapping[str, FloatArray]:
    """Return the curves in the units of files, each of shape (n_points, n_phi), by column name."""
    table = {
        "u_mm": 1e3 * done.u,
        "v_mm": 1e3 * done.v,
        "pressure_N_per_m": done.pressure,
        "normal_N_per_m": done.normal,
        "shear_N_per_m": done.shear,
        "strain_ustrain": MICRO * done.strain,
        "strain_rate_ustrain_per_rad": MICRO * done.rate,
    }
    if done.gage is not None:
        table["gage_ustrain"] = MICRO * done.gage
    return table


def write_curves(done: Simulation, path: Path) -> None:
    """Write the curves as CSV: a row per operating point and angle.

    Raises
    ------
    FormatError
        If the file cannot be written.
    """
    table = columns(done)
    with new_file(path), path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["point", "Fz_N", "phi_rad", *table])
        for point in range(len(done)):
            curves = zip(done.phi, *(curve[point] for curve in table.values()), strict=True)
            force = f"{done.load[point]:.6g}"
            writer.writerows([point, force, *(f"{x:.9g}" for x in row)] for row in curves)
