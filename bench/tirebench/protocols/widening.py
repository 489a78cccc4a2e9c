"""Counters and clocks that wrap soon, made wide by the host's clock.

A number of 8 bits and a time of 24 bits wrap after 0.15 s and 16.8 s. The time that has passed at
the host says which turn of the device's clock is meant, and the device's clock then says which turn
of the number: only a host clock that is wrong by 8 s or more would mislead.
"""

from dataclasses import dataclass

import numpy as np

from tirebench.wire.frames import IntArray
from tirelib.core.arrays import FloatArray


@dataclass(slots=True)
class Widener:
    """Numbers and times of one wheel, to 16 and 32 bits.

    Attributes
    ----------
    frame_us : float, [us]
        Time that a frame covers.
    seq_range, time_range : int
        Where they wrap on the wire.
    tick : float, [us]
        Step of the device's clock.
    """

    frame_us: float
    seq_range: int = 2**8
    time_range: int = 2**24
    tick: float = 1.0
    _seq: int = -1
    _time: int = 0
    _arrival: int = 0

    def widen(self, seq: IntArray, t_us: IntArray, arrival: int) -> tuple[IntArray, IntArray]:
        """Return the numbers modulo 2**16 and times [us] modulo 2**32 of frames in order.

        Parameters
        ----------
        seq, t_us : int arrays, shape (m,), m > 0
            As sent, time in ticks.
        arrival : int, [ns]
            Arrival time of all values, monotonic.
        """
        if self._seq < 0:
            self._seq, self._time, self._arrival = int(seq[0]), int(t_us[0]), arrival
        expected = np.zeros(len(t_us))
        expected[0] = 1e-3 * (arrival - self._arrival) / self.tick  # as the host's clock says
        elapsed = _nearest(_steps(t_us, self._time), expected, self.time_range)
        frames = np.asarray(elapsed * (self.tick / self.frame_us), np.float64)
        steps = _nearest(_steps(seq, self._seq), frames, self.seq_range)
        times, numbers = self._time + np.cumsum(elapsed), self._seq + np.cumsum(steps)
        self._time, self._seq = int(times[-1]), int(numbers[-1])
        self._arrival = arrival
        return numbers % 2**16, np.rint(times * self.tick).astype(np.int64) % 2**32


def _steps(values: IntArray, before: int) -> IntArray:
    """Return each value less the one before it."""
    steps = values.copy()
    steps[0] -= before
    steps[1:] -= values[:-1]
    return steps


def _nearest(difference: IntArray, expected: FloatArray, span: int) -> IntArray:
    """Return what equals `difference` modulo `span` and lies nearest to what is expected."""
    turns = np.rint((expected - difference) / span).astype(np.int64)
    return np.asarray(difference + turns * span)
