"""Messages of the run to its page, written to the board: turns, laps and the state of the line.

This is all that the page costs the run: some writes to memory, never a wait.
"""

import json
import math
import time
from collections import Counter, deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tirebench.estimator.chain import Turn
from tirebench.estimator.estimation import News
from tirebench.estimator.session import Source
from tirebench.estimator.wheels import Wheels
from tirebench.live.board import Board
from tirebench.page.alarms import RULES, Alarm, Alarms, Rule, event_of
from tirebench.page.condition_lines import in_use
from tirebench.page.quantities import UNITS
from tirebench.page.recent import Recent
from tirebench.recording.document import turn_document, wheel_document
from tirebench.wire.conditions import UNKNOWN, Conditions

STATE_EVERY = 0.25
"""Time between two states, [s]."""
LATENCIES = 1000
MESSAGES = 5
"""Messages of the FMU that are shown."""
FLAGS = 8
FLAG_LENGTH = 160
"""Flags and notes of a turn that the page gets: so many, so long; the document has all."""
OF_DECODED = ("silence", "rate", "loss", "delay")
"""Alarms that say nothing of the transmitter while what it sends is only recorded."""
NOTHING_KNOWN = Conditions((0,), (UNKNOWN,))


@dataclass(frozen=True, slots=True)
class About:
    """Facts about the run that the page shows.

    Attributes
    ----------
    link, fmu, tire : str
    lateral : tuple of float, [m]
        ISO 8855, left positive, as the gages are numbered.
    conditions : Conditions
        Conditions that are known besides those from a bus.
    origin : str
        Where they come from, in words.
    folder : Path
        Where device files are written that the page asks for.
    """

    link: str
    fmu: str = ""
    tire: str = ""
    lateral: tuple[float, ...] = (0.06, 0.03, 0.0, -0.03, -0.06)
    conditions: Conditions = NOTHING_KNOWN
    origin: str = "option"
    folder: Path = Path()


