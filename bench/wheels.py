"""One line, several wheels: bytes to the samples of each wheel, in line, with its clock.

All of it can be pickled, so that a reader that is started again goes on where the last one was.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from bench.clock import ClockFit
from bench.conditions import Measured
from bench.device import Device
from bench.frames import Frames, select
from bench.line_counts import LineCounts
from bench.protocols import Decoder
from bench.timeline import Samples, Timeline, TimelineCounts

MOST = 4
"""Wheels that are looked at unless others are named; each costs an estimator."""


@dataclass(frozen=True, slots=True)
class Told:
    """A condition that a bus told, and the device time of the sample from which it holds [us]."""

    t_us: int
    measured: Measured


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """What comes next on the line of one wheel.

    Attributes
    ----------
    wheel : int
    arrival : int, [ns]
        Monotonic, of the bytes that brought it.
    first_us : int, [us]
        Device time of the wheel's very first sample.
    content : Samples or Told
    """

    wheel: int
    arrival: int
    first_us: int
    content: Samples | Told


class Wheel:
    """One wheel of a line.

    Attributes
    ----------
    timeline : Timeline
    clock : ClockFit
        The wheel's clock against the host's.
    """

    def __init__(self, device: Device, number: int) -> None:
        self.timeline = Timeline(device, number)
        self.clock = ClockFit()
        self._number = number
        self._first_us: int | None = None

    @property
    def newest_us(self) -> int:
        """Device time up to which samples have come, [us]."""
        return self.timeline.end_us

    def take(self, items: Sequence[Frames | Measured], arrival: int) -> list[Block]:
        """Take the frames of this wheel and what the bus told between them."""
        blocks: list[Block] = []
        newest: int | None = None
        for item in items:
            if isinstance(item, Measured):
                blocks.append(self._block(Told(self.timeline.end_us, item), arrival))
                continue
            for samples in self.timeline.push(item):
                if samples.reset:
                    self.clock.restart()
                if self._first_us is None:
                    self._first_us = samples.t_us
                blocks.append(self._block(samples, arrival))
                newest = samples.end_us
        if newest is not None and arrival:
            self.clock.push(newest, arrival)
        return blocks

    def _block(self, content: Samples | Told, arrival: int) -> Block:
        return Block(self._number, arrival, self._first_us or 0, content)


class Wheels:
    """Bytes of one line to the samples of all its wheels; the same bytes give the same samples.

    Parameters
    ----------
    decoder : Decoder
    devices : mapping of wheel to Device
        ``None`` is the key of the device for all others.
    chosen : sequence of int, optional
        Wheels to look at; by default the first `MOST` that are heard.

    Attributes
    ----------
    heard : dict of wheel to Wheel
        In the order in which the wheels were heard.
    ignored : int
        Frames of other wheels.
    """

    def __init__(
        self,
        decoder: Decoder,
        devices: Mapping[int | None, Device],
        chosen: Sequence[int] = (),
    ) -> None:
        self.line = decoder
        self.heard: dict[int, Wheel] = {}
        self.ignored = 0
        self._devices = dict(devices)
        self._chosen = tuple(chosen)
        self._told: dict[str, Measured] = {}  # what the bus told last

    def push(self, data: bytes, arrival: int = 0) -> list[Block]:
        """Take bytes that came at a moment [ns, monotonic] and return what they bring."""
        sorted_items: dict[int, list[Frames | Measured]] = {wheel: [] for wheel in self.heard}
        for item in self.line.push(data, arrival):
            if isinstance(item, Measured):
                self._told[item.name] = item
                for items in sorted_items.values():
                    items.append(item)
                continue
            numbers = sorted(set(item.wheel.tolist()))
            for wheel in numbers:
                rows = item.wheel == wheel
                if self._wanted(wheel, len(sorted_items)):
                    items = sorted_items.setdefault(wheel, list(self._told.values()))
                    items.append(item if len(numbers) == 1 else select(item, rows))
                else:
                    self.ignored += int(rows.sum())
        return [
            block
            for wheel, items in sorted_items.items()
            if items
            for block in self._wheel(wheel).take(items, arrival)
        ]

    @property
    def counts(self) -> tuple[LineCounts, TimelineCounts]:
        """What was seen and lost so far, all wheels together."""
        total = sum((wheel.timeline.counts for wheel in self.heard.values()), TimelineCounts())
        total.other_wheel += self.ignored
        return self.line.counts, total

    def interrupt(self) -> None:
        """Note that the line was broken here: a half frame is forgotten."""
        self.line.interrupt()
        self.line.counts.reconnects += 1

    def _wanted(self, wheel: int, heard: int) -> bool:
        if self._chosen:
            return wheel in self._chosen
        return wheel in self.heard or heard < MOST  # heard counts those of before too

    def _wheel(self, number: int) -> Wheel:
        if number not in self.heard:
            device = self._devices.get(number, self._devices.get(None, Device()))
            self.heard[number] = Wheel(device, number)
        return self.heard[number]
