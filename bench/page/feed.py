"""What the run tells its page: turns, laps and the state of the line, onto the board.

This is all that the page costs the run: some writes to memory, never a wait.
"""

import json
import math
import time
from collections import Counter, deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from bench.chain import Turn
from bench.deadline import Deadline
from bench.document import turn_document, wheel_document
from bench.errors import UnpluggedError
from bench.links import BACK, LOST, Link, Read
from bench.page.board import Board
from bench.page.laps import Laps
from bench.wheels import Wheels

STATE_EVERY = 0.25
"""Time between two states, [s]."""
LATE = 0.1
"""When an estimate took longer than this from its bytes, laps are left out, [s]."""
LATENCIES = 1000
MESSAGES = 5
"""Messages of the FMU that are shown."""
FLAGS = 8
FLAG_LENGTH = 160
"""Flags and notes of a turn that the page gets: so many, so long; the document has all."""


class Sink(Protocol):
    """What records."""

    def read(self, read: Read) -> None:
        """Record a read of the link."""


class WatchedLink:
    """A link that tells when bytes came and when the port went away; see `bench.links.Link`.

    Parameters
    ----------
    link : Link
    sink : Sink, optional
        Gets every read before anybody decodes it.

    Attributes
    ----------
    arrival : int, [ns]
        Of the last bytes, monotonic; 0 before.
    lost : float or None, [s]
        When the port went away, on `time.time`; None while it is there.
    heard : float or None, [s]
        When bytes came last, on `time.time`.
    """

    def __init__(self, link: Link, sink: Sink | None = None) -> None:
        self.name, self.live, self.encoding = link.name, link.live, link.encoding
        self.arrival = 0
        self.heard: float | None = None
        self.lost: float | None = None
        self._link = link
        self._sink = sink

    def receive(self, deadline: Deadline) -> Read | None:
        """Return what has come by the deadline."""
        try:
            read = self._link.receive(deadline)
        except UnpluggedError:
            self.lost = time.time() if self.lost is None else self.lost
            raise
        if read is None:
            return None
        if self._sink is not None and (read.data or read.event):
            self._sink.read(read)
        if read.event == LOST:
            self.lost = time.time()
        elif read.event == BACK or read.data:
            self.lost = None
        if read.data:
            self.heard, self.arrival = time.time(), time.monotonic_ns()
        return read

    def close(self) -> None:
        """Give the port back."""
        self._link.close()

    def overruns(self) -> int:
        """Return the overruns so far."""
        return self._link.overruns()


@dataclass(frozen=True, slots=True)
class About:
    """What the page says of the run.

    Attributes
    ----------
    link, fmu, tire : str
    lateral : tuple of float, [m]
        ISO 8855, left positive, as the gages are numbered.
    """

    link: str
    fmu: str = ""
    tire: str = ""
    lateral: tuple[float, ...] = (0.06, 0.03, 0.0, -0.03, -0.06)


class Feed:
    """Write to the board what the run brings.

    Parameters
    ----------
    board : Board
    wheels : Wheels
        Its chains are watched as they appear.
    link : WatchedLink
    about : About
    extra : callable, optional
        More for the state: recording, restarts of the page.

    Attributes
    ----------
    late : int
        Laps that were left out because the run was late.
    """

    def __init__(
        self,
        board: Board,
        wheels: Wheels,
        link: WatchedLink,
        about: About,
        extra: Callable[[], Mapping[str, Any]] = dict,
    ) -> None:
        self.late = 0
        self._board = board
        self._wheels = wheels
        self._link = link
        self._about = about
        self._extra = extra
        self._laps: dict[int, Laps] = {}
        self._count: Counter[int] = Counter()
        self._invalid: Counter[int] = Counter()
        self._latency: deque[float] = deque(maxlen=LATENCIES)
        self._said: deque[str] = deque(maxlen=MESSAGES)
        self._ended = ""
        self._next = 0.0
        self._started = time.time()

    def watch(self, turns: Sequence[Turn], messages: Sequence[str] = ()) -> None:
        """Take what a read has brought, nothing included; called after each read."""
        self._said.extend(messages)
        for wheel in self._wheels.chains.keys() - self._laps.keys():
            laps = self._laps[wheel] = Laps(wheel)
            self._wheels.chains[wheel].watch = laps.samples
        for turn in turns:
            self._turn(turn)
        late = bool(turns) and self._link.live and self._latency[-1] > LATE
        for laps in self._laps.values():
            for lap in laps.take():
                if late:
                    self.late += 1
                else:
                    self._board.laps.put(lap.pack())
        now = time.monotonic()
        if now >= self._next:
            self._next = now + STATE_EVERY
            self._board.state.put(json.dumps(self.state()).encode())

    def end(self, reason: str) -> None:
        """Say that the run has ended."""
        self._ended = reason
        self._board.state.put(json.dumps(self.state()).encode())

    def _turn(self, turn: Turn) -> None:
        wheel = turn.wheel
        self._count[wheel] += 1
        self._invalid[wheel] += not turn.valid
        if wheel in self._laps:
            self._laps[wheel].turn(turn, self._count[wheel])
        self._latency.append(1e-9 * (time.monotonic_ns() - self._link.arrival))
        entry = turn_document(turn)
        entry["flags"] = [name[:FLAG_LENGTH] for name in entry["flags"][:FLAGS]]
        entry["turn"] = self._count[wheel]
        entry["came"], entry["told"] = self._link.heard, time.time()
        self._board.turns.put(json.dumps(entry).encode())

    def state(self) -> dict[str, Any]:
        """Return the state of the run as the page shows it."""
        about, latency = self._about, np.array(self._latency or (math.nan,))
        return {
            "link": about.link,
            "live": self._link.live,
            "fmu": about.fmu,
            "tire": about.tire,
            "axes": "ISO 8855",
            "lateral_mm": [1e3 * y for y in about.lateral],
            "started": self._started,
            "time": time.time(),
            "heard": self._link.heard,
            "lost": self._link.lost,
            "ended": self._ended,
            "latency_p99_ms": _finite(1e3 * float(np.percentile(latency, 99.0))),
            "left_out": self.late + self._board.turns.refused + self._board.laps.refused,
            "messages": [message[:FLAG_LENGTH] for message in self._said],
            "wheels": {str(wheel): self._wheel(wheel) for wheel in sorted(self._wheels.chains)},
            **self._extra(),
        }

    def _wheel(self, wheel: int) -> dict[str, Any]:
        chain = self._wheels.chains[wheel]
        age = math.nan
        if wheel in self._laps and self._laps[wheel].newest_us:
            taken = chain.clock.host_time(self._laps[wheel].newest_us)
            age = time.monotonic() - taken
        return {
            **wheel_document(chain),
            "turns": self._count[wheel],
            "invalid_turns": self._invalid[wheel],
            "laps_lost": self._laps[wheel].lost if wheel in self._laps else 0,
            "newest_sample_age_ms": _finite(1e3 * age),
        }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
