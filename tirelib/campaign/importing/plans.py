"""The rows of ``runs.csv``: kind and set points of every imported run."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from tirelib.campaign.campaign_fault import CampaignFault
from tirelib.campaign.importing.convert import Piece
from tirelib.campaign.importing.rules import ImportMap
from tirelib.campaign.model import RunPlan
from tirelib.campaign.plan import SET_POINTS
from tirelib.core.axes import sign
from tirelib.core.units import from_si, to_si

_SHOWN = 5


@dataclass(frozen=True, slots=True)
class ImportedRun:
    """One run of the new campaign.

    Attributes
    ----------
    plan : RunPlan
    source : str
        The file, and the run in it where it holds several.
    rows : int
        Samples of the rig quantities, of the gages where there are none.
    begin : float, [s]
        First reading of the clock.
    duration : float, [s]
    channels : tuple of str
    """

    plan: RunPlan
    source: str
    rows: int
    begin: float
    duration: float
    channels: tuple[str, ...]


def imported_run(piece: Piece, rules: ImportMap) -> ImportedRun:
    """Return a run with its kind and set points.

    An entry ``[runs.N]`` comes before a column or a mean, these before a number of
    ``[set_points]``.
    """
    entry = rules.runs.get(piece.number)
    points = _points(piece, rules) | piece.points | dict(entry.points if entry is not None else {})
    axes = rules.header.axes
    si = {
        column.quantity: sign(column.quantity, axes)
        * to_si(points.get(column.name, math.nan), column.unit, column.dimension)
        for column in SET_POINTS
    }
    plan = RunPlan(
        run=piece.number,
        file=f"runs/{piece.number:03d}.mf4",
        kind=entry.kind if entry is not None and entry.kind else rules.kind,
        **si,
        start=entry.start if entry is not None else None,
        extra=dict(entry.extra) if entry is not None else {},
    )
    clock = piece.rig_time if piece.rig_time is not None else piece.gage_time
    begin, end = (0.0, 0.0) if clock is None or not clock.size else (clock[0], clock[-1])
    strains = 0 if piece.strain is None else len(piece.strain)
    channels = [*piece.rig, *(f"strain_{k}" for k in range(1, strains + 1))]
    channels += ["trigger"] if piece.trigger is not None else []
    return ImportedRun(
        plan, piece.source, piece.rows, float(begin), float(end - begin), tuple(channels)
    )


def _points(piece: Piece, rules: ImportMap) -> dict[str, float]:
    """Return the numbers and rounded means of ``[set_points]``, in the units of ``runs.csv``."""
    points: dict[str, float] = {}
    for column in SET_POINTS:
        rule = rules.set_points.get(column.name)
        if rule is None or rule.column:
            continue
        points[column.name] = rule.value
        if math.isfinite(rule.mean_to):
            mean = float(np.mean(piece.rig["Fz" if column.quantity == "load" else column.quantity]))
            si = sign(column.quantity, rules.header.axes) * mean
            given = from_si(si, column.unit, column.dimension) / rule.mean_to
            # what is no number is a fault of the column already
            points[column.name] = rule.mean_to * round(given) + 0.0 if math.isfinite(given) else 0.0
    return points


def with_starts(imported: Sequence[ImportedRun]) -> list[ImportedRun]:
    """Return runs of one clock with their starts on it; as they are when each has its own clock."""
    begins = [item.begin for item in imported]
    if any(item.plan.start is not None for item in imported) or any(
        later <= earlier for earlier, later in pairwise(begins)
    ):
        return list(imported)
    return [replace(item, plan=replace(item.plan, start=item.begin)) for item in imported]


def plan_problems(imported: Sequence[ImportedRun], rules: ImportMap) -> list[CampaignFault]:
    """Return run numbers that come twice, entries for no run, and set points that are missing."""
    problems: list[CampaignFault] = []
    first: dict[int, str] = {}
    for item in imported:
        if item.plan.run in first:
            problems.append(
                CampaignFault(
                    item.source,
                    f"run {item.plan.run} is in {first[item.plan.run]} already",
                    "each run has its own number",
                    "renumber the runs of one file",
                )
            )
        first.setdefault(item.plan.run, item.source)
    for run, entry in rules.runs.items():
        if first and run not in first and not entry.skip:
            problems.append(
                CampaignFault(
                    f"{rules.file}, [runs.{run}]",
                    "there is no such run",
                    f"the runs are {_shown(list(first))}",
                    "correct the number",
                )
            )
    for column in SET_POINTS:
        empty = [
            item.plan.run
            for item in imported
            if item.plan.kind != "sweep" and math.isnan(getattr(item.plan, column.quantity))
        ]
        if empty:
            problems.append(
                CampaignFault(
                    f"{rules.file}, {column.name}",
                    f"no set point for run(s) {_shown(empty)}, no sweep",
                    "only a sweep may leave it empty",
                    f"add it to [set_points] or [runs.{empty[0]}], or make the kind sweep",
                )
            )
    return problems


def _shown(runs: Sequence[int]) -> str:
    more = f" and {len(runs) - _SHOWN} more" if len(runs) > _SHOWN else ""
    return ", ".join(map(str, runs[:_SHOWN])) + more
