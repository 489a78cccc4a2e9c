"""Bytes of one wheel to estimates: decode, put in line, step the estimator by up to k samples.

The estimator takes k samples a step, frames bring 16 or any other number: a store between the two
makes the result independent of both, and of how the line was cut into reads. A step is shorter
where a condition changes, so that it changes at its sample, and at the end of a segment.
"""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from bench.clock import ClockFit
from bench.conditions import ROUNDING, UNKNOWN, Condition, Conditions, Held, Measured
from bench.decoder import SerialDecoder
from bench.device import Device
from bench.frames import GAGES, Frames
from bench.line_counts import LineCounts
from bench.protocols import Decoder
from bench.timeline import Samples, Timeline, TimelineCounts
from tirelib.arrays import BoolArray, FloatArray, IntArray
from tirelib.flags import TurnFlag

Outputs = tuple[Mapping[str, float], Mapping[str, str]]
"""Numbers (SI) and texts that an estimator gives at the end of a turn."""


class Estimator(Protocol):
    """What is stepped: an FMU, or a stand-in."""

    samples: int
    """Most samples that a step takes."""

    def start(self, period: float) -> None:
        """Begin afresh with this sample period [s]."""

    def step(self, strain: FloatArray, conditions: Condition, valid: bool) -> "Outputs | None":
        """Take 1 to k samples; return outputs when they ended a turn."""


@dataclass(frozen=True, slots=True)
class Turn:
    """One estimate.

    Attributes
    ----------
    run : int
        Of the campaign, where a sidecar says; else 0.
    segment : int
        Counts the estimator's fresh starts.
    t, ready : float, [s]
        Middle of the contact, and when its last sample was taken: on the run's clock where a
        sidecar gives it, else since the first sample. `t` is NaN if the estimator does not say.
    device_time : float, [s]
        `ready` since the first sample of the line.
    outputs : mapping of name to value, SI
        All numbers that the estimator gives.
    texts : mapping of name to str
        What it says in words: ``rolling``, ``status``.
    flags : int
        `TurnFlag` bits of the estimator and of the line.
    saturated : tuple of int
        Saturated samples of each gage since the turn before.
    wheel : int
    """

    run: int
    segment: int
    t: float
    ready: float
    device_time: float
    outputs: Mapping[str, float]
    texts: Mapping[str, str]
    flags: int
    saturated: tuple[int, ...]
    wheel: int = 0

    @property
    def valid(self) -> bool:
        """Whether the estimate may be used."""
        return self.outputs["valid"] > 0.5


@dataclass(slots=True)
class _Segment:
    """The stretch of samples since the estimator's last fresh start."""

    number: int
    t_us: int
    period: float
    run: int
    origin: float  # what to add to the estimator's time for `t`
    device_origin: float
    waiting: FloatArray = field(default_factory=lambda: np.empty((0, GAGES)))
    stepped: int = 0  # samples so far
    until: float = -1.0  # the sample at which the condition changes
    condition: Condition = UNKNOWN
    marks: BoolArray = field(default_factory=lambda: np.empty((0, GAGES), np.bool_))
    saturated: IntArray = field(default_factory=lambda: np.zeros(GAGES, np.int64))


