"""An identification as JSON (``tirelib-identification/1``) and as a model file."""

from dataclasses import replace
from typing import Any

import numpy as np

from tirelib.campaign import Campaign
from tirelib.core.arrays import FloatArray
from tirelib.core.parameters import FIELDS, TireFile
from tirelib.core.units import from_si
from tirelib.inference.identify.estimate import Estimate
from tirelib.inference.identify.identify import WITHOUT_EFFECTS, Identification
from tirelib.physics.ring.frequencies import rim_stiffness

FORMAT = "tirelib-identification/1"


def identification_document(campaign: Campaign, found: Identification) -> dict[str, Any]:
    """Return the numbers of an identification in the units of a tire file."""
    runs, fit = found.runs, found.fit
    return {
        "format": FORMAT,
        "campaign": campaign.header.name,
        "tire": found.tire.name,
        "axes": "iso",
        "runs": [int(run) for run in runs.waves.run],
        "gages": [gage + 1 for gage in runs.gages],
        "noise_ustrain": 1e6 * runs.noise.std,
        "rms_ustrain": 1e6 * fit.rms,
        "delay_us": 1e6 * fit.delay,
        "strain_rms_ustrain": 1e6 * float(np.sqrt(np.mean(runs.strain**2))),
        "parameters": [_parameter(each) for each in found.estimates],
        "correlation": found.correlation,
        "vertical_stiffness": _vertical_stiffness(found),
        "rim_stiffness": _rim_stiffness(found),
        "steps": fit.steps,
        "provenance": dict(found.tire.extra["provenance"]),
    }


def _parameter(each: Estimate) -> dict[str, Any]:
    field = FIELDS[each.name]

    def edge(value: float) -> float:
        return float(from_si(value, field.unit, field.dimension))

    return each.entry(each.name, edge, abs(edge(1.0)))


def _vertical_stiffness(found: Identification) -> dict[str, float | None]:
    """Return the slope of load over deflection in the middle of the loads, [N/mm]."""
    runs = found.runs
    load = runs.waves.conditions["Fz"]
    model = _slope(found.fit.model.deflection, load)
    known = np.isfinite(runs.deflection)
    measured = _slope(runs.deflection[known], load[known]) if known.sum() >= 3 else None
    return {"load_N": float(load.mean()), "model": model, "measured": measured}


def _rim_stiffness(found: Identification) -> dict[str, float]:
    """Return what tests of the held tread would give, Eq. (112) corrected, for comparison."""
    tire = found.tire.tire
    radius = tire.ring_radius
    shift, turn = rim_stiffness(radius, tire.radial_stiffness, tire.tangential_stiffness)
    return {
        "pressure_bar": 1e-5 * tire.pressure,
        "shift_N_per_mm": 1e-3 * float(shift),
        "turn_Nm_per_deg": float(turn) * np.pi / 180.0,
        # pulled along a road that holds the belt, the rim shifts and turns against it
        "longitudinal_N_per_mm": 1e-3 / float(1.0 / shift + radius**2 / turn),
    }


def _slope(deflection: FloatArray, load: FloatArray) -> float:
    cubic = min(2, np.unique(np.round(load, -2)).size - 1)
    fitted = np.polynomial.Polynomial.fit(load, deflection, cubic).deriv()
    return float(1e-3 / fitted(float(load.mean())))


def model_file(found: Identification) -> TireFile:
    """Return the identified tire as a model without effects; it holds its numbers' correlation."""
    extra = {
        **found.tire.extra,
        "identified_correlation": {
            "names": [each.name for each in found.estimates],
            "values": found.correlation.tolist(),
        },
        **WITHOUT_EFFECTS,
    }
    return replace(found.tire, extra=extra)
