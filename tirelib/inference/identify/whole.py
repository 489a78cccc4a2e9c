"""Ring and brush of one campaign, as far as it can inform them."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from tirelib.campaign import Campaign
from tirelib.core.errors import CalibrationError, TirelibError
from tirelib.core.parameters import TireFile
from tirelib.core.threads import one_thread
from tirelib.core.version import __version__
from tirelib.inference.identify.brush_law import STORED
from tirelib.inference.identify.forces import ForceIdentification, identify_forces
from tirelib.inference.identify.identify import (
    WITHOUT_EFFECTS,
    Identification,
    identify,
    stated_lengths,
)
from tirelib.inference.identify.strain_notes import broken_gages, ring_expected

SAME_RADIUS = 0.01
"""Relative difference up to which two free radii may be one tire's."""


@dataclass(frozen=True, slots=True, eq=False)
class Whole:
    """Ring and brush of a campaign.

    Attributes
    ----------
    reasons : tuple of str
        Why a part is absent, and which runs and gages were not used.
    ring_failed : str
        Why there is no ring although the plan holds the runs for one; else empty.
    file : TireFile
        What the other verbs read.
    """

    ring: Identification | None
    brush: ForceIdentification | None
    reasons: tuple[str, ...]
    ring_failed: str
    file: TireFile


@one_thread()
def identify_whole(
    campaign: Campaign,
    start: TireFile | None = None,
    *,
    base: str = "plain",
    progress: Callable[[str], None] | None = None,
    found: Callable[[TireFile], None] | None = None,
) -> Whole:
    """Fit the ring to straight runs with strain, then the brush to runs with slip.

    Parameters
    ----------
    start : TireFile, optional
        Start and priors of the ring; where the campaign tells no ring, this one gives the contact
        length to the brush.
    base : str
        Base of the ring: plain tire, or the dissertation's
        (`tirelib.inference.identify.identify.BASES`).
    found : callable, optional
        Called with the fitted ring before the intervals of its numbers are computed.

    Raises
    ------
    CalibrationError
        If the campaign informs neither; with both reasons.
    ParameterError
        If the given tire's geometry contradicts that of the campaign.
    """
    reasons: list[str] = []
    known = _start(campaign, start, reasons)
    ring, failed = None, ""
    if campaign.header.gage_lateral:
        try:
            ring = identify(campaign, known, base=base, progress=progress, found=found)
            reasons += ring.notes
        except TirelibError as error:
            why = "; ".join([f"no ring: {error}", *broken_gages(campaign)])
            reasons.append(why)
            failed = why if ring_expected(campaign) else ""
    else:
        reasons.append(f"no ring: {campaign.header.name} holds no strain: it declares no gages")
    of = ring.tire if ring is not None else known
    tire = of.tire if of is not None else None
    brush = None
    try:
        brush = identify_forces(campaign, tire, progress=progress)
    except TirelibError as error:
        kept = "; the ring's parameters are not affected" if ring is not None else ""
        reasons.append(f"forces are not fitted{kept}. {error}")
    if ring is None and known is not None and brush is not None and brush.fit.tire is not None:
        reasons.append(f"the ring of {known.name} gives the contact length")
    if ring is None and brush is None:
        raise CalibrationError("; ".join(reasons))
    file = _file(campaign, known, ring, brush)
    if not file.missing:
        _ = file.tire  # a file that no verb could read is refused here
    return Whole(ring, brush, tuple(reasons), failed, file)


def _start(campaign: Campaign, start: TireFile | None, reasons: list[str]) -> TireFile | None:
    """Return the given tire if it states a ring, and say what does not fit the campaign."""
    if start is None:
        return None
    if start.missing:
        reasons.append(
            f"{start.name}: the given tire states no complete ring ({', '.join(start.missing[:3])} "
            "... missing): literature values are the start instead"
        )
        return None
    given, measured = start.numbers["free_radius"].value, campaign.header.tire.free_radius
    if abs(given / measured - 1.0) > SAME_RADIUS:
        reasons.append(
            f"free_radius is {1e3 * given:.1f} mm in {start.name} and {1e3 * measured:.1f} mm in "
            f"campaign.toml of {campaign.header.name}: is it the same tire? The campaign's counts"
        )
    return start


def _file(
    campaign: Campaign,
    known: TireFile | None,
    ring: Identification | None,
    brush: ForceIdentification | None,
) -> TireFile:
    """Return the model: the ring's file, or a file of geometry, with the brush's numbers."""
    base = ring.tire if ring is not None else _without_ring(campaign, known)
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
    """Return a file of what the campaign states, beside the ring of the given tire if any."""
    numbers, lengths = dict(known.numbers if known else {}), stated_lengths(campaign.header)
    numbers |= {k: v for k, v in lengths.items() if known is None or k == "free_radius"}
    provenance = {
        "tirelib": __version__,
        "campaign": campaign.header.name,
        "data_sha256": campaign.content_hash(),
    }
    extra: dict[str, Any] = {"provenance": provenance, **WITHOUT_EFFECTS}
    if known is None:
        extra["model"] = {}
    return TireFile(campaign.header.tire.name or campaign.header.name, numbers, extra)
