"""The import map, ``tirelib-map/1``: which column is which quantity, in which unit and axes."""

import math
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from tirelib.campaign.campaign_fault import CampaignFault, errors_of, raise_errors
from tirelib.campaign.importing.columns import did_you_mean
from tirelib.campaign.importing.defects import CHOICES, Defects
from tirelib.campaign.importing.mapheader import GAGE_TIME, header_of, strain_number
from tirelib.campaign.importing.mapreader import (
    FORMAT,
    MapReader,
    read_csv_options,
    read_document,
)
from tirelib.campaign.importing.rules import ChannelRule, ImportMap, RunEntry, SetPointRule
from tirelib.campaign.model import KINDS, CampaignHeader, TireGeometry
from tirelib.campaign.plan import SET_POINTS
from tirelib.core.errors import UnitError
from tirelib.core.units import QUANTITIES, to_si

POINTS = tuple(column.name for column in SET_POINTS)
"""Names of the set points, as in ``runs.csv``."""

_TOP = (
    "format",
    "axes",
    "name",
    "kind",
    "run_column",
    "tire",
    "gages",
    "tolerance",
    "rig",
    "channels",
    "set_points",
    "runs",
    "csv",
    *CHOICES,
)
_CHANNEL = ("column", "unit", "factor", "sign", "offset", "override_unit")
_NAMES = (*(name for name in QUANTITIES if name != "load"), GAGE_TIME, "temperature")


def read_map(path: str | Path, name: str = "import") -> ImportMap:
    """Read an import map.

    Parameters
    ----------
    path : str or Path
    name : str
        Name of the campaign, when the map gives none.

    Raises
    ------
    FormatError
        With every fault of the map.
    """
    rules, problems = parse_map(path, name)
    raise_errors(problems)
    return rules


def parse_map(path: str | Path, name: str) -> tuple[ImportMap, list[CampaignFault]]:
    """Read an import map and keep its faults, so that the files can be looked at as well.

    Returns
    -------
    rules : ImportMap
        What is right in it; `ImportMap.sound` is False when anything is wrong.
    problems : list of CampaignFault

    Raises
    ------
    FormatError
        If the map is illegible.
    """
    file = str(path)
    reader = MapReader(file, read_document(file, Path(path)))
    if reader.document.get("format") != FORMAT:
        given = reader.document.get("format")
        said = "the key is missing" if given is None else f"{given!r} is an unknown version"
        reader.fault(
            "format",
            said,
            f"{FORMAT!r} is what this version of tirelib reads",
            "state it, or use the tirelib that knows it",
        )
    reader.known("", reader.document, _TOP)
    channels, wrong = _channels(reader)
    kind = _kind(reader, "kind", reader.text("", reader.document, "kind") or "sweep")
    run_column = reader.text("", reader.document, "run_column")
    set_points = _set_points(reader, channels)
    runs = _runs(reader)
    defects = _defects(reader)
    options = replace(read_csv_options(reader), text_is_missing=defects.text == "missing")
    header, faults = header_of(file, reader.document, channels, name)
    problems = [*reader.problems, *faults]
    errors = errors_of(problems)
    warnings = tuple(problem for problem in problems if problem not in errors)
    sound = header is not None and not errors
    header = header or CampaignHeader("", "iso", TireGeometry("", math.nan))
    right = {quantity: rule for quantity, rule in channels.items() if quantity not in wrong}
    rules = ImportMap(
        file, header, kind, run_column, right, set_points, runs, options, defects, warnings, sound
    )
    return rules, problems


def _kind(reader: MapReader, where: str, kind: str) -> str:
    if kind and kind not in KINDS:
        reader.fault(
            where,
            f"{kind!r} is given",
            f"{', '.join(KINDS)} are allowed",
            did_you_mean(kind, KINDS),
        )
    return kind


def _defects(reader: MapReader) -> Defects:
    chosen = {key: reader.text("", reader.document, key) for key in CHOICES}
    for key, choice in chosen.items():
        if choice and choice not in CHOICES[key]:
            reader.fault(
                key,
                f"{choice!r} is given",
                f"{', '.join(map(repr, CHOICES[key]))} is allowed",
                did_you_mean(choice, CHOICES[key]),
            )
    return Defects(**chosen)


def _channels(reader: MapReader) -> tuple[dict[str, ChannelRule], set[str]]:
    """Return the rules, and the quantities whose rule has a fault."""
    given = reader.table("channels")
    if not given:
        reader.fault(
            "[channels]",
            "no channel is mapped",
            "at least one quantity is needed",
            'write for instance Fz = { column = "FZ", unit = "N" }',
        )
    rules: dict[str, ChannelRule] = {}
    wrong: set[str] = set()
    for quantity, entry in given.items():
        before = len(reader.problems)
        where = f"[channels] {quantity}"
        if not _is_quantity(quantity):
            reader.fault(
                where,
                "the quantity is unknown",
                "names of quantities such as Fz, slip_angle, strain_1, ..._temperature are allowed",
                did_you_mean(quantity, _NAMES),
            )
        elif not isinstance(entry, dict):
            reader.fault(
                where,
                f"{entry!r} is given",
                "a table is needed",
                'write { column = "...", unit = "..." }',
            )
        else:
            rules[quantity] = _channel(reader, where, quantity, entry)
        wrong |= {quantity} if len(reader.problems) > before else set()
    used: dict[str, str] = {}
    for quantity, rule in rules.items():
        if rule.column and rule.column in used:
            reader.fault(
                f"[channels] {quantity}",
                f"column {rule.column!r} is that of {used[rule.column]} already",
                "each column is one quantity",
                "correct one of them",
            )
        used.setdefault(rule.column, quantity)
    return rules, wrong


