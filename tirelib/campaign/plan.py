"""``runs.csv`` to run plans and back."""

import csv
import math
from collections.abc import Iterable, Mapping
from pathlib import Path, PurePosixPath
from typing import NamedTuple

from tirelib.campaign.campaign_fault import CampaignFault
from tirelib.campaign.model import KINDS, RunPlan
from tirelib.core.axes import sign
from tirelib.core.units import from_si, to_si

FILE = "runs.csv"


class _Column(NamedTuple):
    quantity: str
    name: str
    unit: str
    dimension: str
    low: float
    high: float


SET_POINTS: tuple[_Column, ...] = (
    _Column("load", "load_N", "N", "force", 0.0, 5e5),
    _Column("pressure", "pressure_bar", "bar", "pressure", 0.0, 20.0),
    _Column("speed", "speed_kmh", "km/h", "speed", 0.0, 600.0),
    _Column("slip_angle", "slip_angle_deg", "deg", "angle", -90.0, 90.0),
    _Column("camber", "camber_deg", "deg", "angle", -90.0, 90.0),
    _Column("slip_ratio", "slip_ratio", "1", "ratio", -1.0, 10.0),
)
"""The columns of the set points: quantity, column, unit, dimension and what is plausible."""

ROAD: tuple[_Column, ...] = (
    _Column("friction", "friction", "1", "ratio", 0.0, 2.0),
    _Column("tread_depth", "tread_depth_mm", "mm", "length", 0.0, 30.0),
    _Column("tread_temperature", "tread_temperature_degC", "degC", "temperature", -60.0, 200.0),
)
"""Optional columns: conditions of road and tread, for sweeps too."""

REQUIRED = ("run", "file", "kind", *(column.name for column in SET_POINTS))
_START = "start_s"
_NO_EXTRA = frozenset((*REQUIRED, _START, *(column.name for column in ROAD)))


def parse_plans(folder: Path, axes: str) -> tuple[tuple[RunPlan, ...], list[CampaignFault]]:
    """Read ``runs.csv`` of a folder whose data are in `axes`.

    Returns
    -------
    plans : tuple of RunPlan
        Plans of the rows without a fault, in file order.
    problems : list of CampaignFault
        Every fault found, in reading order.
    """
    try:
        with (folder / FILE).open(encoding="utf-8-sig", newline="") as stream:
            table = list(csv.reader(stream))
    except OSError as error:
        return (), [
            CampaignFault(
                FILE,
                f"it cannot be read ({error.strerror})",
                "every campaign needs one",
                "write a row for each run",
            )
        ]
    except (UnicodeDecodeError, csv.Error) as error:
        return (), [
            CampaignFault(
                FILE,
                f"not a text table: {error}",
                "comma-separated UTF-8 is needed",
                "export it again",
            )
        ]
    columns = [name.strip() for name in table[0]] if table else []
    problems = _separator_problems(columns) or _column_problems(columns)
    if problems:
        return (), problems
    plans: list[RunPlan] = []
    for line, cells in enumerate(table[1:], start=2):
        if any(cell.strip() for cell in cells):
            plan, faults = _parse_row(line, columns, cells, axes)
            problems += faults
            plans += [plan] if plan is not None else []
    problems += _duplicates(table, columns)
    if len(table) < 2:
        problems.append(
            CampaignFault(FILE, "no run is listed", "one row a run is needed", "add the runs")
        )
    return tuple(plans), problems


def _separator_problems(columns: list[str]) -> list[CampaignFault]:
    """Return a fault where the separator of the columns is not a comma."""
    for mark, words in ((";", "semicolons"), ("\t", "tabs"), ("|", "bars")):
        if len(columns) == 1 and {"run", "file"} <= {c.strip() for c in columns[0].split(mark)}:
            return [
                CampaignFault(
                    f"{FILE}, line 1",
                    f"the columns are separated by {words} ({mark!r})",
                    "commas are needed, and a point in decimal numbers",
                    "export it again as comma-separated text",
                )
            ]
    return []


def _column_problems(columns: list[str]) -> list[CampaignFault]:
    problems = [
        CampaignFault(
            f"{FILE}, line 1",
            f"column {name!r} is missing",
            f"the columns {', '.join(REQUIRED)} are needed",
            "add it",
        )
        for name in REQUIRED
        if name not in columns
    ]
    problems += [
        CampaignFault(
            f"{FILE}, line 1",
            f"column {name!r} occurs twice",
            "each column may occur once",
            "rename or drop one",
        )
        for name in dict.fromkeys(columns)
        if columns.count(name) > 1
    ]
    return problems


