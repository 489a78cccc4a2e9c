"""``campaign.toml`` to CampaignHeader and back."""

import math
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tirelib.campaign.campaign_fault import CampaignFault, errors_of
from tirelib.campaign.model import CampaignHeader, TireGeometry, Tolerance
from tirelib.core.axes import FLIPPED, sign
from tirelib.core.units import dimensions_of_unit, units_of

FORMAT = "tirelib-campaign/1"
FILE = "campaign.toml"

_TIRE_RANGE: Mapping[str, tuple[float, float]] = {
    "free_radius_m": (0.1, 1.5),
    "ring_radius_m": (0.08, 1.5),
    "tread_thickness_m": (0.0005, 0.08),
    "belt_width_m": (0.03, 1.0),
    "innerliner_offset_m": (-0.06, 0.0),
}
_LATERAL_RANGE = (-0.5, 0.5)
_RATE_RANGE = (1.0, 1e7)
_TOLERANCE_RANGE = (0.0, 0.5)
_KNOWN: Mapping[str, frozenset[str]] = {
    "": frozenset({"format", "tirelib", "name", "axes", "tire", "gages", "tolerance", "rig"}),
    "tire": frozenset({"name", *_TIRE_RANGE}),
    "gages": frozenset({"lateral_m", "rate_hz", "unit"}),
    "tolerance": frozenset({"load", "pressure", "speed", "gain"}),
    "rig": frozenset({"name", "note"}),
}


class _Reader:
    """Takes typed values out of one TOML document and keeps every fault."""

    def __init__(self, document: Mapping[str, Any]) -> None:
        self.document = document
        self.problems: list[CampaignFault] = []

    def fault(self, key: str, given: str, allowed: str, remedy: str) -> None:
        self.problems.append(CampaignFault(f"{FILE}, {key}", given, allowed, remedy))

    def table(self, key: str) -> Mapping[str, Any]:
        value = self.document.get(key, {})
        if isinstance(value, dict):
            return value
        self.fault(
            f"[{key}]", f"{value!r} is not a table", "a table is needed", "write [" + key + "]"
        )
        return {}

    def text(self, table: str, key: str, *, required: bool = True) -> str:
        where, values = self._place(table, key)
        if key not in values:
            if required:
                self.fault(where, "the key is missing", "a text is needed", "add it")
            return ""
        value = values[key]
        if isinstance(value, str) and (value.strip() or not required):
            return value
        self.fault(where, f"{value!r} is given", "a text is needed", "write it in quotes")
        return ""

    def number(
        self, table: str, key: str, low: float, high: float, *, required: bool = True
    ) -> float | None:
        where, values = self._place(table, key)
        if key not in values:
            if required:
                self.fault(where, "the key is missing", "a number is needed", "add it")
            return None
        return self._checked(where, values[key], low, high, "m" if key.endswith("_m") else "")

    def numbers(self, table: str, key: str, low: float, high: float) -> tuple[float, ...]:
        where, values = self._place(table, key)
        value = values.get(key)
        if not isinstance(value, list) or not value:
            given = "the key is missing" if value is None else f"{value!r} is given"
            self.fault(where, given, "a list of numbers is needed", "write [-0.03, 0.0, 0.03]")
            return ()
        checked = [
            self._checked(f"{where}[{i}]", item, low, high, "m") for i, item in enumerate(value)
        ]
        return tuple(item for item in checked if item is not None)

    def _place(self, table: str, key: str) -> tuple[str, Mapping[str, Any]]:
        return (f"[{table}] {key}", self.table(table)) if table else (key, self.document)

    def _checked(self, where: str, value: Any, low: float, high: float, unit: str) -> float | None:
        if isinstance(value, bool) or not isinstance(value, (int, float)) or math.isnan(value):
            self.fault(
                where, f"{value!r} is given", "a number is needed", "write it without quotes"
            )
            return None
        if low <= value <= high:
            return float(value)
        remedy = "check it"
        if unit == "m" and low <= value / 1000.0 <= high:
            remedy = f"it looks like millimetres: write {value / 1000.0:g}"
        elif unit == "m" and low <= -value <= high:
            remedy = f"its sign looks wrong: write {-value:g}"
        elif not unit and high == _TOLERANCE_RANGE[1] and low <= value / 100.0 <= high:
            remedy = f"it looks like percent: write {value / 100.0:g}"
        self.fault(
            where,
            f"{value:g} {unit}".rstrip() + " is not plausible",
            f"{low:g} .. {high:g} {unit}".rstrip() + " is allowed",
            remedy,
        )
        return None


