"""Ring and brush of one campaign, as far as it can inform them."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from tirelib import __version__
from tirelib.campaign import Campaign
from tirelib.errors import CalibrationError, TirelibError
from tirelib.identify.brush_model import STORED
from tirelib.identify.document import model_file
from tirelib.identify.forces import ForceIdentification, identify_forces
from tirelib.identify.identify import Identification, identify, start_file
from tirelib.identify.routes import Routes, follow_routes
from tirelib.parameters import Number, Tire, TireFile


@dataclass(frozen=True, slots=True, eq=False)
class Whole:
    """Ring and brush of a campaign.

    Attributes
    ----------
    ring : Identification or None
    routes : Routes or None
        Beside the ring.
    brush : ForceIdentification or None
    reasons : tuple of str
        Why a part is absent.
    file : TireFile
        What the other verbs read.
    """

    ring: Identification | None
    routes: Routes | None
    brush: ForceIdentification | None
    reasons: tuple[str, ...]
    file: TireFile


def identify_whole(
    campaign: Campaign,
    start: TireFile | None = None,
    *,
    progress: Callable[[str], None] | None = None,
) -> Whole:
    """Fit the ring to straight runs with strain, then the brush to runs with slip.

    Parameters
    ----------
    campaign : Campaign
    start : TireFile, optional
        Start and priors of the ring; where the campaign tells no ring, this one gives the contact
        length to the brush.
    progress : callable, optional
        Called with a label at each step.

    Raises
    ------
    CalibrationError
        If the campaign informs neither; with both reasons.
    """
    reasons: list[str] = []
    known = start if start is not None and not start.missing else None
    ring, routes = None, None
    if campaign.header.gage_lateral:
        try:
            ring = identify(campaign, known, progress=progress)
            first = start_file(campaign.header, ring.runs, known)
            routes = follow_routes(ring.runs, first, progress=progress)
        except TirelibError as error:
            reasons.append(f"no ring: {error}")
    else:
        reasons.append(f"no ring: {campaign.header.name} holds no strain: it declares no gages")
    tire: Tire | None = None
    if ring is not None:
        tire = ring.tire.tire
    elif known is not None:
        tire = known.tire
    brush = None
    try:
        brush = identify_forces(campaign, tire, progress=progress)
    except TirelibError as error:
        reasons.append(f"no brush: {error}")
    if ring is None and known is not None and brush is not None and brush.fit.tire is not None:
        reasons.append(f"the ring of {known.name} gives the contact length")
    if ring is None and brush is None:
        raise CalibrationError("; ".join(reasons))
    file = _file(campaign, known, ring, routes, brush)
    return Whole(ring, routes, brush, tuple(reasons), file)


def _file(
    campaign: Campaign,
    known: TireFile | None,
    ring: Identification | None,
    routes: Routes | None,
    brush: ForceIdentification | None,
) -> TireFile:
    """Return the model: the ring's file, or a file of geometry, with the brush's numbers."""
    if ring is not None:
        base = model_file(ring, routes.damping if routes is not None else None)
    else:
        base = _without_ring(campaign, known)
    if brush is None:
        return base
    extra: dict[str, Any] = dict(base.extra)
    extra["model"] = {**extra["model"], "brush": "parabola"}
    extra["provenance"] = {
        **extra["provenance"],
        "brush_method": "forces by least squares, misfit as a Gaussian process in the intervals",
        "brush_forces": list(brush.fit.rmse),
        "brush_points": brush.fit.points,
    }
    # a brush that the start held is replaced as a whole: its half length may not outlive it
    old = {*STORED.values(), "reference_load", "reference_pressure"}
    kept = {name: number for name, number in base.numbers.items() if name not in old}
    return replace(base, numbers={**kept, **brush.numbers}, extra=extra)


def _without_ring(campaign: Campaign, known: TireFile | None) -> TireFile:
    geometry = campaign.header.tire
    numbers = dict(known.numbers) if known is not None else {}
    measured: dict[str, float | None] = {"free_radius": geometry.free_radius}
    if known is None:
        measured |= {
            "ring_radius": geometry.ring_radius,
            "belt_width": geometry.belt_width,
            "tread_thickness": geometry.tread_thickness,
            "innerliner_offset": geometry.innerliner_offset,
        }
    source = f"{campaign.header.name}, campaign.toml"
    for name, value in measured.items():
        if value is not None:
            numbers[name] = Number(float(value), float("nan"), "measured", source)
    extra = {
        "provenance": {
            "tirelib": __version__,
            "campaign": campaign.header.name,
            "data_sha256": campaign.content_hash(),
        },
        "model": {"ring": "large displacements", "contact": "radial"} if known is not None else {},
        "effects": [],
        "history": [],
    }
    return TireFile(geometry.name or campaign.header.name, numbers, extra)
