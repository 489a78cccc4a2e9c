"""What the run tells its page: turns, laps and the state of the line, onto the board.

This is all that the page costs the run: some writes to memory, never a wait.
"""

import json
import math
import time
from collections import Counter, deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from bench.chain import Turn
from bench.document import turn_document, wheel_document
from bench.estimation import News
from bench.page.board import Board
from bench.session import Source

STATE_EVERY = 0.25
"""Time between two states, [s]."""
LATENCIES = 1000
MESSAGES = 5
"""Messages of the FMU that are shown."""
FLAGS = 8
FLAG_LENGTH = 160
"""Flags and notes of a turn that the page gets: so many, so long; the document has all."""


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
    source : Source
    about : About
    extra : callable, optional
        More for the state: recording, processes that were started again.
    """

    def __init__(
        self,
        board: Board,
        source: Source,
        about: About,
        extra: Callable[[], Mapping[str, Any]] = dict,
    ) -> None:
        self._board = board
        self._source = source
        self._about = about
        self._extra = extra
        self._left_out = 0
        self._count: Counter[int] = Counter()
        self._invalid: Counter[int] = Counter()
        self._latency: deque[float] = deque(maxlen=LATENCIES)
        self._said: deque[str] = deque(maxlen=MESSAGES)
        self._ended = ""
        self._next = 0.0
        self._started = time.time()

    def watch(self, news: News) -> None:
        """Take what is new, also when nothing is; called again and again."""
        self._said.extend(news.messages)
        self._latency.extend(news.latency)
        self._left_out += news.left_out
        for turn in news.turns:
            self._turn(turn)
        for lap in news.laps:
            self._board.laps.put(lap)
        now = time.monotonic()
        if now >= self._next:
            self._next = now + STATE_EVERY
            self._board.state.put(json.dumps(self.state()).encode())

    def end(self, reason: str) -> None:
        """Say that the run has ended."""
        self._ended = reason
        self._board.state.put(json.dumps(self.state()).encode())

    def _turn(self, turn: Turn) -> None:
        self._count[turn.wheel] += 1
        self._invalid[turn.wheel] += not turn.valid
        entry = turn_document(turn)
        entry["flags"] = [name[:FLAG_LENGTH] for name in entry["flags"][:FLAGS]]
        entry["turn"] = self._count[turn.wheel]
        now = time.time()
        waited = 1e-9 * (time.monotonic_ns() - turn.arrival) if self._source.live else 0.0
        entry["came"], entry["told"] = now - waited, now
        self._board.turns.put(json.dumps(entry).encode())

    def state(self) -> dict[str, Any]:
        """Return the state of the run as the page shows it."""
        about, latency = self._about, np.array(self._latency or (math.nan,))
        return {
            "link": about.link,
            "live": self._source.live,
            "fmu": about.fmu,
            "tire": about.tire,
            "axes": "ISO 8855",
            "lateral_mm": [1e3 * y for y in about.lateral],
            "started": self._started,
            "time": time.time(),
            "heard": self._source.heard,
            "lost": self._source.lost,
            "ended": self._ended,
            "latency_p99_ms": _finite(1e3 * float(np.percentile(latency, 99.0))),
            "left_out": self._left_out + self._board.turns.refused + self._board.laps.refused,
            "messages": [message[:FLAG_LENGTH] for message in self._said],
            "wheels": {
                str(wheel): self._wheel(wheel) for wheel in sorted(self._source.wheels.heard)
            },
            **self._extra(),
        }

    def _wheel(self, number: int) -> dict[str, Any]:
        wheel = self._source.wheels.heard[number]
        age = time.monotonic() - wheel.clock.host_time(wheel.newest_us)
        return {
            **wheel_document(self._source.wheels, number),
            **self._source.wheel_counts(number),
            "turns": self._count[number],
            "invalid_turns": self._invalid[number],
            "newest_sample_age_ms": _finite(1e3 * age),
        }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
