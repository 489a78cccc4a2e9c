"""TYDEX 1.3, the tire data exchange format: reader and writer.

A text file of blocks, each opened by a keyword line ``**NAME``. Entries stand in fixed columns:
name 10 characters, comment 30, unit 10, then values of 10 characters each; a measured channel has
three of these, factor f, offset of the recorded value a and offset of the physical value b,

    physical = f (recorded + a) + b

in which an empty factor is 1 and an empty offset 0. A line that begins with ``!`` is a comment.

Known difference: other blocks (as ``**MODELPARAMETERS``) are skipped and named in `skipped`.
The order of a and f above is the one that their names imply; it matters only where a is not 0.
"""

import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import numpy.typing as npt

from tirelib.core.errors import FormatError, ParameterError, ShapeError

FloatArray = npt.NDArray[np.float64]

RELEASE = "1.3"
_WIDTH = 10
_NAME, _COMMENT, _UNIT, _VALUE = slice(0, 10), slice(10, 40), slice(40, 50), slice(50, None)
_READ = ("HEADER", "COMMENTS", "CONSTANTS", "MEASURCHANNELS", "MEASURDATA", "END")


@dataclass(frozen=True, slots=True)
class TydexEntry:
    """A line of **HEADER or **CONSTANTS: name, comment, unit and value as text."""

    name: str
    comment: str = ""
    unit: str = ""
    value: str = ""

    def number(self) -> float | None:
        """Return the value as a number, None when it is text."""
        try:
            value = float(self.value)
        except ValueError:
            return None
        return value if math.isfinite(value) else None


@dataclass(frozen=True, slots=True)
class TydexChannel:
    """A line of **MEASURCHANNELS; see the module for the formula."""

    name: str
    comment: str = ""
    unit: str = ""
    factor: float = 1.0
    recorded_offset: float = 0.0
    physical_offset: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class TydexFile:
    """A TYDEX file.

    Attributes
    ----------
    header, constants : tuple of TydexEntry
    comments : tuple of str
    channels : tuple of TydexChannel
    recorded : array, shape (n_rows, n_channels)
        As **MEASURDATA has them; NaN for an empty cell. See `physical`.
    skipped : tuple of str
        Keywords of the blocks that were not read.
    """

    channels: tuple[TydexChannel, ...]
    recorded: FloatArray
    header: tuple[TydexEntry, ...] = (TydexEntry("RELEASE", "Release of TYDEX-Format", "", "1.3"),)
    comments: tuple[str, ...] = ()
    constants: tuple[TydexEntry, ...] = ()
    skipped: tuple[str, ...] = ()

    def physical(self) -> FloatArray:
        """Return the physical values in the units of the channels, shape (n_rows, n_channels)."""
        factor = np.array([channel.factor for channel in self.channels])
        before = np.array([channel.recorded_offset for channel in self.channels])
        after = np.array([channel.physical_offset for channel in self.channels])
        return np.asarray(factor * (self.recorded + before) + after, np.float64)


@dataclass(slots=True)
class _Parsed:
    faults: list[str] = field(default_factory=list)

    def fault(self, line: int, given: str, allowed: str, remedy: str) -> None:
        where = f"line {line}: " if line else ""
        self.faults.append(f"{where}{given}; {allowed}; {remedy}")


def read_tydex(path: str | Path) -> TydexFile:
    """Read a TYDEX file.

    Raises
    ------
    FormatError
        With every fault: a missing block, no ``**END`` (truncated), entries that are not in
        their columns, rows with too few or too many values.
    OSError
        If the file cannot be read.
    """
    lines = Path(path).read_text(encoding="latin-1").splitlines()
    parsed = _Parsed()
    blocks = _blocks(lines, parsed)
    channels = _channels(blocks.get("MEASURCHANNELS", []), parsed)
    recorded = _data(blocks.get("MEASURDATA", []), channels, parsed)
    if parsed.faults:
        raise FormatError([f"{path}: {fault}" for fault in parsed.faults])
    return TydexFile(
        channels=channels,
        recorded=recorded,
        header=tuple(_entry(line) for _, line in blocks.get("HEADER", [])),
        comments=tuple(line for _, line in blocks.get("COMMENTS", [])),
        constants=tuple(_entry(line) for _, line in blocks.get("CONSTANTS", [])),
        skipped=tuple(name for name in blocks if name not in _READ),
    )


