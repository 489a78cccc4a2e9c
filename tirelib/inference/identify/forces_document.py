"""Brush and forces of an identification as JSON, in engineers' units."""

from typing import Any

import numpy as np

from tirelib.campaign import Campaign
from tirelib.core.parameters import NUMBERS
from tirelib.core.quantities import QUANTITIES
from tirelib.core.units import from_si
from tirelib.inference.identify.brush_estimates import SlipStiffness
from tirelib.inference.identify.brush_model import STORED
from tirelib.inference.identify.document import FORMAT, identification_document
from tirelib.inference.identify.error_bands import BandError
from tirelib.inference.identify.estimate import Estimate
from tirelib.inference.identify.forces import ForceIdentification
from tirelib.inference.identify.lateral_force import PressureComparison
from tirelib.inference.identify.whole import Whole

_DEG = float(np.pi / 180.0)


def whole_document(campaign: Campaign, whole: Whole) -> dict[str, Any]:
    """Return ring and brush; what the campaign does not tell is null or empty."""
    if whole.ring is not None:
        document = identification_document(campaign, whole.ring)
    else:
        document = _no_ring(campaign, whole)
    document["reasons"] = list(whole.reasons)
    document["provenance"] = dict(whole.file.extra["provenance"])
    brush = whole.brush
    document["brush"] = None if brush is None else brush_document(brush)
    document["forces"] = None if brush is None else forces_document(brush)
    document["ring_pressure"] = (
        None if brush is None or brush.comparison is None else pressure_document(brush.comparison)
    )
    return document


def _no_ring(campaign: Campaign, whole: Whole) -> dict[str, Any]:
    """Return the keys of a ring's identification, empty."""
    return {
        "format": FORMAT,
        "campaign": campaign.header.name,
        "tire": whole.file.name,
        "axes": "iso",
        "runs": [],
        "gages": [],
        "noise_ustrain": None,
        "rms_ustrain": None,
        "delay_us": None,
        "strain_rms_ustrain": None,
        "parameters": [],
        "correlation": [],
        "vertical_stiffness": None,
        "rim_stiffness": None,
        "steps": None,
        "provenance": {},
    }


def brush_document(found: ForceIdentification) -> dict[str, Any]:
    """Return the numbers of the brush in the units of a tire file."""
    fit = found.fit
    deviation = np.sqrt(np.diag(fit.covariance))
    with np.errstate(invalid="ignore"):
        correlation = fit.covariance / np.outer(deviation, deviation)
    held = [
        {
            "name": STORED[name],
            "value": _edge(name, value),
            "unit": NUMBERS[STORED[name]].unit,
            "reason": why,
        }
        for name, (value, why) in fit.held.items()
        if not (name == "half_length" and fit.tire is not None)
    ]
    source = "ring" if fit.tire is not None else "Mz" if "half_length" in fit.names else "assumed"
    return {
        "reference": {
            "load_N": fit.reference.load,
            "pressure_bar": 1e-5 * fit.reference.pressure,
        },
        "half_length_from": source,
        "parameters": [_parameter(each) for each in found.estimates],
        "correlation": correlation,
        "held": held,
        "stiffness": [_stiffness(each) for each in found.stiffness],
        "notes": list(found.notes),
    }


def forces_document(found: ForceIdentification) -> dict[str, Any]:
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
                "bands": [_band(row) for row in fit.errors if row.force == name],
            }
            for name, rmse in fit.rmse.items()
        },
    }


def pressure_document(found: PressureComparison) -> dict[str, Any]:
    """Return lateral force by the ring's pressure against the parabola (Fig. 6-38 to 6-42), [N]."""
    rows = []
    for row in found.table:
        rows.append(
            {
                "by": row.by,
                **_range(row.by, row.low, row.high),
                "points": row.points,
                "ring_rmse": row.ring,
                "parabola_rmse": row.parabola,
                "ring_bias": row.ring_bias,
                "parabola_bias": row.parabola_bias,
                "ring_rmse_unseen": row.ring_unseen,
                "parabola_rmse_unseen": row.parabola_unseen,
                "gain": row.gain,
                "better": row.better,
            }
        )
    return {"unit": "N", "stiffness": "each load and pressure its own", "table": rows}


def _parameter(each: Estimate) -> dict[str, Any]:
    step = 1e-6 * abs(each.value) or 1e-6
    rate = abs(_edge(each.name, each.value + step) - _edge(each.name, each.value)) / step
    told = each.entry(STORED[each.name], lambda value: _edge(each.name, value), rate)
    return told | {"interval": [told["low"], told["high"]]}


def _edge(name: str, value: float) -> float:
    """Return a parameter of the law in the unit of its number in a file."""
    field = NUMBERS[STORED[name]]
    if name == "lateral_compliance":
        value = 1.0 / value if value > 0.0 else float("inf")
    return float(from_si(value, field.unit, field.dimension))


def _stiffness(each: SlipStiffness) -> dict[str, Any]:
    unit, factor = ("N/deg", _DEG) if each.slip == "slip_angle" else ("N", 1.0)
    return {
        "slip": each.slip,
        "load_N": each.load,
        "pressure_bar": 1e-5 * each.pressure,
        "unit": unit,
        "value": factor * each.value,
        "std": factor * each.std,
        "low": factor * each.low,
        "high": factor * each.high,
    }


def _band(row: BandError) -> dict[str, Any]:
    return {
        "by": row.by,
        **_range(row.by, row.low, row.high),
        "points": row.points,
        "rmse": row.rmse,
        "bias": row.bias,
    }


def _range(by: str, low: float, high: float) -> dict[str, Any]:
    if by not in QUANTITIES:
        return {"low": low, "high": high, "range_unit": ""}
    quantity = QUANTITIES[by]
    ends = {"low": quantity.told(low), "high": quantity.told(high)}
    return {**ends, "range_unit": quantity.words}
