"""From the bytes of several lines to the samples of each wheel, in order and with its clock.

All of it can be pickled, so that a reader that is started again goes on where the last one was.
"""

import math
import pickle
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from tirebench.errors import DeviceError
from tirebench.protocols import Decoder
from tirebench.protocols.layouts import Health
from tirebench.wire.clock import ClockFit
from tirebench.wire.conditions import Measured
from tirebench.wire.device import Device
from tirebench.wire.frames import Frames, select
from tirebench.wire.line_counts import LineCounts
from tirebench.wire.rate_check import PERIOD
from tirebench.wire.timeline import Samples, Timeline, TimelineCounts

MOST_WHEELS = 4
"""Wheels that are looked at unless others are named; each costs an estimator."""


@dataclass(frozen=True, slots=True)
class BusCondition:
    """A condition that a bus sent, and the device time of the sample from which it holds [us]."""

    t_us: int
    measured: Measured


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """The next samples, or the next condition, of one wheel.

    Attributes
    ----------
    wheel : int
    arrival : int, [ns]
        Monotonic, of the bytes that brought it.
    first_us : int, [us]
        Device time of the wheel's very first sample.
    content : Samples or BusCondition
    parts : tuple of (int, int)
        Where several reads brought the samples: how many samples had come by the end of each read,
        and when it arrived. Empty where one read brought them.
    """

    wheel: int
    arrival: int
    first_us: int
    content: Samples | BusCondition
    parts: tuple[tuple[int, int], ...] = ()

    def pack(self) -> bytes:
        """Return the block as it goes to another process."""
        content = self.content
        packed = content.pack() if isinstance(content, Samples) else content
        return pickle.dumps((self.wheel, self.arrival, self.first_us, packed), 5)

    @classmethod
    def unpack(cls, message: bytes) -> "Block":
        """Return the block of which `pack` made a message."""
        wheel, arrival, first_us, packed = pickle.loads(message)
        content = Samples.unpack(packed) if isinstance(packed, tuple) else packed
        return cls(wheel, arrival, first_us, content)


class Wheel:
    """One wheel of a line.

    Attributes
    ----------
    timeline : Timeline
    clock : ClockFit
        The wheel's clock against the host's.
    bus_conditions : dict of float, SI
        The conditions that a bus sent last, by name.
    rssi, temperature : int or None, [dBm], [degC]
        As the last frame says.
    """

    def __init__(self, device: Device, number: int, rate_said_by: str = PERIOD) -> None:
        self.timeline = Timeline(device, number, rate_said_by)
        self.clock = ClockFit()
        self.bus_conditions: dict[str, float] = {}
        self.rssi: int | None = None
        self.temperature: int | None = None
        self._number = number
        self._first_us: int | None = None

    @property
    def newest_us(self) -> int:
        """Device time up to which samples have come, [us]."""
        return self.timeline.end_us

    def take(self, items: Sequence[Frames | Measured], arrival: int) -> list[Block]:
        """Take the frames of this wheel and the conditions that the bus sent between them."""
        blocks: list[Block] = []
        newest: int | None = None
        for item in items:
            if isinstance(item, Measured):
                self.bus_conditions[item.name] = item.value
                blocks.append(self._block(BusCondition(self.timeline.end_us, item), arrival))
                continue
            self._note(item)
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

    def _note(self, frames: Frames) -> None:
        """Keep the state that the wheel sends about itself."""
        if len(frames) and frames.rssi[-1]:
            self.rssi, self.temperature = int(frames.rssi[-1]), int(frames.temperature[-1])

    def _block(self, content: Samples | BusCondition, arrival: int) -> Block:
        return Block(self._number, arrival, self._first_us or 0, content)


