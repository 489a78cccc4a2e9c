"""Both routes of the dissertation beside the whole-waveform fit, as far as the campaign allows."""

from collections.abc import Callable
from dataclasses import dataclass

from routes.dynamic_route import DynamicRoute, dynamic_route
from routes.static_route import StaticRoute, static_route
from routes.static_route_fit import Quantity
from tirelib.core.errors import TirelibError
from tirelib.core.parameters import TireFile
from tirelib.inference.identify.campaign_data import StraightRuns


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
        known = dynamic.values if dynamic else None
        static = static_route(runs, start, values=known)
        reasons += [f"chapter 5: {reason}" for reason in static.reasons]
    except TirelibError as error:
        reasons.append(f"chapter 5: {error}")
    return Routes(static, dynamic, tuple(reasons))
