"""Both routes of the dissertation beside the whole-waveform fit, as far as the campaign allows."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from tirelib.errors import TirelibError
from tirelib.identify.campaign_data import StraightRuns
from tirelib.identify.dynamic_route import DynamicRoute, dynamic_route
from tirelib.identify.static_route import StaticRoute, static_route
from tirelib.identify.static_route_fit import Quantity
from tirelib.parameters import TireFile


@dataclass(frozen=True, slots=True)
class Routes:
    """Results of the two routes; None with the reason where one is not possible.

    Attributes
    ----------
    static : StaticRoute or None
        Chapter 5.
    dynamic : DynamicRoute or None
        Chapter 6; holds the damping.
    reasons : tuple of str
    """

    static: StaticRoute | None
    dynamic: DynamicRoute | None
    reasons: tuple[str, ...]

    @property
    def damping(self) -> Quantity | None:
        """Damping ratio of the sidewall from the waveforms alone, without the trigger."""
        found = self.dynamic.damping if self.dynamic else None
        return found.without_angle if found else None


def follow_routes(
    runs: StraightRuns, start: TireFile, *, progress: Callable[[str], None] | None = None
) -> Routes:
    """Follow both routes from the same start values.

    Parameters
    ----------
    runs : StraightRuns
    start : TireFile
        Geometry, start values and priors.
    progress : callable, optional
        Called with a label before each route.
    """
    reasons: list[str] = []
    dynamic: DynamicRoute | None = None
    static: StaticRoute | None = None
    if progress is not None:
        progress("route of chapter 6")
    try:
        dynamic = dynamic_route(runs, start)
        reasons += [f"chapter 6: {reason}" for reason in dynamic.reasons]
    except TirelibError as error:
        reasons.append(f"chapter 6: {error}")
    if progress is not None:
        progress("route of chapter 5")
    try:
        static = static_route(runs, start)
        reasons += [f"chapter 5: {reason}" for reason in static.reasons]
    except TirelibError as error:
        reasons.append(f"chapter 5: {error}")
    return Routes(static, dynamic, tuple(reasons))


def routes_document(routes: Routes) -> dict[str, Any]:
    """Return the routes as JSON holds them, SI."""
    damping = routes.damping
    document: dict[str, Any] = {
        "damping": None if damping is None else {**_quantity(damping), "law": "sidewall"},
        "chapter_5": None,
        "chapter_6": None,
        "reasons": list(routes.reasons),
    }
    if routes.static is not None:
        lengths = routes.static.lengths
        document["chapter_5"] = {
            "runs": [int(run) for run in routes.static.run],
            "from_strain": _quantities(routes.static.strain_based),
            "from_contact_model": _quantities(routes.static.conventional),
            "contact_length_mm": {
                "load_N": lengths.load,
                "read": 1e3 * lengths.read,
                "corrected": 1e3 * lengths.corrected,
                "contact_model": 1e3 * lengths.conventional,
            },
        }
    if routes.dynamic is not None:
        dynamic = routes.dynamic
        document["chapter_6"] = {
            "quantities": _quantities(dynamic.quantities),
            "load_error_percent": {
                "as_printed": None
                if dynamic.as_printed is None
                else _percent(dynamic.as_printed.estimated, dynamic.as_printed.measured),
                "corrected": _percent(dynamic.loads.estimated, dynamic.loads.measured),
            },
            "vertical_stiffness": _stiffness(dynamic),
        }
    return document


def _percent(estimated: Any, measured: Any) -> float:
    return 100.0 * float(np.sqrt(np.mean((estimated / measured - 1.0) ** 2)))


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


def _quantities(quantities: Iterable[Quantity]) -> list[dict[str, Any]]:
    return [_quantity(quantity) for quantity in quantities]


def _quantity(quantity: Quantity) -> dict[str, Any]:
    return {
        "name": quantity.name,
        "unit": quantity.unit,
        "value": quantity.value,
        "std": quantity.std,
        "low": quantity.low,
        "high": quantity.high,
        "flags": list(quantity.flags),
    }