class Chain:
    """The whole way for one wheel; the same bytes give the same estimates.

    Parameters
    ----------
    estimator : Estimator
    device : Device
    conditions : Conditions
    wheel : int, optional
        By default that of the first frame.
    decoder : Decoder, optional
        Of the line; by default that of SERIAL v1. Several wheels on one line share it.

    Attributes
    ----------
    clock : ClockFit
        The wheel's clock against the host's.
    watch : callable, optional
        Called with each block of samples before it is stepped; for a live page.
    """

    def __init__(
        self,
        estimator: Estimator,
        device: Device,
        conditions: Conditions,
        wheel: int | None = None,
        decoder: Decoder | None = None,
    ) -> None:
        self.line: Decoder = SerialDecoder() if decoder is None else decoder
        self.clock = ClockFit()
        self.watch: Callable[[Samples], None] | None = None
        self.timeline = Timeline(device, wheel)
        self.steps = 0
        self._estimator = estimator
        self._conditions = Held(conditions)
        self._segment: _Segment | None = None
        self._first_us: int | None = None

    @property
    def counts(self) -> tuple[LineCounts, TimelineCounts]:
        """What was seen and lost so far."""
        return self.line.counts, self.timeline.counts

    def push(self, data: bytes, arrival: int = 0) -> list[Turn]:
        """Take bytes that came at a moment [ns, monotonic] and return the turns that they end."""
        return self.take(self.line.push(data, arrival), arrival)

    def take(self, items: Iterable[Frames | Measured], arrival: int = 0) -> list[Turn]:
        """Take decoded frames, of this wheel or of several, and return the turns that they end."""
        turns: list[Turn] = []
        newest: int | None = None
        for item in items:
            if isinstance(item, Measured):
                self._tell(item)
                continue
            for block in self.timeline.push(item):
                if self.watch is not None:
                    self.watch(block)
                if block.reset:
                    turns += self.finish()
                    self._begin(block)
                    self.clock.restart()
                turns += self._take(block)
                newest = block.end_us
        if newest is not None and arrival:
            self.clock.push(newest, arrival)
        return turns

    def _tell(self, measured: Measured) -> None:
        """Let a condition hold from the next sample on."""
        self._conditions.tell(self.timeline.end_us, measured)
        if self._segment is not None:
            self._segment.until = -1.0

    def finish(self) -> list[Turn]:
        """Step what is left, in a shorter step, and close the segment."""
        segment, self._segment = self._segment, None
        if segment is None or not len(segment.waiting):
            return []
        segment.saturated += segment.marks.sum(axis=0)
        turn = self._step(segment, segment.waiting)
        return [] if turn is None else [turn]

    def _begin(self, block: Samples) -> None:
        self._estimator.start(block.period)
        if self._first_us is None:
            self._first_us = block.t_us
        device_origin = 1e-6 * (block.t_us - self._first_us)
        run, origin = 0, device_origin
        known = self._conditions.run_at(block.t_us)
        if known is not None:
            mark, start = known
            run, origin = mark.run, mark.start_time + 1e-6 * (block.t_us - start)
        self._segment = _Segment(
            block.segment, block.t_us, block.period, run, origin, device_origin
        )

    def _take(self, block: Samples) -> list[Turn]:
        """Store samples and take as many steps as they fill."""
        segment = self._segment
        if segment is None or not len(block.strain):
            return []
        strain, marks = block.strain, block.saturated
        if len(segment.waiting):
            strain = np.concatenate((segment.waiting, strain))
            marks = np.concatenate((segment.marks, marks))
        marked = bool(marks.any())
        turns, first = [], 0
        while len(strain) - first >= (size := self._size(segment)):
            if marked:
                segment.saturated += marks[first : first + size].sum(axis=0)
            turn = self._step(segment, strain[first : first + size])
            first += size
            if turn is not None:
                turns.append(turn)
        segment.waiting, segment.marks = strain[first:], marks[first:]
        return turns

    def _size(self, segment: _Segment) -> int:
        """Return the size of the next step: full, or up to where a condition changes."""
        if segment.stepped >= segment.until:
            moment = segment.t_us + segment.stepped * segment.period * 1e6
            segment.condition = self._conditions.at(moment)
            change = self._conditions.next_change(moment) - segment.t_us - ROUNDING
            segment.until = change / (1e6 * segment.period)
        left = segment.until - segment.stepped
        size = self._estimator.samples
        return size if left >= size else max(1, math.ceil(left))

    def _step(self, segment: _Segment, strain: FloatArray) -> Turn | None:
        valid = not np.isnan(strain).all()
        result = self._estimator.step(strain, segment.condition, valid)
        segment.stepped += len(strain)
        self.steps += 1
        if result is None:
            return None
        outputs, texts = result
        saturated = tuple(segment.saturated.tolist())
        segment.saturated[:] = 0
        ready = self._ready(outputs, segment)
        return Turn(
            run=segment.run,
            segment=segment.number,
            t=segment.origin + outputs.get("contact_time", math.nan),
            ready=segment.origin + ready,
            device_time=segment.device_origin + ready,
            outputs=outputs,
            texts=texts,
            flags=int(outputs["flags"]) | (int(TurnFlag.SATURATED) if any(saturated) else 0),
            saturated=saturated,
            wheel=self.timeline.wheel or 0,
        )

    @staticmethod
    def _ready(outputs: Mapping[str, float], segment: _Segment) -> float:
        """Time at which the estimate was ready, since the segment's first sample, [s]."""
        return segment.stepped * segment.period - outputs["age"]