def parse_header(folder: Path) -> tuple[CampaignHeader | None, list[CampaignFault]]:
    """Read ``campaign.toml`` of a folder.

    Returns
    -------
    header : CampaignHeader or None
        None when the runs could not be read by it: format, axes, free radius or gages are wrong.
    problems : list of CampaignFault
        Every fault found, in reading order.
    """
    document, problem = _document(folder)
    if document is None:
        return None, [problem] if problem else []
    reader = _Reader(document)
    _check_format(reader)
    name = reader.text("", "name")
    axes = _axes(reader)
    tire = _tire(reader)
    lateral, rate, unit = _gages(reader, axes, tire)
    tolerance = _tolerance(reader)
    rig_name = reader.text("rig", "name", required=False)
    rig_note = reader.text("rig", "note", required=False)
    _check_keys(reader)
    if tire is None or any(_blocks(problem) for problem in errors_of(reader.problems)):
        return None, reader.problems
    header = CampaignHeader(name, axes, tire, lateral, rate, unit, tolerance, rig_name, rig_note)
    return header, reader.problems


def _blocks(problem: CampaignFault) -> bool:
    """Return whether the runs cannot be interpreted as long as this key is wrong."""
    keys = ("format", "axes", "[gages]", "[tire] free_radius_m")
    return problem.where.startswith(tuple(f"{FILE}, {key}" for key in keys))


def _document(folder: Path) -> tuple[dict[str, Any] | None, CampaignFault | None]:
    try:
        return tomllib.loads((folder / FILE).read_text(encoding="utf-8-sig")), None
    except OSError as error:
        return None, CampaignFault(
            FILE,
            f"it cannot be read ({error.strerror})",
            "every campaign needs one",
            "write it or name the campaign's own folder",
        )
    except UnicodeDecodeError as error:
        return None, CampaignFault(
            FILE, f"byte {error.start} is not UTF-8", "TOML is UTF-8", "save it as UTF-8"
        )
    except tomllib.TOMLDecodeError as error:
        return None, CampaignFault(
            FILE, f"not TOML: {error}", "valid TOML is needed", "correct it there"
        )


def _check_format(reader: _Reader) -> None:
    given = reader.document.get("format")
    if given == FORMAT:
        return
    said = "the key is missing" if given is None else f"{given!r} is an unknown version"
    reader.fault(
        "format",
        said,
        f"{FORMAT!r} is what this version of tirelib reads",
        "use the tirelib that wrote it, or convert the folder",
    )


def _axes(reader: _Reader) -> str:
    given = reader.document.get("axes")
    if isinstance(given, str) and given in FLIPPED:
        return given
    said = "the key is missing" if given is None else f"{given!r} is an unknown axis system"
    reader.fault(
        "axes", said, f"{', '.join(FLIPPED)} are allowed", "name the axis system of the data"
    )
    return "iso"


def _tire(reader: _Reader) -> TireGeometry | None:
    if "tire" not in reader.document:
        reader.fault(
            "[tire]", "the table is missing", "name and free_radius_m are needed", "add it"
        )
        return None
    name = reader.text("tire", "name")
    values = {
        key: reader.number("tire", key, low, high, required=key == "free_radius_m")
        for key, (low, high) in _TIRE_RANGE.items()
    }
    free, ring = values["free_radius_m"], values["ring_radius_m"]
    if free is not None and ring is not None and not 0.5 * free < ring < free:
        reader.fault(
            "[tire] ring_radius_m",
            f"{ring:g} m does not fit the free radius of {free:g} m",
            "between half of it and all of it is allowed",
            "measure to the belt's neutral line",
        )
    if free is None:
        return None
    return TireGeometry(
        name,
        free,
        ring,
        values["tread_thickness_m"],
        values["belt_width_m"],
        values["innerliner_offset_m"],
    )


