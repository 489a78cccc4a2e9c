"""Samples of one wheel to estimates: step the estimator by up to k samples.

The estimator takes k samples a step, blocks bring any number: a store between the two makes the
result independent of both, and of how the line was cut into reads. A step is shorter where a
condition changes, so that it changes at its sample, and at the end of a segment.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

import numpy as np

from tirebench.estimator.wheels import Block
from tirebench.wire.conditions import ROUNDING, UNKNOWN, Condition, Conditions, Held
from tirebench.wire.timeline import Samples
from tirelib.core.arrays import BoolArray, FloatArray, IntArray
from tirelib.core.flags import TurnFlag

Outputs = tuple[Mapping[str, float], Mapping[str, str]]
"""Numbers (SI) and texts that an estimator gives at the end of a turn."""
RESTARTED, SKIPPED = "restarted", "skipped"
"""Reasons for a restart of an estimator within a segment; each is a note of the next turn."""


class Estimator(Protocol):
    """The estimator that is stepped: an FMU, or a replacement for it."""

    samples: int
    """Largest number of samples in a step."""

    def start(self, period: float) -> None:
        """Start again with this sample period [s]."""

    def step(self, strain: FloatArray, conditions: Condition, valid: bool) -> "Outputs | None":
        """Take 1 to k samples; return outputs when they ended a turn."""


@dataclass(frozen=True, slots=True)
class Turn:
    """One estimate.

    Attributes
    ----------
    run : int
        Run number of the campaign, where a sidecar states it; else 0.
    segment : int
        Stretch of the line's samples, see `tirebench.wire.timeline`.
    t, ready : float, [s]
        Middle of the contact, and when its last sample was taken: on the run's clock where a
        sidecar gives it, else since the first sample. `t` is NaN if the estimator does not say.
    device_time : float, [s]
        `ready` since the first sample of the line.
    outputs : mapping of name to value, SI
        All numbers that the estimator gives.
    texts : mapping of name to str
        What it says in words: ``rolling``, ``status``; ``note`` where it began afresh.
    flags : int
        `TurnFlag` bits of the estimator and of the line: `GAP` where samples were lost since the
        turn before, whether the estimator needed them or not.
    saturated : tuple of int
        Saturated samples of each gage since the turn before.
    wheel : int
    arrival : int, [ns]
        Monotonic, of the bytes that ended it; that of the last bytes where the line's end did.
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
    arrival: int = 0

    @property
    def valid(self) -> bool:
        """Whether the estimate may be used."""
        return self.outputs["valid"] > 0.5


def quantity_valid(turn: Turn, name: str) -> bool:
    """Whether one quantity of a turn may be used.

    An FMU with an output ``Fz_valid`` says so itself; without it the whole turn decides, and a slip
    ratio needs a speed.
    """
    own = turn.outputs.get(f"{name}_valid")
    if own is not None:
        return own > 0.5
    known = math.isfinite(turn.outputs[name])
    return turn.valid and known and not (name == "kappa" and turn.flags & TurnFlag.NO_SPEED)


class Place(NamedTuple):
    """A sample of a wheel's line: its segment, and its number within."""

    segment: int
    sample: int


class Jump(NamedTuple):
    """The samples at which the estimator of a wheel stopped and started again.

    It is written into the recording, so that a replay does the same.

    Attributes
    ----------
    wheel : int
    start, end : Place
        First sample that is not stepped, and the first that is again; both begin a block.
    why : str
        `RESTARTED` or `SKIPPED`.
    samples, turns : int
        About how much was left out.
    """

    wheel: int
    start: Place
    end: Place
    why: str
    samples: int = 0
    turns: int = 0


@dataclass(slots=True)
class _Segment:
    """The samples since the estimator's last start."""

    number: int
    t_us: int
    period: float
    run: int
    origin: float  # what to add to the estimator's time for `t`
    device_origin: float
    gages: int
    waiting: FloatArray = field(default_factory=lambda: np.empty((0, 0)))
    stepped: int = 0  # samples so far
    until: float = -1.0  # the sample at which the condition changes
    condition: Condition = UNKNOWN
    marks: BoolArray = field(default_factory=lambda: np.empty((0, 0), np.bool_))
    """Marks of the waiting samples: saturated in each gage, lost."""
    marked: IntArray = field(default_factory=lambda: np.empty((0, 0), np.int64))
    """Marked samples since the preceding turn: number, saturated in each gage, lost."""

    def mark(self, marks: BoolArray) -> None:
        """Keep the marks of samples that are to be stepped next."""
        rows = np.flatnonzero(marks.any(axis=1))
        if len(rows):
            new = np.column_stack((self.stepped + rows, marks[rows]))
            self.marked = np.concatenate((*([self.marked] if len(self.marked) else []), new))

    def seen(self, ready: float) -> list[int]:
        """Return and forget the marks up to the end of a turn [s], which a step may go beyond."""
        if not len(self.marked):
            return [0] * (self.gages + 1)
        mine = self.marked[:, 0] < round(ready / self.period)
        counts = self.marked[mine, 1:].sum(axis=0)
        self.marked = self.marked[~mine]
        return [int(count) for count in counts]


