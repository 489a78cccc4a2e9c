"""Both routes as JSON holds them: contact angles, tables by method, pressure, damping."""

from dataclasses import asdict
from typing import Any

import numpy as np

from routes.dynamic_pressure import ContactModel, PressureMap, dynamic_pressure
from routes.dynamic_route import DynamicRoute
from routes.dynamic_route_damping import Damping
from routes.edges import Edges
from routes.follow import Routes
from routes.static_route import PressureShape, StaticRoute
from routes.static_route_fit import Quantity
from tirelib.core.errors import TirelibError

DEG = 180.0 / np.pi
_POINTS = 41
"""Points of a pressure curve in JSON."""
_LOADS = 5
"""Loads at which the rolling tire's pressure is given."""


def routes_document(routes: Routes) -> dict[str, Any]:
    """Return the routes for JSON: numbers of the tire in SI, tables in the units they name."""
    damping = routes.damping
    document: dict[str, Any] = {
        "damping": None if damping is None else {**_quantity(damping), "law": "sidewall"},
        "chapter_5": None if routes.static is None else _static(routes.static),
        "chapter_6": None,
        "reasons": list(routes.reasons),
    }
    if routes.dynamic is not None:
        document["chapter_6"] = _dynamic(routes.dynamic)
        if document["damping"] is not None:
            document["damping"] |= _other_damping(routes.dynamic)
    return document


def _static(static: StaticRoute) -> dict[str, Any]:
    lengths = static.lengths
    return {
        "runs": [int(run) for run in static.run],
        "pressure_bar": 1e-5 * static.pressure,
        "speed_kmh": 3.6 * static.speed,
        "from_strain": [_quantity(q) for q in static.strain_based],
        "from_contact_model": [_quantity(q) for q in static.conventional],
        "correlation": static.correlation,
        "load_error_percent_contact_model": 100.0 * static.load_error,
        "contact_length_mm": {
            "load_N": lengths.load,
            "read": 1e3 * lengths.read,
            "corrected": 1e3 * lengths.corrected,
            "corrected_std": 1e3 * lengths.corrected_std,
            "contact_model": 1e3 * lengths.conventional,
            "contact_model_std": 1e3 * lengths.conventional_std,
        },
        "pressure": [_shape(shape) for shape in static.pressures],
    }


def _shape(shape: PressureShape) -> dict[str, Any]:
    keep = np.linspace(0, shape.x.size - 1, _POINTS).round().astype(int)
    return {
        "load_N": shape.load,
        "x_mm": 1e3 * shape.x[keep],
        "from_strain_N_per_m": shape.strain_based[keep],
        "from_contact_model_N_per_m": shape.conventional[keep],
        "center_N_per_m": shape.centre_pressure.value,
        "center_std_N_per_m": shape.centre_pressure.std,
    }


def _dynamic(dynamic: DynamicRoute) -> dict[str, Any]:
    printed = dynamic.as_printed
    return {
        "quantities": [_quantity(q) for q in dynamic.quantities],
        "correlation": {"names": list(dynamic.names), "values": dynamic.correlation},
        "load_error_percent": {
            "as_printed": None if printed is None else 100.0 * printed.rms,
            "corrected": 100.0 * dynamic.loads.rms,
        },
        "loads": [
            {
                "run": int(dynamic.loads.run[i]),
                "measured_N": float(dynamic.loads.measured[i]),
                "as_printed_percent": None if printed is None else 100.0 * printed.relative[i],
                "corrected_percent": 100.0 * float(dynamic.loads.relative[i]),
                "std_N": float(dynamic.loads.std[i]),
            }
            for i in np.argsort(dynamic.loads.measured)
        ],
        "contact_angles": contact_angles(dynamic.edges),
        "vertical_stiffness": _stiffness(dynamic),
        "pressure": _rolling_pressure(dynamic),
    }


def contact_angles(edges: Edges) -> list[dict[str, Any]]:
    """Return what is read at the strain-rate peaks, its bias, and what is left of it, by run."""
    reading, true = edges.reading, edges.edges
    return [
        {
            "run": int(edges.run[i]),
            "read_deg": [DEG * float(reading.lead[i]), DEG * float(reading.trail[i])],
            "bias_deg": [DEG * float(x) for x in edges.bias.bias[i]],
            "half_bias_deg": DEG * float(edges.bias.half[i]),
            "half_bias_std_deg": DEG * float(edges.bias.half_std[i]),
            "corrected_deg": [DEG * float(x) for x in true[i]],
            "half_std_deg": DEG * float(edges.half_std[i]),
            "short_percent": 100.0 * (1.0 - float(reading.half[i] / edges.half[i])),
        }
        for i in range(edges.run.size)
    ]


def _rolling_pressure(dynamic: DynamicRoute) -> list[dict[str, Any]]:
    """Return Eq. (114) at loads of the campaign, its mean pressure and largest speed."""
    load = dynamic.loads.measured
    at = np.linspace(load.min(), load.max(), _LOADS)
    bar = float(dynamic.values["pressure"])
    models: tuple[ContactModel, ...] = ("radial", "sheared")
    rows: list[dict[str, Any]] = []
    for model in models:
        try:
            found = dynamic_pressure(dynamic.values, at, bar, dynamic.turn_rate, model=model)
        except TirelibError as error:
            rows.append({"contact": model, "reason": str(error)})
            continue
        rows += [_pressure_row(found, i, bar, dynamic.turn_rate) for i in range(at.size)]
    return rows


def _pressure_row(found: PressureMap, i: int, pressure: float, omega: float) -> dict[str, Any]:
    keep = np.linspace(0, found.phi.shape[1] - 1, _POINTS).round().astype(int)
    return {
        "contact": found.model,
        "load_N": float(found.load[i]),
        "pressure_bar": 1e-5 * pressure,
        "omega_rad_s": omega,
        "deflection_mm": 1e3 * float(found.deflection[i]),
        "length_mm": 1e3 * float(found.length[i]),
        "center_mm": 1e3 * float(found.centre[i]),
        "angle_deg": DEG * found.phi[i, keep],
        "q_N_per_m": found.pressure[i, keep],
    }


def _other_damping(dynamic: DynamicRoute) -> dict[str, Any]:
    """Return the reading against the trigger, and the same tire's ratio by the modal law."""

    def both(found: Damping | None) -> dict[str, Any] | None:
        if found is None:
            return None
        with_angle = found.with_angle
        return {
            "without_angle": _quantity(found.without_angle),
            "with_angle": None if with_angle is None else _quantity(with_angle),
            "zero_deg": DEG * found.zero,
        }

    return {"readings": both(dynamic.damping), "modal": both(dynamic.damping_modal)}


def _stiffness(dynamic: DynamicRoute) -> list[dict[str, float]]:
    vertical = dynamic.vertical
    if vertical is None:
        return []
    return [
        {
            "pressure_bar": 1e-5 * float(vertical.pressure[i]),
            "speed_kmh": 3.6 * float(vertical.speed[i]),
            "measured_N_per_mm": 1e-3 * float(vertical.measured[i]),
            "measured_std_N_per_mm": 1e-3 * float(vertical.measured_std[i]),
            "predicted_N_per_mm": 1e-3 * float(vertical.predicted[i]),
        }
        for i in range(vertical.pressure.size)
    ]


def _quantity(quantity: Quantity) -> dict[str, Any]:
    return {**asdict(quantity), "flags": list(quantity.flags)}
