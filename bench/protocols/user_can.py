"""CAN frames of another make's transmitter to `Frames`, by its map."""

from dataclasses import replace

import numpy as np

from bench.can_batch import CanBatch
from bench.conditions import Measured
from bench.frames import GAGES, CountArray, Frames
from bench.line_counts import LineCounts
from bench.protocols.signals import Signal, raw_values, real_values
from bench.protocols.user_map import Message, UserMap, WheelMap
from bench.protocols.wheel_can import period_of
from bench.protocols.widening import Widener
from tirelib.arrays import BoolArray
from tirelib.units import to_si


class UserCan:
    """A `bench.protocols.frame_decoder.FrameDecoder` made from a map."""

    def __init__(self, user_map: UserMap, counts: LineCounts) -> None:
        self._map = replace(user_map, text="")  # of the file; this object is copied often
        self._counts = counts
        self._wheels = [_Wheel(wheel, user_map.rate) for wheel in user_map.wheels]

    def push(self, batch: CanBatch, arrival: int) -> list[Frames | Measured]:
        """Return strain frames, and the speed where it changes between them."""
        if self._map.speed is None:
            return self._strain(batch, arrival)
        message, signal, unit = self._map.speed
        rows = np.flatnonzero(_rows(batch, message, signal))
        self._counts.ok += len(rows)
        items: list[Frames | Measured] = []
        numbers = np.arange(len(batch))
        first = 0
        read = real_values if signal.real else raw_values
        raw = read(batch.data[rows], [signal])[:, 0]
        for row, value in zip(rows.tolist(), raw.tolist(), strict=True):
            items += self._strain(batch.take(numbers[first:row]), arrival)
            shown = signal.offset + signal.factor * value
            items.append(Measured("speed", float(to_si(shown, unit, "speed"))))
            first = row + 1
        return items + self._strain(batch.take(numbers[first:]), arrival)

    def interrupt(self) -> None:
        """Nothing waits here."""

    def _strain(self, batch: CanBatch, arrival: int) -> list[Frames | Measured]:
        items: list[Frames | Measured] = []
        known = 0
        for wheel in self._wheels:
            rows = _rows(batch, wheel.map.message, wheel.map.strain[0])
            if rows.any():
                known += int(rows.sum())
                items.append(wheel.frames(batch.take(rows), arrival))
        self._counts.ok += known
        self._counts.unknown += len(batch) - known
        return items


class _Wheel:
    """One wheel of the map, with the state of its counter and clock."""

    def __init__(self, wheel: WheelMap, rate: float) -> None:
        self.map = wheel
        self._period = period_of(rate)
        self._frame_us = wheel.samples * self._period / 10.0
        counter, time = wheel.counter, wheel.time
        self._wide = Widener(
            self._frame_us,
            2**counter.length if counter else 1,
            2**time.length if time else 2 ** (counter.length if counter else 1),
            1e6 * wheel.tick if time else self._frame_us,
        )

    def frames(self, batch: CanBatch, arrival: int) -> Frames:
        """Return the frames of a batch of this wheel's message."""
        wheel = self.map
        first, second = wheel.counter or wheel.time, wheel.time or wheel.counter
        if first is None or second is None:
            raise AssertionError("a map without counter and time is refused when it is read")
        raw = raw_values(batch.data, [first, second])
        seq, t_us = self._wide.widen(raw[:, 0], raw[:, 1], arrival)
        m = len(batch)
        counts: CountArray
        if wheel.strain[0].real:
            counts = real_values(batch.data, wheel.strain)
        else:
            counts = raw_values(batch.data, wheel.strain).astype(np.int32)
        return Frames(
            wheel=np.full(m, wheel.wheel),
            seq=seq,
            t_us=t_us,
            period=np.full(m, self._period),
            flags=np.zeros(m, np.int64),
            rssi=np.zeros(m, np.int64),
            temperature=np.zeros(m, np.int64),
            counts=counts.reshape(m, wheel.samples, GAGES),
        )


def _rows(batch: CanBatch, message: Message, signal: Signal) -> BoolArray:
    """Return which frames are this message, and hold this signal where it is multiplexed."""
    rows = np.asarray(
        (batch.identifier == message.identifier)
        & (batch.extended == message.extended)
        & (batch.length >= message.length)
    )
    if signal.selector is not None and rows.any():
        rows[rows] = np.isin(raw_values(batch.data[rows], [signal.selector])[:, 0], signal.selected)
    return rows
