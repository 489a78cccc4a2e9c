"""An identification as JSON (``tirelib-identification/1``), in the units of a tire file."""

from dataclasses import asdict
from typing import Any

import numpy as np

from tirelib.campaign import Campaign
from tirelib.core.arrays import FloatArray
from tirelib.core.parameters import NUMBERS
from tirelib.core.quantities import QUANTITIES
from tirelib.core.units import from_si
from tirelib.inference.identify.brush_estimates import SlipStiffness
from tirelib.inference.identify.brush_law import STORED
from tirelib.inference.identify.error_bands import BandError
from tirelib.inference.identify.estimate import Estimate
from tirelib.inference.identify.forces import ForceIdentification
from tirelib.inference.identify.identify import Identification
from tirelib.inference.identify.lateral_force import PressureBand
from tirelib.inference.identify.whole import Whole
from tirelib.physics.ring.frequencies import rim_stiffness

FORMAT = "tirelib-identification/1"
_DEG = float(np.pi / 180.0)


def whole_document(campaign: Campaign, whole: Whole) -> dict[str, Any]:
    """Return ring and brush; what the campaign does not tell is null or empty."""
    brush, comparison = whole.brush, whole.brush and whole.brush.comparison
    lateral = comparison and {  # by the ring's pressure against the parabola, Fig. 6-38 to 6-42
        "unit": "N",
        "stiffness": "each load and pressure its own",
        "table": [_band(row) for row in comparison.table],
    }
    return {
        "format": FORMAT,
        "campaign": campaign.header.name,
        "tire": whole.file.name,
        "axes": "iso",
        **_ring(whole.ring),
        "provenance": dict(whole.file.extra["provenance"]),
        "reasons": list(whole.reasons),
        "brush": brush and _brush(brush),
        "forces": brush and _forces(brush),
        "ring_pressure": lateral,
    }


def _ring(found: Identification | None) -> dict[str, Any]:
    """Return the numbers of a ring; without one every key is empty."""
    if found is None:
        sizes = ("noise_ustrain", "rms_ustrain", "delay_us", "strain_rms_ustrain")
        return {
            "runs": [],
            "gages": [],
            **dict.fromkeys(sizes),
            "parameters": [],
            "correlation": [],
            **dict.fromkeys(("vertical_stiffness", "rim_stiffness", "steps")),
        }
    runs, fit = found.runs, found.fit
    return {
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
    }


def _parameter(each: Estimate) -> dict[str, Any]:
    """Return a number of ring or brush in the unit of a tire file."""
    stored = STORED.get(each.name, each.name)
    field = NUMBERS[stored]
    low, high = sorted((_edge(each.name, each.low), _edge(each.name, each.high)))
    scale = abs(float(from_si(1.0, field.unit, field.dimension)))
    if each.name == "lateral_compliance":  # a file has its inverse
        scale /= each.value**2 or np.nan
    return {
        "name": stored,
        "meaning": field.meaning,
        "value": _edge(each.name, each.value),
        "std": scale * each.std,
        "low": low,
        "high": high,
        "fit_std": scale * each.fit_std,
        "unit": field.unit,
        "flags": list(each.flags),
        "helps": each.helps,
    }


def _edge(name: str, value: float) -> float:
    """Return a number of ring or brush in the unit of its number in a file."""
    field = NUMBERS[STORED.get(name, name)]
    if name == "lateral_compliance":
        value = 1.0 / value if value > 0.0 else float("inf")
    return float(from_si(value, field.unit, field.dimension))


def _vertical_stiffness(found: Identification) -> dict[str, float | None]:
    """Return the slope of load over deflection in the middle of the loads, [N/mm]."""
    runs = found.runs
    load = runs.waves.conditions["Fz"]
    model = _slope(found.fit.model.deflection, load)
    known = np.isfinite(runs.deflection)
    measured = _slope(runs.deflection[known], load[known]) if known.sum() >= 3 else None
    return {"load_N": float(load.mean()), "model": model, "measured": measured}


def _slope(deflection: FloatArray, load: FloatArray) -> float:
    cubic = min(2, np.unique(np.round(load, -2)).size - 1)
    fitted = np.polynomial.Polynomial.fit(load, deflection, cubic).deriv()
    return float(1e-3 / fitted(float(load.mean())))


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


def _brush(found: ForceIdentification) -> dict[str, Any]:
    fit = found.fit
    deviation = np.sqrt(np.diag(fit.covariance))
    with np.errstate(invalid="ignore"):
        correlation = fit.covariance / np.outer(deviation, deviation)  # of z as of the values
    source = "ring" if fit.tire is not None else "Mz" if "half_length" in fit.names else "assumed"
    return {
        "reference": {
            "load_N": fit.reference.load,
            "pressure_bar": 1e-5 * fit.reference.pressure,
        },
        "half_length_from": source,
        "parameters": [
            told | {"interval": [told["low"], told["high"]]}
            for told in map(_parameter, found.estimates)
        ],
        "correlation": correlation,
        "held": [
            {
                "name": STORED[name],
                "value": _edge(name, value),
                "unit": NUMBERS[STORED[name]].unit,
                "reason": why,
            }
            for name, (value, why) in fit.held.items()
            if not (name == "half_length" and fit.tire is not None)
        ],
        "stiffness": [_stiffness(each) for each in found.stiffness],
        "notes": list(found.notes),
    }


def _stiffness(each: SlipStiffness) -> dict[str, Any]:
    unit, factor = ("N/deg", _DEG) if each.slip == "slip_angle" else ("N", 1.0)
    return {
        "slip": each.slip,
        "load_N": each.load,
        "pressure_bar": 1e-5 * each.pressure,
        "unit": unit,
        **{key: factor * getattr(each, key) for key in ("value", "std", "low", "high")},
    }


def _forces(found: ForceIdentification) -> dict[str, Any]:
    """Return what the brush leaves of each force."""
    fit = found.fit
    return {
        "points": fit.points,
        **{
            name: {
                "unit": QUANTITIES[name].unit,
                "rmse": rmse,
                "rmse_percent_of_peak": 100.0 * rmse / fit.peak[name],
                "r2": fit.r2[name],
                "peak": fit.peak[name],
                "bands": [_band(row) for row in fit.errors[name]],
            }
            for name, rmse in fit.rmse.items()
        },
    }


def _band(row: BandError | PressureBand) -> dict[str, Any]:
    """Return the errors of a band, its range in engineers' units."""
    told = asdict(row)
    by, low, high = (told.pop(name) for name in ("by", "low", "high"))
    quantity = QUANTITIES.get(by)
    if quantity is None:
        return {"by": by, "low": low, "high": high, "range_unit": "", **told}
    ends = {"low": quantity.told(low), "high": quantity.told(high)}
    return {"by": by, **ends, "range_unit": quantity.words, **told}