def _blocks(lines: list[str], parsed: _Parsed) -> dict[str, list[tuple[int, str]]]:
    """Return the lines of each block with their numbers, without comments and empty lines."""
    blocks: dict[str, list[tuple[int, str]]] = {}
    current: list[tuple[int, str]] | None = None
    for number, line in enumerate(lines, start=1):
        if line.startswith("**"):
            name = line[2:].strip().upper()
            if name in blocks and name != "END":
                parsed.fault(
                    number,
                    f"**{name} occurs again",
                    "each block may occur once",
                    "merge the blocks",
                )
            current = blocks.setdefault(name, [])
            if name == "END":
                break
        elif current is not None and line.strip() and not line.startswith("!"):
            current.append((number, line.rstrip()))
    if not blocks:
        parsed.fault(
            0,
            "not a TYDEX file (no line begins with **)",
            "blocks such as **HEADER are needed",
            "name the file by its format, or export it again",
        )
        return blocks
    for name in ("MEASURCHANNELS", "MEASURDATA"):
        if name not in blocks:
            parsed.fault(
                0, f"**{name} is missing", "channels and data are needed", "export it again"
            )
    if "END" not in blocks:
        parsed.fault(
            0,
            "**END is missing: the file is truncated",
            "a complete file is needed",
            "copy it again",
        )
    return blocks


def _entry(line: str) -> TydexEntry:
    return TydexEntry(
        line[_NAME].strip(), line[_COMMENT].strip(), line[_UNIT].strip(), line[_VALUE].strip()
    )


def _channels(lines: list[tuple[int, str]], parsed: _Parsed) -> tuple[TydexChannel, ...]:
    channels: list[TydexChannel] = []
    for number, line in lines:
        cells = [line[start : start + _WIDTH].strip() for start in (50, 60, 70)]
        values = [
            default if not cell else _number(cell)
            for cell, default in zip(cells, (1.0, 0.0, 0.0), strict=True)
        ]
        numbers = [value for value in values if value is not None]
        straddles = len(line) > 50 and not {" "} & {line[49], line[50]}
        if len(numbers) < 3 or not line[_NAME].strip() or "\t" in line or straddles:
            parsed.fault(
                number,
                f"the channel {line[_NAME].strip()!r} has {' '.join(cells)!r} from column 51 on",
                "name, comment, unit, factor and two offsets stand in columns of 10, 30, 10, 10, "
                "10 and 10 characters, without tabs",
                "correct the line",
            )
            numbers = [1.0, 0.0, 0.0]
        entry = _entry(line)
        if any(channel.name == entry.name for channel in channels):
            parsed.fault(
                number,
                f"channel {entry.name} occurs again",
                "each name may occur once",
                "rename one",
            )
        channels.append(TydexChannel(entry.name, entry.comment, entry.unit, *numbers))
    return tuple(channels)


def _number(cell: str) -> float | None:
    try:
        value = float(cell)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _data(
    lines: list[tuple[int, str]], channels: tuple[TydexChannel, ...], parsed: _Parsed
) -> FloatArray:
    rows: list[list[float]] = []
    for number, line in lines if channels else ():
        row = _row(line, len(channels))
        if row is not None:
            rows.append(row)
            continue
        cells = line.split()
        comma = " (decimal commas?)" if "," in line else ""
        parsed.fault(
            number,
            f"{len(cells)} values that are no row of {len(channels)} numbers{comma}",
            f"a value for each of the {len(channels)} channels, 10 characters wide or separated "
            "by blanks, with a decimal point",
            "export it again",
        )
        if len(parsed.faults) > 20:
            break
    return np.array(rows, dtype=np.float64).reshape(len(rows), len(channels))


