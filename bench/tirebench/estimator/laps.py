"""Strain of a turn over wheel angle: cut in the run, put on a grid and banded in the page."""

import math
import struct
from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from tirebench.wire.frames import GAGES

if TYPE_CHECKING:
    from tirebench.estimator.chain import Turn
    from tirebench.wire.timeline import Samples

Float32Array = npt.NDArray[np.float32]

SAMPLES_KEPT = 65_536
"""Samples of a wheel that are remembered: 6.5 s at 10 kHz."""
MOST_SAMPLES = 1440
"""A lap with more samples is thinned to every k-th."""
GRID = np.arange(-180.0, 180.0, 0.5)
"""Wheel angle of the page's traces, [deg]; 0 under the axle."""
BAND_LAPS = 50
"""Turns that a band is made of."""
PERCENTILES = (5.0, 95.0)
_HEAD = struct.Struct("<IIQiIdd")


@dataclass(frozen=True, slots=True, eq=False)
class Lap:
    """Samples of one turn, half of it before the contact and half after.

    Attributes
    ----------
    wheel, turn, segment : int
        Turn counts the estimates of the wheel from 1.
    valid : bool
        Validity of the turn's estimate.
    first, step : float, [deg]
        Wheel angle of the first sample, and from one to the next.
    strain : float32 array, shape (n, 5)
        NaN where lost or saturated.
    """

    wheel: int
    turn: int
    segment: int
    valid: bool
    first: float
    step: float
    strain: Float32Array

    def pack(self) -> bytes:
        """Return the lap as bytes."""
        head = _HEAD.pack(
            self.wheel, len(self.strain), self.turn, self.segment, self.valid, self.first, self.step
        )
        return head + self.strain.tobytes()

    @classmethod
    def unpack(cls, data: bytes) -> "Lap":
        """Return the lap of `pack`."""
        wheel, n, turn, segment, valid, first, step = _HEAD.unpack_from(data)
        strain = np.frombuffer(data, np.float32, n * GAGES, _HEAD.size).reshape(n, GAGES)
        return cls(wheel, turn, segment, bool(valid), first, step, strain)

    def on_grid(self) -> Float32Array:
        """Return the strain at `GRID`, shape (5, 720); NaN where it is unknown."""
        angle = self.first + self.step * np.arange(len(self.strain))
        rows = [np.interp(GRID, angle, gage, np.nan, np.nan) for gage in self.strain.T]
        return np.array(rows, dtype=np.float32)


@dataclass(frozen=True, slots=True)
class _Pending:
    """A contact whose second half turn is still to come; `middle` and `half` in samples."""

    turn: int
    segment: int
    valid: bool
    middle: float
    half: float

    @property
    def last(self) -> int:
        """Number of the first sample at or after the end of the lap."""
        return math.ceil(self.middle + self.half)


class Laps:
    """The samples of one wheel, cut into laps as the turns come.

    Attributes
    ----------
    lost : int
        Laps that were not in memory any more.
    """

    def __init__(self, wheel: int) -> None:
        self.wheel = wheel
        self.lost = 0
        self._rows = np.empty((SAMPLES_KEPT, GAGES), np.float32)
        self._used = 0
        self._start = 0  # number within the segment of the first row
        self._first = 0  # the same, of the first sample that the estimator was given
        self._segment = -1
        self._period = math.nan
        self._pending: deque[_Pending] = deque()
        self._last_contact = (-1, math.nan)

    def samples(self, block: "Samples") -> None:
        """Take samples before they are stepped."""
        if block.segment != self._segment:
            self._pending.clear()
            self._segment, self._start, self._used = block.segment, block.start, 0
            self._first = block.start
        self._period = block.period
        strain = block.strain[-SAMPLES_KEPT // 2 :]
        if len(strain) < len(block.strain):
            self._used = 0  # what is left out may not be bridged
        if self._used + len(strain) > SAMPLES_KEPT:
            kept = min(self._used, SAMPLES_KEPT // 2)
            self._rows[:kept] = self._rows[self._used - kept : self._used]
            self._used = kept
        shown = min(strain.shape[1], GAGES)  # the chart has room for five
        self._rows[self._used : self._used + len(strain), :shown] = strain[:, :shown]
        self._rows[self._used : self._used + len(strain), shown:] = np.nan
        self._used += len(strain)
        self._start = block.start + len(block.strain) - self._used

    def turn(self, turn: "Turn", number: int) -> None:
        """Note that a turn has ended; `number` counts from 1."""
        contact = turn.outputs.get("contact_time", math.nan)
        last_segment, last = self._last_contact
        self._last_contact = (turn.segment, contact)
        duration = 2.0 * math.pi / (turn.outputs.get("turn_rate", math.nan) or math.nan)
        if not math.isfinite(duration) and last_segment == turn.segment:
            duration = contact - last
        if turn.segment != self._segment or not (math.isfinite(contact) and duration > 0.0):
            return
        middle, half = self._first + contact / self._period, 0.5 * duration / self._period
        self._pending.append(_Pending(number, turn.segment, turn.valid, middle, half))

    def take(self) -> list[Lap]:
        """Return the laps whose last sample has come."""
        end, laps = self._start + self._used, []
        while self._pending and self._pending[0].last < end:
            lap = self._cut(self._pending.popleft())
            if lap is None:
                self.lost += 1
            else:
                laps.append(lap)
        return laps

    def _cut(self, pending: _Pending) -> Lap | None:
        first = math.floor(pending.middle - pending.half)
        last = pending.last
        if last - self._start >= self._used or last <= self._start:
            return None
        first = max(first, self._start)
        every = math.ceil((last - first) / MOST_SAMPLES)
        rows = self._rows[first - self._start : last - self._start + 1 : every]
        degrees = 180.0 / pending.half
        return Lap(
            self.wheel,
            pending.turn,
            pending.segment,
            pending.valid,
            degrees * (first - pending.middle),
            degrees * every,
            rows.copy(),
        )


def band(traces: list[Float32Array]) -> Float32Array:
    """Return 5 % and 95 % of traces on the grid, shape (2, 5, 720); what is NaN is left out.

    Percentiles are linear between the ranks, as `numpy.percentile` has them.
    """
    ranked = np.sort(np.stack(traces, axis=-1), axis=-1)  # NaN last
    count = np.isfinite(ranked).sum(axis=-1)
    rows = []
    for percent in PERCENTILES:
        rank = np.maximum(count - 1, 0) * (percent / 100.0)
        low = np.floor(rank).astype(np.intp)
        high = np.minimum(low + 1, np.maximum(count - 1, 0))
        below = np.take_along_axis(ranked, low[..., None], -1)[..., 0]
        above = np.take_along_axis(ranked, high[..., None], -1)[..., 0]
        rows.append(below + (rank - low).astype(np.float32) * (above - below))
    return np.array(rows, dtype=np.float32)
