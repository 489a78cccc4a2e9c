"""Recording of a live run (``tirebench-recording/1``, MCAP): raw bytes as they came, bad ones too.

The file is MCAP without chunks, so that what is written stands on disk (in the kernel's cache, at
least) and can be read whatever happens next. MCAP readers that take a stream (and PlotJuggler,
Foxglove) open it; a file without its end does as well. A recorder that is started again goes on in
the same file, where it is known to be whole.

==============  ===================  ============================================================
part            encoding             content
==============  ===================  ============================================================
metadata        ``tirebench``        format, settings (JSON), start on both clocks, device file
``/serial``     ``serial-v1``        bytes of one read; log time is UTC, publish time monotonic;
                                     ``/slcan`` and ``/can`` on another kind of line
``/events``     ``json``             the port went away or came back; markers; a process was
                                     started again; where an estimator began afresh
``/conditions`` ``json``             conditions as a sidecar holds them (``tirebench-conditions/1``)
metadata        ``end``              why the run ended
==============  ===================  ============================================================
"""

import json
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO

from mcap.exceptions import McapError
from mcap.records import Channel, Message, Metadata
from mcap.writer import CompressionType, Writer

from bench.chain import Jump, Place
from bench.conditions import Conditions, conditions_document, parse_conditions
from bench.errors import DeviceError, RecordingError
from bench.links import BACK, LOST, RESUMED, Read
from bench.protocols import SERIAL
from bench.records import records

FORMAT = "tirebench-recording/1"
CONDITIONS, EVENTS = "/conditions", "/events"
LATEST = 2**63
"""Times are below this, [ns]: 292 years."""


class Recorder:
    """Write a recording; a context manager that closes it whatever happens.

    Parameters
    ----------
    path : Path
        A file that does not exist yet, or one to go on with.
    header : RecordingHeader
        What the run was.
    conditions : Conditions
    length : int, optional
        Of a file that another recorder has begun: bytes that are known to be whole. What follows
        them is cut off, and the recording goes on there.

    Attributes
    ----------
    bytes : int
        Raw bytes so far, since this recorder began.

    Raises
    ------
    RecordingError
        If the file exists already, or cannot be written.
    """

    def __init__(
        self,
        path: Path,
        header: "RecordingHeader",
        conditions: Conditions,
        length: int | None = None,
    ) -> None:
        self.path = path
        self.bytes = 0
        self._clock = header.wall_ns - header.monotonic_ns  # one for the whole file
        self._number = 0
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file: BinaryIO = path.open("xb" if length is None else "r+b")
            if length is not None:
                self._file.truncate(length)
                self._file.seek(length)
        except FileExistsError:
            raise RecordingError(
                f"{path}: it exists; a recording is never overwritten; name another file"
            ) from None
        except OSError as error:
            raise _unwritable(path, error) from None
        self._writer = Writer(self._file, use_chunking=False, compression=CompressionType.NONE)
        if length is None:
            self._writer.start("tirebench", FORMAT)
            self._writer.add_metadata("tirebench", header.as_text())
        # the same channels with the same numbers again, which MCAP allows
        self._raw = self._writer.register_channel(raw_topic(header.encoding), header.encoding, 0)
        self._events = self._writer.register_channel(EVENTS, "json", 0)
        channel = self._writer.register_channel(CONDITIONS, "json", 0)
        if length is None:
            text = json.dumps(conditions_document(conditions)).encode()
            self._message(channel, text, time.monotonic_ns())
        else:
            self.event({"event": "recorder started again"})
        self.flush()

    @property
    def length(self) -> int:
        """Bytes of the file so far."""
        return self._file.tell()

    def read(self, read: Read) -> None:
        """Write one read: what happened to the port, and its bytes."""
        if read.event:
            self.event({"event": read.event}, read.arrival)
        if read.data:
            self._message(self._raw, read.data, read.arrival)
            self.bytes += len(read.data)

    def event(self, event: Mapping[str, Any], arrival: int | None = None) -> None:
        """Write an event of a moment [ns, monotonic], by default of this one."""
        moment = time.monotonic_ns() if arrival is None else arrival
        self._message(self._events, json.dumps(event).encode(), moment)

    def flush(self) -> None:
        """Let what was written outlive this process."""
        try:
            self._file.flush()
        except OSError as error:
            raise _unwritable(self.path, error) from None

    def _message(self, channel: int, data: bytes, arrival: int) -> None:
        self._number += 1
        try:
            self._writer.add_message(
                channel, arrival + self._clock, data, arrival, self._number % 2**32
            )
        except OSError as error:
            raise _unwritable(self.path, error) from None

    def close(self, reason: str) -> None:
        """Finish the file; `reason` says why the run ended."""
        if self._file.closed:
            return
        try:
            self._writer.add_metadata("end", {"reason": reason})
            finish: Callable[[], None] = self._writer.finish  # mcap has no annotation here
            finish()
            self._file.close()
        except OSError as error:
            raise _unwritable(self.path, error) from None

    def __enter__(self) -> "Recorder":
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self.close("closed" if kind is None else kind.__name__)


