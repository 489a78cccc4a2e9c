"""Tire files: TOML, one table per number (``tirelib-tire/1``, also inside ``tirelib-model/1``)."""

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from pathlib import Path
from types import MappingProxyType
from typing import Any

from tirelib.core.documents import stamped
from tirelib.core.errors import FormatError, ParameterError, UnitError
from tirelib.core.parameters.tire import (
    FIELDS,
    NUMBERS,
    Tire,
    radii_fault,
    range_fault,
    unknown_name,
)
from tirelib.core.units import from_si, to_si

FORMAT = "tirelib-tire/1"
FORMATS = (FORMAT, "tirelib-model/1")
KINDS = ("measured", "fitted", "literature", "assumed")
REQUIRED = (
    "ring_radius",
    "free_radius",
    "belt_width",
    "tread_thickness",
    "innerliner_offset",
    "bending_stiffness",
    "mass",
    "pressure",
    "radial_stiffness",
    "tangential_stiffness",
    "tread_stiffness",
)

BRUSH_NEEDS = ("bristle_lateral", "friction")
"""Without these a file states no brush."""
_RING = tuple(name for name in REQUIRED if FIELDS[name].group in ("belt", "sidewall", "tread"))
"""A file that states one of these states a ring."""
_GROUPS = tuple(dict.fromkeys(entry.group for entry in NUMBERS.values()))


@dataclass(frozen=True, slots=True)
class Number:
    """One number of a tire file.

    Attributes
    ----------
    value, std : float
        In SI; std is NaN where it is unknown.
    kind : str
        measured, fitted, literature or assumed.
    source : str
    notes : mapping
        Further entries of the table, kept (interval, flags).
    """

    value: float
    std: float
    kind: str
    source: str
    notes: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class TireFile:
    """A tire with what is known about each of its numbers.

    A file may state a ring, a brush, or both.

    Attributes
    ----------
    name : str
    numbers : mapping of str to Number
        Only the parameters that the file states; the others have the defaults of `Tire`.
    extra : mapping
        Other top-level tables of the file (provenance, effects, history), as read.
    """

    name: str
    numbers: Mapping[str, Number]
    extra: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}))

    @property
    def missing(self) -> tuple[str, ...]:
        """Names of the numbers that a ring needs and the file does not state."""
        return tuple(name for name in REQUIRED if name not in self.numbers)

    @property
    def tire(self) -> Tire:
        """The values alone, as the ring needs them.

        Raises
        ------
        ParameterError
            If numbers of the ring are missing; with their names.
        """
        if self.missing:
            names = ", ".join(f"[{FIELDS[name].group}.{name}]" for name in self.missing)
            raise ParameterError(
                f"{self.name}: the file states no complete ring, {names} missing; identify the "
                "tire from a campaign with strain in straight runs, or add these numbers"
            )
        return Tire(**{k: number.value for k, number in self.numbers.items() if k in FIELDS})


def models_folder() -> Path:
    """Return the folder of the models that come with the library."""
    inside = Path(__file__).parents[2] / "models"
    return inside if inside.is_dir() else Path(__file__).parents[3] / "models"


def find_tire(name: str | Path) -> Path:
    """Return the file for a path, or for the name of a tire that comes with the library.

    Raises
    ------
    ParameterError
        If there is neither.
    """
    path = Path(name)
    if path.is_file():
        return path
    shipped = {
        file.stem: file
        for folder in (models_folder() / "tires", models_folder())
        for file in sorted(folder.glob("*.toml"))
    }
    if str(name) in shipped:
        return shipped[str(name)]
    near = get_close_matches(str(name), shipped, n=2)
    hint = f"did you mean {' or '.join(near)}?" if near else f"known: {', '.join(shipped)}"
    raise ParameterError(f"model {str(name)!r}: no such file and no tire of that name; {hint}")


def read_tire(name: str | Path) -> TireFile:
    """Read a tire (or the tire of a model) by path or name.

    Raises
    ------
    ParameterError
        If there is no such file.
    FormatError
        With every fault of the file.
    """
    path = find_tire(name)
    try:
        document = tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise FormatError(f"{path}: is not TOML ({error}); mend that line") from None
    if document.get("format") not in FORMATS:
        raise FormatError(
            f"{path}: format = {document.get('format')!r}; allowed are "
            f"{' and '.join(map(repr, FORMATS))}; give a tire or model file"
        )
    numbers, faults = _numbers(document)
    if not faults and all(key in numbers for key in REQUIRED):
        fault = radii_fault(numbers["ring_radius"].value, numbers["free_radius"].value)
        faults += [] if fault is None else [fault]
    if faults:
        raise FormatError([f"{path}: {fault}" for fault in faults])
    extra = {k: v for k, v in document.items() if k not in {*_GROUPS, "format", "tirelib", "name"}}
    return TireFile(str(document.get("name", path.stem)), numbers, extra)


