"""Tire property files (.tir): reader and writer that lose nothing.

Sections in brackets, ``KEY = value`` lines, comments after ``!`` or ``$``, strings in quotes, empty
values, tables without keys and vendor sections are all kept and written back in order. Values stay
as the file has them; `TirFile.number` converts the keys that have a unit, by [UNITS], to SI.
"""

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

from tirelib.core.errors import FormatError, ParameterError
from tirelib.core.parameters.tir_units import BASES, POWERS, factor, scale_of, words

FIT_TYPES = (5, 6, 52, 60, 61, 62)
"""MF-Tyre 5.0, PAC2002, MF 5.2, 6.0, 6.1, 6.2."""
FORMATS = MappingProxyType({"MF_05": 5, "PAC2002": 6})
"""FITTYP of files that only name their PROPERTY_FILE_FORMAT."""

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?")
_KEY = re.compile(r"[A-Za-z_][A-Za-z0-9_.\-/]*")
_SECTION = re.compile(r"\[([^\[\]]+)\]\s*(?:[!$](.*))?")
_COEFFICIENT = re.compile(r"[PQRS][A-Z]{1,3}\d{1,2}|L[A-Z]{1,6}")
_NO_TEXT = re.compile(r"[\x00-\x08\x0e-\x19\x1b-\x1f]")
"""Control characters beside white space and the end mark of old systems."""

Value = float | str | None


@dataclass(frozen=True, slots=True)
class TirEntry:
    """One ``KEY = value $ comment``; None is an empty value, `quoted` holds for text only."""

    key: str
    value: Value
    comment: str = ""
    quoted: bool = True


@dataclass(frozen=True, slots=True)
class TirLine:
    """A line without an entry: blank, a comment, a table's head or row. It is kept unchanged."""

    text: str


@dataclass(frozen=True, slots=True)
class TirSection:
    """A section in brackets with its lines."""

    name: str
    lines: tuple[TirEntry | TirLine, ...]
    comment: str = ""

    @property
    def entries(self) -> Iterator[TirEntry]:
        """Entries in order."""
        return (line for line in self.lines if isinstance(line, TirEntry))


@dataclass(frozen=True, slots=True)
class TirFile:
    """A tire property file.

    Attributes
    ----------
    sections : tuple of TirSection
    preamble : tuple of TirLine
        Comments above the first section.
    fit_type : int
        5, 6 (PAC2002), 52, 60, 61 or 62.
    factors : mapping
        SI per file unit for length, force, angle, mass, time and pressure. A file without a unit
        of pressure means force per length squared, Pa in metres and newtons.
    where : str
        Name for error messages.
    """

    sections: tuple[TirSection, ...]
    preamble: tuple[TirLine, ...] = ()
    fit_type: int = 61
    factors: Mapping[str, float] = field(default_factory=lambda: dict.fromkeys(BASES, 1.0))
    where: str = field(default="tir", compare=False)

    def get(self, key: str, section: str | None = None) -> Value:
        """Return a value as the file has it; None where it is absent or empty. Case is ignored.

        Without `section`, the first non-empty one counts.
        """
        for part in self.sections:
            if section is not None and part.name.upper() != section.upper():
                continue
            for entry in part.entries:
                if entry.key.upper() == key.upper() and entry.value is not None:
                    return entry.value
        return None

    def places(self, key: str) -> tuple[tuple[str, Value], ...]:
        """Return (section, value) wherever the key is not empty; [UNITS] holds words, not data."""
        return tuple(
            (part.name, entry.value)
            for part in self.sections
            if part.name.upper() != "UNITS"
            for entry in part.entries
            if entry.key.upper() == key.upper() and entry.value is not None
        )

    def number(self, key: str) -> float | None:
        """Return a number in SI, None where it is absent or empty.

        Raises
        ------
        ParameterError
            If the value is text, or several sections have different ones.
        """
        found = self.places(key)
        if not found:
            return None
        value = found[0][1]
        for section, other in found[1:]:
            if other != value:
                raise ParameterError(
                    f"{key} = {value!r} in [{found[0][0]}] but {other!r} in [{section}]; one value "
                    "is needed; remove the other"
                )
        if isinstance(value, str):
            raise ParameterError(f"{key} = {value!r} is text; a number is needed; correct the file")
        return None if value is None else value * scale_of(key.upper(), self.factors)