@dataclass(frozen=True, slots=True)
class Line:
    """One source of bytes, with its decoder and its wheels.

    Attributes
    ----------
    decoder : Decoder
        Fresh.
    devices : mapping of wheel to Device
        ``None`` is the key of the device for all others.
    wheel : int or None
        Number that the only wheel of this line gets; None: numbers are as sent.
    name : str
        For messages.
    rate_said_by : str
        Where the sample rate is said, for messages.
    expected : int
        Wheels that it brings, at least.
    known : tuple of int
        Its wheels, as far as they are known before anything is heard.
    """

    decoder: Decoder
    devices: Mapping[int | None, Device]
    wheel: int | None = None
    name: str = "the line"
    rate_said_by: str = PERIOD
    expected: int = 1
    known: tuple[int, ...] = ()

    def push(self, data: bytes, arrival: int) -> list[Frames | Measured]:
        """Return what bytes bring, with the wheels' numbers of the run.

        Raises
        ------
        DeviceError
            If a second wheel is heard where one was said.
        """
        items = list(self.decoder.push(data, arrival))
        return items if self.wheel is None else [self._numbered(item) for item in items]

    def _numbered(self, item: Frames | Measured) -> Frames | Measured:
        if isinstance(item, Measured):
            return item
        sent = sorted(set(item.wheel.tolist()))
        if len(sent) > 1:
            raise DeviceError(
                f"{self.name}: frames came from wheels {', '.join(map(str, sent))}; a source with "
                f"wheel = {self.wheel} may carry one wheel only; leave that out, and give each "
                "transmitter its own number"
            )
        return replace(item, wheel=np.full(len(item), self.wheel))

    def device(self, wheel: int) -> Device:
        """Return the device of a wheel, which converts its counts to strain."""
        return self.devices.get(wheel, self.devices.get(None, Device()))


