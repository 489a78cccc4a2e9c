"""One session at the bench: take news of a source, show them, until something ends it."""

import time
from collections import Counter, deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol

from tirebench.deadline import Deadline
from tirebench.errors import BenchError
from tirebench.estimator.chain import Turn, quantity_valid
from tirebench.estimator.estimation import News
from tirebench.estimator.wheels import Wheels
from tirelib.core.flags import flag_names

LONGEST_WAIT = 0.2
"""The longest wait for news before the screen is looked after, [s]."""


class Source(Protocol):
    """Where news come from: the live chain, or a recording.

    Attributes
    ----------
    name : str
        Name of the port or the file.
    live : bool
        Whether time passes at the other end.
    ended, message : str
        Why nothing will come any more, empty while something may; what is to be said of it.
    wheels : Wheels
        Counters and clocks.
    heard, lost : float or None, [s]
        When bytes came last and when the port went away, on `time.time`; None if not.
    last_byte : float or None, [s]
        When bytes came last, on `time.monotonic`.
    """

    live: bool
    ended: str
    message: str

    @property
    def name(self) -> str:
        """Return what is read."""

    @property
    def wheels(self) -> Wheels:
        """Return counters and clocks."""

    @property
    def heard(self) -> float | None:
        """Return when bytes came last."""

    @property
    def lost(self) -> float | None:
        """Return when the port went away."""

    @property
    def last_byte(self) -> float | None:
        """Return when bytes came last, on the monotonic clock."""

    def counts(self) -> dict[str, Any]:
        """Return the counts of restarts, skipped turns and unrecorded bytes."""

    def cpu_time(self) -> float:
        """Return what the processes beside this one have used, [s]."""

    def wheel_counts(self, wheel: int) -> dict[str, int]:
        """Return what was skipped of a wheel."""

    def poll(self, deadline: Deadline) -> News:
        """Return what has come by the deadline, at once when there is something."""

    def finish(self, reason: str) -> News:
        """End in good order and return what was left."""


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
    """Result of a session.

    Attributes
    ----------
    reason : str
        ``end`` (of a recording), ``duration``, ``silence``, ``turns``, ``stopped``, ``unplugged``.
    message : str
        Message of the port that went away.
    count, valid, with_load : int
        Turns so far, those that may be used as a whole, and those whose Fz may be used.
    spoiled : Counter of str
        Names of the flags of the turns whose Fz may not be used.
    turns : list of Turn
        In the order in which their bytes came; empty unless they are to be kept.
    error : BenchError or None
        What ended it after the first turn, to be raised when all is written (``error``).
    latency : deque of float, [s]
        Arrival of the bytes that ended a turn to its estimate; the last 10,000.
    """

    reason: str = "end"
    message: str = ""
    count: int = 0
    valid: int = 0
    with_load: int = 0
    spoiled: Counter[str] = field(default_factory=Counter)
    turns: list[Turn] = field(default_factory=list)
    error: BenchError | None = None
    latency: deque[float] = field(default_factory=lambda: deque(maxlen=10_000))


class Session:
    """Take news until something ends it.

    Parameters
    ----------
    source : Source
    limits : Limits
    keep : bool
        Keep all turns in the outcome.
    watch : callable, optional
        Called with what is new, also when nothing is; for the screen.

    Attributes
    ----------
    outcome : Outcome
    watch : callable or None
    """

    def __init__(
        self,
        source: Source,
        *,
        limits: Limits | None = None,
        keep: bool = True,
        watch: Callable[[News], None] | None = None,
    ) -> None:
        self.outcome = Outcome()
        self._source = source
        self._limits = limits or Limits()
        self._keep = keep
        self.watch = watch
        self._stopped = False

    def stop(self) -> None:
        """Ask the session to end; safe in a signal handler."""
        self._stopped = True

    def run(self) -> Outcome:
        """Go on until a limit, the end of the source, or `stop`."""
        limits, outcome = self._limits, self.outcome
        end = Deadline.never() if limits.duration is None else Deadline.after(limits.duration)
        while True:
            if self._stopped:
                outcome.reason = "stopped"
            elif self._source.ended:
                outcome.reason, outcome.message = self._source.ended, self._source.message
            elif end.expired:
                outcome.reason = "duration"
            elif limits.turns is not None and outcome.count >= limits.turns:
                outcome.reason = "turns"
            elif self._silent():
                outcome.reason = "silence"
            else:
                try:
                    self._note(self._source.poll(end.sooner(LONGEST_WAIT)))
                    continue
                except BenchError as error:
                    if not outcome.count:
                        raise
                    outcome.reason, outcome.error = "error", error
            break
        self._note(self._source.finish(outcome.reason))
        order = {wheel: place for place, wheel in enumerate(self._source.wheels.heard)}
        outcome.turns.sort(key=lambda turn: (turn.arrival, order[turn.wheel]))
        return outcome

    def _silent(self) -> bool:
        limit, last = self._limits.silence, self._source.last_byte
        return limit is not None and last is not None and time.monotonic() - last > limit

    def _note(self, news: News) -> None:
        self.outcome.count += len(news.turns)
        self.outcome.valid += sum(turn.valid for turn in news.turns)
        lost = [turn for turn in news.turns if not quantity_valid(turn, "Fz")]
        self.outcome.with_load += len(news.turns) - len(lost)
        self.outcome.spoiled.update(name for turn in lost for name in flag_names(turn.flags))
        self.outcome.latency.extend(news.latency)
        if self._keep:
            self.outcome.turns.extend(news.turns)
        if self.watch is not None:
            self.watch(news)