def read_tir(path: str | Path) -> TirFile:
    """Read a .tir file; result and errors as `parse_tir`, and an error if it cannot be read."""
    try:
        data = Path(path).read_bytes()
    except OSError as error:
        raise FormatError(
            f"{path}: cannot be read ({error.strerror}); give the path of a .tir file"
        ) from None
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")  # comments of older exporters
    return parse_tir(text, where=str(path))


def parse_tir(text: str, where: str = "tir") -> TirFile:
    """Parse the text of a .tir file.

    Parameters
    ----------
    text : str
    where : str
        Name for error messages.

    Raises
    ------
    FormatError
        With every fault: lines that are neither entry, comment nor table, keys twice in a section,
        unknown or missing units, text where a number is needed, an unknown FITTYP. What is no
        text, or has no section at all, is one fault.

    Examples
    --------
    >>> units = ["LENGTH='mm'", "FORCE='kN'", "ANGLE='deg'", "MASS='kg'", "TIME='s'"]
    >>> text = chr(10).join(["[UNITS]", *units, "[MODEL]", "FITTYP=61", "[VERTICAL]", "FNOMIN=4.5"])
    >>> tire = parse_tir(text)
    >>> tire.fit_type, tire.number("FNOMIN")
    (61, 4500.0)
    """
    problems: list[str] = []
    if _NO_TEXT.search(text):
        raise FormatError(
            f"{where}: control characters, as in binary data or UTF-16; a .tir file is text in "
            "UTF-8 or latin-1; convert it or give another file"
        )
    preamble, sections = _structure(text, problems)
    if not sections:
        raise FormatError(
            f"{where}: no [SECTION] in {len(text.splitlines())} lines; this is not a .tir file; "
            "give another one"
        )
    factors = _factors(sections, problems)
    _check_values(sections, problems)
    fit_type = _fit_type(TirFile(tuple(sections)), problems)
    if problems:
        raise FormatError([f"{where}: {problem}" for problem in problems])
    return TirFile(tuple(sections), tuple(preamble), fit_type, MappingProxyType(factors), where)


def write_tir(tire: TirFile, path: str | Path) -> None:
    """Write a .tir file; reading it gives the same file again."""
    Path(path).write_text(format_tir(tire), encoding="utf-8", newline="\n")


def format_tir(tire: TirFile) -> str:
    """Return the text of a .tir file.

    Raises
    ------
    ParameterError
        If a number is not finite or a text cannot stand in a .tir file.
    """
    lines = [line.text for line in tire.preamble]
    for section in tire.sections:
        lines.append(f"[{section.name}]" + (f" ${section.comment}" if section.comment else ""))
        for line in section.lines:
            lines.append(line.text if isinstance(line, TirLine) else _format_entry(line))
    return "\n".join(lines) + "\n"


def _format_entry(entry: TirEntry) -> str:
    value = entry.value
    if value is None:
        text = ""
    elif isinstance(value, str):
        text = _format_text(entry, value)
    elif math.isfinite(value):
        whole = value.is_integer() and abs(value) < 1e15 and math.copysign(1.0, value) > 0.0
        text = str(int(value)) if whole else repr(value)
    else:
        raise ParameterError(f"{entry.key} = {value}; a .tir file holds finite numbers only")
    line = f"{entry.key:<24} = {text}"
    return f"{line:<44} ${entry.comment}" if entry.comment else line.rstrip()


def _format_text(entry: TirEntry, value: str) -> str:
    if not entry.quoted:
        return value
    for quote in "'\"":
        if quote not in value and value.isprintable():
            return f"{quote}{value}{quote}"
    raise ParameterError(
        f"{entry.key} = {value!r} has both quotes or a control character; a .tir file holds neither"
    )