class Wheels:
    """Bytes of all lines to the samples of all wheels; the same bytes give the same samples.

    Parameters
    ----------
    lines : sequence of Line
        By the number of the source.
    chosen : sequence of int, optional
        Wheels to look at; by default the first `MOST_WHEELS` that are heard.

    Attributes
    ----------
    heard : dict of wheel to Wheel
        In the order in which the wheels were heard.
    ignored : int
        Frames of other wheels.
    """

    def __init__(self, lines: Sequence[Line], chosen: Sequence[int] = ()) -> None:
        self.lines = tuple(lines)
        self.heard: dict[int, Wheel] = {}
        self.ignored = 0
        self._chosen = tuple(chosen)
        self._sources: dict[int, int] = {}  # of each wheel that was heard
        self._bus_conditions: dict[
            tuple[str, int | None], Measured
        ] = {}  # the last that a bus sent
        self._sent_at: dict[tuple[str, int | None], int] = {}  # and when it came [ns]

    @classmethod
    def of_one(
        cls,
        decoder: Decoder,
        devices: Mapping[int | None, Device],
        chosen: Sequence[int] = (),
    ) -> "Wheels":
        """Return the wheels of a single line."""
        return cls([Line(decoder, devices)], chosen)

    @property
    def line(self) -> Decoder:
        """The decoder of the first line."""
        return self.lines[0].decoder

    def push(self, data: bytes, arrival: int = 0, source: int = 0) -> list[Block]:
        """Take bytes of a source that came at a moment [ns, monotonic]; return what they bring.

        A condition from a bus holds for the wheels of all lines, from their next sample on; when
        the bus was silent about it for too long it is unknown to them.

        Raises
        ------
        DeviceError
            If a wheel comes from two sources.
        """
        sorted_items: dict[int, list[Frames | Measured]] = {wheel: [] for wheel in self.heard}
        bus_conditions: dict[
            tuple[str, int | None], Measured
        ] = {}  # since the last frame of strain
        for place, silence in self.silences(arrival).items():
            last = self._bus_conditions[place]
            if silence and not math.isnan(last.value):
                bus_conditions[place] = replace(last, value=math.nan)
        for item in self.lines[source].push(data, arrival):
            if isinstance(item, Measured):
                bus_conditions[item.name, item.wheel] = item
                self._sent_at[item.name, item.wheel] = arrival
                continue
            self._hand_over(bus_conditions, sorted_items)
            numbers = sorted(set(item.wheel.tolist()))
            for wheel in numbers:
                rows = item.wheel == wheel
                if not self._wanted(wheel, len(sorted_items)):
                    self.ignored += int(rows.sum())
                    continue
                if self._sources.setdefault(wheel, source) != source:
                    raise self._twice(wheel, source)
                known: list[Frames | Measured] = [
                    one for one in self._bus_conditions.values() if one.wheel in (None, wheel)
                ]
                items = sorted_items.setdefault(wheel, known)
                items.append(item if len(numbers) == 1 else select(item, rows))
        self._hand_over(bus_conditions, sorted_items)
        return [
            block
            for wheel, items in sorted_items.items()
            if items
            for block in self._wheel(wheel).take(items, arrival)
        ]

    def silences(self, now: int) -> dict[tuple[str, int | None], str]:
        """Return a sentence on each condition about which its bus has been silent for too long.

        Those that came in time have an empty one.

        Parameters
        ----------
        now : int, [ns]
            Monotonic, as arrivals are.
        """
        return {
            (name, wheel): ""
            if 1e-9 * (now - self._sent_at[name, wheel]) <= last.hold
            else f"{name}{'' if wheel is None else f' of wheel {wheel}'}: the bus has not sent it "
            f"for more than {last.hold:g} s, so it is unknown; check the bus, or set hold_s in its "
            "map if it is sent less often"
            for (name, wheel), last in self._bus_conditions.items()
        }

    def _hand_over(
        self,
        bus_conditions: dict[tuple[str, int | None], Measured],
        sorted_items: dict[int, list[Frames | Measured]],
    ) -> None:
        """Hand the conditions from a bus to the wheels for which they hold, and clear the list."""
        for item in bus_conditions.values():
            for wheel, items in sorted_items.items():
                if item.wheel in (None, wheel):
                    items.append(item)
        self._bus_conditions |= bus_conditions
        bus_conditions.clear()

    @property
    def contradicted(self) -> dict[int, str]:
        """Wheels whose clock contradicts the configured sample rate, with a sentence on each."""
        said = {number: wheel.timeline.contradiction for number, wheel in self.heard.items()}
        return {number: text for number, text in said.items() if text}

    @property
    def judged(self) -> set[int]:
        """Wheels whose sample rate was checked against their clock."""
        return {number for number, wheel in self.heard.items() if wheel.timeline.judged}

    def agreeing(self, blocks: Sequence[Block]) -> list[Block]:
        """Return the blocks of wheels whose clock agrees with their rate: those may be estimated.

        Raises
        ------
        DeviceError
            If no such wheel is left, and no other is expected.
        """
        wrong = self.contradicted
        expected = len(self._chosen) or min(sum(line.expected for line in self.lines), MOST_WHEELS)
        if wrong and len(wrong) == len(self.heard) >= expected:
            raise DeviceError(list(wrong.values()))
        return [block for block in blocks if block.wheel not in wrong]

    def line_counts(self, wheel: int) -> LineCounts:
        """Return the counters of a wheel's line."""
        return self.lines[self._sources.get(wheel, 0)].decoder.counts

    def health(self, wheel: int) -> Health | None:
        """Return the content of a wheel's last HEALTH frame, if there was one."""
        line = self.lines[self._sources.get(wheel, 0)]
        said = line.decoder.health
        if line.wheel is not None:  # whatever number it says, it is the only one
            return next(iter(said.values()), None)
        return said.get(wheel)

    @property
    def counts(self) -> tuple[LineCounts, TimelineCounts]:
        """What was seen and lost so far, all lines and all wheels together."""
        total = sum((wheel.timeline.counts for wheel in self.heard.values()), TimelineCounts())
        total.other_wheel += self.ignored
        lines = [line.decoder.counts for line in self.lines]
        names = [field.name for field in fields(LineCounts)]
        seen = LineCounts(*(sum(getattr(line, name) for line in lines) for name in names))
        return seen, total

    def hints(self) -> dict[int, str]:
        """Return advice for each line from which no good frame came, by its source."""
        said = {source: line.decoder.counts.hint for source, line in enumerate(self.lines)}
        many = len(self.lines) > 1
        return {
            source: f"{self.lines[source].name}: {hint}" if many else hint
            for source, hint in said.items()
            if hint
        }

    @property
    def missing(self) -> list[int]:
        """Wheels that are chosen or known beforehand and have not sent a frame so far."""
        known = self._chosen or [wheel for line in self.lines for wheel in line.known]
        return sorted(set(known) - set(self.heard))

    def interrupt(self, source: int = 0) -> None:
        """Note that a line was interrupted here: a half frame is dropped."""
        decoder = self.lines[source].decoder
        decoder.interrupt()
        decoder.counts.reconnects += 1

    def forget(self) -> None:
        """Drop half frames of all lines: the bytes that follow are not decoded."""
        for line in self.lines:
            line.decoder.interrupt()

    def _wanted(self, wheel: int, heard: int) -> bool:
        if self._chosen:
            return wheel in self._chosen
        return wheel in self.heard or heard < MOST_WHEELS  # heard counts those of before too

    def _wheel(self, number: int) -> Wheel:
        if number not in self.heard:
            line = self.lines[self._sources.get(number, 0)]
            self.heard[number] = Wheel(line.device(number), number, line.rate_said_by)
        return self.heard[number]

    def _twice(self, wheel: int, source: int) -> DeviceError:
        names = self.lines[self._sources[wheel]].name, self.lines[source].name
        return DeviceError(
            f"wheel {wheel} comes from {names[0]} and from {names[1]}; each wheel may come from "
            "one source only; write `wheel = N` for a source in the setup, or --port N=PORT"
        )
