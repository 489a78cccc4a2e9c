"""What the run wants of the recorder, and how far that is."""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple


def triggers(event: Mapping[str, Any]) -> bool:
    """Return whether an event starts a recording that waits for one, or lets it go on for longer.

    A marker and an alarm that begins do; an alarm that ends does not. A port that goes away does as
    well, see `tirebench.links.LOST`.
    """
    kind = event.get("event")
    return kind == "marker" or (kind == "alarm" and event.get("state") == "on")


class Order(NamedTuple):
    """What the run wants.

    Attributes
    ----------
    kind : str
        ``start`` a recording, ``stop`` it, write an ``event``, or ``close`` after the last read.
    what : str or dict
        Name of the file; why it ends; the event.
    moment : int, [ns]
        Monotonic, of the event.
    """

    kind: str
    what: Any
    moment: int


@dataclass(frozen=True, slots=True)
class RecordingRule:
    """How it is recorded.

    Attributes
    ----------
    strain : bool
        Whether decoded samples stand beside the raw bytes.
    split_time : float, [s]
    split_size : float, [bytes]
        A new part begins when a file is so old or so long; infinite for never.
    around : tuple of float or None, [s]
        Record only from so long before a marker, an alarm or a lost port to so long after it, a
        recording for each; None for all the time.
    """

    strain: bool = True
    split_time: float = float("inf")
    split_size: float = float("inf")
    around: tuple[float, float] | None = None


@dataclass(slots=True)
class RecorderState:
    """How far the recorder is.

    Attributes
    ----------
    path : Path or None
        Path of the file that is being written or waits for free space; None where nothing is
        recorded.
    length : int
        Bytes of that file that are whole.
    bytes : int
        Raw bytes in the recording.
    part : int
        Number of the part that is being written, from 1.
    written : int
        Bytes of the recording's parts before it.
    began : tuple of str, int and int
        Name of the recording that goes on, and its start on the wall clock and on the monotonic
        one, [ns]: the same in all its parts.
    since : float, [s]
        When the recording began, monotonic.
    raw, strain, results, orders : int
        Cursors of the queues: what is before them was done.
    done : int
        Orders so far.
    cpu : float, [s]
        Time that the recorder has used.
    answer : str
        Why the last recording could not be started; empty if it was.
    error : str
        Why nothing can be written at the moment; empty if it can.
    waits : Path or None
        Path of the recording that the next trigger starts.
    until : int, [ns]
        Monotonic, when the recording around a trigger ends.
    recordings : int
        That were begun.
    failures : int
        How often writing has failed.
    free, rate : float, [bytes], [bytes/s]
        Room on the disk; what the recording grows by.
    """

    path: Path | None = None
    length: int = 0
    bytes: int = 0
    part: int = 1
    written: int = 0
    began: tuple[str, int, int] = ("", 0, 0)
    since: float = 0.0
    raw: int = 0
    strain: int = 0
    results: int = 0
    orders: int = 0
    done: int = 0
    cpu: float = 0.0
    answer: str = ""
    error: str = ""
    waits: Path | None = None
    until: int = 0
    recordings: int = 0
    failures: int = 0
    free: float = float("nan")
    rate: float = float("nan")

    def as_document(self, lost_bytes: int) -> dict[str, Any]:
        """Return what the page shows of it; a number that is not known is null."""
        going = self.path is not None
        minutes = (time.monotonic() - self.since) / 60.0 if going else None
        left = self.free / self.rate / 60.0 if self.rate > 0.0 else None
        return {
            "file": self.path.name if self.path else "",
            "part": self.part,
            "waits_for_trigger": self.waits is not None and not going,
            "recordings": self.recordings,
            "bytes": self.written + self.length,
            "raw_bytes": self.bytes,
            "minutes": minutes,
            "free_bytes": self.free if self.free == self.free else None,
            "bytes_per_s": self.rate if self.rate == self.rate else None,
            "minutes_left": left,
            "error": self.error,
            "failures": self.failures,
            "lost_bytes": lost_bytes,
        }
