"""A campaign at a glance: its header, and set points and means run by run, in field units.

Signs are ISO here, whatever axis system the files have.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from tirelib.campaign.model import CampaignHeader, Run, RunPlan
from tirelib.campaign.plan import SET_POINTS
from tirelib.core.units import from_si


class Column(NamedTuple):
    """A rig quantity, the set point that goes with it, and how it is shown."""

    name: str
    planned: str
    heading: str
    unit: str
    dimension: str
    digits: int
    key: str

    def cell(self, row: "RunRow", between: str = " / ") -> str:
        """Return set point and mean of a run as one cell; ``-`` for what is not there."""
        measured = _text(row.measured[self.name], self.digits)
        if not self.planned:
            return measured
        return f"{_text(row.planned[self.name], self.digits)}{between}{measured}"


COLUMNS = (
    Column("Fz", "load", "Fz\nN", "N", "force", 0, "Fz_N"),
    Column("pressure", "pressure", "pressure\nbar", "bar", "pressure", 2, "pressure_bar"),
    Column("speed", "speed", "speed\nkm/h", "km/h", "speed", 1, "speed_kmh"),
    Column("slip_angle", "slip_angle", "slip\nangle\ndeg", "deg", "angle", 1, "slip_angle_deg"),
    Column("camber", "camber", "camber\ndeg", "deg", "angle", 1, "camber_deg"),
    Column("slip_ratio", "slip_ratio", "slip\nratio\n1", "1", "ratio", 2, "slip_ratio"),
    Column("Fx", "", "Fx\nN", "N", "force", 0, "Fx_N"),
    Column("Fy", "", "Fy\nN", "N", "force", 0, "Fy_N"),
    Column("Mz", "", "Mz\nNm", "Nm", "moment", 0, "Mz_Nm"),
)
"""What is shown of each run."""


@dataclass(frozen=True, slots=True)
class RunRow:
    """One run in field units: set points and measured means by quantity, None where absent."""

    run: int
    kind: str
    file: str
    planned: dict[str, float | None]
    measured: dict[str, float | None]
    samples: int
    duration: float


def run_row(run: Run) -> RunRow:
    """Return the row of a run."""
    planned = {
        column.name: _finite(
            from_si(getattr(run.plan, column.planned), column.unit, column.dimension)
        )
        for column in COLUMNS
        if column.planned
    }
    measured: dict[str, float | None] = {}
    for column in COLUMNS:
        mean = run.mean(column.name)
        measured[column.name] = (
            None if mean is None else _finite(from_si(mean, column.unit, column.dimension))
        )
    samples = 0 if run.strain is None else run.strain.shape[1]
    if samples:
        duration = samples / run.rate
    elif run.rig_time is not None and run.rig_time.size:
        duration = float(run.rig_time[-1] - run.rig_time[0])
    else:
        duration = 0.0
    plan = run.plan
    return RunRow(plan.run, plan.kind, plan.file, planned, measured, samples, duration)


def representative_plans(plans: Sequence[RunPlan], count: int = 4) -> list[RunPlan]:
    """Return a few runs that span the plan: the first, then always the one farthest from all.

    Distance is over the set points, each scaled by its spread in the plan.
    """
    points = [[_zero(getattr(plan, column.quantity)) for column in SET_POINTS] for plan in plans]
    spans = [max(axis) - min(axis) or 1.0 for axis in zip(*points, strict=True)]
    scaled = [[value / span for value, span in zip(p, spans, strict=True)] for p in points]
    chosen: list[int] = [0] if plans else []
    while len(chosen) < min(count, len(plans)):
        distance = [min(math.dist(p, scaled[i]) for i in chosen) for p in scaled]
        farthest = max(range(len(plans)), key=distance.__getitem__)
        if distance[farthest] == 0.0:
            break
        chosen.append(farthest)
    return [plans[i] for i in chosen]


def header_lines(header: CampaignHeader) -> list[tuple[str, str]]:
    """Return the header as pairs of name and text."""
    tire = header.tire
    lengths = [
        (text, value)
        for text, value in (
            ("free radius", tire.free_radius),
            ("ring radius", tire.ring_radius),
            ("tread", tire.tread_thickness),
            ("belt width", tire.belt_width),
            ("innerliner offset", tire.innerliner_offset),
        )
        if value is not None
    ]
    lines = [
        ("campaign", header.name),
        ("axes", f"files {header.axes}, shown here iso"),
        ("tire", tire.name),
        ("", ", ".join(f"{text} {1e3 * value:.1f} mm" for text, value in lengths)),
    ]
    if header.gage_lateral:
        places = ", ".join(place_label(y) for y in header.gage_lateral)
        lines.append(("gages", f"y = {places} (iso, strain_1 first)"))
        lines.append(("", f"{header.rate:g} Hz, {header.strain_unit}"))
    else:
        lines.append(("gages", "none: forces and moments only"))
    if header.tolerance is not None:
        spread = header.tolerance
        lines.append(
            (
                "repeatability",
                f"load {spread.load:.1%}, pressure {spread.pressure:.1%}, "
                f"speed {spread.speed:.1%}, gain {spread.gain:.1%} (one sigma)",
            )
        )
    lines += [("rig", header.rig_name)] if header.rig_name else []
    lines += [("note", header.rig_note)] if header.rig_note else []
    return lines


def header_document(header: CampaignHeader) -> dict[str, Any]:
    """Return the header for JSON: mm and Hz, signs iso."""
    tire = header.tire

    def millimetres(length: float | None) -> float | None:
        return None if length is None else round(1e3 * length, 6)

    return {
        "name": header.name,
        "file_axes": header.axes,
        "tire": {
            "name": tire.name,
            "free_radius_mm": millimetres(tire.free_radius),
            "ring_radius_mm": millimetres(tire.ring_radius),
            "tread_thickness_mm": millimetres(tire.tread_thickness),
            "belt_width_mm": millimetres(tire.belt_width),
            "innerliner_offset_mm": millimetres(tire.innerliner_offset),
        },
        "gage_lateral_mm": [millimetres(y) for y in header.gage_lateral],
        "rate_hz": _finite(header.rate),
        "strain_unit": header.strain_unit,
        "rig": {"name": header.rig_name, "note": header.rig_note},
    }


def row_document(row: RunRow) -> dict[str, Any]:
    """Return a run for JSON: set points and means with the unit in the key."""
    return {
        "run": row.run,
        "kind": row.kind,
        "file": row.file,
        "set_point": {c.key: row.planned[c.name] for c in COLUMNS if c.planned},
        "mean": {c.key: row.measured[c.name] for c in COLUMNS},
        "strain_samples": row.samples,
        "duration_s": row.duration,
    }


def place_label(lateral: float) -> str:
    """Return the lateral position of a gage as people name it.

    >>> place_label(0.03), place_label(-0.0)
    ('+30 mm', '0 mm')
    """
    text = f"{1e3 * lateral:+.0f}"
    return "0 mm" if float(text) == 0.0 else f"{text} mm"


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _zero(value: float) -> float:
    return value if math.isfinite(value) else 0.0


def _text(value: float | None, digits: int) -> str:
    if value is None:
        return "-"
    text = f"{value:.{digits}f}"
    return text.lstrip("-") if float(text) == 0.0 else text