def _structure(text: str, problems: list[str]) -> tuple[list[TirLine], list[TirSection]]:
    """Split the text into sections."""
    preamble: list[TirLine] = []
    heads: list[tuple[str, str]] = []
    bodies: list[list[TirEntry | TirLine]] = []
    for number, raw in enumerate(re.split(r"\r\n|\r|\n", text.rstrip("\r\n")), start=1):
        line = raw.strip()
        head = _SECTION.fullmatch(line)
        if head:
            heads.append((head[1].strip(), (head[2] or "").rstrip()))
            bodies.append([])
        elif not line or line[0] in "!$":
            (bodies[-1] if bodies else preamble).append(TirLine(raw))
        elif not bodies:
            problems.append(f"line {number}: {line!r} stands before the first [SECTION]; move it")
        elif "=" in line.split("!")[0].split("$")[0]:
            entry = _entry(line, number, problems)
            if entry:
                bodies[-1].append(entry)
        elif line[0] == "{" or _is_row(line):
            bodies[-1].append(TirLine(raw))
        else:
            problems.append(
                f"line {number}: {line!r} is not a KEY = value, a comment, a [SECTION] or a table "
                "row; correct it or make it a comment with !"
            )
    sections = [
        TirSection(name, tuple(body), comment)
        for (name, comment), body in zip(heads, bodies, strict=True)
    ]
    return preamble, sections


def _entry(line: str, number: int, problems: list[str]) -> TirEntry | None:
    key, rest = (part.strip() for part in line.split("=", 1))
    if not _KEY.fullmatch(key):
        problems.append(f"line {number}: key {key!r} is not a word of letters, digits, _ . - /")
        return None
    quote = rest[:1]
    if quote in ("'", '"'):
        end = rest.find(quote, 1)
        after = rest[end + 1 :].strip()
        if end < 0 or (after and after[0] not in "!$"):
            problems.append(f"line {number}: {key} has text without a closing quote; add {quote}")
            return None
        return TirEntry(key, rest[1:end], after[1:].rstrip(), True)
    found = re.search(r"[!$]", rest)
    bare, comment = (rest[: found.start()], rest[found.end() :]) if found else (rest, "")
    bare = bare.strip()
    if not bare:
        return TirEntry(key, None, comment.rstrip())
    if _NUMBER.fullmatch(bare):
        value = float(bare.lower().replace("d", "e"))
        if math.isfinite(value):
            return TirEntry(key, value, comment.rstrip())
        problems.append(f"line {number}: {key} = {bare} is larger than any number; correct it")
        return None
    return TirEntry(key, bare, comment.rstrip(), False)


def _is_row(line: str) -> bool:
    return all(_NUMBER.fullmatch(word) for word in re.split(r"[!$]", line)[0].split())


def _factors(sections: list[TirSection], problems: list[str]) -> dict[str, float]:
    """Read [UNITS]."""
    given = {
        entry.key.lower(): entry.value
        for section in sections
        if section.name.upper() == "UNITS"
        for entry in section.entries
    }
    factors = dict.fromkeys(BASES, 1.0)
    for base in BASES:
        word = given.get(base)
        if word is None:
            if base != "pressure":
                problems.append(f"[UNITS] has no {base.upper()}; name the file's unit of {base}")
            continue
        found = factor(base, word) if isinstance(word, str) else None
        if found is None:
            problems.append(
                f"[UNITS] {base.upper()} = {word!r} is not known; allowed are "
                f"{', '.join(words(base))}; correct it"
            )
        else:
            factors[base] = found
    if given.get("pressure") is None:
        factors["pressure"] = factors["force"] / factors["length"] ** 2
    return factors


def _check_values(sections: list[TirSection], problems: list[str]) -> None:
    seen: set[tuple[str, str]] = set()
    for section in sections:
        name = section.name.upper()
        for entry in section.entries:
            key = entry.key.upper()
            if (name, key) in seen:
                problems.append(f"[{section.name}] {entry.key} stands twice; remove one")
            seen.add((name, key))
            number = (key in POWERS and name != "UNITS") or (
                name.endswith("_COEFFICIENTS") and _COEFFICIENT.fullmatch(key)
            )
            if number and isinstance(entry.value, str):
                problems.append(
                    f"[{section.name}] {entry.key} = {entry.value!r} is text; it must be a number "
                    "or empty"
                )


def _fit_type(tire: TirFile, problems: list[str]) -> int:
    value = tire.get("FITTYP")
    if value is None:
        value = FORMATS.get(str(tire.get("PROPERTY_FILE_FORMAT")).upper())
    if value in FIT_TYPES and isinstance(value, (int, float)):
        return int(value)
    problems.append(
        f"[MODEL] FITTYP = {value!r}; allowed are {', '.join(map(str, FIT_TYPES))}, or a "
        f"PROPERTY_FILE_FORMAT of {' or '.join(FORMATS)}; name the version of the Magic Formula"
    )
    return 0
