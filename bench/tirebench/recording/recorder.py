"""Write a recording (``tirebench-recording/2``, see `tirebench.recording.recording`)."""

import json
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tirebench.errors import RecordingError
from tirebench.estimator.chain import Jump
from tirebench.estimator.wheels import Block
from tirebench.links import Read
from tirebench.recording.header import RecordingHeader, encoding_of
from tirebench.recording.mcap_log import McapLog
from tirebench.recording.topics import (
    BUS_CONDITION,
    BUS_CONDITION_SCHEMA,
    CONDITIONS,
    CONDITIONS_SCHEMA,
    ESTIMATE,
    ESTIMATE_SCHEMA,
    EVENT_SCHEMA,
    EVENTS,
    LINE,
    LINK,
    LINK_SCHEMA,
    RAW,
    STRAIN,
    STRAIN_SCHEMA,
    bus_condition_message,
    strain_messages,
)
from tirebench.wire.conditions import Conditions, conditions_document
from tirebench.wire.timeline import Samples

DRIFT = 500e-6
"""A wheel's clock may be so much slower than the host's: a quartz has 50 ppm, an RC clock more."""


class Recorder:
    """Write a recording; a context manager that closes it whatever happens.

    What was written stands in the file after `flush`, all of it or, on an error, nothing.

    Parameters
    ----------
    path : Path
        A file that does not exist yet, or one to go on with.
    header : RecordingHeader
        What the run was.
    conditions : Conditions
    length : int, optional
        Length of a file that another recorder has begun: bytes that are known to be whole. What
        follows them is cut off, and the recording goes on there.

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
        header: RecordingHeader,
        conditions: Conditions,
        length: int | None = None,
    ) -> None:
        self.path = path
        self.bytes = 0
        self._clock = header.clock  # one for all parts
        self._origins: dict[int, tuple[int, float]] = {}
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._log = McapLog(path, length)
        except FileExistsError:
            raise RecordingError(
                f"{path}: already exists; a recording is never overwritten; name another file"
            ) from None
        except OSError as error:
            raise unwritable(path, error) from None
        log = self._log
        if length is None:
            log.metadata("tirebench", header.as_text())
        self._raw = [
            log.channel(
                RAW.format(number),
                encoding_of(source),
                metadata={"source": str(number), "name": str(source.get("name", ""))},
            )
            for number, source in enumerate(header.sources)
        ]
        self._events = log.channel(EVENTS, "json", EVENT_SCHEMA)
        channel = log.channel(CONDITIONS, "json", CONDITIONS_SCHEMA)
        if length is None:
            text = json.dumps(conditions_document(conditions)).encode()
            self._message(channel, text, time.monotonic_ns())
        else:
            self.event({"event": "recorder started again"})
        try:
            self.flush()
        except RecordingError:
            log.abandon()
            if length is None:
                path.unlink(missing_ok=True)
            raise

    @property
    def length(self) -> int:
        """Bytes of the file that are whole."""
        return self._log.length

    @property
    def waiting(self) -> int:
        """Bytes that wait for `flush`, before compression."""
        return self._log.waiting

    def read(self, read: Read) -> None:
        """Write one read: what happened to the port, and its bytes."""
        if read.event:
            self.event({"event": read.event, "source": read.source}, read.arrival)
        if read.data:
            self._message(self._raw[read.source], read.data, read.arrival)
            self.bytes += len(read.data)

    def event(self, event: Mapping[str, Any], arrival: int | None = None) -> None:
        """Write an event of a moment [ns, monotonic], by default of this one."""
        moment = time.monotonic_ns() if arrival is None else arrival
        self._message(self._events, json.dumps(event).encode(), moment)

    def block(self, block: Block) -> None:
        """Write what a read brought of a wheel: its strain, or conditions from a bus."""
        content, wheel = block.content, block.wheel
        if isinstance(content, Samples):
            channel = self._log.channel(STRAIN.format(wheel), "json", STRAIN_SCHEMA)
            begin = self._host_time(block, content)
            for offset, data in strain_messages(content):
                self._message(channel, data, begin + offset)
        else:
            channel = self._log.channel(BUS_CONDITION.format(wheel), "json", BUS_CONDITION_SCHEMA)
            self._message(channel, bus_condition_message(content.measured), block.arrival)

    def estimate(self, wheel: int, arrival: int, document: bytes) -> None:
        """Write a turn, as JSON, whose last bytes came at a moment [ns, monotonic]."""
        channel = self._log.channel(ESTIMATE.format(wheel), "json", ESTIMATE_SCHEMA)
        self._message(channel, document, arrival)

    def link(self, wheel: int | None, document: Mapping[str, Any]) -> None:
        """Write the counters of a wheel, or of all lines together."""
        topic = LINE if wheel is None else LINK.format(wheel)
        channel = self._log.channel(topic, "json", LINK_SCHEMA)
        self._message(channel, json.dumps(document).encode(), time.monotonic_ns())

    def flush(self) -> None:
        """Let what was written outlive this process.

        Raises
        ------
        RecordingError
            If it cannot be written; what was written since the last `flush` is not in the file.
        """
        try:
            self._log.flush()
        except OSError as error:
            raise unwritable(self.path, error) from None

    def close(self, reason: str) -> None:
        """Finish the file; `reason` says why it ends."""
        if self._log.closed:
            return
        self._log.metadata("end", {"reason": reason})
        try:
            self._log.finish()
        except OSError as error:
            raise unwritable(self.path, error) from None

    def abandon(self) -> int:
        """Close the file as it is and return its length."""
        self._log.abandon()
        return self._log.length

    def _message(self, channel: int, data: bytes, arrival: int) -> None:
        try:
            self._log.message(channel, arrival + self._clock, data)
        except OSError as error:
            raise unwritable(self.path, error) from None

    def _host_time(self, block: Block, samples: Samples) -> int:
        """Return when the first sample was taken at the host [ns, monotonic], but for a constant.

        Bytes come late by chance, never early: the smallest delay so far is that of the clocks.
        """
        end = 1000 * samples.end_us
        segment, delay = self._origins.get(block.wheel, (-1, 0.0))
        newest = float(block.arrival - end)
        if segment != samples.segment:
            delay = newest
        delay = min(delay + 1e9 * DRIFT * samples.period * len(samples.strain), newest)
        self._origins[block.wheel] = samples.segment, delay
        return 1000 * samples.t_us + int(delay)

    def __enter__(self) -> "Recorder":
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self.close("closed" if kind is None else kind.__name__)


def alarm_event(name: str, text: str, *, on: bool) -> dict[str, Any]:
    """Return an alarm of the run that begins or ends, as an event of a recording."""
    return {
        "event": "alarm",
        "state": "on" if on else "off",
        "name": name,
        "wheel": None,
        "value": None,
        "text": text,
    }


def jump_event(jump: Jump, *, whole: bool = True) -> dict[str, Any]:
    """Return a jump as an event of a recording.

    Its places count from the beginning of the run: a recording that is not `whole`, because it was
    begun later, records the jump, but a replay does not find the place.
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


def finish(path: Path, length: int, reason: str) -> None:
    """Write the end of a file that was left without, of which so many bytes are whole.

    Raises
    ------
    RecordingError
        If there is no room for it.
    """
    try:
        log = McapLog(path, length)
        log.metadata("end", {"reason": reason})
        log.finish()
    except OSError as error:
        raise unwritable(path, error) from None


def unwritable(path: Path, error: OSError) -> RecordingError:
    """Return the error about a file that cannot be written."""
    return RecordingError(
        f"{path}: cannot be written ({error.strerror}); a disk with room for 1 GB per hour and "
        "wheel is needed; free some space, or name another file"
    )
