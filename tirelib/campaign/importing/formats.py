"""A file of any known format as a Table. The suffix states the format; the content must agree."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from tirelib.campaign.importing.columns import TEXT_TABLE, Column, Table, refusal
from tirelib.campaign.importing.delimited import CsvOptions, read_delimited
from tirelib.campaign.importing.matlab import (
    HDF5_MAGIC,
    MAGIC,
    MAGIC_73,
    read_mat5,
    read_mat73,
)
from tirelib.campaign.importing.tydex import read_tydex
from tirelib.campaign.mdf import Group, read_mdf
from tirelib.core.errors import FormatError

SUFFIXES = {
    ".mat": "MATLAB",
    ".csv": TEXT_TABLE,
    ".tsv": TEXT_TABLE,
    ".txt": TEXT_TABLE,
    ".dat": TEXT_TABLE,
    ".parquet": "Parquet",
    ".tdx": "TYDEX",
    ".tyd": "TYDEX",
    ".tydex": "TYDEX",
    ".mf4": "MDF 4",
    ".mdf": "MDF 4",
}
"""The format that each suffix states."""

_HEAD = 520


def read_table(path: Path, options: CsvOptions | None = None) -> Table:
    """Read a file by its suffix.

    Parameters
    ----------
    path : Path
    options : CsvOptions, optional
        For text tables.

    Raises
    ------
    FormatError
        With every fault: missing, empty, truncated, of an unknown format, or not of the format
        that its suffix states.
    """
    file = str(path)
    stated = SUFFIXES.get(path.suffix.lower())
    if stated is None:
        raise refusal(
            file,
            f"the suffix {path.suffix!r} states no format",
            f"{', '.join(SUFFIXES)} are allowed",
            "rename the file by its format, or convert it",
        )
    found = _content(path)
    if stated != found and not (stated == TEXT_TABLE and found == "TYDEX"):
        raise refusal(
            file,
            f"its content is {found}, its suffix {path.suffix!r} states {stated}",
            "both must agree",
            "rename the file by its content, or export it again",
        )
    table = (
        _READERS[found](path)
        if found in _READERS
        else read_delimited(path, options or CsvOptions())
    )
    if not any(column.values.size for column in table.columns.values()):
        why = "; ".join(f"{name}: {reason}" for name, reason in list(table.left_out.items())[:1])
        raise refusal(
            file,
            "it holds no column of numbers" + f" ({why})" * bool(why),
            "measured columns are needed",
            "export it again",
        )
    return table


def _content(path: Path) -> str:
    """Return the format that the first bytes show; a text is a table unless it begins a block."""
    try:
        with path.open("rb") as stream:
            head = stream.read(_HEAD)
    except OSError as error:
        raise refusal(
            str(path), f"it cannot be read ({error.strerror})", "a file is needed", "check the path"
        ) from None
    if not head:
        raise refusal(str(path), "the file is empty", "measured data are needed", "export it again")
    if head.startswith((MAGIC, MAGIC_73)):
        return "MATLAB"
    for magic, form in (
        (b"PAR1", "Parquet"),
        (b"MDF     ", "MDF 4"),
        (b"UnFinMF ", "MDF 4"),
        (HDF5_MAGIC, "HDF5 without a MATLAB heading"),
    ):
        if head.startswith(magic):
            return form
    lines = [line for line in head.splitlines() if line.strip() and not line.startswith(b"!")]
    if lines and lines[0].startswith(b"**"):
        return "TYDEX"
    return (
        "no known binary format"
        if b"\0" in head and head[:2] not in (b"\xff\xfe", b"\xfe\xff")
        else TEXT_TABLE
    )


def _matlab(path: Path) -> Table:
    with path.open("rb") as stream:
        return read_mat73(path) if stream.read(_HEAD).startswith(MAGIC_73) else read_mat5(path)


def _parquet(path: Path) -> Table:
    import pyarrow
    import pyarrow.parquet

    try:
        table = pyarrow.parquet.read_table(path)
    except (pyarrow.ArrowException, OSError) as error:
        raise refusal(
            str(path),
            f"truncated or damaged Parquet file of {path.stat().st_size} bytes (reader: "
            f"{str(error).splitlines()[0][:80]})",
            "a complete file is needed",
            "copy it again",
        ) from error
    columns: dict[str, Column] = {}
    left_out: dict[str, str] = {}
    for field, samples in zip(table.schema, table.columns, strict=True):
        types = pyarrow.types
        if (
            types.is_floating(field.type)
            or types.is_integer(field.type)
            or types.is_decimal(field.type)
            or types.is_boolean(field.type)
        ):
            values = samples.to_pandas().to_numpy(dtype=np.float64, na_value=np.nan)
            unit = (field.metadata or {}).get(b"unit", b"").decode("utf-8", "replace")
            columns[field.name] = Column(field.name, values, unit)
        else:
            left_out[field.name] = f"it holds {field.type}, no numbers"
    return Table(str(path), "Parquet", columns, left_out)


def _tydex(path: Path) -> Table:
    content = read_tydex(path)
    columns = {
        channel.name: Column(channel.name, values, channel.unit)
        for channel, values in zip(content.channels, content.physical().T, strict=True)
    }
    left_out: dict[str, str] = {}
    for entry in content.constants:
        number = entry.number()
        if entry.name in columns:
            continue
        if number is None:
            left_out[entry.name] = f"it is a constant with the text {entry.value!r}"
        else:
            values = np.array([number])
            columns[entry.name] = Column(entry.name, values, entry.unit, constant=True)
    notes = [f"block **{name} is skipped" for name in content.skipped]
    notes += [
        f"channel {channel.name}: the offset {channel.recorded_offset:g} was added to the recorded "
        f"value before the factor {channel.factor:g}"
        for channel in content.channels
        if channel.recorded_offset
    ]
    return Table(str(path), "TYDEX", columns, left_out, tuple(notes))


def _mdf(path: Path) -> Table:
    try:
        groups = [group for group in read_mdf(path) if group.channels]
    except FormatError as error:
        (fault,) = error.faults
        raise refusal(
            str(path),
            fault.given,
            "a complete MDF 4 file is needed",
            "copy it again from the logger",
        ) from error
    names = [name for group in groups for name in _names(group)]
    twice = {name for name in names if names.count(name) > 1}
    columns: dict[str, Column] = {}
    left_out: dict[str, str] = {}
    for number, group in enumerate(groups, start=1):
        keys = {name: f"{number}/{name}" if name in twice else name for name in _names(group)}
        clock = "" if group.time is None else keys[group.time.name]
        for channel in (*([group.time] if group.time is not None else []), *group.channels):
            key = keys[channel.name]
            if channel.samples.dtype.kind not in "biuf" or channel.samples.ndim != 1:
                left_out[key] = f"it holds {channel.samples.dtype}, no single numbers"
            elif key in columns:
                columns.pop(key)
                left_out[key] = "several channels of its group have this name"
            elif key not in left_out:
                values = channel.samples.astype(np.float64)
                columns[key] = Column(key, values, channel.unit, clock)
    notes = (
        f"names that occur in several groups are written as GROUP/NAME: {', '.join(sorted(twice))}",
    )
    return Table(str(path), "MDF 4", columns, left_out, notes if twice else ())


def _names(group: Group) -> list[str]:
    names = [channel.name for channel in group.channels]
    return list(dict.fromkeys([*([group.time.name] if group.time is not None else []), *names]))


_READERS: dict[str, Callable[[Path], Table]] = {
    "MATLAB": _matlab,
    "Parquet": _parquet,
    "TYDEX": _tydex,
    "MDF 4": _mdf,
}
