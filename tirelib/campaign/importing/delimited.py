"""Text tables such as CSV: separator, decimal sign and header lines are detected and reported.

An ambiguous layout is refused; the table ``[csv]`` of the map then states it.
"""

import csv
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from io import StringIO
from pathlib import Path

import numpy as np

from tirelib.campaign.importing.columns import (
    TEXT_TABLE,
    Column,
    FloatArray,
    Table,
    refusal,
)
from tirelib.core.units import dimensions_of_unit

SEPARATORS = {";": "';'", "\t": "tab", ",": "','", "|": "'|'", " ": "blanks"}
"""Separators that are looked for, with their names in messages. A blank stands for any number."""

_NUMBER = {
    ".": re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?"),
    ",": re.compile(r"[+-]?(\d+(,\d+)?|,\d+)([eE][+-]?\d+)?"),  # no "1,": a comma too many
}
_MISSING = ("", "nan", "NaN", "NAN", "NA", "N/A", "n/a", "null", "NULL", "#N/A", "-nan")
_SAMPLE = 200
_UNIT_IN_NAME = re.compile(r".*\S\s*[\[(](?P<unit>[^\[\]()]+)[\])]")


@dataclass(frozen=True, slots=True)
class CsvOptions:
    """What the map states of text tables; the rest is detected.

    Attributes
    ----------
    separator : str or None
    decimal : str or None
        Point or comma.
    names_line, units_line : int or None
        Lines, counted from 1, with the names and the units of the columns.
    text_is_missing : bool
        Text in a column that holds numbers too is a missing number.
    """

    separator: str | None = None
    decimal: str | None = None
    names_line: int | None = None
    units_line: int | None = None
    text_is_missing: bool = False


@dataclass(frozen=True, slots=True)
class _Layout:
    separator: str
    decimal: str
    count: int
    numeric: tuple[bool, ...]

    @property
    def share(self) -> float:
        return sum(self.numeric) / self.count

    def __str__(self) -> str:
        return f"separator {SEPARATORS.get(self.separator, repr(self.separator))}, decimal " + repr(
            self.decimal
        )


def read_delimited(path: Path, options: CsvOptions) -> Table:
    """Read a text table.

    Raises
    ------
    FormatError
        If no table of numbers is found, two layouts fit alike, or rows are incomplete.
    """
    text, encoding = _decoded(path)
    lines = text.splitlines()
    layout = _layout(str(path), lines, options)
    first = _first_row(str(path), lines, layout, options)
    names_at, units_at = _heading(str(path), lines, first, layout, options)
    names = _split(lines[names_at], layout.separator)
    units = _split(lines[units_at], layout.separator) if units_at is not None else []
    body = [(number, line) for number, line in enumerate(lines[first:], first + 1) if line.strip()]
    _check_counts(str(path), body, layout)
    columns, left_out, found = _columns(names, units, body, layout, options.text_is_missing)
    note = f"read as text table: {layout}, names in line {names_at + 1}"
    note += f", units in line {units_at + 1}" if units_at is not None else ""
    note += f", {len(body)} rows from line {first + 1}"
    note += f", encoding {encoding}" if encoding != "utf-8" else ""
    numbers = np.array([number for number, _ in body])
    return Table(str(path), TEXT_TABLE, columns, left_out, (note, *found), numbers)


def _decoded(path: Path) -> tuple[str, str]:
    content = path.read_bytes()
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        encodings = ["utf-16"]
    elif b"\0" in content:
        encodings = []
    else:
        encodings = ["utf-8-sig", "cp1252"]
    for encoding in encodings:
        try:
            return content.decode(encoding), encoding.removesuffix("-sig")
        except UnicodeDecodeError:
            continue
    raise refusal(
        str(path),
        "not a text file (it holds bytes that are no characters)",
        "a text table in UTF-8 is needed",
        "name the file by its format (.mat, .parquet, .mf4, ...), or export it again",
    )


def _split(line: str, separator: str) -> list[str]:
    if separator == " ":
        cells = line.split()
    elif '"' in line:
        cells = next(csv.reader([line], delimiter=separator, skipinitialspace=True))
    else:
        cells = line.split(separator)
    return [cell.strip() for cell in cells]


def _is_number(cell: str, decimal: str) -> bool:
    return _NUMBER[decimal].fullmatch(cell) is not None


