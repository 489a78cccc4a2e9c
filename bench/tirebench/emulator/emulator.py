"""What an emulator plays: records of wheels on one device clock, encoded piece by piece.

Runs of a campaign follow each other. The first frames of each carry the time-reset flag, because
the wheel does not turn on from one run to the next.
"""

import time
from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, Protocol

import numpy as np

from tirebench.emulator.faults import Faults
from tirebench.errors import DeviceError
from tirebench.protocols import CAN, SERIAL, SLCAN
from tirebench.protocols.slcan import encode as slcan_lines
from tirebench.protocols.transmitter import (
    ANNOUNCED,
    WHOLE,
    Record,
    Sent,
    SerialTransmitter,
    Transmitter,
)
from tirebench.wire.can_batch import CanBatch
from tirebench.wire.conditions import Condition, Conditions, RunMark
from tirebench.wire.device import Device
from tirebench.wire.frames import GAGES, SAMPLES, TICK
from tirelib.campaign import CampaignHeader, Run
from tirelib.campaign.conditions import changes_of, conditions_of
from tirelib.campaign.header import header_document

PAUSE_BETWEEN_RUNS = 0.1
"""Device time between two runs, [s]."""
BURST = 0.002
"""Frames are sent this often, [s]."""
PIECE = 50 * WHOLE
"""Samples that are encoded at once: 0.24 s at 10 kHz."""
TRUTH = {"Fz": "Fz", "alpha": "slip_angle", "kappa": "slip_ratio", "Fy": "Fy"}


@dataclass(frozen=True, slots=True)
class Tape:
    """Records of one pass, all wheels.

    Attributes
    ----------
    records : tuple of Record
        In order of device time; several wheels side by side.
    conditions : Conditions
        Conditions of one pass, with the runs and their truth.
    duration : float, [s]
    """

    records: tuple[Record, ...]
    conditions: Conditions
    duration: float


@dataclass(frozen=True, slots=True)
class Script:
    """Frames ready to be sent.

    Attributes
    ----------
    due : tuple of float, [s]
        When each frame is complete, on the host's clock from the start.
    frames : tuple
        As sent, faults included: bytes, empty for a lost one, or lists of CAN frames.
    conditions : Conditions
    duration : float, [s]
    """

    due: tuple[float, ...]
    frames: tuple[Any, ...]
    conditions: Conditions
    duration: float


class Sink(Protocol):
    """Where frames go."""

    def send(self, frames: Sequence[Any]) -> bool:
        """Take frames; return False if no reader listens.

        Raises
        ------
        UnpluggedError
            If the cable was pulled: there is nothing left to send to.
        """


def record_tape(
    runs: Sequence[Run],
    device: Device,
    faults: Faults,
    wheels: Sequence[int] = (0,),
    header: CampaignHeader | None = None,
) -> Tape:
    """Return runs one after the other, the same for each wheel.

    Raises
    ------
    DeviceError
        If a run has no strain of five gages, or a rate that a frame cannot say.
    """
    records: list[Record] = []
    marks, times, values = [], [], []
    seconds = 0.0
    for run in runs:
        period = _period(run)
        start = round(seconds * 1e6)
        marks.append(RunMark(run.plan.run, start, run.start_time, _truth(run), _plan(run)))
        for moment, value in _conditions(run):
            times.append(start + round((moment - run.start_time) * 1e6))
            values.append(value)
        counts, marked = device.counts(np.asarray(run.strain).T)
        for wheel in wheels:
            struck, bits = faults.gages(counts, period * TICK, device.scale)
            bits = (bits | (marked << np.arange(GAGES)).sum(axis=1)).astype(np.int16)
            records.append(Record(wheel, start, period, struck, bits))
        seconds += _samples(run) * period * TICK + PAUSE_BETWEEN_RUNS
    campaign = None if header is None else header_document(replace(header, axes="iso"))
    conditions = Conditions(tuple(times), tuple(values), tuple(marks), campaign=campaign)
    return Tape(tuple(records), conditions, seconds)


