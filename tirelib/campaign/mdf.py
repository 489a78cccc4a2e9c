"""ASAM MDF 4 files as plain groups of channels. The only place that knows asammdf."""

import struct
import zlib
from collections.abc import Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass
from io import BytesIO, StringIO
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from tirelib.errors import Fault, FormatError

_MAGIC = b"MDF     "
_UNFINISHED = b"UnFinMF "
_WHOLE = (
    "a complete file is needed",
    "copy it again from the logger or take the run out of runs.csv",
)
_HEADER_END = 168  # identification block 64 bytes, header block 104 bytes
_BLOCK_HEAD = 24  # of any block: 4 bytes name, 4 spare, 8 length, 8 number of links


@dataclass(frozen=True, slots=True, eq=False)
class Channel:
    """One channel as the file has it: no unit is converted, no sign changed."""

    name: str
    unit: str
    samples: npt.NDArray[Any]


@dataclass(frozen=True, slots=True, eq=False)
class Group:
    """Channels that share one time channel.

    Attributes
    ----------
    index : int
        Position in the file, from 0.
    time : Channel or None
        The time channel; None when the group has none.
    channels : tuple of Channel
        All others, in file order.
    """

    index: int
    time: Channel | None
    channels: tuple[Channel, ...]


def read_mdf(path: Path) -> list[Group]:
    """Read every group of an MDF 4 file.

    Raises
    ------
    FormatError
        If the file is missing, is not MDF 4, was never finished, or ends too early.
    """
    content = _checked_content(path)
    from asammdf import MDF  # 0.4 s to import; only those who read pay
    from asammdf.blocks.utils import MdfException

    try:
        # From memory: a truncated file then ends in an exception, never in a bus error.
        # The reader prints what it stumbles over; only the command line prints here.
        with (
            redirect_stdout(StringIO()),
            MDF(BytesIO(content), raise_on_multiple_occurrences=False) as mdf,
        ):
            return [_group(mdf, index) for index in range(len(mdf.groups))]
    except (
        MdfException,
        ArithmeticError,
        AttributeError,
        LookupError,
        MemoryError,
        OSError,
        TypeError,
        ValueError,
        struct.error,
        zlib.error,
    ) as error:
        raise FormatError(
            Fault(
                "",
                f"truncated or damaged MDF 4 file of {len(content)} bytes (reader: "
                f"{str(error)[:80] or type(error).__name__})",
                *_WHOLE,
            )
        ) from error


def _checked_content(path: Path) -> bytes:
    """Return the bytes of a file that begins like a finished MDF 4 file."""
    try:
        content = path.read_bytes()
    except OSError as error:
        raise FormatError(
            Fault(
                "",
                f"the run file cannot be read ({error.strerror})",
                "every file of runs.csv must be there",
                "restore it or take its row out of runs.csv",
            )
        ) from None
    if content.startswith(_UNFINISHED):
        raise FormatError(
            Fault(
                "",
                "the recording was never finished (UnFinMF)",
                "a finished MDF 4 file is needed",
                "finish it with the logger's own tool",
            )
        )
    if not content.startswith(_MAGIC):
        raise FormatError(
            Fault(
                "",
                f"not an MDF file (begins with {content[:8]!r})",
                "ASAM MDF 4 is needed",
                "convert it with `tirelib import`",
            )
        )
    if content[8:9] != b"4":
        version = content[8:16].decode("ascii", "replace").strip(" \0")
        raise FormatError(
            Fault(
                "",
                f"MDF version {version or 'unknown'}",
                "version 4 is needed",
                "convert it with the logger's own tool",
            )
        )
    if not _has_header(content):
        raise FormatError(
            Fault(
                "",
                f"truncated or damaged MDF 4 file of {len(content)} bytes (no whole header)",
                *_WHOLE,
            )
        )
    return content


def _has_header(content: bytes) -> bool:
    """Return whether the header and the chains of data and channel groups lie within the file.

    The reader would find that out too, but leaves a half-made object behind.
    """
    if len(content) < _HEADER_END or content[64:68] != b"##HD":
        return False
    first_group, *others = struct.unpack_from("<6Q", content, 64 + _BLOCK_HEAD)
    if any(address and _links(content, address) is None for address in others):
        return False
    to_visit, seen = [first_group], {0}
    while to_visit:
        address = to_visit.pop()
        if address in seen:
            continue
        seen.add(address)
        links = _links(content, address)
        if links is None:
            return False
        # a data group links to the next one and its first channel group, that to the next
        count = {b"##DG": 2, b"##CG": 1}.get(content[address : address + 4], 0)
        to_visit += links[:count]
    return True


def _links(content: bytes, address: int) -> list[int] | None:
    """Return the links of the block at an address, None when it does not lie within the file."""
    if address + _BLOCK_HEAD > len(content):
        return None
    length, count = struct.unpack_from("<2Q", content, address + 8)
    if address + length > len(content) or _BLOCK_HEAD + 8 * count > length:
        return None
    return list(struct.unpack_from(f"<{count}Q", content, address + _BLOCK_HEAD))


def _group(mdf: Any, index: int) -> Group:
    raw = mdf.groups[index]
    master = mdf.masters_db.get(index)
    for channel in raw.channels:  # the reader's compiled part trusts these numbers blindly
        last = channel.byte_offset + (channel.bit_offset + channel.bit_count + 7) // 8
        if last > raw.channel_group.samples_byte_nr:
            raise ValueError(f"{channel.name!r} lies outside of its record")
    signals = mdf.select(
        [(None, index, column) for column in range(len(raw.channels))], copy_master=False
    )
    expected = int(raw.channel_group.cycles_nr)
    for signal in signals:
        if len(signal.samples) != expected:
            raise ValueError(f"{signal.name} has {len(signal.samples)} of {expected} samples")
    channels = [_channel(signal) for signal in signals]
    time = None if master is None else channels.pop(master)
    return Group(index, time, tuple(channels))


def _channel(signal: Any) -> Channel:
    """Return a signal as a Channel; samples that the logger marked invalid become NaN."""
    samples = np.asarray(signal.samples)
    invalid = signal.invalidation_bits
    if invalid is not None and samples.dtype.kind in "biuf":
        samples = np.where(np.asarray(invalid, dtype=bool), np.nan, samples)
    return Channel(str(signal.name), str(signal.unit or ""), samples)


def write_mdf(path: Path, groups: Sequence[Group]) -> None:
    """Write groups, each with a time channel, as an MDF 4.10 file; an old one is replaced."""
    from asammdf import MDF, Signal

    with MDF(version="4.10") as mdf:
        for group in groups:
            if group.time is None:
                raise FormatError(
                    f"{path.name}: group {group.index} has no time channel; every group needs "
                    "one; add it"
                )
            times = np.asarray(group.time.samples, dtype=np.float64)
            signals = [
                Signal(channel.samples, times, unit=channel.unit, name=channel.name)
                for channel in group.channels
            ]
            mdf.append(signals, common_timebase=True)
        mdf.save(path, overwrite=True)