def _layout(file: str, lines: Sequence[str], options: CsvOptions) -> _Layout:
    """Return the layout in which the largest share of the columns are numbers."""
    filled = [line for line in lines if line.strip()]
    if len(filled) < 2:
        raise refusal(
            file,
            f"{len(filled)} line(s) with text",
            "a line of names and rows of numbers are needed",
            "export it again",
        )
    # the last line may be cut off, the first ones are a heading
    sample = filled[max(1, 2 * len(filled) // 3, len(filled) - _SAMPLE) : -1] or filled[-1:]
    separators = [options.separator] if options.separator else list(SEPARATORS)
    decimals = [options.decimal] if options.decimal else [".", ","]
    found = [
        layout
        for separator in separators
        for decimal in decimals
        if separator != decimal and (layout := _tried(sample, separator, decimal)) is not None
    ]
    best = [item for item in found if item.share == max(other.share for other in found)]
    by_separator: dict[str, _Layout] = {}
    for item in best:
        by_separator.setdefault(item.separator, item)  # without any decimals: the point
    if len(by_separator) > 1:
        by_separator.pop(" ", None)
    if len(by_separator) == 1:
        return next(iter(by_separator.values()))
    given = (
        "no table of numbers is found"
        if not best
        else f"it reads equally well with {' or with '.join(map(str, by_separator.values()))}"
    )
    raise refusal(
        file,
        given,
        f"columns separated by {', '.join(SEPARATORS.values())} with decimal '.' or ','",
        "state separator and decimal in [csv] of the map, or export it again",
    )


def _tried(sample: Sequence[str], separator: str, decimal: str) -> _Layout | None:
    rows = [_split(line, separator) for line in sample]
    count = Counter(map(len, rows)).most_common(1)[0][0]
    rows = [row for row in rows if len(row) == count]
    numeric = tuple(
        all(cell in _MISSING or _is_number(cell, decimal) for cell in column)
        and any(_is_number(cell, decimal) for cell in column)
        for column in zip(*rows, strict=True)
    )
    if count < 2 or not any(numeric):
        return None
    return _Layout(separator, decimal, count, numeric)


def _first_row(file: str, lines: Sequence[str], layout: _Layout, options: CsvOptions) -> int:
    """Return the index of the first line of numbers."""
    stated = max(options.names_line or 0, options.units_line or 0)
    for index, line in enumerate(lines):
        cells = _split(line, layout.separator)
        if index < stated or len(cells) != layout.count:
            continue
        looked_at = [c for c, numeric in zip(cells, layout.numeric, strict=True) if numeric]
        numbers = [_is_number(cell, layout.decimal) for cell in looked_at]
        if any(numbers) and all(
            number or cell in _MISSING for number, cell in zip(numbers, looked_at, strict=True)
        ):
            return index
    raise refusal(
        file,
        f"no row of numbers ({layout})",
        f"rows of {layout.count} cells are needed",
        "check names_line and units_line in [csv] of the map",
    )


def _heading(
    file: str, lines: Sequence[str], first: int, layout: _Layout, options: CsvOptions
) -> tuple[int, int | None]:
    """Return the indices of the lines with names and, if there is one, with units."""
    if options.names_line is not None:
        units = None if options.units_line is None else options.units_line - 1
        names = options.names_line - 1
        lengths = {
            key: len(_split(lines[index], layout.separator)) if index < len(lines) else 0
            for key, index in (("names_line", names), ("units_line", units))
            if index is not None
        }
        wrong = [f"{key} has {n} cells" for key, n in lengths.items() if n != layout.count]
        if wrong:
            raise refusal(
                file,
                f"{', '.join(wrong)} ({layout})",
                f"{layout.count} are needed, as the rows have",
                "correct [csv] of the map",
            )
        return names, units
    above = [i for i in range(first) if lines[i].strip()][-2:]
    fits = [i for i in above if len(_split(lines[i], layout.separator)) == layout.count]
    if above and above[-1] not in fits:
        fits = []
    if not fits:
        raise refusal(
            file,
            f"no line with {layout.count} names above the numbers in line {first + 1} ({layout})",
            "a name for each column is needed",
            "write it in, or state separator, decimal and names_line in [csv] of the map",
        )
    if len(fits) == 2:
        cells = [_bare(cell) for cell in _split(lines[fits[1]], layout.separator)]
        if any(dimensions_of_unit(cell) for cell in cells):
            return fits[0], fits[1]
    return fits[-1], None


def _bare(unit: str) -> str:
    """Return a unit without the brackets around it."""
    return unit.strip().strip("[]()").strip()


def _check_counts(file: str, body: Sequence[tuple[int, str]], layout: _Layout) -> None:
    """Refuse rows with more or fewer cells than the others, such as a last one cut off."""
    counts = [
        (number, len(line.split()) if layout.separator == " " else line.count(layout.separator) + 1)
        for number, line in body
    ]
    wrong = [
        (number, count)
        for (number, count), (_, line) in zip(counts, body, strict=True)
        if count != layout.count and len(_split(line, layout.separator)) != layout.count
    ]
    if not wrong:
        return
    shown = ", ".join(f"line {number} has {count}" for number, count in wrong[:3])
    more = f" and {len(wrong) - 3} more" if len(wrong) > 3 else ""
    cut = wrong[-1][0] == body[-1][0] and wrong[-1][1] < layout.count
    raise refusal(
        file,
        f"{shown}{more}" + (": the file is truncated in its last line" if cut else ""),
        f"every row needs {layout.count} cells ({layout})",
        "export it again, or correct these lines",
    )


def _columns(
    names: Sequence[str],
    units: Sequence[str],
    body: Sequence[tuple[int, str]],
    layout: _Layout,
    text_is_missing: bool,
) -> tuple[dict[str, Column], dict[str, str], list[str]]:
    """Return the columns of numbers, the reasons for the others, and the treatment of text."""
    import pandas as pd

    frame = pd.read_csv(
        StringIO("\n".join(line for _, line in body)),
        sep=r"\s+" if layout.separator == " " else layout.separator,
        decimal=layout.decimal,
        header=None,
        names=list(range(len(names))),
        index_col=False,
        skipinitialspace=True,
        na_values=list(_MISSING),
        low_memory=False,
    )
    columns: dict[str, Column] = {}
    left_out: dict[str, str] = {}
    notes: list[str] = []
    for place, name in enumerate(names):
        series = frame[place]
        if not name and series.isna().all():  # every line ends in a separator
            continue
        if name in columns or name in left_out:
            columns.pop(name, None)
            left_out[name] = "several columns have this name"
        elif series.dtype.kind in "biuf":
            stated = _bare(units[place]) if units else _unit_in(name)
            columns[name] = Column(name, series.to_numpy(np.float64), stated)
        else:
            cells = [str(cell).strip() for cell in series]
            values = _numbers(cells, layout.decimal)
            said = _text_at([number for number, _ in body], cells, layout.decimal)
            if text_is_missing and np.isfinite(values).any():
                stated = _bare(units[place]) if units else _unit_in(name)
                columns[name] = Column(name, values, stated)
                notes.append(f'text = "missing": column {name!r}: {said}')
            else:
                left_out[name] = said + (
                    '; text = "missing" in the map makes it a missing number'
                    if np.isfinite(values).any()
                    else ""
                )
    return columns, left_out, notes


def _numbers(cells: Sequence[str], decimal: str) -> FloatArray:
    """Return the numbers of a column's cells, NaN for missing ones and for text."""
    return np.array(
        [float(c.replace(decimal, ".")) if _is_number(c, decimal) else np.nan for c in cells]
    )


def _unit_in(name: str) -> str:
    """Return the unit that stands in brackets behind a name, if it is one."""
    match = _UNIT_IN_NAME.fullmatch(name)
    return match["unit"].strip() if match and dimensions_of_unit(match["unit"]) else ""


def _text_at(lines: Sequence[int], cells: Sequence[str], decimal: str) -> str:
    """Return which line holds the first text, and how many do."""
    texts = [
        (line, cell)
        for line, cell in zip(lines, cells, strict=True)
        if cell not in _MISSING and not _is_number(cell, decimal)
    ]
    if not texts:
        return "its cells are no numbers"
    line, cell = texts[0]
    count = f" ({len(texts)} such lines in all)" if len(texts) > 1 else ""
    return f"line {line} holds {cell!r}, which is no number with decimal {decimal!r}{count}"