class Player:
    """Encodes a tape piece by piece for one kind of line, pass after pass.

    Parameters
    ----------
    make : callable
        Gives a transmitter; each wheel has its own.
    line : str
        ``serial-v1``, ``slcan`` or ``can``: what a frame becomes.
    faults : Faults
    """

    def __init__(self, make: Callable[[], Transmitter], line: str, faults: Faults) -> None:
        self._make = make
        self._line = line
        self._faults = faults
        self._wheels: dict[int, Transmitter] = {}
        self._restarted = 0.0

    def pieces(self, tape: Tape, turn: int = 0) -> Iterator[Script]:
        """Yield the frames of a pass in pieces, in order of time."""
        shift = round(turn * tape.duration * 1e6)
        begins = sorted({record.start_us for record in tape.records})
        for begin in begins:
            side = [record for record in tape.records if record.start_us == begin]
            moved = [replace(record, start_us=begin + shift) for record in side]
            length = max(len(record.counts) for record in moved)
            cuts = [*range(0, length, PIECE), length]
            for first, last in pairwise(cuts):
                sent = [
                    self._transmitter(record.wheel, first, record).send(
                        record, first, min(last, len(record.counts))
                    )
                    for record in moved
                    if first < len(record.counts)
                ]
                yield self._script(sent, tape)

    def _transmitter(self, wheel: int, first: int, record: Record) -> Transmitter:
        """Return the transmitter of a wheel, restarted where that fault was asked for."""
        if wheel not in self._wheels:
            self._wheels[wheel] = self._make()
        now = 1e-6 * float(record.times(np.array([first]))[0])
        if now - self._restarted >= self._faults.reset:
            self._restarted = now
            self._faults.done["reset"] += 1
            for other in self._wheels.values():
                other.restart()
        return self._wheels[wheel]

    def _script(self, sent: Sequence[Sent], tape: Tape) -> Script:
        due = np.concatenate([one.due for one in sent]) / (1.0 + self._faults.drift)
        frames = [frame for one in sent for frame in self._wire(one.frames)]
        order = np.argsort(due, kind="stable")
        frames, due = [frames[row] for row in order.tolist()], due[order]
        if self._line == CAN:
            struck: list[Any] = self._faults.bus(frames, due)
        else:
            struck = self._faults.wire(frames, due)
        return Script(tuple(due.tolist()), tuple(struck), tape.conditions, tape.duration)

    def _wire(self, frames: "Sequence[bytes] | CanBatch") -> Sequence[Any]:
        """Return each frame as the line carries it."""
        if not isinstance(frames, CanBatch):
            return frames
        if self._line == SLCAN:
            return slcan_lines(frames)
        from tirebench.links.can_bus import message_of

        return [message_of(frames, row) for row in range(len(frames))]


def write_script(
    runs: Sequence[Run], device: Device, faults: Faults, *, wheel: int = 0, turn: int = 0
) -> Script:
    """Turn runs into frames of SERIAL v1 with faults, all at once.

    Parameters
    ----------
    turn : int
        Pass of a loop: number and device time go on from the passes before.
    """
    tape = record_tape(runs, device, faults, (wheel,))
    before = turn * sum(-(-_samples(run) // SAMPLES) for run in runs)
    player = Player(lambda: SerialTransmitter(before), SERIAL, faults)
    pieces = list(player.pieces(tape, turn))
    return Script(
        tuple(due for piece in pieces for due in piece.due),
        tuple(frame for piece in pieces for frame in piece.frames),
        tape.conditions,
        tape.duration,
    )


@dataclass(slots=True)
class Tally:
    """What has been sent so far.

    Attributes
    ----------
    sent : int
        Frames, lost ones included.
    unheard : int
        Frames sent while nobody listened.
    late : float, [s]
        The largest delay of a burst against its time.
    """

    sent: int = 0
    unheard: int = 0
    late: float = 0.0


def play(script: Script, sink: Sink, tally: Tally, *, start: float, speedup: float = 1.0) -> None:
    """Send a script at the right pace, and keep the tally.

    Parameters
    ----------
    sink : Sink
        `send` may block while the reader is behind.
    tally : Tally
    start : float, [s]
        Moment on `time.monotonic` that is time zero.
    speedup : float
    """
    first = 0
    while first < len(script.frames):
        wait = start + script.due[first] / speedup - time.monotonic()
        if wait > 0.0:
            time.sleep(max(wait, BURST))
        now = (time.monotonic() - start) * speedup
        stop = max(bisect_right(script.due, now), first + 1)
        tally.late = max(tally.late, now / speedup - script.due[first] / speedup - BURST)
        heard = sink.send(script.frames[first:stop])
        tally.sent += stop - first
        tally.unheard += 0 if heard else stop - first
        first = stop


def _period(run: Run) -> int:
    """Sample period in ticks of a frame."""
    where = f"run {run.plan.run}"
    if run.strain is None or run.strain.shape[0] != GAGES:
        given = "no strain" if run.strain is None else f"{run.strain.shape[0]} gages"
        raise DeviceError(
            f"{where}: the run has {given}; the transmitter sends {GAGES} gages; choose another run"
        )
    period = round(1.0 / (run.rate * TICK))
    if not 1 <= period < 2**16 or abs(period * TICK * run.rate - 1.0) > 1e-6:
        raise DeviceError(
            f"{where}: {run.rate:g} Hz has a period of {1e6 / run.rate:g} us; a frame states the "
            "period in steps of 0.1 us up to 6553.5 us; resample the run"
        )
    return period


def _samples(run: Run) -> int:
    return 0 if run.strain is None else int(run.strain.shape[1])


def _conditions(run: Run) -> Iterator[tuple[float, Condition]]:
    """Yield time [s, the run's clock] and conditions wherever they change while strain is sent."""
    times = changes_of(run)
    times = times[times < run.start_time + _samples(run) / run.rate]
    table = np.stack(list(conditions_of(run, times).values()))
    for moment, values in zip(times.tolist(), table.T.tolist(), strict=True):
        yield moment, tuple(values)


def _plan(run: Run) -> dict[str, float | str]:
    names = ("kind", "load", "pressure", "speed", "slip_angle", "camber", "slip_ratio")
    return {name: getattr(run.plan, name) for name in names}


def _truth(run: Run) -> dict[str, float]:
    means = {name: run.mean(quantity) for name, quantity in TRUTH.items()}
    return {name: value for name, value in means.items() if value is not None}


__all__ = [
    "ANNOUNCED",
    "Player",
    "Script",
    "Sink",
    "Tally",
    "Tape",
    "play",
    "record_tape",
    "write_script",
]
