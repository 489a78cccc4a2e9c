"""A recording as other programs read it: campaign (MDF4), CSV, Parquet, CAN logs (BLF, ASC, log).

Samples come from the same decoder and the same line of samples as a run, so that the library finds
in an exported campaign what the FMU was given.
"""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from bench.can_batch import CanBatch, unpack
from bench.conditions import QUANTITIES, UNKNOWN, Condition, Conditions, Measured, RunMark
from bench.device import Device
from bench.errors import RecordingError
from bench.frames import GAGES
from bench.line_counts import LineCounts
from bench.protocols import CAN, SLCAN
from bench.protocols.frame_decoder import FrameDecoder
from bench.protocols.plan import ProtocolPlan
from bench.protocols.slcan import SlcanDecoder
from bench.recording import Recording
from bench.timeline import Samples, Timeline
from tirelib.arrays import BoolArray, FloatArray
from tirelib.campaign import CampaignHeader, Run, RunPlan, write_campaign
from tirelib.held import HELD
from tirelib.units import from_si

SHORTEST = 0.05
"""A segment shorter than this becomes no run of a campaign, [s]."""
RIG_TRUTH = {"Fz": "Fz", "alpha": "slip_angle", "kappa": "slip_ratio", "Fy": "Fy"}
CAN_LOGS = (".blf", ".asc", ".log")


@dataclass(slots=True)
class Segment:
    """Samples of one wheel without a break in time."""

    wheel: int
    number: int
    t_us: int
    period: float
    blocks: list[Samples] = field(default_factory=list)

    @property
    def strain(self) -> FloatArray:
        """All samples, shape (n, 5), NaN where lost or saturated."""
        return np.concatenate([block.strain for block in self.blocks])

    @property
    def lost(self) -> BoolArray:
        """Where no frame brought the sample, shape (n,)."""
        return np.concatenate([block.lost for block in self.blocks])


def segments(
    recording: Recording, plan: ProtocolPlan, devices: dict[int | None, Device],
    wheel: int | None = None,
) -> Iterator[Segment]:  # fmt: skip
    """Yield the segments of all wheels, or of one, each when it is complete."""
    decoder = plan.decoder()
    lines: dict[int, Timeline] = {}
    current: dict[int, Segment] = {}
    for read in recording.reads():
        if not read.data:
            decoder.interrupt()
            continue
        for item in decoder.push(read.data, read.arrival):
            if isinstance(item, Measured):
                continue
            for number in np.unique(item.wheel).tolist():
                if wheel is not None and number != wheel:
                    continue
                if number not in lines:
                    device = devices.get(number, devices.get(None, plan.device))
                    lines[number] = Timeline(device, number)
                for block in lines[number].push(item):
                    if block.reset:
                        if number in current:
                            yield current[number]
                        current[number] = Segment(number, block.segment, block.t_us, block.period)
                    current[number].blocks.append(block)
    yield from current.values()


def campaign_runs(found: Sequence[Segment], conditions: Conditions) -> Iterator[Run]:
    """Yield each segment as a run with the conditions that were told."""
    taken: set[int] = set()
    for segment in found:
        strain = segment.strain
        if len(strain) * segment.period < SHORTEST:
            continue
        known = conditions.run_at(segment.t_us)
        mark, begin = known if known is not None else (RunMark(0, segment.t_us, 0.0), segment.t_us)
        number = mark.run
        while number in taken or (number < 1 and known is None):
            number = max(taken, default=0) + 1
        taken.add(number)
        start = mark.start_time + 1e-6 * (segment.t_us - begin)
        span = segment.t_us, segment.t_us + round(1e6 * segment.period * len(strain))
        times, rig = _rig(conditions, span, start, mark)
        yield Run(
            plan=_plan(mark, number, 1e-6 * segment.t_us),
            strain=np.ascontiguousarray(strain.T),
            rate=round(1.0 / segment.period, 6),
            start_time=start,
            rig=rig,
            rig_time=times,
        )


def write_campaign_of(
    recording: Recording, found: Sequence[Segment], folder: Path, header: CampaignHeader
) -> int:
    """Write a campaign and return the number of its runs.

    Raises
    ------
    RecordingError
        If there is nothing to write.
    """
    runs = list(campaign_runs(found, recording.conditions))
    if not runs:
        raise RecordingError(
            f"{recording.path}: it has no {SHORTEST:g} s of strain of that wheel; a recording with "
            "samples is needed; name another wheel or recording"
        )
    rate = runs[0].rate
    write_campaign(folder, replace(header, rate=rate, strain_unit="ustrain"), runs)
    return len(runs)


_SPELLED = {"km/h": "kmh", "bar": "bar", "deg": "deg", "rad/s": "rad_s"}
"""Units as a column's name spells them."""


