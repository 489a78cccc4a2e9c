"""The samples of a recording, wheel by wheel and block by block."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tirelib.campaign.conditions import LONGEST_HOLD
from tirelib.campaign.mdf import Channel, MdfFile, Place
from tirelib.campaign.model import CLOCK_TOLERANCE, BoolArray, FloatArray
from tirelib.campaign.recording import Recording, Wheel
from tirelib.campaign.timebase import STEP_TOLERANCE
from tirelib.core.axes import sign
from tirelib.core.errors import Fault, FormatError, UnitError
from tirelib.core.units import dimension_of, to_si

BLOCK = 1 << 17
"""Samples of a block. With five gages half of it takes 2.5 MB and as long; double takes 10 MB."""
LONGEST_GAP = 3.0
"""Gap that is filled with missing samples, [s]: no turn is longer
(`tirelib.measured.signal.turns`), so after a longer one nothing of the turn before it is left."""


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """Samples of one wheel that follow each other, SI, ISO.

    Attributes
    ----------
    strain : array, shape (n_gages, n), [-]
        NaN where samples are missing.
    trigger : bool array, shape (n,), or None
    held : dict of arrays, shape (n,)
        Conditions; those that are unknown are absent or NaN.
    time : array, shape (n,), [s]
        Since the start of the recording's first file.
    rate : float, [Hz]
    fresh : bool
        Nothing before this block belongs to it: the first one, or the one after a long gap.
    """

    strain: FloatArray
    trigger: BoolArray | None
    held: dict[str, FloatArray]
    time: FloatArray
    rate: float
    fresh: bool


def blocks(recording: Recording, wheel: Wheel) -> Iterator[Block]:
    """Yield the samples of one wheel, file after file; the memory is that of one block.

    Raises
    ------
    FormatError
        Naming file and channel: illegible, a channel that is missing, a unit that is wrong, a
        clock that does not grow.
    """
    began: float | None = None
    last = -np.inf
    for path, _ in _by_start(recording):
        with _named(path), MdfFile(path) as file:
            began = file.start if began is None else began
            for block in _blocks_of(file, wheel, recording.axes, file.start - began, last):
                last = float(block.time[-1])
                yield block


def started(recording: Recording) -> float:
    """Return when a recording began, [s since 1970-01-01 UTC]."""
    return _by_start(recording)[0][1]


def _by_start(recording: Recording) -> list[tuple[Path, float]]:
    found = []
    for path in recording.files:
        with _named(path), MdfFile(path) as file:
            found.append((path, file.start))
    return sorted(found, key=lambda each: (each[1], each[0]))


@contextmanager
def _named(path: Path) -> Iterator[None]:
    """State the file in the message of an error whose finder did not know it."""
    try:
        yield
    except FormatError as error:
        places = [f"{path}, {fault.where}" if fault.where else str(path) for fault in error.faults]
        raise FormatError(
            [
                Fault(where, fault.given, fault.allowed, fault.remedy)
                for where, fault in zip(places, error.faults, strict=True)
            ]
        ) from error


def _blocks_of(
    file: MdfFile, wheel: Wheel, axes: str, shift: float, last: float
) -> Iterator[Block]:
    gages = [file.place(wheel.strain.format(k + 1)) for k in range(len(wheel.lateral))]
    places = [file.clock(gages[0].group), *gages]
    if wheel.trigger:
        places.append(file.place(wheel.trigger))
    apart = {place.group for place in places[1:]}
    if len(apart) > 1:
        raise FormatError(
            Fault(
                "",
                f"the gages and the trigger of {wheel.name} stand in {len(apart)} groups",
                "one group, one clock is needed for a wheel's gages",
                "record them together",
            )
        )
    held = {
        name: _Condition(file, file.place(each.channel), name, axes, each.hold, shift)
        for name, each in wheel.conditions.items()
    }
    group, period = gages[0].group, np.nan
    total = file.samples(group)
    for start in range(0, total, BLOCK):
        count = min(BLOCK, total - start)
        channels = file.read(places, start, count)
        time = _si(channels[0], "time") + shift
        if start == 0:
            if count < 2:
                continue
            period = float(np.median(np.diff(time)))
        strain = np.stack([_si(each, "strain") for each in channels[1 : len(gages) + 1]])
        trigger = _si(channels[-1], "ratio") > 0.5 if wheel.trigger else None
        for part in _without_gaps(time, strain, trigger, period, last):
            times = part.time
            known = {name: each.at(times) for name, each in held.items()}
            yield Block(part.strain, part.trigger, known, times, 1.0 / period, part.fresh)
        last = float(time[-1])


def _without_gaps(
    time: FloatArray,
    strain: FloatArray,
    trigger: BoolArray | None,
    period: float,
    last: float,
) -> Iterator[Block]:
    """Yield stretches: short gaps are filled with NaN, at long ones a new stretch begins."""
    steps = np.diff(time, prepend=last if np.isfinite(last) else time[0] - period)
    if not (np.isfinite(time).all() and (steps > 0.0).all()):
        first = int(np.flatnonzero(~(np.isfinite(time) & (steps > 0.0)))[0])
        raise FormatError(
            Fault(
                "time of the gages",
                f"the time does not grow at {time[first]:.6g} s",
                "time must increase from sample to sample and from file to file",
                "sort out the clock at its source",
            )
        )
    crowded = np.flatnonzero(steps < (1.0 - STEP_TOLERANCE) * period)
    if crowded.size:
        first = int(crowded[0])
        raise FormatError(
            Fault(
                "time of the gages",
                f"not uniform: a step of {1e3 * steps[first]:.3g} ms at {time[first]:.4f} s, the "
                f"usual step is {1e3 * period:.3g} ms",
                "uniform steps are needed, gaps are allowed",
                "export it with the logger's own clock",
            )
        )
    long = np.flatnonzero(steps > LONGEST_GAP)
    fresh = not np.isfinite(last)
    for begin, end in zip([0, *long], [*long, time.size], strict=True):
        if begin == end:
            continue
        cut = fresh or bool(steps[begin] > LONGEST_GAP)
        lost = np.maximum(np.round(steps[begin:end] / period).astype(np.int64) - 1, 0)
        lost[0] = 0 if cut else lost[0]
        place = np.arange(end - begin) + np.cumsum(lost)
        n = int(place[-1]) + 1
        filled = np.full((strain.shape[0], n), np.nan)
        filled[:, place] = strain[:, begin:end]
        passed = None
        if trigger is not None:
            passed = np.zeros(n, dtype=np.bool_)
            passed[place] = trigger[begin:end]
        times = time[begin:end]
        if n > end - begin:
            known, at = place, times
            if place[0]:  # the gap began before this block
                known, at = np.append(-1, place), np.append(last, times)
            times = np.interp(np.arange(n), known, at)
        yield Block(filled, passed, {}, times, 1.0 / period, cut)
        fresh = False


class _Condition:
    """A channel that is held: its samples are read as far as the wheel's time has come."""

    def __init__(
        self,
        file: MdfFile,
        place: Place,
        name: str,
        axes: str,
        hold: float | None,
        shift: float,
    ) -> None:
        self._file, self._place, self._name, self._hold = file, place, name, hold
        self._clock, self._shift = file.clock(place.group), shift
        self._sign = sign(name, axes)
        self._next, self._total = 0, file.samples(place.group)
        self._time, self._values = np.empty(0), np.empty(0)

    def at(self, times: FloatArray) -> FloatArray:
        """Return the newest value at each time, NaN before the first and after the hold."""
        while self._next < self._total and (not self._time.size or self._time[-1] <= times[-1]):
            count = min(BLOCK, self._total - self._next)
            clock, channel = self._file.read([self._clock, self._place], self._next, count)
            self._next += count
            new = _si(clock, "time") + self._shift
            if self._hold is None and new.size > 1:
                self._hold = LONGEST_HOLD * float(np.median(np.diff(new)))
            values = self._sign * _si(channel, dimension_of(self._name) or "ratio")
            kept = max(int(np.searchsorted(self._time, times[0], side="right")) - 1, 0)
            self._time = np.concatenate((self._time[kept:], new))
            self._values = np.concatenate((self._values[kept:], values))
        newest = np.searchsorted(self._time, times + CLOCK_TOLERANCE, side="right") - 1
        if not self._time.size:
            return np.full(times.shape, np.nan)
        found = np.where(newest < 0, np.nan, self._values[np.maximum(newest, 0)])
        age = times - self._time[np.maximum(newest, 0)]
        return np.where(age > (np.inf if self._hold is None else self._hold), np.nan, found)


def _si(channel: Channel, dimension: str) -> FloatArray:
    if channel.samples.dtype.kind not in "biuf" or channel.samples.ndim != 1:
        raise FormatError(
            Fault(
                f"channel {channel.name}",
                f"its samples are of type {channel.samples.dtype}",
                "one number a sample is needed",
                "export it as a number",
            )
        )
    unit = channel.unit.strip()
    try:
        return to_si(channel.samples.astype(np.float64), unit, dimension)
    except UnitError as error:
        raise FormatError(
            [Fault(f"channel {channel.name}", f.given, f.allowed, f.remedy) for f in error.faults]
        ) from None
