"""Frames to an unbroken line of samples: sequence and device time make every loss visible.

Device time decides. A short gap is filled with NaN samples, so that time goes on; after a gap that
is too long to fill, a time reset, or a change of the sample period a new **segment** begins, and
whatever follows must forget what came before. What comes again or late is dropped and counted.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import zip_longest

import numpy as np
import numpy.typing as npt

from tirebench.wire.device import Device
from tirebench.wire.frames import GAGES, TICK, FrameFlag, Frames, select
from tirebench.wire.rate_check import PERIOD, RateCheck
from tirelib.core.arrays import BoolArray, FloatArray, IntArray

LONGEST_FILL = 1.0
"""A gap up to this long is filled with NaN, [s]; a longer one begins a new segment."""
LATEST_FRAME = 64
"""A frame up to this many numbers back is late; further back, the transmitter restarted."""
SEQ_RANGE = 2**16
TIME_RANGE = 2**32
_RESET = int(FrameFlag.TIME_RESET)
_COUNTED = (("low_battery", int(FrameFlag.LOW_BATTERY)), ("radio_loss", int(FrameFlag.RADIO_LOSS)))


@dataclass(slots=True)
class TimelineCounts:
    """What was lost and mended, in frames unless said otherwise.

    Attributes
    ----------
    gaps, lost_frames, lost_samples : int
        Places where something is missing; frames by sequence; samples by device time.
    duplicates, out_of_order : int
        Frames that came again, or late; they are dropped.
    other_wheel : int
        Good frames of a wheel that is not looked at.
    resets : int
        New segments after the first.
    saturated : list of int
        Samples of each gage at an end of its range.
    low_battery, radio_loss : int
        Frames with that flag.
    """

    gaps: int = 0
    lost_frames: int = 0
    lost_samples: int = 0
    duplicates: int = 0
    out_of_order: int = 0
    other_wheel: int = 0
    resets: int = 0
    saturated: list[int] = field(default_factory=lambda: [0] * GAGES)
    low_battery: int = 0
    radio_loss: int = 0

    def __add__(self, other: "TimelineCounts") -> "TimelineCounts":
        """Return the counts of two wheels together."""
        total = TimelineCounts()
        for name in TimelineCounts.__slots__:
            one, two = getattr(self, name), getattr(other, name)
            setattr(total, name, added(one, two) if name == "saturated" else one + two)
        return total


def added(one: Sequence[int], two: Sequence[int]) -> list[int]:
    """Return counts of gages, gage by gage; a wheel may have more of them than another."""
    return [a + b for a, b in zip_longest(one, two, fillvalue=0)]


PackedSamples = tuple[int, str, int, int, float, int, bytes, bytes, bytes]
"""Segment, reset, start, t_us, period and number of gages of `Samples`; strain, lost, saturated."""


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """Samples that follow each other without a gap in time.

    Attributes
    ----------
    segment : int
    reset : str
        Why a new segment begins with this block; empty if it goes on.
    start : int
        Number of the first sample within the segment.
    t_us : int, [us]
        Device time of the first sample, unwrapped; it never goes back, not even when a device
        clock that restarts does.
    period : float, [s]
    strain : array, shape (n, n_gages)
        NaN where lost or saturated.
    lost : bool array, shape (n,)
        True where no frame brought the sample.
    saturated : bool array, shape (n, n_gages)
    """

    segment: int
    reset: str
    start: int
    t_us: int
    period: float
    strain: FloatArray
    lost: BoolArray
    saturated: BoolArray

    @property
    def end(self) -> int:
        """Number of the sample that follows, within the segment."""
        return self.start + len(self.strain)

    @property
    def end_us(self) -> int:
        """Device time of the sample that follows, [us]."""
        return self.t_us + round(1e6 * self.period * len(self.strain))

    def pack(self) -> PackedSamples:
        """Return numbers and bytes, which go to another process in a tenth of an object's time."""
        head = (self.segment, self.reset, self.start, self.t_us, self.period, self.strain.shape[1])
        arrays = (self.strain, self.lost, self.saturated)
        return *head, *(array.tobytes() for array in arrays)

    @classmethod
    def unpack(cls, *packed: PackedSamples) -> "Samples":
        """Return packed samples, of which each goes on where the one before ends, in one block.

        Its arrays are read-only.
        """
        segment, reset, start, t_us, period, gages, *_ = packed[0]
        *_, strain, lost, saturated = zip(*packed, strict=True)
        return cls(
            segment,
            reset,
            start,
            t_us,
            period,
            np.frombuffer(b"".join(strain)).reshape(-1, gages),
            np.frombuffer(b"".join(lost), np.bool_),
            np.frombuffer(b"".join(saturated), np.bool_).reshape(-1, gages),
        )


