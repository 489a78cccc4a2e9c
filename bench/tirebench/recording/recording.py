"""Recording of a live run (``tirebench-recording/2``, MCAP): raw bytes as they came, bad ones too.

Beside the bytes stands what the run made of them, so that other programs list and plot it (schemas:
`tirebench.recording.topics`). Messages stand in chunks that are closed several times a second: what
was closed can be read whatever happens next, also in a file without its end. A recorder that is
started again goes on in the same file, where it is known to be whole.

=====================  ================  ===========================================================
part                   encoding          content
=====================  ================  ===========================================================
metadata               ``tirebench``     format, settings, sources, start on both clocks, devices
``/raw/0`` ...         ``serial-v1`` ..  bytes of one read, a topic for each source of bytes
``/events``            ``json``          the port went away or came back; markers; a process was
                                         started again; where an estimator began afresh
``/conditions``        ``json``          conditions as a sidecar holds them
``/line``              ``json``          counters of all lines together
``/wheel/0/strain``    ``json``          decoded samples, microstrain
``/wheel/0/estimate``  ``json``          a turn, as in the run's JSON
``/wheel/0/link``      ``json``          counters of the wheel
metadata               ``end``           why the file ended
=====================  ================  ===========================================================

Log time is UTC. The estimates of a replay come from the raw bytes and the events alone.
``tirebench-recording/1``, without chunks and with one source of bytes (``/serial``, ``/slcan``,
``/can``), is read as well.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, BinaryIO

from mcap.exceptions import McapError
from mcap.records import Channel, Message, Metadata

from tirebench.errors import DeviceError, RecordingError
from tirebench.estimator.chain import Jump, Place
from tirebench.links import BACK, DECODED, LOST, PASSED, RESUMED, Read
from tirebench.recording.header import (
    FORMER,
    RecordingHeader,
    header_of,
    json_of,
    moment,
    part_path,
)
from tirebench.recording.recorder import Recorder, jump_event
from tirebench.recording.records import records
from tirebench.recording.topics import CONDITIONS, EVENTS, RAW
from tirebench.wire.conditions import Conditions, parse_conditions

_FORMER_RAW = ("/serial", "/slcan", "/can")


class Recording:
    """Read a recording with the parts that follow, a damaged one up to where it breaks off.

    Attributes
    ----------
    header : RecordingHeader
    conditions : Conditions
    complete : bool or None
        Whether every part has its end; None until all of them have been read.
    damage : str
        Where not: what was met.

    Raises
    ------
    RecordingError
        If the file cannot be read, is no recording, or of an unknown version.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.complete: bool | None = None
        self.damage = ""
        self._begin(path)
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
                header = header_of(record.metadata, str(self.path))
            elif isinstance(record, Message) and self._topic(record) == CONDITIONS:
                if header is None:
                    break
                return header, self._conditions(record.data)
        damage = f" ({self.damage})" if self.complete is False else ""
        raise RecordingError(
            f"{self.path}: the header of a recording is missing{damage}; a file of `tirebench run "
            "--record` is needed; name one"
        )

    def raw(self) -> Iterator[tuple[int, bytes]]:
        """Yield arrival [ns, monotonic] and bytes of each read, in order; once."""
        for read in self.reads():
            if read.data:
                yield read.arrival, read.data

    def reads(self) -> Iterator[Read]:
        """Yield every read in order, once, with the records of a lost port."""
        for channel, time, data in self.messages():
            if (source := self._source(channel)) is not None:
                yield Read(time, data, "", source)
            elif channel.topic == EVENTS:
                event = _event(data)
                if event.get("event") in (LOST, BACK, RESUMED, PASSED, DECODED):
                    yield Read(time, b"", str(event["event"]), self._number(event.get("source")))

    def messages(self) -> Iterator[tuple[Channel, int, bytes]]:
        """Yield all messages: channel, moment [ns, monotonic], content; parts follow; once."""
        while True:
            former, clock = self.header.format == FORMER, self.header.clock
            for record in self._sound():
                if isinstance(record, Message) and record.channel_id in self._channels:
                    time = record.publish_time if former else record.log_time - clock
                    yield self._channels[record.channel_id], time, record.data
            if not self._next_part():
                return

    def jumps(self) -> list[Jump]:
        """Return where estimators began afresh, in order; reads a file of its own to the end."""
        other = Recording(self.path)
        found = [
            _jump(_event(data)) for channel, _, data in other.messages() if channel.topic == EVENTS
        ]
        other.close()
        return [jump for jump in found if jump is not None]

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _begin(self, path: Path) -> None:
        try:
            self._file: BinaryIO = path.open("rb")
        except OSError as error:
            raise RecordingError(
                f"{path}: cannot be read ({error.strerror}); a recording of `tirebench run "
                "--record` is needed; check the path"
            ) from None
        self._records = records(self._file)
        self._channels: dict[int, Channel] = {}

    def _next_part(self) -> bool:
        """Go on with the part that follows; False if there is none."""
        file = part_path(self.path, self.header.part + 1)
        if not self.header.recording or not file.exists():
            return False
        path, header = self.path, self.header
        self.close()
        self._begin(file)
        try:
            self.path = file
            self.header, _ = self._open()
        except RecordingError:
            self.path, self.complete = path, False
            self.damage = f"{file} is not a part of it"
            return False
        if self.header.recording != header.recording:
            self.path, self.header = path, header
            return False
        return True

    def _source(self, channel: Channel) -> int | None:
        """Return the source whose raw bytes a channel holds; None if it holds something else."""
        if self.header.format == FORMER:
            return 0 if channel.topic in _FORMER_RAW else None
        known = range(len(self.header.sources))
        return next((n for n in known if channel.topic == RAW.format(n)), None)

    def _number(self, source: Any) -> int:
        """Return the source that an event names; the first where it names none."""
        return source if source in range(len(self.header.sources)) else 0

    def _topic(self, record: Message) -> str:
        channel = self._channels.get(record.channel_id)
        return "" if channel is None else str(channel.topic)

    def _sound(self) -> Iterator[object]:
        """Yield records up to the end of the file or the first that is broken."""
        try:
            for record in self._records:
                if isinstance(record, Channel):
                    self._channels[record.id] = record
                elif isinstance(record, Message):
                    moment(record.publish_time)
                    moment(record.log_time)
                yield record
            self.complete = self.complete is not False
        except (McapError, ValueError, EOFError, OSError, LookupError) as error:
            self._break_off(error)
        except Exception as error:  # struct.error and whatever a damaged file provokes in mcap
            self._break_off(error)

    def _break_off(self, error: Exception) -> None:
        self.complete = False
        self.damage = str(error) or type(error).__name__

    def _conditions(self, data: bytes) -> Conditions:
        try:
            return parse_conditions(json_of(data), f"{self.path}: {CONDITIONS}")
        except (ValueError, DeviceError) as error:
            raise RecordingError(
                f"{self.path}: the conditions are damaged ({error}); JSON is needed; use another "
                "recording"
            ) from None


def _event(data: bytes) -> dict[str, Any]:
    """Return what an event says; empty if it is damaged."""
    try:
        event = json_of(data)
    except ValueError:
        return {}
    return event if isinstance(event, dict) else {}


def _jump(event: Mapping[str, Any]) -> Jump | None:
    """Return the jump that an event describes; None if it describes something else."""
    if event.get("event") != "jump":
        return None
    try:
        start, end = (Place(*map(int, event[key])) for key in ("from", "to"))
        return Jump(
            int(event["wheel"]),
            start,
            end,
            str(event["why"]),
            int(event["samples"]),
            int(event["turns"]),
        )
    except (KeyError, OverflowError, TypeError, ValueError):
        return None


__all__ = ["Recorder", "Recording", "RecordingHeader", "jump_event"]
