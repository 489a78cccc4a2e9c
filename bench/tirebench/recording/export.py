"""A recording as other programs read it: campaign (MDF4), CSV, Parquet, CAN logs (BLF, ASC, log).

Samples come from the same decoder and the same line of samples as a run, so that the library finds
in an exported campaign what the FMU was given.
"""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from tirebench.errors import RecordingError
from tirebench.protocols import CAN, SLCAN
from tirebench.protocols.frame_decoder import FrameDecoder
from tirebench.protocols.slcan import SlcanDecoder
from tirebench.recording.recording import Recording
from tirebench.recording.segments import Segment
from tirebench.wire.can_batch import CanBatch, unpack
from tirebench.wire.conditions import QUANTITIES, ROUNDING, Condition, Conditions, RunMark
from tirebench.wire.line_counts import LineCounts
from tirelib.campaign import CampaignHeader, Run, RunPlan, write_campaign
from tirelib.core.arrays import FloatArray
from tirelib.core.held import HELD
from tirelib.core.units import from_si
from tirelib.core.version import __version__

SHORTEST_RUN = 0.05
"""A segment shorter than this becomes no run of a campaign, [s]."""
RIG_TRUTH = {"Fz": "Fz", "alpha": "slip_angle", "kappa": "slip_ratio", "Fy": "Fy"}
CAN_LOGS = (".blf", ".asc", ".log")


def campaign_runs(found: Sequence[Segment], conditions: Conditions) -> Iterator[Run]:
    """Yield each segment as a run with the conditions that were sent; see `left_out`."""
    taken: set[int] = set()
    for segment in found:
        left = left_out(segment, conditions)
        strain = segment.strain[left:]
        if len(strain) * segment.period < SHORTEST_RUN:
            continue
        first_us = segment.t_us + round(1e6 * segment.period * left)
        known = conditions.run_at(segment.t_us)
        mark, begin = known if known is not None else (RunMark(0, segment.t_us, 0.0), segment.t_us)
        number = mark.run
        while number in taken or (number < 1 and known is None):
            number = max(taken, default=0) + 1
        taken.add(number)
        start = mark.start_time + 1e-6 * (first_us - begin)
        span = first_us, first_us + round(1e6 * segment.period * len(strain))
        times, rig = _rig(segment.known(conditions), span, start, mark)
        yield Run(
            plan=_plan(mark, number, 1e-6 * first_us),
            strain=np.ascontiguousarray(strain.T),
            rate=round(1.0 / segment.period, 6),
            start_time=start,
            rig=rig,
            rig_time=times,
        )


def left_out(segment: Segment, conditions: Conditions) -> int:
    """Return how many samples of a segment came before the bus had sent its conditions.

    A channel of a campaign holds numbers from its first sample on, so that a run begins there; none
    are left out where too few would remain.
    """
    known = segment.known(conditions)
    values = np.array(known.values)
    present = np.isfinite(values).any(axis=0)
    row = int(np.argmax(np.isfinite(values[:, present]).all(axis=1)))
    left = round(1e-6 * (known.t_us[row] - segment.t_us) / segment.period)
    enough = (len(segment.strain) - left) * segment.period >= SHORTEST_RUN
    return left if enough else 0


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
            f"{recording.path}: it holds less than {SHORTEST_RUN:g} s of strain of that wheel; at "
            "least that much is needed; name another wheel or recording"
        )
    rate = runs[0].rate
    write_campaign(folder, replace(header, rate=rate, strain_unit="ustrain"), runs)
    return len(runs)


_SPELLED = {"km/h": "_kmh", "rad/s": "_rad_s", "1": ""}
"""Ends of columns' names for units that are not spelled as they are."""


def sample_table(segment: Segment, conditions: Conditions) -> dict[str, Any]:
    """Return the columns of a segment, units in the names."""
    strain = segment.strain
    n = len(strain)
    t_us = segment.t_us + 1e6 * segment.period * np.arange(n)
    course = segment.known(conditions)
    held = np.array(course.values)[np.searchsorted(course.t_us, t_us + ROUNDING, side="right") - 1]
    known = conditions.run_at(segment.t_us)
    return {
        "wheel": np.full(n, segment.wheel, np.int16),
        "segment": np.full(n, segment.number, np.int32),
        "run": np.full(n, known[0].run if known else 0, np.int32),
        "t_s": 1e-6 * t_us,
        **{f"strain_{g + 1}_ustrain": 1e6 * strain[:, g] for g in range(strain.shape[1])},
        "lost": segment.lost,
        **{
            f"{name}{_SPELLED.get(unit, f'_{unit}')}": from_si(held[:, column], unit, dimension)
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
            columns = sample_table(segment, conditions)
            table = pa.table(columns, metadata={"tirelib": __version__})
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
            f"{recording.path}: it was recorded from a serial line; a CAN log needs a recording of "
            "a CAN bus (slcan:... or can:...); export it as a campaign, CSV or Parquet"
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

    from tirebench.links.can_bus import message_of

    kinds: dict[str, Any] = {
        ".blf": can.BLFWriter,
        ".asc": can.ASCWriter,
        ".log": can.CanutilsLogWriter,
    }
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
    except BaseException:
        with suppress(OSError):  # the first failure is the one that is reported
            writer.stop()
        raise
    writer.stop()
    return count


class _Nothing(FrameDecoder):
    """Frames are only passed on."""

    def push(self, batch: CanBatch, arrival: int) -> list[Any]:
        return []

    def interrupt(self) -> None:
        """Nothing waits."""


def _plan(mark: RunMark, number: int, start: float) -> RunPlan:
    plan = mark.plan
    load, pressure, speed, slip_angle, camber, slip_ratio = (
        float(plan.get(name, float("nan")))
        for name in ("load", "pressure", "speed", "slip_angle", "camber", "slip_ratio")
    )
    file, kind = f"runs/{number:03d}.mf4", str(plan.get("kind", "sweep"))
    return RunPlan(number, file, kind, load, pressure, speed, slip_angle, camber, slip_ratio, start)


def _rig(
    conditions: Conditions, span: tuple[int, int], start: float, mark: RunMark
) -> tuple[FloatArray | None, dict[str, FloatArray]]:
    """Return times and channels of a segment's conditions; constants where they do not change."""
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