def jump_event(jump: Jump, *, whole: bool = True) -> dict[str, Any]:
    """Return a jump as an event of a recording.

    Its places count from the beginning of the run: a recording that is not `whole`, because it was
    begun later, tells of the jump, but a replay does not find the place.
    """
    return {
        "event": "jump" if whole else "jump of the run",
        "wheel": jump.wheel,
        "from": list(jump.start),
        "to": list(jump.end),
        "why": jump.why,
        "samples": jump.samples,
        "turns": jump.turns,
    }


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
        What the bytes are: `bench.protocols.plan.ProtocolPlan.as_header`.
    wall_ns, monotonic_ns : int
        The start on both clocks.
    """

    settings: dict[str, Any]
    device: str = ""
    fmu: str = ""
    protocol: dict[str, Any] = field(default_factory=dict)
    wall_ns: int = field(default_factory=time.time_ns)
    monotonic_ns: int = field(default_factory=time.monotonic_ns)

    @property
    def encoding(self) -> str:
        """What the bytes of a read are, see `bench.protocols`."""
        return str(self.protocol.get("encoding", SERIAL))

    def as_text(self) -> dict[str, str]:
        """Return the header as MCAP metadata."""
        return {
            "format": FORMAT,
            "settings": json.dumps(self.settings),
            "device": self.device,
            "fmu_sha256": self.fmu,
            "protocol": json.dumps(self.protocol),
            "wall_ns": str(self.wall_ns),
            "monotonic_ns": str(self.monotonic_ns),
        }


class Recording:
    """Read a recording, a damaged or unfinished one up to where it breaks off.

    Attributes
    ----------
    header : RecordingHeader
    conditions : Conditions
    complete : bool or None
        Whether the file has its end; None until all of it has been read.

    Raises
    ------
    RecordingError
        If the file cannot be read, is no recording, or of an unknown version.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.complete: bool | None = None
        try:
            self._file: BinaryIO = path.open("rb")
        except OSError as error:
            raise RecordingError(
                f"{path}: it cannot be read ({error.strerror}); a recording of `tirebench run "
                "--record` is needed; check the path"
            ) from None
        self._records = records(self._file)
        self._topics: dict[int, str] = {}
        try:
            self.header, self.conditions = self._open()
        except RecordingError:
            self.close()
            raise

    def _open(self) -> tuple[RecordingHeader, Conditions]:
        """Read up to the conditions, which stand before all raw bytes."""
        header: RecordingHeader | None = None
        for record in self._sound():
            if isinstance(record, Metadata) and record.name == "tirebench":
                header = self._header(record.metadata)
            elif isinstance(record, Message) and self._topics.get(record.channel_id) == CONDITIONS:
                if header is None:
                    break
                return header, self._conditions(record.data)
        damage = f" ({self.damage})" if self.complete is False else ""
        raise RecordingError(
            f"{self.path}: it has no header of a recording{damage}; a file of `tirebench run "
            "--record` is needed; name one"
        )

    def raw(self) -> Iterator[tuple[int, bytes]]:
        """Yield arrival [ns, monotonic] and bytes of each read, in order; once."""
        for read in self.reads():
            if read.data:
                yield read.arrival, read.data

    def reads(self) -> Iterator[Read]:
        """Yield every read in order, those included that tell of a lost port; once."""
        raw = raw_topic(self.header.encoding)
        for record in self._sound():
            if not isinstance(record, Message):
                continue
            topic = self._topics.get(record.channel_id)
            if topic == raw:
                yield Read(record.publish_time, record.data)
            elif topic == EVENTS:
                event = _event(record.data).get("event")
                if event in (LOST, BACK, RESUMED):
                    yield Read(record.publish_time, b"", str(event))

    def jumps(self) -> list[Jump]:
        """Return where estimators began afresh, in order; reads a file of its own to the end."""
        other = Recording(self.path)
        found = [
            _jump(_event(record.data))
            for record in other._sound()
            if isinstance(record, Message) and other._topics.get(record.channel_id) == EVENTS
        ]
        other.close()
        return [jump for jump in found if jump is not None]

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _sound(self) -> Iterator[object]:
        """Yield records up to the end of the file or the first that is broken."""
        try:
            for record in self._records:
                if isinstance(record, Channel):
                    self._topics[record.id] = record.topic
                elif isinstance(record, Message):
                    _moment(record.publish_time)
                yield record
            self.complete = True
        except (McapError, ValueError, EOFError, OSError, LookupError) as error:
            self.complete = False
            self.damage = str(error) or type(error).__name__
        except Exception as error:  # struct.error and whatever a damaged file provokes in mcap
            self.complete = False
            self.damage = str(error) or type(error).__name__

    def _header(self, text: dict[str, str]) -> RecordingHeader:
        if text.get("format") != FORMAT:
            raise RecordingError(
                f"{self.path}: format = {text.get('format')!r}; {FORMAT!r} is understood here; "
                "take a program of that version"
            )
        try:
            return RecordingHeader(
                settings=_settings(_json(text["settings"])),
                device=text["device"],
                fmu=text["fmu_sha256"],
                protocol=dict(_json(text.get("protocol", "{}"))),
                wall_ns=_moment(int(text["wall_ns"])),
                monotonic_ns=_moment(int(text["monotonic_ns"])),
            )
        except (KeyError, TypeError, ValueError) as error:
            raise RecordingError(
                f"{self.path}: the header is damaged ({error}); settings, device, fmu_sha256 and "
                "both clocks are needed; take another recording"
            ) from None

    def _conditions(self, data: bytes) -> Conditions:
        try:
            return parse_conditions(_json(data), f"{self.path}: {CONDITIONS}")
        except (ValueError, DeviceError) as error:
            raise RecordingError(
                f"{self.path}: the conditions are damaged ({error}); JSON is needed; "
                "take another recording"
            ) from None