def _parse_row(
    line: int, columns: list[str], cells: list[str], axes: str
) -> tuple[RunPlan | None, list[CampaignFault]]:
    where = f"{FILE}, line {line}"
    if len(cells) != len(columns):
        return None, [
            CampaignFault(
                where,
                f"{len(cells)} cells are given",
                f"{len(columns)} columns are declared",
                "complete the row",
            )
        ]
    row = {name: cell.strip() for name, cell in zip(columns, cells, strict=True)}
    problems: list[CampaignFault] = []
    run = _run_number(where, row["run"], problems)
    file = _file_name(where, row["file"], problems)
    kind = row["kind"]
    if kind not in KINDS:
        problems.append(
            CampaignFault(
                f"{where}, kind",
                f"{kind!r} is given",
                f"{', '.join(KINDS)} are allowed",
                "name one of these; sweep when the set points vary",
            )
        )
    points = {
        c.quantity: _set_point(where, row[c.name], kind, c, axes, problems) for c in SET_POINTS
    }
    points |= {
        c.quantity: _set_point(where, row.get(c.name, ""), "sweep", c, axes, problems) for c in ROAD
    }
    start = _number(f"{where}, {_START}", row.get(_START, ""), problems)
    if problems or run is None:
        return None, problems
    extra = {name: _extra(cell) for name, cell in row.items() if name not in _NO_EXTRA and cell}
    plan = RunPlan(
        run=run,
        file=file,
        kind=kind,
        **points,
        start=None if math.isnan(start) else start,
        extra=extra,
    )
    return plan, problems


def _run_number(where: str, cell: str, problems: list[CampaignFault]) -> int | None:
    if cell.isdecimal():
        return int(cell)
    problems.append(
        CampaignFault(
            f"{where}, run",
            f"{cell!r} is given",
            "a whole number, 0 or more, is needed",
            "number the runs",
        )
    )
    return None


def _file_name(where: str, cell: str, problems: list[CampaignFault]) -> str:
    path = PurePosixPath(cell)
    if not cell or path.is_absolute() or ".." in path.parts:
        problems.append(
            CampaignFault(
                f"{where}, file",
                f"{cell!r} is given",
                "a file inside the folder is needed",
                "write for instance runs/000.mf4",
            )
        )
    return cell


def _number(where: str, cell: str, problems: list[CampaignFault]) -> float:
    """Return the number in a cell, NaN for an empty one; a fault is noted and gives NaN."""
    if not cell:
        return math.nan
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        problems.append(
            CampaignFault(
                where,
                f"{cell!r} is given",
                "a finite number is needed",
                "correct it, with a decimal point",
            )
        )
    return value


def _set_point(
    where: str, cell: str, kind: str, column: _Column, axes: str, problems: list[CampaignFault]
) -> float:
    place = f"{where}, {column.name}"
    before = len(problems)
    value = _number(place, cell, problems)
    if len(problems) > before:
        return math.nan
    if math.isnan(value):
        if kind != "sweep":
            problems.append(
                CampaignFault(
                    place,
                    "the set point is empty",
                    "only a sweep may leave it empty",
                    "fill it in or make the kind sweep",
                )
            )
        return math.nan
    if not column.low <= value <= column.high:
        problems.append(
            CampaignFault(
                place,
                f"{value:g} {column.unit} is not plausible",
                f"{column.low:g} .. {column.high:g} {column.unit} is allowed",
                "check its unit and sign; a load is positive in every axis system",
            )
        )
        return math.nan
    return sign(column.quantity, axes) * to_si(value, column.unit, column.dimension) + 0.0


def _extra(cell: str) -> float | str:
    try:
        return float(cell)
    except ValueError:
        return cell


def _duplicates(table: list[list[str]], columns: list[str]) -> list[CampaignFault]:
    """Return the run numbers and the files that occur in more than one row."""
    problems: list[CampaignFault] = []
    for name, allowed in (
        ("run", "each run has its own number"),
        ("file", "each run has its own file"),
    ):
        place = columns.index(name)
        lines: dict[str, list[int]] = {}
        for line, cells in enumerate(table[1:], start=2):
            if place < len(cells) and cells[place].strip():
                lines.setdefault(cells[place].strip(), []).append(line)
        problems += [
            CampaignFault(
                f"{FILE}, lines {', '.join(map(str, where))}",
                f"{name} {value} is listed {len(where)} times",
                allowed,
                "renumber or remove the copy" if name == "run" else "name the file of each run",
            )
            for value, where in lines.items()
            if len(where) > 1
        ]
    return problems


def write_plans(path: Path, plans: Iterable[RunPlan], axes: str) -> None:
    """Write plans as ``runs.csv`` in `axes`; the inverse of `parse_plans`."""
    rows = list(plans)
    extras = list(dict.fromkeys(name for plan in rows for name in plan.extra))
    starts = [_START] if any(plan.start is not None for plan in rows) else []
    road = [c for c in ROAD if any(not math.isnan(getattr(plan, c.quantity)) for plan in rows)]
    given = [column.name for column in road]
    with path.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.DictWriter(stream, [*REQUIRED, *starts, *given, *extras], lineterminator="\n")
        writer.writeheader()
        writer.writerows(_plan_row(plan, axes, road, bool(starts), extras) for plan in rows)


def _plan_row(
    plan: RunPlan, axes: str, road: list[_Column], with_start: bool, extras: list[str]
) -> Mapping[str, int | float | str]:
    row: dict[str, int | float | str] = {"run": plan.run, "file": plan.file, "kind": plan.kind}
    for column in (*SET_POINTS, *road):
        value: float = getattr(plan, column.quantity)
        given = sign(column.quantity, axes) * from_si(value, column.unit, column.dimension) + 0.0
        row[column.name] = "" if math.isnan(value) else float(f"{given:.12g}")
    if with_start:
        row[_START] = "" if plan.start is None else plan.start
    row.update({name: plan.extra.get(name, "") for name in extras})
    return row