class Feed:
    """Write to the board what the run brings.

    Parameters
    ----------
    board : Board
    source : Source
    about : About
    extra : callable, optional
        More for the state: recording, processes that were started again.
    rules : mapping of name to Rule
        Limits of the alarms.
    note : callable, optional
        Takes the event of each alarm that begins or ends.
    """

    def __init__(
        self,
        board: Board,
        source: Source,
        about: About,
        extra: Callable[[], Mapping[str, Any]] = dict,
        rules: Mapping[str, Rule] = RULES,
        note: Callable[[dict[str, Any]], None] | None = None,
    ) -> None:
        self._board = board
        self._source = source
        self._about = about
        self._extra = extra
        self._alarms = Alarms(rules)
        self._note = note
        self._recent: dict[int, Recent] = {}
        self._last: dict[int, dict[str, Any]] = {}
        self._left_out = 0
        self._count: Counter[int] = Counter()
        self._invalid: Counter[int] = Counter()
        self._latency: deque[float] = deque(maxlen=LATENCIES)
        self._said: deque[str] = deque(maxlen=MESSAGES)
        self._ended = ""
        self._unwritten = ""
        self._next = 0.0
        self._started = time.time()

    def watch(self, news: News, unwritten: str = "") -> None:
        """Take what is new, also when nothing is; called again and again.

        `unwritten` says why turns cannot be written at the moment; empty if they can.
        """
        self._unwritten = unwritten
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
        self._last[turn.wheel] = entry
        self._board.turns.put(json.dumps(entry).encode())

    def state(self) -> dict[str, Any]:
        """Return the state of the run as the page shows it."""
        about, latency = self._about, np.array(self._latency or (math.nan,))
        extra = dict(self._extra())
        wheels = {wheel: self._wheel(wheel) for wheel in sorted(self._source.wheels.heard)}
        self._watch_limits(wheels, extra)
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
            "wheels": {str(wheel): entry for wheel, entry in wheels.items()},
            "alarms": self._alarms.document(),
            **extra,
        }

    def _wheel(self, number: int) -> dict[str, Any]:
        wheel = self._source.wheels.heard[number]
        age = time.monotonic() - wheel.clock.host_time(wheel.newest_us)
        recent = self._recent.setdefault(number, Recent())
        turns, invalid = self._count[number], self._invalid[number]
        return {
            **wheel_document(self._source.wheels, number),
            **self._source.wheel_counts(number),
            "turns": turns,
            "invalid_turns": invalid,
            "newest_sample_age_ms": _finite(1e3 * age),
            **(recent.look(wheel, turns, invalid) if self._source.live else {}),
            **vitals(self._source.wheels, number),
            "in_use": in_use(wheel, self._about.conditions, self._about.origin),
        }

    def _watch_limits(self, wheels: dict[int, dict[str, Any]], extra: dict[str, Any]) -> None:
        """Let alarms begin and end with what is known now; a replay has none."""
        if not self._source.live or self._ended:
            return
        now, chain = time.time(), extra.get("chain", {})
        busy = chain.get("raw", {}).get("alarm", "")
        changed = []
        for number, entry in wheels.items():
            values = self._watched(number, entry, now)
            if busy:
                changed += self._alarms.end(OF_DECODED, number, now)
                values = {name: x for name, x in values.items() if name not in OF_DECODED}
            changed += self._alarms.look(values, number, now)
        changed += [] if busy else self._unheard(now)
        for number, said in self._source.wheels.contradicted.items():
            self._alarms.report(f"sample rate of wheel {number}", said, now)
        for (name, wheel), said in self._source.wheels.silences(time.monotonic_ns()).items():
            self._alarms.report(f"{name} of {wheel} from the bus", said, now)
        for source, said in chain.get("given_up", {}).items():
            self._alarms.report(f"port of source {source}", said, now)
        self._alarms.report("busy", busy, now)  # the run writes these into the recording
        self._alarms.report("json", self._unwritten, now)
        recorded = chain.get("recording", {})
        free = recorded.get("free_bytes")
        room = {
            "minutes_left": recorded.get("minutes_left"),
            "disk": None if free is None else 1e-9 * free,
        }
        changed += self._alarms.look(room, None, now)
        if self._note is not None:
            for alarm in changed:
                self._note(event_of(alarm))

    def _unheard(self, now: float) -> list[Alarm]:
        """Watch sources without a frame, and wheels that are known and were not heard."""
        wheels, waited = self._source.wheels, now - self._started
        rung = self._alarms.rules["silence"].beyond(waited, already=False)
        hints, changed = wheels.hints() if rung else {}, []
        for source in range(len(wheels.lines)):
            changed += self._alarms.report(f"source {source}", hints.get(source, ""), now)
        for number in wheels.missing:
            changed += self._alarms.look({"silence": waited}, number, now)
        return changed

    def _watched(self, number: int, entry: dict[str, Any], now: float) -> dict[str, float | None]:
        """Return the values of a wheel that have limits."""
        age, heard = entry["newest_sample_age_ms"], self._source.heard
        last = self._last.get(number, {})
        silence = (
            None
            if age is None and heard is None
            else max(0.0 if age is None else 1e-3 * age, 0.0 if heard is None else now - heard)
        )
        return {
            "silence": silence,
            "rate": entry.get("rate_percent"),
            "loss": entry.get("loss_percent"),
            "saturated": entry.get("saturated_percent"),
            "invalid": entry.get("invalid_percent"),
            "delay": age,
            "signal": entry["rssi_dbm"],
            "temperature": entry["temperature_c"],
            "battery": entry["battery_v"],
            "tire_pressure": entry["tire_pressure_bar"],
            **{name: last[name] for name in UNITS if last.get(f"{name}_valid")},
        }


def vitals(wheels: Wheels, number: int) -> dict[str, float | None]:
    """Return the values of a wheel's HEALTH frame; null where it sends none."""
    wheel, health = wheels.heard[number], wheels.health(number)
    return {
        "rssi_dbm": wheel.rssi,
        "temperature_c": wheel.temperature,
        "battery_v": None if health is None else health.battery or None,  # 0: not measured
        "tire_pressure_bar": None if health is None else 1e-5 * health.pressure or None,
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