def raw_topic(encoding: str) -> str:
    """Return the topic of the raw bytes of an encoding."""
    return f"/{encoding.partition('-')[0]}"


def _json(text: str | bytes) -> Any:
    """Return what JSON says.

    Raises
    ------
    ValueError
        If it is none, or nested too deeply to be read.
    """
    try:
        return json.loads(text)
    except RecursionError:
        raise ValueError("JSON is nested too deeply") from None


def _moment(time_ns: int) -> int:
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


def _event(data: bytes) -> dict[str, Any]:
    """Return what an event says; empty if it is damaged."""
    try:
        event = _json(data)
    except ValueError:
        return {}
    return event if isinstance(event, dict) else {}


def _jump(event: Mapping[str, Any]) -> Jump | None:
    """Return the jump that an event tells of; None if it tells of something else."""
    if event.get("event") != "jump":
        return None
    try:
        start, end = (Place(*map(int, event[key])) for key in ("from", "to"))
        return Jump(int(event["wheel"]), start, end, str(event["why"]),
                    int(event["samples"]), int(event["turns"]))  # fmt: skip
    except (KeyError, OverflowError, TypeError, ValueError):
        return None


def _unwritable(path: Path, error: OSError) -> RecordingError:
    return RecordingError(
        f"{path}: it cannot be written ({error.strerror}); a place with room for 0.5 GB an hour "
        "is needed; free space or name another file"
    )
