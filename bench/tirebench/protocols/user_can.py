"""CAN frames of another make's transmitter to `Frames`, by its map."""

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from tirebench.protocols.layouts import Health
from tirebench.protocols.map_messages import Message
from tirebench.protocols.map_parts import UserMap, WheelMap
from tirebench.protocols.signals import Signal, raw_values, real_values
from tirebench.protocols.wheel_can import period_of
from tirebench.protocols.widening import Widener
from tirebench.wire.can_batch import CanBatch
from tirebench.wire.conditions import Measured
from tirebench.wire.frames import CountArray, Frames
from tirebench.wire.line_counts import LineCounts
from tirelib.core.arrays import BoolArray


class UserCan:
    """A `tirebench.protocols.frame_decoder.FrameDecoder` made from a map."""

    def __init__(self, user_map: UserMap, counts: LineCounts) -> None:
        self._map = replace(user_map, text="")  # of the file; this object is copied often
        self._counts = counts
        self._wheels = [_Wheel(wheel, user_map.rate) for wheel in user_map.wheels]

    health: Mapping[int, Health] = MappingProxyType({})

    def push(self, batch: CanBatch, arrival: int) -> list[Frames | Measured]:
        """Return the strain frames, and between them the conditions that the bus sent, in order."""
        sent = self._conditions(batch)
        wheels = [
            (wheel, _rows(batch, wheel.map.message, wheel.map.strain[0])) for wheel in self._wheels
        ]
        known = np.zeros(len(batch), np.bool_)
        known[[row for row, _ in sent]] = True
        for _, rows in wheels:
            known |= rows
        self._counts.ok += int(known.sum())
        self._counts.unknown += int((~known).sum())
        items: list[Frames | Measured] = []
        first = 0
        for row, measured in sent:
            items += self._strain(batch, wheels, first, row, arrival)
            items.append(measured)
            first = row
        return items + self._strain(batch, wheels, first, len(batch), arrival)

    def _conditions(self, batch: CanBatch) -> list[tuple[int, Measured]]:
        """Return the conditions that the bus sent with their rows, in order."""
        sent: list[tuple[int, Measured]] = []
        for quantity in self._map.quantities:
            signal = quantity.signal
            rows = np.flatnonzero(_rows(batch, quantity.message, signal))
            read = real_values if signal.real else raw_values
            raw = read(batch.data[rows], [signal])[:, 0]
            sent += zip(rows.tolist(), map(quantity.measured, raw.tolist()), strict=True)
        return sorted(sent, key=lambda one: one[0])

    def interrupt(self) -> None:
        """Nothing waits here."""

    @staticmethod
    def _strain(
        batch: CanBatch,
        wheels: "list[tuple[_Wheel, BoolArray]]",
        first: int,
        end: int,
        arrival: int,
    ) -> list[Frames | Measured]:
        """Return the strain of some rows."""
        return [
            wheel.frames(batch.take(np.flatnonzero(rows[first:end]) + first), arrival)
            for wheel, rows in wheels
            if rows[first:end].any()
        ]


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
        counts = counts.reshape(m, wheel.samples, -1)
        if any(wheel.absent):
            counts, there = np.full((m, wheel.samples, len(wheel.absent)), np.nan), counts
            counts[:, :, ~np.array(wheel.absent)] = there
        return Frames(
            wheel=np.full(m, wheel.wheel),
            seq=seq,
            t_us=t_us,
            period=np.full(m, self._period),
            flags=np.zeros(m, np.int64),
            rssi=np.zeros(m, np.int64),
            temperature=np.zeros(m, np.int64),
            counts=counts,
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