def _numbers(document: Mapping[str, Any]) -> tuple[dict[str, Number], list[str]]:
    """Return the numbers of a document and every fault."""
    numbers: dict[str, Number] = {}
    faults: list[str] = []
    for name in document:
        near = get_close_matches(name, _GROUPS, n=1, cutoff=0.75)
        if name in NUMBERS:
            faults.append(
                f"{name} is at the top level of the file; move it to [{NUMBERS[name].group}]"
            )
        elif near and name not in _GROUPS:
            faults.append(f"[{name}] is not a table of a tire file; did you mean [{near[0]}]?")
    for group in _GROUPS:
        table = document.get(group, {})
        if not isinstance(table, dict):
            faults.append(f"[{group}] is not a table; write [{group}.name] with value and unit")
            continue
        for name, entry in table.items():
            if name not in NUMBERS or NUMBERS[name].group != group:
                right = (
                    f"stands in [{NUMBERS[name].group}]" if name in NUMBERS else unknown_name(name)
                )
                faults.append(f"[{group}.{name}]: {right}")
                continue
            try:
                numbers[name] = _number(name, entry)
            except (ParameterError, UnitError) as error:
                faults.append(f"[{group}.{name}]: {error}")
    faults += [
        f"[{NUMBERS[name].group}.{name}] is missing ({NUMBERS[name].meaning}); add value and unit"
        for name in REQUIRED
        if name not in _table(document, NUMBERS[name].group) and not _brush_alone(document)
    ]
    faults += [
        f"[brush.{name}] is missing: the half length of the contact goes with it "
        f"({NUMBERS[name].meaning}); add value and unit"
        for name, because in (
            ("reference_load", "load_power"),
            ("reference_pressure", "pressure_power"),
        )
        if because in numbers
        and numbers[because].value != 0.0
        and name not in _table(document, "brush")
    ]
    return numbers, faults


def _brush_alone(document: Mapping[str, Any]) -> bool:
    """Whether a file states a brush and nothing of a ring but geometry."""
    every = {name for group in _GROUPS for name in _table(document, group)}
    return every.issuperset(BRUSH_NEEDS) and every.isdisjoint(_RING)


def _table(document: Mapping[str, Any], group: str) -> Mapping[str, Any]:
    table = document.get(group, {})
    return table if isinstance(table, dict) else {}


def _number(name: str, entry: Any) -> Number:
    if not isinstance(entry, dict) or "value" not in entry or "unit" not in entry:
        raise ParameterError(f"{entry!r} lacks value or unit; write a table with both")
    value, std = entry["value"], entry.get("std", math.nan)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ParameterError(f"value = {value!r} is not a number")
    if isinstance(std, bool) or not isinstance(std, int | float) or std < 0 or math.isinf(std):
        raise ParameterError(f"std = {std!r}; a finite number >= 0 is needed, in the value's unit")
    kind = entry.get("kind", "assumed")
    if kind not in KINDS:
        raise ParameterError(f"kind = {kind!r}; allowed are {', '.join(KINDS)}")
    dimension = NUMBERS[name].dimension
    unit = str(entry["unit"])
    si = to_si(float(value), unit, dimension) if math.isfinite(value) else float(value)
    spread = to_si(float(std), unit, dimension) if math.isfinite(std) else math.nan
    if (fault := range_fault(name, si)) is not None:
        raise ParameterError(fault)
    notes = {k: v for k, v in entry.items() if k not in {"value", "unit", "std", "kind", "source"}}
    return Number(si, spread, kind, str(entry.get("source", "")), notes)


def write_tire(file: TireFile, path: str | Path, file_format: str = FORMAT) -> None:
    """Write a tire, each number in its unit of `NUMBERS`; it reads back to a relative 3e-16."""
    import tomli_w

    document: dict[str, Any] = stamped({"format": file_format, "name": file.name})
    for name, entry in NUMBERS.items():
        number = file.numbers.get(name)
        if number is None:
            continue
        value, std = (from_si(si, entry.unit, entry.dimension) for si in (number.value, number.std))
        table: dict[str, Any] = {"value": value, "unit": entry.unit}
        if math.isfinite(std):
            table["std"] = std
        table |= {"kind": number.kind, "source": number.source, **number.notes}
        document.setdefault(entry.group, {})[name] = table
    document |= file.extra
    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(
        "# A tire of tirelib: one table per number. Signs: u outward, innerliner offset < 0.\n"
        + tomli_w.dumps(document),
        encoding="utf-8",
    )