class WheelChain:
    """The estimator of one wheel and what feeds it; the same blocks give the same estimates.

    Parameters
    ----------
    estimator : Estimator
    conditions : Conditions

    Attributes
    ----------
    steps : int
        Steps so far.
    """

    def __init__(self, estimator: Estimator, conditions: Conditions) -> None:
        self.steps = 0
        self._estimator = estimator
        self._known = conditions
        self._conditions = Held(conditions)
        self._segment: _Segment | None = None
        self._wheel = 0
        self._arrival = 0
        self._note = ""
        self._afresh = False

    def take(self, block: Block) -> list[Turn]:
        """Take the next block and return the turns that it ends."""
        content = block.content
        if not isinstance(content, Samples):
            self._conditions.set_from_bus(content.t_us, content.measured)
            if self._segment is not None:
                self._segment.until = -1.0
            return []
        self._wheel = block.wheel
        turns: list[Turn] = []
        if content.reset or self._afresh:
            turns = self.finish()
            self._begin(content, block.first_us)
        return turns + self._take(content, block.parts or ((len(content.strain), block.arrival),))

    def jump(self, why: str) -> None:
        """Start again with the next samples; drop waiting samples and conditions from the bus."""
        self._segment, self._afresh, self._note = None, True, why
        self._conditions = Held(self._known)

    def finish(self) -> list[Turn]:
        """Step the remaining samples, in a shorter step, and close the segment."""
        segment, self._segment = self._segment, None
        if segment is None or not len(segment.waiting):
            return []
        segment.mark(segment.marks)
        turn = self._step(segment, segment.waiting, marked=True)
        return [] if turn is None else [turn]

    def _begin(self, block: Samples, first_us: int) -> None:
        self._afresh = False
        self._estimator.start(block.period)
        device_origin = 1e-6 * (block.t_us - first_us)
        run, origin = 0, device_origin
        known = self._conditions.run_at(block.t_us)
        if known is not None:
            mark, start = known
            run, origin = mark.run, mark.start_time + 1e-6 * (block.t_us - start)
        self._segment = _Segment(
            block.segment,
            block.t_us,
            block.period,
            run,
            origin,
            device_origin,
            block.strain.shape[1],
        )

    def _take(self, block: Samples, parts: Sequence[tuple[int, int]]) -> list[Turn]:
        """Store samples and take as many steps as they fill, read by read."""
        segment = self._segment
        if segment is None or not len(block.strain):
            return []
        before = len(segment.waiting)
        strain, marks = block.strain, np.empty((len(block.lost), segment.gages + 1), np.bool_)
        marks[:, :-1], marks[:, -1] = block.saturated, block.lost  # 600 times a second
        if before:
            strain = np.concatenate((segment.waiting, strain))
            marks = np.concatenate((segment.marks, marks))
        marked = bool(marks.any())
        turns, first = [], 0
        for came, self._arrival in parts:
            while before + came - first >= (size := self._size(segment)):
                if marked:
                    segment.mark(marks[first : first + size])
                turn = self._step(segment, strain[first : first + size], marked)
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

    def _step(self, segment: _Segment, strain: FloatArray, marked: bool) -> Turn | None:
        valid = not (marked and np.isnan(strain).all())
        result = self._estimator.step(strain, segment.condition, valid)
        segment.stepped += len(strain)
        self.steps += 1
        if result is None:
            return None
        outputs, texts = result
        if self._note:
            texts, self._note = {**texts, "note": self._note}, ""
        ready = segment.stepped * segment.period - outputs["age"]
        *saturated, lost = segment.seen(ready)
        seen = int(TurnFlag.SATURATED) * any(saturated) | int(TurnFlag.GAP) * (lost > 0)
        return Turn(
            run=segment.run,
            segment=segment.number,
            t=segment.origin + outputs.get("contact_time", math.nan),
            ready=segment.origin + ready,
            device_time=segment.device_origin + ready,
            outputs=outputs,
            texts=texts,
            flags=int(outputs["flags"]) | seen,
            saturated=tuple(saturated),
            wheel=self._wheel,
            arrival=self._arrival,
        )