def sample_table(segment: Segment, conditions: Conditions) -> dict[str, Any]:
    """Return the columns of a segment, units in the names."""
    strain = segment.strain
    n = len(strain)
    t_us = segment.t_us + 1e6 * segment.period * np.arange(n)
    index = np.searchsorted(np.asarray(conditions.t_us), t_us + 0.6, side="right") - 1
    held = np.array([*conditions.values, UNKNOWN])[index]  # -1: nothing is known yet
    known = conditions.run_at(segment.t_us)
    return {
        "wheel": np.full(n, segment.wheel, np.int16),
        "segment": np.full(n, segment.number, np.int32),
        "run": np.full(n, known[0].run if known else 0, np.int32),
        "t_s": 1e-6 * t_us,
        **{f"strain_{g + 1}_ustrain": 1e6 * strain[:, g] for g in range(GAGES)},
        "lost": segment.lost,
        **{
            f"{name}_{_SPELLED[unit]}": from_si(held[:, column], unit, dimension)
            for column, (name, (unit, dimension)) in enumerate(QUANTITIES.items())
        },
    }


def write_table(found: Iterator[Segment], conditions: Conditions, path: Path) -> int:
    """Write all samples as CSV or Parquet, by the file's ending; return the number of rows."""
    import pyarrow as pa
    from pyarrow import csv, parquet

    rows, writer = 0, None
    try:
        for segment in found:
            table = pa.table(sample_table(segment, conditions))
            if writer is None:
                kind = parquet.ParquetWriter if path.suffix == ".parquet" else csv.CSVWriter
                writer = kind(str(path), table.schema)
            writer.write_table(table)
            rows += table.num_rows
    finally:
        if writer is not None:
            writer.close()
    return rows


def can_frames(recording: Recording) -> Iterator[tuple[int, CanBatch]]:
    """Yield arrival [ns, monotonic] and the frames of each read.

    Raises
    ------
    RecordingError
        If the recording is not of a CAN bus.
    """
    encoding = recording.header.encoding
    if encoding not in (SLCAN, CAN):
        raise RecordingError(
            f"{recording.path}: it is of a serial line; a CAN log needs a recording of a bus "
            "(slcan:... or can:...); export it as a campaign, CSV or Parquet"
        )
    lines = SlcanDecoder(_Nothing(), LineCounts())
    for read in recording.reads():
        if not read.data:
            lines.interrupt()
        elif encoding == SLCAN:
            yield read.arrival, lines.frames_of(read.data)
        elif (batch := unpack(read.data)) is not None:
            yield read.arrival, batch


def write_can_log(recording: Recording, path: Path) -> int:
    """Write every CAN frame with its arrival on the wall clock; return how many.

    A line of slcan and a packed batch have one arrival for several frames.
    """
    import can

    from bench.links.can_bus import message_of

    kinds: dict[str, Any] = {".blf": can.BLFWriter, ".asc": can.ASCWriter,
                             ".log": can.CanutilsLogWriter}  # fmt: skip
    header = recording.header
    offset = header.wall_ns - header.monotonic_ns
    count = 0
    frames = can_frames(recording)
    first = next(frames, None)  # an unsuitable recording is refused before a file is made
    writer = kinds[path.suffix](str(path))
    try:
        while first is not None:
            arrival, batch = first
            for row in range(len(batch)):
                writer(message_of(batch, row, 1e-9 * (arrival + offset)))
            count += len(batch)
            first = next(frames, None)
    finally:
        with suppress(OSError):
            writer.stop()
    return count


class _Nothing(FrameDecoder):
    """Frames are only passed on."""

    def push(self, batch: CanBatch, arrival: int) -> list[Any]:
        return []

    def interrupt(self) -> None:
        """Nothing waits."""


def _plan(mark: RunMark, number: int, start: float) -> RunPlan:
    told = mark.plan
    load, pressure, speed, slip_angle, camber, slip_ratio = (
        float(told.get(name, float("nan")))
        for name in ("load", "pressure", "speed", "slip_angle", "camber", "slip_ratio")
    )
    file, kind = f"runs/{number:03d}.mf4", str(told.get("kind", "sweep"))
    return RunPlan(number, file, kind, load, pressure, speed, slip_angle, camber, slip_ratio, start)


def _rig(
    conditions: Conditions, span: tuple[int, int], start: float, mark: RunMark
) -> tuple[FloatArray | None, dict[str, FloatArray]]:
    """Return times and channels of what was told about a segment; constants where they are."""
    rows: list[tuple[float, Condition]] = [(start, conditions.at(span[0]))]
    moment = conditions.next_change(span[0])
    while moment < span[1]:
        rows.append((start + 1e-6 * (moment - span[0]), conditions.at(moment)))
        moment = conditions.next_change(moment)
    times = np.array([time for time, _ in rows])
    values = np.array([value for _, value in rows])
    rig = {name: values[:, i] for i, name in enumerate(HELD) if np.isfinite(values[:, i]).all()}
    for name, channel in RIG_TRUTH.items():
        if name in mark.truth:
            rig[channel] = np.full(len(times), mark.truth[name])
    return (times if rig else None), rig
