"""What a recording says of itself, and the names of its files.

A recording may have several files, its parts: ``a.mcap``, ``a.part2.mcap``, ``a.part3.mcap``. Each
has the header, with its number; a reader that begins with one goes on with those that follow.
"""

import json
import re
import time
import uuid
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tirebench.errors import RecordingError
from tirebench.protocols import SERIAL
from tirelib.core.version import __version__

FORMAT, FORMER = "tirebench-recording/2", "tirebench-recording/1"
LATEST = 2**63
"""Times are below this, [ns]: 292 years."""
_PART = re.compile(r"\.part\d+$")


@dataclass(frozen=True, slots=True)
class RecordingHeader:
    """What a recording says of itself.

    Attributes
    ----------
    settings : dict
        Options of the run, as JSON knows them.
    device : str
        Text of the device file; empty for the default device.
    fmu : str
        SHA-256 of the FMU file, hex.
    protocol : dict
        What the bytes of the first source are: `tirebench.protocols.plan.ProtocolPlan.as_header`.
    more : tuple of dict
        The same of every further source, in the order of `tirebench.links.Read.source`.
    wall_ns, monotonic_ns : int
        The start on both clocks.
    recording : str
        The same in all parts of a recording, and in no other.
    part : int
        From 1.
    format : str
        `FORMAT`, or `FORMER` of a file that was read.
    """

    settings: dict[str, Any]
    device: str = ""
    fmu: str = ""
    protocol: dict[str, Any] = field(default_factory=dict)
    more: tuple[dict[str, Any], ...] = ()
    wall_ns: int = field(default_factory=time.time_ns)
    monotonic_ns: int = field(default_factory=time.monotonic_ns)
    recording: str = field(default_factory=lambda: uuid.uuid4().hex)
    part: int = 1
    format: str = field(default_factory=lambda: FORMAT)

    @property
    def sources(self) -> tuple[dict[str, Any], ...]:
        """What the bytes of each source are."""
        return (self.protocol, *self.more)

    @property
    def encoding(self) -> str:
        """What the bytes of a read of the first source are, see `tirebench.protocols`."""
        return encoding_of(self.protocol)

    @property
    def clock(self) -> int:
        """What the wall clock is ahead of the monotonic one, [ns]."""
        return self.wall_ns - self.monotonic_ns

    def as_text(self) -> dict[str, str]:
        """Return the header as MCAP metadata."""
        return {
            "format": self.format,
            "tirelib": __version__,
            "settings": json.dumps(self.settings),
            "device": self.device,
            "fmu_sha256": self.fmu,
            "sources": json.dumps(self.sources),
            "wall_ns": str(self.wall_ns),
            "monotonic_ns": str(self.monotonic_ns),
            "recording": self.recording,
            "part": str(self.part),
        }


def header_of(text: Mapping[str, str], where: str) -> RecordingHeader:
    """Return the header that a file holds.

    Raises
    ------
    RecordingError
        If it is of an unknown version, or damaged.
    """
    if text.get("format") not in (FORMAT, FORMER):
        raise RecordingError(
            f"{where}: format = {text.get('format')!r}; this program reads {FORMAT!r} and "
            f"{FORMER!r}; use the version of tirelib that wrote the file"
        )
    try:
        if text["format"] == FORMER:
            sources = [json_of(text.get("protocol", "{}"))]
        else:
            sources = json_of(text["sources"])
        first, *more = (dict(source) for source in sources)
        return RecordingHeader(
            settings=_settings(json_of(text["settings"])),
            device=text["device"],
            fmu=text["fmu_sha256"],
            protocol=first,
            more=tuple(more),
            wall_ns=moment(int(text["wall_ns"])),
            monotonic_ns=moment(int(text["monotonic_ns"])),
            recording=text.get("recording", ""),
            part=moment(int(text.get("part", "1"))),
            format=text["format"],
        )
    except (KeyError, TypeError, ValueError) as error:
        raise RecordingError(
            f"{where}: the header is damaged ({error}); settings, device, fmu_sha256, sources and "
            "both clocks are needed; use another recording"
        ) from None


def json_of(text: str | bytes) -> Any:
    """Return what JSON says.

    Raises
    ------
    ValueError
        If it is no JSON, or nested too deeply to be read.
    """
    try:
        return json.loads(text)
    except RecursionError:
        raise ValueError("JSON is nested too deeply") from None


def moment(time_ns: int) -> int:
    """Return a time [ns] that counters of 63 bits can hold; refuse another."""
    if not 0 <= time_ns < LATEST:
        raise ValueError(f"a time of {time_ns} ns; 0 .. 2^63 is allowed")
    return time_ns


def _settings(found: Any) -> dict[str, Any]:
    """Return settings whose wheels, where they are named, are numbers of wheels."""
    settings = dict(found)
    wheels = settings.get("wheels") or []
    sound = isinstance(wheels, list) and all(type(n) is int and 0 <= n <= 255 for n in wheels)
    if not sound:
        raise ValueError(f"wheels = {str(wheels)[:40]}; a list of 0 .. 255 is allowed")
    return settings


def encoding_of(protocol: Mapping[str, Any]) -> str:
    """Return what the bytes of a source are."""
    return str(protocol.get("encoding", SERIAL))


def part_path(path: Path, part: int) -> Path:
    """Return the file of a part, given any file of the recording.

    Examples
    --------
    >>> part_path(Path("a.part2.mcap"), 3).name
    'a.part3.mcap'
    >>> part_path(Path("a.part2.mcap"), 1).name
    'a.mcap'
    """
    stem = _PART.sub("", path.stem)
    return path.with_name(f"{stem}{f'.part{part}' if part > 1 else ''}{path.suffix}")


def parts_of(path: Path) -> list[Path]:
    """Return the files that a recording has, in order."""
    found: list[Path] = []
    while (file := part_path(path, len(found) + 1)).exists():
        found.append(file)
    return found


def numbered(file: Path) -> Path:
    """Return the file, or the first of ``name-2``, ``name-3`` ... that is not there yet."""
    number, free = 1, file
    while free.exists():
        number += 1
        free = file.with_name(f"{file.stem}-{number}{file.suffix}")
    return free
