"""The wheel transmitter's stand-in: runs of a campaign as SERIAL v1 frames with device time.

Runs follow each other on one device clock. The first frames of each run carry the time-reset flag,
because the wheel does not turn on from one run to the next.
"""

import time
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from bench.conditions import UNKNOWN, Condition, Conditions, RunMark
from bench.device import Device
from bench.errors import DeviceError
from bench.faults import Faults
from bench.frames import GAGES, SAMPLES, TICK, FrameFlag, Int16Array, encode, strain_frames
from tirelib.campaign import Run

PAUSE = 0.1
"""Device time between two runs, [s]."""
ANNOUNCED = 8
"""Frames of a run that carry the time-reset flag; a receiver acts on the first that it gets."""
BURST = 0.002
"""Frames are sent this often, [s]."""
TRUTH = {"Fz": "Fz", "alpha": "slip_angle", "kappa": "slip_ratio", "Fy": "Fy"}


@dataclass(frozen=True, slots=True)
class Script:
    """What the emulator plays in one pass.

    Attributes
    ----------
    due : tuple of float, [s]
        When each frame is complete, on the device clock.
    frames : tuple of bytes
        As sent, faults included; empty for a lost one.
    conditions : Conditions
        Of one pass, with the runs and their truth.
    duration : float, [s]
    """

    due: tuple[float, ...]
    frames: tuple[bytes, ...]
    conditions: Conditions
    duration: float


class Sink(Protocol):
    """Where frames go."""

    def send(self, data: bytes) -> bool:
        """Take bytes; False if nobody listens.

        Raises
        ------
        UnpluggedError
            If the cable was pulled: there is nothing left to send to.
        """


def write_script(
    runs: Sequence[Run], device: Device, faults: Faults, *, wheel: int = 0, turn: int = 0
) -> Script:
    """Turn runs into frames with faults.

    Parameters
    ----------
    runs : sequence of Run
        With strain of five gages.
    turn : int
        Pass of a loop: sequence and device time go on from the passes before.

    Raises
    ------
    DeviceError
        If a run has no strain of five gages, or a rate that a frame cannot say.
    """
    wire: list[bytes] = []
    due: list[float] = []
    marks, times, values = [], [], []
    periods = [_period(run) for run in runs]
    length = sum(_duration(run, p) + PAUSE for run, p in zip(runs, periods, strict=True))
    seconds, seq = turn * length, 0
    if turn:
        seq = turn * sum(-(-_samples(run) // SAMPLES) for run in runs)
    for run, period in zip(runs, periods, strict=True):
        start = round(seconds * 1e6)
        marks.append(RunMark(run.plan.run, start, run.start_time, _truth(run)))
        for moment, value in _conditions(run):
            times.append(start + round((moment - run.start_time) * 1e6))
            values.append(value)
        frames, ends = _frames(run, period, device, faults, wheel, seq, start)
        seq += len(frames)
        wire.extend(faults.wire(frames))
        due.extend(seconds + ends)
        seconds += _duration(run, period) + PAUSE
    conditions = Conditions(tuple(times), tuple(values), tuple(marks))
    return Script(tuple(due), tuple(wire), conditions, length)


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
        Moment on `time.monotonic` that is device time zero.
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
        heard = sink.send(b"".join(script.frames[first:stop]))
        tally.sent += stop - first
        tally.unheard += 0 if heard else stop - first
        first = stop


def _frames(
    run: Run, period: int, device: Device, faults: Faults, wheel: int, seq: int, start: int
) -> tuple[list[bytes], np.ndarray[tuple[int], np.dtype[np.float64]]]:
    """Frames of one run, and the end of each [s] from the run's start."""
    strain = np.asarray(run.strain).T
    counts, marked = device.counts(strain)
    counts, bits = faults.gages(counts)
    bits = bits | (marked << np.arange(GAGES)).sum(axis=1)
    whole = len(counts) // SAMPLES * SAMPLES
    wire: list[bytes] = []
    for part in (slice(0, whole), slice(whole, None)):
        if len(counts[part]):
            wire += _encoded(counts[part], bits[part], period, wheel, seq + len(wire),
                             start + round(part.start * period / 10), len(wire))  # fmt: skip
    ends = np.minimum(SAMPLES * (1 + np.arange(len(wire))), len(counts)) * period * TICK
    return wire, ends


def _encoded(
    counts: Int16Array, bits: Int16Array, period: int, wheel: int, seq: int, t_us: int, before: int
) -> list[bytes]:
    samples = min(SAMPLES, len(counts))
    flags = np.bitwise_or.reduce(bits.reshape(-1, samples), axis=1).astype(np.int64)
    flags[: max(0, ANNOUNCED - before)] |= int(FrameFlag.TIME_RESET)
    return encode(
        strain_frames(counts, period=period, wheel=wheel, seq=seq, t_us=t_us, flags=flags.tolist())
    )


def _period(run: Run) -> int:
    """Sample period in ticks of a frame."""
    where = f"run {run.plan.run}"
    if run.strain is None or run.strain.shape[0] != GAGES:
        given = "no strain" if run.strain is None else f"{run.strain.shape[0]} gages"
        raise DeviceError(f"{where}: it has {given}; the transmitter sends {GAGES} gages; "
                          "choose another run")  # fmt: skip
    period = round(1.0 / (run.rate * TICK))
    if not 1 <= period < 2**16 or abs(period * TICK * run.rate - 1.0) > 1e-6:
        raise DeviceError(
            f"{where}: {run.rate:g} Hz has a period of {1e6 / run.rate:g} us; a frame says it in "
            "steps of 0.1 us up to 6553.5 us; resample the run"
        )
    return period


def _samples(run: Run) -> int:
    return 0 if run.strain is None else int(run.strain.shape[1])


def _duration(run: Run, period: int) -> float:
    return _samples(run) * period * TICK


def _conditions(run: Run) -> Iterator[tuple[float, Condition]]:
    """Yield time [s, the run's clock] and conditions wherever the rig measured them."""
    times = run.rig_time if run.rig_time is not None else np.array([run.start_time])
    columns = [run.rig.get(name) for name in ("speed", "pressure", "camber")]
    first = int(np.searchsorted(times, run.start_time, side="right")) - 1
    if first < 0:
        yield run.start_time, UNKNOWN
    for index in range(max(first, 0), len(times)):
        speed, pressure, camber = (
            float("nan") if column is None or not column.size else float(column[index])
            for column in columns
        )
        yield max(float(times[index]), run.start_time), (speed, pressure, camber)


def _truth(run: Run) -> dict[str, float]:
    means = {name: run.mean(quantity) for name, quantity in TRUTH.items()}
    return {name: value for name, value in means.items() if value is not None}