class Timeline:
    """Put the frames of one wheel in line.

    Parameters
    ----------
    device : Device
        Counts to strain.
    wheel : int, optional
        Wheel to look at; by default that of the first frame.
    rate_said_by : str
        Where the sample rate is said, for a message.
    """

    def __init__(
        self, device: Device, wheel: int | None = None, rate_said_by: str = PERIOD
    ) -> None:
        self.counts = TimelineCounts()
        self.received = 0  # samples so far
        self.paused = 0.0  # between segments that the wheel itself parted, by its clock, s
        self.wheel = wheel
        self._device = device
        self._segment = -1
        self._start = 0  # samples in the segment so far
        self._seq = -1  # of the last frame
        self._wire_time = 0  # t_us of the last frame, as sent
        self._time = 0  # the same, unwrapped
        self._samples = 0  # in the last frame
        self._period = 0  # ticks
        self._gages = GAGES
        self._flagged = False  # last frame had the time-reset flag
        self._rate = RateCheck(rate_said_by)

    def push(self, frames: Frames) -> list[Samples]:
        """Take frames in the order of the wire and return what they add."""
        if self.wheel is None and len(frames):
            self.wheel = int(frames.wheel[0])
        mine = frames.wheel == self.wheel
        if not mine.all():
            self.counts.other_wheel += int((~mine).sum())
            frames = select(frames, mine)
        blocks: list[Samples] = []
        first = 0
        while first < len(frames):
            count = self._unbroken(frames, first)
            if count:
                rows = slice(first, first + count)
                blocks.append(self._block(select(frames, rows), ""))
                first += count
            else:
                blocks.extend(self._single(select(frames, slice(first, first + 1))))
                first += 1
        return blocks

    def _unbroken(self, frames: Frames, first: int) -> int:
        """Return the number of frames from `first` on that just continue what came before."""
        if self._segment < 0:
            return 0
        seq, sent = frames.seq[first:], frames.t_us[first:]
        steps, elapsed = np.empty_like(seq), np.empty_like(sent)
        steps[0], elapsed[0] = seq[0] - self._seq, sent[0] - self._wire_time
        np.subtract(seq[1:], seq[:-1], out=steps[1:])
        np.subtract(sent[1:], sent[:-1], out=elapsed[1:])
        ticks = _signed(elapsed, TIME_RANGE) * 10 - frames.samples * self._period
        ticks[0] += (frames.samples - self._samples) * self._period
        going = (steps % SEQ_RANGE == 1) & (np.abs(ticks) * 2 < self._period)
        going &= frames.period[first:] == self._period
        reset = (frames.flags[first:] & _RESET) != 0
        if self._flagged or reset.any():
            before = np.concatenate(([self._flagged], reset[:-1]))
            going &= ~reset | before
        return int(going.size if going.all() else np.argmin(going))

    def _single(self, frame: Frames) -> list[Samples]:
        """Take one frame that does not simply continue: decide what happened."""
        reset = bool(frame.flags[0] & _RESET) and not self._flagged
        if self._segment < 0:
            return [self._begin(frame, "start")]
        if reset:
            return [self._begin(frame, "time_reset")]
        if frame.period[0] != self._period:
            return [self._begin(frame, "period_change")]
        steps = _signed_one(int(frame.seq[0]) - self._seq, SEQ_RANGE)
        elapsed = _signed_one(int(frame.t_us[0]) - self._wire_time, TIME_RANGE)
        if steps == 0 and elapsed == 0:
            self.counts.duplicates += 1
            return []
        if -LATEST_FRAME <= steps < 0 and elapsed < 0:
            self.counts.out_of_order += 1
            return []
        missing = round(elapsed * 10 / self._period) - self._samples
        if missing < 0:
            return [self._begin(frame, "clock_back")]
        self.counts.gaps += 1
        self.counts.lost_frames += max((steps - 1) % SEQ_RANGE, 0)
        self.counts.lost_samples += missing
        if missing * self._period * TICK > LONGEST_FILL:
            return [self._begin(frame, "long_gap")]
        return [self._fill(missing), self._block(frame, "")]

    def _begin(self, frame: Frames, why: str) -> Samples:
        if self._segment < 0:
            self._time = int(frame.t_us[0])
        else:
            self.counts.resets += 1
            elapsed = _signed_one(int(frame.t_us[0]) - self._wire_time, TIME_RANGE)
            self._time += elapsed if elapsed > 0 else self._frame_time
            if why == "time_reset":
                self.paused += 1e-6 * max(elapsed - self._frame_time, 0)
        self._segment += 1
        self._start = 0
        return self._block(frame, why)

    @property
    def end_us(self) -> int:
        """Unwrapped device time of the sample that comes next, [us]."""
        return self._time + self._frame_time

    @property
    def contradiction(self) -> str:
        """What the wheel's clock shows against the sample rate that was said; empty: it agrees."""
        return self._rate.contradiction

    @property
    def judged(self) -> bool:
        """Whether the rate was held against the clock since the segment began."""
        return self._rate.judged

    @property
    def device(self) -> Device:
        """What the counts of the wheel mean."""
        return self._device

    @property
    def rate(self) -> float:
        """Sample rate of the gages, as the wheel says it, [Hz]; 0 before the first frame."""
        return 1.0 / (self._period * TICK) if self._period else 0.0

    @property
    def _frame_time(self) -> int:
        """Microseconds from the first sample of the last frame to the end of that frame."""
        return round(self._samples * self._period / 10)

    def _fill(self, missing: int) -> Samples:
        time = self._time + self._frame_time
        return self._samples_of(
            np.full((missing, self._gages), np.nan),
            np.ones(missing, np.bool_),
            np.zeros((missing, self._gages), np.bool_),
            time,
            "",
        )

    def _block(self, frames: Frames, why: str) -> Samples:
        """Join frames that follow each other, and remember the last one."""
        if why:
            time = self._time
            if why != "clock_back":  # a period that is said too long looks like this
                self._rate.restart()
        else:
            time = self._time + _signed_one(int(frames.t_us[0]) - self._wire_time, TIME_RANGE)
        self._period, self._gages = int(frames.period[0]), frames.counts.shape[2]
        self._rate.push(int(frames.wheel[0]), frames)
        strain, saturated = self._device.strain(frames.counts, frames.flags)
        self.received += len(strain)
        if saturated.any():
            seen = saturated.sum(axis=0).tolist()
            self.counts.saturated = added(self.counts.saturated, seen)
        if frames.flags.any():
            for name, bit in _COUNTED:
                seen = int(np.count_nonzero(frames.flags & bit))
                setattr(self.counts, name, getattr(self.counts, name) + seen)
        block = self._samples_of(strain, np.zeros(len(strain), np.bool_), saturated, time, why)
        self._time = time + _signed_one(int(frames.t_us[-1]) - int(frames.t_us[0]), TIME_RANGE)
        self._wire_time, self._seq = int(frames.t_us[-1]), int(frames.seq[-1])
        self._samples = frames.samples
        self._flagged = bool(frames.flags[-1] & _RESET)
        return block

    def _samples_of(
        self, strain: FloatArray, lost: BoolArray, saturated: BoolArray, time: int, why: str
    ) -> Samples:
        block = Samples(
            self._segment, why, self._start, time, self._period * TICK, strain, lost, saturated
        )
        self._start += len(strain)
        return block


def _signed(difference: npt.NDArray[np.int64], span: int) -> IntArray:
    """Return differences of wrapping counters as signed numbers."""
    return np.asarray((difference + span // 2) % span - span // 2, dtype=np.int64)


def _signed_one(difference: int, span: int) -> int:
    """Return one such difference."""
    return (difference + span // 2) % span - span // 2
