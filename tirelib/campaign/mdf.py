"""ASAM MDF 4 files as plain groups of channels. The only place that knows asammdf."""

import mmap
import struct
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass
from io import BytesIO, StringIO
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from tirelib.campaign.mdf_header import HEADER_END, START_TIME, WHOLE, check_beginning
from tirelib.core.errors import Fault, FormatError
from tirelib.core.version import WRITER

_SHOWN = 12


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
    # From memory: a truncated file then ends in an exception, never in a bus error.
    with _reading(len(content)) as MDF, _mdf(MDF, BytesIO(content)) as mdf:
        return [_group(mdf, index) for index in range(len(mdf.groups))]


def _mdf(MDF: Any, stream: Any) -> Any:
    return MDF(stream, raise_on_multiple_occurrences=False)


@contextmanager
def _reading(size: int) -> Iterator[Any]:
    """Yield the reader's class; what it raises over a file of a size in bytes is a FormatError.

    The reader prints what it stumbles over; only the command line prints here.
    """
    from asammdf import MDF  # 0.4 s to import; only those who read pay
    from asammdf.blocks.utils import MdfException

    try:
        with redirect_stdout(StringIO()):
            yield MDF
    except FormatError:
        raise
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
                f"truncated or damaged MDF 4 file of {size} bytes (reader: "
                f"{str(error)[:80] or type(error).__name__})",
                *WHOLE,
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
    check_beginning(content)
    return content


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


@dataclass(frozen=True, slots=True)
class Place:
    """Where a channel lies in a file: its group, its number there, and its unit."""

    name: str
    group: int
    index: int
    unit: str


class MdfFile:
    """An MDF 4 file that is read in blocks, so that memory does not grow with its length.

    Parameters
    ----------
    path : Path

    Attributes
    ----------
    start : float, [s]
        When the recording began, since 1970-01-01 UTC.

    Raises
    ------
    FormatError
        As from `read_mdf`.
    """

    def __init__(self, path: Path) -> None:
        try:
            self._stream = path.open("rb")
            self._size = path.stat().st_size
        except OSError as error:
            raise FormatError(
                Fault(
                    str(path),
                    f"the recording cannot be read ({error.strerror})",
                    "every file of a recording must be there",
                    "restore it",
                )
            ) from None
        try:
            if self._size < HEADER_END:
                check_beginning(self._stream.read())
            with mmap.mmap(self._stream.fileno(), 0, access=mmap.ACCESS_READ) as content:
                check_beginning(content)
                self.start = 1e-9 * struct.unpack_from("<Q", content, START_TIME)[0]
            # a file object, not a path: a file that ends early raises and never a bus error
            with _reading(self._size) as MDF:
                self._mdf = _mdf(MDF, self._stream)
        except BaseException:
            self._stream.close()
            raise
        self._places: dict[str, list[Place]] = {}
        for number, group in enumerate(self._mdf.groups):
            for index, channel in enumerate(group.channels):
                place = Place(channel.name, number, index, "")
                self._places.setdefault(channel.name, []).append(place)

    def __enter__(self) -> "MdfFile":
        return self

    def __exit__(self, *_: object) -> None:
        self._mdf.close()
        self._stream.close()

    def place(self, name: str) -> Place:
        """Return where the only channel of a name lies.

        Raises
        ------
        FormatError
            If there is none, or more than one.
        """
        found = self._places.get(name, [])
        if len(found) != 1:
            known = ", ".join(sorted(self._places)[:_SHOWN])
            raise FormatError(
                Fault(
                    "",
                    f"channel {name!r} is there {len(found)} times",
                    f"a channel that is named must be there once; the file has {known}"
                    + (" and others" if len(self._places) > _SHOWN else ""),
                    "correct the name in the description or rename the channel in the logger",
                )
            )
        return found[0]

    def clock(self, group: int) -> Place:
        """Return the time channel of a group.

        Raises
        ------
        FormatError
            If the group has none.
        """
        master = self._mdf.masters_db.get(group)
        if master is None:
            raise FormatError(
                Fault(
                    f"group {group}",
                    "it has no time channel",
                    "each group needs its own",
                    "export it with its master channel",
                )
            )
        return Place(self._mdf.groups[group].channels[master].name, group, master, "")

    def samples(self, group: int) -> int:
        """Return the number of samples of a group."""
        return int(self._mdf.groups[group].channel_group.cycles_nr)

    def read(self, places: Sequence[Place], start: int, count: int) -> list[Channel]:
        """Return samples `start` to `start + count` of channels of one group.

        Raises
        ------
        FormatError
            If the file ends before them.
        """
        with _reading(self._size):
            signals = self._mdf.select(
                [(None, place.group, place.index) for place in places],
                record_offset=start,
                record_count=count,
                copy_master=False,
            )
            for signal in signals:
                if len(signal.samples) != count:
                    raise ValueError(f"{signal.name} has {len(signal.samples)} of {count} samples")
            return [_channel(signal) for signal in signals]


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
        mdf.header.description = f"written by {WRITER}"
        mdf.save(path, overwrite=True)
