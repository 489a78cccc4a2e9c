"""The wheel transmitter's stand-in: samples of a record to the frames of each format.

A transmitter keeps its number, its sample index and its clock from one piece to the next, so that a
record may be encoded in pieces while it is played. Pieces that are a multiple of `WHOLE` samples
long cut no frame.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from tirebench.errors import DeviceError
from tirebench.protocols.layouts import (
    HEALTH,
    LAYOUTS,
    RAW12,
    RAW12C,
    RAW16,
    SYNC,
    WHEELS,
    Health,
    Raw,
    encode_health,
    encode_raw12,
    encode_raw12c,
    encode_raw16,
    encode_sync,
)
from tirebench.wire.can_batch import CanBatch, joined, same_kind
from tirebench.wire.frames import (
    GAGES,
    SAMPLES,
    FrameFlag,
    Int16Array,
    IntArray,
    encode,
    strain_frames,
)
from tirelib.core.arrays import FloatArray

SERIAL = "serial"
FORMATS = (SERIAL, RAW16, RAW12, RAW12C)
"""Formats that can be sent."""
WHOLE = 48
"""Samples that fill whole frames of every format."""
ANNOUNCED = 8
"""Frames of a record that carry the time-reset flag; a receiver acts on the first that it gets."""
HEALTH_PERIOD = 100_000
"""[us]"""
SYNC_PERIOD = 10_000
"""[us]"""


@dataclass(frozen=True, slots=True, eq=False)
class Record:
    """Samples of one wheel that follow each other.

    Attributes
    ----------
    wheel : int
    start_us : int
        Device time of the first sample [us].
    period : int
        In ticks of 0.1 us.
    counts : int16 array, shape (n, 5)
    bits : int array, shape (n,)
        Flag bits of each sample: gages that are saturated.
    """

    wheel: int
    start_us: int
    period: int
    counts: Int16Array
    bits: Int16Array

    def times(self, samples: IntArray) -> IntArray:
        """Return device times of samples, [us]."""
        return self.start_us + np.rint(samples * self.period / 10.0).astype(np.int64)


@dataclass(frozen=True, slots=True, eq=False)
class Sent:
    """Frames and when each is complete on the device's clock, [s]; bytes, or CAN frames."""

    due: FloatArray
    frames: "Sequence[bytes] | CanBatch"


class Transmitter(Protocol):
    """What a wheel sends."""

    def send(self, record: Record, first: int, last: int) -> Sent:
        """Return the frames of the samples `first` to `last` of a record."""

    def restart(self) -> None:
        """Start again: number and clock begin at zero, as after a power failure."""


class _Clock:
    """Device time that a restart sets back, and the announcement that follows."""

    def __init__(self) -> None:
        self.offset = 0
        self.now = 0
        self.announced = 0

    def restart(self) -> None:
        self.offset, self.announced = self.now, ANNOUNCED

    def announcements(self, first: int, frames: int) -> IntArray:
        """Return the time-reset flag of each of the next frames."""
        if first == 0:
            self.announced = ANNOUNCED
        flags = np.zeros(frames, np.int64)
        flags[: self.announced] = int(FrameFlag.TIME_RESET)
        self.announced = max(0, self.announced - frames)
        return flags


class SerialTransmitter:
    """SERIAL v1; `seq` is the number of the first frame."""

    def __init__(self, seq: int = 0) -> None:
        self._seq = seq
        self._clock = _Clock()

    def send(self, record: Record, first: int, last: int) -> Sent:
        """Return full frames, and a shorter one at the end."""
        counts, bits = record.counts[first:last], record.bits[first:last]
        whole = len(counts) // SAMPLES * SAMPLES
        wire: list[bytes] = []
        for part in (slice(0, whole), slice(whole, None)):
            if not len(counts[part]):
                continue
            samples = min(SAMPLES, len(counts[part]))
            begin = int(record.times(np.array([first + part.start]))[0])
            self._clock.now = begin
            flags = np.bitwise_or.reduce(bits[part].reshape(-1, samples), axis=1).astype(np.int64)
            flags |= self._clock.announcements(first + part.start, len(flags))
            frames = strain_frames(
                counts[part],
                period=record.period,
                wheel=record.wheel,
                seq=self._seq,
                t_us=(begin - self._clock.offset) % 2**32,
                flags=flags.tolist(),
            )
            self._seq += len(frames)
            wire += encode(frames)
        ends = np.minimum(SAMPLES * (1 + np.arange(len(wire))), len(counts)) + first
        return Sent(np.asarray(1e-6 * record.times(ends)), wire)

    def restart(self) -> None:
        """Start again with the first number."""
        self._clock.restart()
        self._seq = 0


