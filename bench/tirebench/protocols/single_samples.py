"""RAW12C: single samples that a SYNC frame before and after puts in time.

A counter of four bits cannot see a gap of sixteen samples. So samples are held until the next SYNC,
which tells how many there should have been; at 100 Hz that costs 10 ms. Where the counters explain
what is missing, the gap is placed; where they do not, the samples between the two SYNC frames are
dropped and counted, because the time of their measurement is unknown.
"""

import numpy as np

from tirebench.protocols.layouts import COUNTER_RANGE, decode_raw12c, decode_sync
from tirebench.wire.can_batch import ByteArray
from tirebench.wire.frames import Frames, Int16Array, IntArray
from tirebench.wire.line_counts import LineCounts
from tirelib.core.arrays import BoolArray

LONGEST_WAIT = 2**16
"""Samples that wait for a SYNC; then they are dropped."""


class SingleSamples:
    """The samples of one wheel between its SYNC frames.

    Parameters
    ----------
    wheel : int
    period : int
        Sample period in ticks of 0.1 us.
    counts : LineCounts
        `unplaced` is kept here.
    """

    def __init__(self, wheel: int, period: int, counts: LineCounts) -> None:
        self._wheel = wheel
        self._period = period
        self._counts = counts
        self._anchor: tuple[int, int] | None = None  # index, t_us of the last SYNC
        self._waiting: list[tuple[ByteArray, IntArray]] = []

    def push(self, sync: BoolArray, data: ByteArray, state: IntArray) -> list[Frames]:
        """Take frames in the order of the bus and return the samples that a SYNC confirms.

        Parameters
        ----------
        sync : bool array, shape (m,)
        data : uint8 array, shape (m, 8)
        state : int array, shape (m, 3)
            Flags, rssi and temperature that hold at each frame.
        """
        frames: list[Frames] = []
        first = 0
        for place in np.flatnonzero(sync).tolist():
            self._waiting.append((data[first:place], state[first:place]))
            index, t_us = decode_sync(data[place : place + 1])
            frames += self._close(int(index[0]), int(t_us[0]))
            first = place + 1
        self._waiting.append((data[first:], state[first:]))
        if sum(len(block) for block, _ in self._waiting) > LONGEST_WAIT:
            self.interrupt()
        return frames

    def interrupt(self) -> None:
        """Drop the waiting samples; the next SYNC starts again."""
        self._counts.unplaced += sum(len(block) for block, _ in self._waiting)
        self._waiting.clear()
        self._anchor = None

    def _close(self, index: int, t_us: int) -> list[Frames]:
        """Place the samples since the last SYNC."""
        data = np.concatenate([block for block, _ in self._waiting])
        state = np.concatenate([block for _, block in self._waiting])
        self._waiting.clear()
        anchor, self._anchor = self._anchor, (index, t_us)
        if not len(data):
            return []
        if anchor is None:
            self._counts.unplaced += len(data)
            return []
        counter, counts = decode_raw12c(data)
        span = (index - anchor[0]) % 2**32
        steps = np.diff(counter, prepend=anchor[0] - 1, append=index) % COUNTER_RANGE
        new = steps[:-1] > 0  # else the same sample again
        steps[-1] = steps[-1] or COUNTER_RANGE  # the sample before this SYNC was not the last one
        place = np.cumsum(steps[:-1])[new] - 1
        if int(steps.sum()) != span + 1 or not new.any():
            self._counts.unplaced += len(data)
            return []
        elapsed = (t_us - anchor[1]) % 2**32
        return [self._frames(counts[new], state[new], anchor, place, elapsed / span)]

    def _frames(
        self,
        counts: Int16Array,
        state: IntArray,
        anchor: tuple[int, int],
        place: IntArray,
        step: float,
    ) -> Frames:
        m = len(place)
        return Frames(
            wheel=np.full(m, self._wheel),
            seq=(anchor[0] + place) % 2**16,
            t_us=(anchor[1] + np.rint(place * step).astype(np.int64)) % 2**32,
            period=np.full(m, self._period),
            flags=state[:, 0],
            rssi=state[:, 1],
            temperature=state[:, 2],
            counts=counts[:, None, :],
        )
