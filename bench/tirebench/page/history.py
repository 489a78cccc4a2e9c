"""The page's memory of past turns, and the messages to viewers.

A message is a length (u32), a JSON header padded to 8 bytes, and the arrays that the header lists,
each padded to 8 bytes, little-endian.
"""

import json
import struct
import time
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from tirebench.estimator.laps import BAND_LAPS, Float32Array, Lap, band
from tirebench.live.board import Board, RingReader
from tirebench.page.quantities import NORMAL_95, UNITS

REMEMBERED = 6000
"""Turns of a wheel: 7 min at 14 turns a second."""
BAND_EVERY = 0.25
"""Interval at which a band is computed again, [s]."""
COLUMNS = ("time", *(f"{name}{part}" for name in UNITS for part in ("", "_95")), "valid")
"""Columns of the rows of turns; ``valid`` is a sum of bits: the quantities in order, the turn."""


@dataclass(slots=True)
class WheelHistory:
    """One wheel.

    Attributes
    ----------
    rows : deque
        A row of `COLUMNS` for each turn.
    count : int
        Turns so far, those that are forgotten included.
    last : dict
        The last turn as the document of a recording has it.
    laps : deque of float32 array, shape (5, 720)
    lap : Lap or None
        The last one.
    """

    rows: deque[list[float]] = field(default_factory=lambda: deque(maxlen=REMEMBERED))
    count: int = 0
    last: dict[str, Any] = field(default_factory=dict)
    laps: deque[Float32Array] = field(default_factory=lambda: deque(maxlen=BAND_LAPS))
    lap: Lap | None = None
    lap_count: int = 0
    band_count: int = 0
    _band: Float32Array | None = None
    _band_laps: int = -1
    _band_time: float = 0.0

    def band(self) -> Float32Array | None:
        """Return the band of the last laps; None before the second."""
        if len(self.laps) < 2:
            return None
        now = time.monotonic()
        if self._band is None or (
            self._band_laps != self.lap_count and now - self._band_time >= BAND_EVERY
        ):
            self._band, self._band_laps, self._band_time = (
                band(list(self.laps)),
                self.lap_count,
                now,
            )
            self.band_count += 1
        return self._band


class History:
    """Everything that the page knows, read from the board.

    Attributes
    ----------
    wheels : dict of wheel to WheelHistory
    state : dict
        The newest state of the run; empty before the first.
    states : int
        States so far.
    """

    def __init__(self, board: Board) -> None:
        self.wheels: dict[int, WheelHistory] = {}
        self.state: dict[str, Any] = {}
        self.states = 0
        self._turns = RingReader(board.turns)
        self._laps = RingReader(board.laps)
        self._states = RingReader(board.state, newest=1)

    @property
    def missed(self) -> int:
        """Turns and laps that were overwritten before this process read them."""
        return self._turns.missed + self._laps.missed

    def update(self) -> bool:
        """Read what is new; return whether there was anything."""
        turns, laps, states = self._turns.take(), self._laps.take(), self._states.take()
        for message in turns:
            self._turn(json.loads(message))
        newest: dict[int, Lap] = {}
        for message in laps:
            lap = Lap.unpack(message)
            wheel = self.wheels.setdefault(lap.wheel, WheelHistory())
            wheel.laps.append(lap.on_grid())
            wheel.lap_count += 1
            newest[lap.wheel] = lap
        for number, lap in newest.items():
            self.wheels[number].lap = lap
        if states:
            self.state = json.loads(states[-1])
            self.states += 1
        return bool(turns or laps or states)

    def _turn(self, entry: dict[str, Any]) -> None:
        wheel = self.wheels.setdefault(entry["wheel"], WheelHistory())
        row = [entry["device_time"]]
        bits = 0
        for place, name in enumerate(UNITS):
            std = entry[f"{name}_std"]
            row += [_nan(entry[name]), NORMAL_95 * _nan(std)]
            bits |= bool(entry[f"{name}_valid"]) << place
        row.append(float(bits | bool(entry["valid"]) << len(UNITS)))
        if wheel.last and wheel.last["segment"] != entry["segment"]:
            wheel.rows.append([row[0], *(float("nan"),) * (len(COLUMNS) - 2), 0.0])
            wheel.count += 1
        wheel.rows.append(row)
        wheel.count += 1
        wheel.last = entry


@dataclass(slots=True, eq=False)
class Viewer:
    """Position of one viewer in the history.

    Attributes
    ----------
    wheel : int or None
        Whose strain is shown; None for the first.
    skipped : int
        Messages that were left out because this viewer was slow.
    """

    wheel: int | None = None
    skipped: int = 0
    _turns: dict[int, int] = field(default_factory=dict)
    _state: int = 0
    _lap: tuple[int, int] = (-1, -1)
    _band: tuple[int, int] = (-1, -1)

    def message(self, history: History, page: dict[str, Any]) -> bytes | None:
        """Return what is new to this viewer; None if nothing is."""
        header: dict[str, Any] = {}
        arrays: list[npt.NDArray[Any]] = []
        turns = {}
        for number, wheel in history.wheels.items():
            fresh = min(wheel.count - self._turns.get(number, 0), len(wheel.rows))
            if fresh:
                rows = [wheel.rows[i] for i in range(-fresh, 0)]
                turns[number] = {"rows": len(arrays), "last": wheel.last}
                arrays.append(np.array(rows))
                self._turns[number] = wheel.count
        if turns:
            header["turns"] = turns
        lap = self._lap_of(history, arrays)
        if lap:
            header["lap"] = lap
        if self._state != history.states:
            self._state = history.states
            header["state"] = history.state
        if not header:
            return None
        return encode({**header, "page": {**page, "skipped": self.skipped}}, arrays)

    def _lap_of(self, history: History, arrays: list[npt.NDArray[Any]]) -> dict[str, Any] | None:
        number = self.wheel if self.wheel is not None else min(history.wheels, default=None)
        wheel = None if number is None else history.wheels.get(number)
        if number is None or wheel is None or wheel.lap is None:
            return None
        made = wheel.band()
        if self._lap == (number, wheel.lap_count) and self._band == (number, wheel.band_count):
            return None
        lap = wheel.lap
        entry = {
            "wheel": number,
            "turn": lap.turn,
            "valid": lap.valid,
            "laps": len(wheel.laps),
            "trace": len(arrays),
        }
        arrays.append(1e6 * wheel.laps[-1])
        self._lap = (number, wheel.lap_count)
        if made is not None and self._band != (number, wheel.band_count):
            self._band = (number, wheel.band_count)
            entry["band"] = len(arrays)
            arrays.append(1e6 * made)
        return entry


def encode(header: dict[str, Any], arrays: Sequence[npt.NDArray[Any]]) -> bytes:
    """Return a message; see the module."""
    header = {**header, "arrays": [[array.dtype.str[1:], *array.shape] for array in arrays]}
    text = json.dumps(header).encode()
    text += b" " * (-(len(text) + 4) % 8)
    parts = [struct.pack("<I", len(text)), text]
    for array in arrays:
        data = np.ascontiguousarray(array).astype(array.dtype.newbyteorder("<")).tobytes()
        parts += [data, b"\0" * (-len(data) % 8)]
    return b"".join(parts)


def _nan(value: float | None) -> float:
    return float("nan") if value is None else value