def _is_quantity(name: str) -> bool:
    return (
        name in _NAMES
        or strain_number(name) is not None
        or re.fullmatch(r"\w+_temperature", name) is not None
    )


def _channel(reader: MapReader, where: str, quantity: str, entry: Mapping[str, Any]) -> ChannelRule:
    clock = quantity in ("time", GAGE_TIME)
    reader.known(where, entry, (*_CHANNEL, "rate_hz") if clock else _CHANNEL)
    column = reader.text(where, entry, "column")
    rate = reader.number(where, entry, "rate_hz", math.nan) if clock else math.nan
    if not column and not ("rate_hz" in entry and clock):
        reader.fault(
            where,
            "no column is named",
            "column = a name in the files",
            "name it, or rate_hz for a clock without a column" if clock else "name it",
        )
    if "rate_hz" in entry and clock and (column or not rate > 0.0):
        reader.fault(
            where,
            f"rate_hz = {rate:g}" + (" together with a column" if column else ""),
            "a rate above 0 instead of a column",
            "give one of them",
        )
    unit = reader.text(where, entry, "unit")
    factor = reader.number(where, entry, "factor", 1.0)
    turn = reader.number(where, entry, "sign", 1.0)
    offset = reader.number(where, entry, "offset", 0.0)
    if turn not in (1.0, -1.0):
        reader.fault(
            f"{where} sign", f"{turn:g} is given", "1 and -1 are allowed", "use factor for a scale"
        )
    if factor == 0.0:
        reader.fault(f"{where} factor", "0 is given", "any other number is allowed", "correct it")
    override = entry.get("override_unit", False)
    if not isinstance(override, bool) or (override and not unit):
        reader.fault(
            f"{where} override_unit",
            f"{override!r} is given" + ("" if unit else " without a unit"),
            "true or false, and a unit as well",
            "correct it",
        )
    rule = ChannelRule(quantity, column, unit, turn * factor, offset, rate, override is True)
    _check_unit(reader, where, unit, rule.dimension)
    return rule


def _check_unit(reader: MapReader, where: str, unit: str, dimension: str) -> None:
    """Note a unit of the wrong dimension; an empty one is left to the file."""
    try:
        if unit:
            to_si(1.0, unit, dimension)
    except UnitError as error:
        for fault in error.faults:
            remedy = "write the unit of the column"
            reader.fault(f"{where} unit", fault.given, fault.allowed, remedy)


def _set_points(reader: MapReader, channels: Mapping[str, ChannelRule]) -> dict[str, SetPointRule]:
    given = reader.table("set_points")
    reader.known("[set_points]", given, POINTS)
    rules: dict[str, SetPointRule] = {}
    for column in SET_POINTS:
        entry = given.get(column.name)
        where = f"[set_points] {column.name}"
        if entry is None:
            continue
        if not isinstance(entry, dict):
            rules[column.name] = SetPointRule(
                reader.number("[set_points]", given, column.name, 0.0)
            )
        elif "mean_to" in entry:
            reader.known(where, entry, ("mean_to",))
            step = reader.number(where, entry, "mean_to", 1.0)
            measured = "Fz" if column.quantity == "load" else column.quantity
            if not step > 0.0:
                reader.fault(
                    f"{where} mean_to",
                    f"{step:g} is given",
                    "a step above 0",
                    f"write {{ mean_to = 50 }}, say, in {column.unit}",
                )
            if measured not in channels:
                reader.fault(
                    where,
                    f"the mean of {measured} is asked for",
                    f"[channels] {measured} is needed for that",
                    "map it",
                )
            rules[column.name] = SetPointRule(mean_to=step)
        else:
            reader.known(where, entry, ("column", "unit"))
            unit = reader.text(where, entry, "unit") or column.unit
            _check_unit(reader, where, unit, column.dimension)
            name = reader.text(where, entry, "column")
            if not name:
                reader.fault(
                    where,
                    "no column is named",
                    "a number, { column, unit } or { mean_to } is allowed",
                    "name it",
                )
            rules[column.name] = SetPointRule(column=name, unit=unit)
    return rules


def _runs(reader: MapReader) -> dict[int, RunEntry]:
    entries: dict[int, RunEntry] = {}
    for key, values in reader.table("runs").items():
        where = f"[runs.{key}]"
        if not key.isdecimal() or not isinstance(values, dict):
            reader.fault(
                where,
                f"{key!r} with {values!r}"[:60],
                "a table for a run number",
                "write for instance [runs.18]",
            )
            continue
        kind = _kind(reader, f"{where} kind", reader.text(where, values, "kind"))
        points = {n: reader.number(where, values, n, math.nan) for n in POINTS if n in values}
        start = reader.number(where, values, "start_s", 0.0) if "start_s" in values else None
        extra: dict[str, float | str] = {}
        for name, value in values.items():
            if name in (*POINTS, "kind", "start_s", "skip"):
                continue
            if isinstance(value, str | int | float) and name not in ("run", "file"):
                extra[name] = value if isinstance(value, str) else float(value)
            else:
                reader.fault(
                    f"{where} {name}",
                    f"{value!r} is given",
                    "a further condition is a number or a text, and run and file are taken",
                    "correct it",
                )
        skip = values.get("skip", False)
        if not isinstance(skip, bool):
            reader.fault(f"{where} skip", f"{skip!r} is given", "true or false", "correct it")
        entries[int(key)] = RunEntry(kind, points, start, extra, skip is True)
    return entries