class CanTransmitter:
    """RAW16, RAW12, or RAW12C with SYNC; each with HEALTH. Samples short of a frame are not sent.

    Parameters
    ----------
    kind : str
    health : Health
        What HEALTH says, its flags set as they are needed.
    """

    def __init__(self, kind: str, health: Health | None = None) -> None:
        self._kind = kind
        self._health = health or Health()
        self._seq = 0
        self._clock = _Clock()
        self._next_health = self._next_sync = 0

    def send(self, record: Record, first: int, last: int) -> Sent:
        """Return strain frames with SYNC and HEALTH between them."""
        if not 0 <= record.wheel < WHEELS:
            raise DeviceError(
                f"wheel {record.wheel}; 0 .. {WHEELS - 1} have identifiers on CAN; choose a number "
                "in this range"
            )
        n = LAYOUTS[self._kind].samples
        frames = (last - first) // n
        starts = first + n * np.arange(frames)
        if first == 0:
            self._next_health = self._next_sync = record.start_us
        strain = self._strain(record, starts, n)
        self._clock.now = int(record.times(np.array([first]))[0])
        parts = [(1e-6 * record.times(starts + n), strain)]
        flags = self._clock.announcements(first, frames)
        parts += self._health_of(record, starts, flags)
        if self._kind == RAW12C:
            parts += self._synced(record, starts, last == len(record.counts))
        self._seq += frames
        due = np.concatenate([times for times, _ in parts])
        order = np.argsort(due, kind="stable")
        return Sent(due[order], joined([batch for _, batch in parts]).take(order))

    def restart(self) -> None:
        """Start again with the first number."""
        self._clock.restart()
        self._seq = 0
        self._next_sync = self._next_health = self._clock.now

    def _strain(self, record: Record, starts: IntArray, n: int) -> CanBatch:
        identifier = LAYOUTS[self._kind].base + record.wheel
        seq = self._seq + np.arange(len(starts))
        stop = int(starts[-1]) + n if len(starts) else 0
        counts = record.counts[int(starts[0]) if len(starts) else 0 : stop]
        if self._kind == RAW12C:
            return same_kind(identifier, encode_raw12c(seq, counts), fd=False)
        raw = Raw(seq, record.times(starts) - self._clock.offset, counts.reshape(-1, n, GAGES))
        data = encode_raw16(raw) if self._kind == RAW16 else encode_raw12(raw)
        return same_kind(identifier, data, fd=True)

    def _health_of(
        self, record: Record, starts: IntArray, flags: IntArray
    ) -> list[tuple[FloatArray, CanBatch]]:
        """HEALTH every 0.1 s, and wherever the announcement begins, goes on, or ends."""
        identifier = LAYOUTS[HEALTH].base + record.wheel
        times = record.times(starts)
        period = LAYOUTS[self._kind].samples * record.period / 10.0
        parts = []
        for row in range(len(starts)):
            announced = bool(flags[row])
            if announced or times[row] >= self._next_health:
                self._next_health = int(times[row]) + (0 if announced else HEALTH_PERIOD)
                health = Health(
                    self._health.radio_lost,
                    self._health.rssi,
                    self._health.temperature,
                    self._health.battery,
                    self._health.pressure,
                    self._health.flags | int(flags[row]),
                )
                batch = same_kind(identifier, encode_health(health), fd=False)
                # just before the frame that it speaks of
                parts.append((np.array([1e-6 * (times[row] + 0.5 * period)]), batch))
        return parts

    def _synced(
        self, record: Record, starts: IntArray, final: bool
    ) -> list[tuple[FloatArray, CanBatch]]:
        """SYNC at 100 Hz, and at the end of a record."""
        times = record.times(starts)
        rows = []
        for row in range(len(starts)):
            if times[row] >= self._next_sync:
                rows.append(row)
                self._next_sync = int(times[row]) + SYNC_PERIOD
        index = [self._seq + row for row in rows]
        moments = [int(times[row]) for row in rows]
        due = [1e-6 * (t + 0.05 * record.period) for t in moments]
        if final and len(starts):
            index.append(self._seq + len(starts))
            moments.append(int(record.times(starts[-1:] + 1)[0]))
            due.append(1e-6 * (moments[-1] + 0.01 * record.period))
        data = encode_sync(
            np.array(index, np.int64), np.array(moments, np.int64) - self._clock.offset
        )
        return [(np.array(due), same_kind(LAYOUTS[SYNC].base + record.wheel, data, fd=False))]


def transmitter(kind: str) -> Callable[[], Transmitter]:
    """Return what makes a transmitter of a format.

    Raises
    ------
    DeviceError
        If there is none of this name.
    """
    if kind == SERIAL:
        return SerialTransmitter
    if kind in FORMATS:
        return lambda: CanTransmitter(kind)
    raise DeviceError(
        f"format {kind!r}: unknown; known formats are {', '.join(FORMATS)}; choose one of them"
    )