def _row(line: str, count: int) -> list[float] | None:
    """Return the numbers of a line: in fixed columns if they fit, else separated by blanks."""
    if len(line) <= _WIDTH * count and "\t" not in line:
        fixed = [_cell(line[start : start + _WIDTH]) for start in range(0, _WIDTH * count, _WIDTH)]
        numbers = [value for value in fixed if value is not None]
        if len(numbers) == count and _WIDTH * (count - 1) < len(line):
            return numbers
    free = [_number(cell) for cell in line.split()]
    numbers = [value for value in free if value is not None]
    return numbers if len(numbers) == len(free) == count else None


def _cell(cell: str) -> float | None:
    """Return the number in a fixed column, NaN for an empty one."""
    return _number(cell) if cell.strip() else math.nan


def write_tydex(path: str | Path, content: TydexFile) -> None:
    """Write a TYDEX 1.3 file.

    A value gets 9 characters and a blank before it: within ``5e-7 max(1, |x|)`` of the recorded
    value for ``|x| < 1e8``. Who needs more writes Parquet.

    Raises
    ------
    ParameterError
        If a name, comment or unit is too long for its columns or a number is not finite.
    ShapeError
        If the data have not one column for each channel.
    """
    recorded = np.asarray(content.recorded, np.float64)
    if recorded.ndim != 2 or recorded.shape[1] != len(content.channels):
        raise ShapeError(
            f"recorded has shape {recorded.shape}; (n_rows, {len(content.channels)}) is needed, a "
            "column for each channel; correct one of them"
        )
    if not np.isfinite(recorded).all():
        raise ParameterError(
            "recorded holds NaN or infinity; TYDEX knows finite numbers only; drop these rows"
        )
    lines = ["**HEADER", *(_line(entry) for entry in content.header)]
    lines += ["**COMMENTS", *(_text(comment, 80, "comment") for comment in content.comments)]
    lines += ["**CONSTANTS", *(_line(entry) for entry in content.constants)]
    lines += ["**MEASURCHANNELS", *(_channel_line(channel) for channel in content.channels)]
    lines += ["**MEASURDATA"]
    lines += ["".join(f"{_short(value):>10}" for value in row) for row in recorded.tolist()]
    Path(path).write_text("\n".join([*lines, "**END", ""]), encoding="latin-1")


def _line(entry: TydexEntry | TydexChannel) -> str:
    name = _text(entry.name, _WIDTH, "name")
    if not name.strip() or name.startswith(("!", "*")):
        raise ParameterError(
            f"name {name!r} is given; 1 to 10 characters, not beginning with ! or *, are needed; "
            "choose one"
        )
    comment = _text(entry.comment, 30, "comment")
    start = f"{name:<10}{comment:<30}{_text(entry.unit, _WIDTH, 'unit'):<10}"
    return start + (entry.value if isinstance(entry, TydexEntry) else "")


def _channel_line(channel: TydexChannel) -> str:
    numbers = (channel.factor, channel.recorded_offset, channel.physical_offset)
    if not all(map(math.isfinite, numbers)):
        raise ParameterError(
            f"channel {channel.name} has {numbers}; finite numbers are needed; correct them"
        )
    return _line(channel) + "".join(f"{_short(value):>10}" for value in numbers)


def _text(text: str, width: int, what: str) -> str:
    if len(text) > width or not text.isprintable() or not all(ord(c) < 256 for c in text):
        raise ParameterError(
            f"{what} {text!r} does not fit; at most {width} printable Latin-1 characters are "
            "allowed; shorten it"
        )
    return text


def _short(value: float) -> str:
    """Return a number with as many digits as 9 characters hold."""
    for digits in range(17, 0, -1):
        plain, power = f"{value:.{digits}g}", f"{value:.{digits - 1}e}"
        mantissa, _, exponent = power.partition("e")
        for text in (plain, f"{mantissa}e{int(exponent)}"):
            if len(text) <= _WIDTH - 1:
                return text
    raise ParameterError(
        f"{value!r} does not fit in 9 characters; smaller numbers are needed; "
        "use the factor of the channel"
    )