def _gages(
    reader: _Reader, axes: str, tire: TireGeometry | None
) -> tuple[tuple[float, ...], float, str]:
    """Return lateral positions (ISO), rate and unit; nothing for a force-only campaign."""
    if "gages" not in reader.document:
        return (), math.nan, "ustrain"
    lateral = reader.numbers("gages", "lateral_m", *_LATERAL_RANGE)
    if len(set(lateral)) < len(lateral):
        reader.fault(
            "[gages] lateral_m",
            f"{list(lateral)} holds a position twice",
            "each gage needs its own position",
            "gages are named by their position: correct the list",
        )
    width = tire.belt_width if tire else None
    outside = [y for y in lateral if width is not None and abs(y) > 0.6 * width]
    if outside:
        reader.fault(
            "[gages] lateral_m",
            f"{outside} lie outside the belt, which is {width:g} m wide",
            "positions on the belt are allowed, middle = 0",
            "correct the list or belt_width_m",
        )
    rate = reader.number("gages", "rate_hz", *_RATE_RANGE)
    unit = reader.text("gages", "unit")
    if unit and "strain" not in dimensions_of_unit(unit):
        reader.fault(
            "[gages] unit",
            f"{unit!r} is not a unit of strain",
            f"{', '.join(units_of('strain'))} are allowed",
            "name the unit of the strain channels",
        )
    flip = sign("lateral", axes)
    return tuple(flip * y + 0.0 for y in lateral), math.nan if rate is None else rate, unit


def _tolerance(reader: _Reader) -> Tolerance | None:
    if "tolerance" not in reader.document:
        return None
    low, high = _TOLERANCE_RANGE
    values = [
        reader.number("tolerance", key, low, high) for key in ("load", "pressure", "speed", "gain")
    ]
    known = [value for value in values if value is not None]
    return Tolerance(*known) if len(known) == 4 else None


def _check_keys(reader: _Reader) -> None:
    """Warn of unknown keys: most are misspelt."""
    for table, known in _KNOWN.items():
        values = reader.table(table) if table else reader.document
        for key in values:
            if key not in known:
                where = f"[{table}] {key}" if table else key
                reader.problems.append(
                    CampaignFault(
                        f"{FILE}, {where}",
                        "the key is unknown and is ignored",
                        f"known keys are {', '.join(sorted(known))}",
                        "correct its spelling or remove it",
                        "warning",
                    )
                )


def header_document(header: CampaignHeader) -> dict[str, Any]:
    """Return the TOML document of a header, in its own axes; the inverse of `parse_header`."""
    tire = {
        "name": header.tire.name,
        "free_radius_m": header.tire.free_radius,
        "ring_radius_m": header.tire.ring_radius,
        "tread_thickness_m": header.tire.tread_thickness,
        "belt_width_m": header.tire.belt_width,
        "innerliner_offset_m": header.tire.innerliner_offset,
    }
    document: dict[str, Any] = {
        "format": FORMAT,
        "name": header.name,
        "axes": header.axes,
        "tire": {key: value for key, value in tire.items() if value is not None},
    }
    if header.gage_lateral:
        flip = sign("lateral", header.axes)
        document["gages"] = {
            "lateral_m": [flip * y + 0.0 for y in header.gage_lateral],
            "rate_hz": header.rate,
            "unit": header.strain_unit,
        }
    if header.tolerance is not None:
        spread = header.tolerance
        document["tolerance"] = {
            "load": spread.load,
            "pressure": spread.pressure,
            "speed": spread.speed,
            "gain": spread.gain,
        }
    if header.rig_name or header.rig_note:
        document["rig"] = {"name": header.rig_name, "note": header.rig_note}
    return document
