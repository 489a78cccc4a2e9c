"""One session at the bench: read a link, record, estimate, until something ends it."""

import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

from bench.chain import Turn
from bench.deadline import Deadline
from bench.errors import UnpluggedError
from bench.links import BACK, Link, Read
from bench.recording import Recorder
from bench.wheels import Wheels

WAIT = 0.2
"""The longest wait for bytes before the screen is looked after, [s]."""


@dataclass(frozen=True, slots=True)
class Limits:
    """When a session ends by itself; None for never.

    Attributes
    ----------
    duration : float or None, [s]
        Since the session's start.
    silence : float or None, [s]
        Without a byte, after the first has come.
    turns : int or None
    """

    duration: float | None = None
    silence: float | None = None
    turns: int | None = None


@dataclass(slots=True)
class Outcome:
    """What a session brought.

    Attributes
    ----------
    reason : str
        ``end`` (of a recording), ``duration``, ``silence``, ``turns``, ``stopped``, ``unplugged``.
    message : str
        Of the port that went away.
    count, valid : int
        Turns so far, and those that may be used.
    turns : list of Turn
        Empty unless they are to be kept.
    latency : deque of float, [s]
        Arrival of the bytes that ended a turn to its estimate; the last 1000.
    """

    reason: str = "end"
    message: str = ""
    count: int = 0
    valid: int = 0
    turns: list[Turn] = field(default_factory=list)
    latency: deque[float] = field(default_factory=lambda: deque(maxlen=1000))


class Session:
    """Read, record, estimate.

    Parameters
    ----------
    link : Link
    wheels : Wheels
        The decoder and a chain for each wheel.
    recorder : Recorder, optional
        Gets every byte before it is decoded.
    limits : Limits
    keep : bool
        Keep all turns in the outcome.
    watch : callable, optional
        Called with the new turns after each read, an empty list included; for the screen.
    """

    def __init__(
        self,
        link: Link,
        wheels: Wheels,
        *,
        recorder: Recorder | None = None,
        limits: Limits | None = None,
        keep: bool = True,
        watch: Callable[[list[Turn]], None] | None = None,
    ) -> None:
        self.outcome = Outcome()
        self._link = link
        self._wheels = wheels
        self._recorder = recorder
        self._limits = limits or Limits()
        self._keep = keep
        self._watch = watch
        self._stopped = False
        self._overruns: int | None = None
        self._next_look = 0.0

    def stop(self) -> None:
        """Ask the session to end; safe in a signal handler."""
        self._stopped = True

    def run(self) -> Outcome:
        """Go on until a limit, the end of the link, or `stop`."""
        limits, outcome = self._limits, self.outcome
        end = Deadline.never() if limits.duration is None else Deadline.after(limits.duration)
        last_byte: float | None = None
        while True:
            if self._stopped:
                outcome.reason = "stopped"
            elif end.expired:
                outcome.reason = "duration"
            elif limits.turns is not None and outcome.count >= limits.turns:
                outcome.reason = "turns"
            elif self._silent(last_byte):
                outcome.reason = "silence"
            else:
                try:
                    read = self._link.receive(end.sooner(WAIT))
                except UnpluggedError as error:
                    outcome.reason, outcome.message = "unplugged", str(error)
                    break
                if read is None:
                    break
                last_byte = time.monotonic() if read.data else last_byte
                self._take(read)
                continue
            break
        self._note(self._wheels.finish())
        return outcome

    def _silent(self, last_byte: float | None) -> bool:
        limit = self._limits.silence
        if limit is None or last_byte is None:
            return False
        return time.monotonic() - last_byte > limit

    def _take(self, read: Read) -> None:
        if self._recorder is not None and (read.data or read.event):
            self._recorder.read(read)
        if read.event == BACK:
            self._wheels.interrupt()
        if not read.data:
            self._note([])
            return
        turns = self._wheels.push(read.data, read.arrival)
        self._wheels.line.counts.overruns += self._new_overruns()
        if turns and self._link.live:
            self.outcome.latency.append(1e-9 * (time.monotonic_ns() - read.arrival))
        self._note(turns)

    def _new_overruns(self) -> int:
        """Return the overruns of the port since it was last asked, once a second."""
        now = time.monotonic()
        if now < self._next_look:
            return 0
        self._next_look = now + 1.0
        seen, self._overruns = self._overruns, self._link.overruns()
        return 0 if seen is None else self._overruns - seen

    def _note(self, turns: list[Turn]) -> None:
        self.outcome.count += len(turns)
        self.outcome.valid += sum(turn.valid for turn in turns)
        if self._keep:
            self.outcome.turns.extend(turns)
        if self._watch is not None:
            self._watch(turns)
