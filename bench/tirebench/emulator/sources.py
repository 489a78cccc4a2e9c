"""What an emulator can play: runs of a campaign, a manoeuvre on the rig, a recording as it is."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tirebench.emulator.emulator import Script, Tape
from tirebench.emulator.faults import Faults
from tirebench.emulator.manoeuvre import Manoeuvre, Motion, Rig, nodes, waveform
from tirebench.errors import DeviceError
from tirebench.protocols import CAN
from tirebench.protocols.transmitter import Record
from tirebench.recording.header import encoding_of
from tirebench.recording.recording import Recording
from tirebench.wire.can_batch import unpack
from tirebench.wire.conditions import Conditions, RunMark, condition
from tirebench.wire.device import Device
from tirebench.wire.frames import GAGES, TICK
from tirelib.campaign import Campaign, Run

CONDITION_STEP = 0.01
"""Interval at which speed, pressure and camber of a manoeuvre are given, [s]."""
READS = 256
"""Reads of a recording that are played as one piece."""


def campaign_runs(campaign: Campaign, numbers: Sequence[int], everything: bool) -> list[Run]:
    """Return the runs that were asked for, by default the first.

    Raises
    ------
    DeviceError
        If there is none of a number.
    """
    plans = {plan.run: plan for plan in campaign.plans}
    chosen = list(plans) if everything else list(numbers) or list(plans)[:1]
    unknown = [str(number) for number in chosen if number not in plans]
    if unknown or not chosen:
        raise DeviceError(
            f"{campaign.path}: no run {', '.join(unknown) or 'none'}; its runs are "
            f"{', '.join(str(number) for number in plans) or 'none'}; choose among them"
        )
    return [campaign.load(plans[number]) for number in chosen]


def manoeuvre_tape(
    manoeuvre: Manoeuvre,
    device: Device,
    faults: Faults,
    wheels: Sequence[int],
    *,
    rate: float,
    seed: int = 0,
    progress: Callable[[str], None] = lambda label: None,
) -> tuple[Tape, dict[int, Motion]]:
    """Solve the rig along a manoeuvre and return what the wheels send, and the truth of each.

    All of it is solved and put into counts beforehand, so that playing costs little. `progress` is
    told after each node that is solved.
    """
    rig = Rig(manoeuvre.tire)
    period = round(1.0 / (rate * TICK))
    records, motions = [], {}
    for wheel in wheels:
        path = nodes(manoeuvre.of_wheel(wheel))
        motion = rig.motion(path, _solved(wheel, progress))
        strain = waveform(motion, manoeuvre.tire, 1.0 / (period * TICK), seed=seed + wheel)
        counts, marked = device.counts(strain)
        struck, bits = faults.gages(counts, period * TICK, device.scale)
        bits = (bits | (marked << np.arange(GAGES)).sum(axis=1)).astype(np.int16)
        records.append(Record(wheel, 0, period, struck, bits))
        motions[wheel] = motion
    duration = max(len(record.counts) for record in records) * period * TICK
    conditions = _conditions(motions[wheels[0]], alone=len(wheels) == 1)
    return Tape(tuple(records), conditions, duration + 0.1), motions


def _solved(wheel: int, progress: Callable[[str], None]) -> Callable[[int, int], None]:
    return lambda done, of: progress(f"wheel {wheel}, {done} of {of}")


def _conditions(motion: Motion, *, alone: bool) -> Conditions:
    """Return the conditions along a motion; the turn rate only of a wheel that plays alone."""
    time = np.arange(0.0, motion.time[-1], CONDITION_STEP)
    columns = {
        name: np.interp(time, motion.time, [getattr(c, name) for c in motion.conditions]).tolist()
        for name in ("speed", "pressure", "camber")
    }
    if alone:
        columns["omega"] = np.interp(time, motion.time, motion.omega).tolist()
    rows = zip(*columns.values(), strict=True)
    values = tuple(condition(**dict(zip(columns, row, strict=True))) for row in rows)
    steady = len(set(motion.conditions)) == 1
    truth = {name: float(values[0]) for name, values in motion.truth.items() if name != "Fx"}
    mark = RunMark(1, 0, 0.0, truth if steady else {})
    return Conditions(tuple(np.rint(1e6 * time).astype(int).tolist()), values, (mark,))


def truth_rows(motions: Mapping[int, Motion]) -> Iterator[dict[str, float]]:
    """Yield what the rig's contact gave, a row for each solution; units are in the names."""
    degrees = 180.0 / np.pi
    for wheel, motion in motions.items():
        for row, moment in enumerate(motion.time.tolist()):
            truth = {name: float(values[row]) for name, values in motion.truth.items()}
            condition = motion.conditions[row]
            yield {
                "wheel": wheel,
                "t_s": moment,
                "Fz_N": truth["Fz"],
                "Fy_N": truth["Fy"],
                "Fx_N": truth["Fx"],
                "alpha_deg": truth["alpha"] * degrees,
                "kappa": truth["kappa"],
                "speed_kmh": 3.6 * condition.speed,
                "pressure_bar": 1e-5 * condition.pressure,
                "omega_rad_s": float(motion.omega[row]),
            }


def chosen_source(recording: Recording, source: int | None) -> int:
    """Return the source of a recording that is played: the one that was asked for, or the only one.

    Raises
    ------
    DeviceError
        If there is no such source, or several and none was asked for.
    """
    sources = recording.header.sources
    if source not in range(len(sources)) and (source is not None or len(sources) > 1):
        names = (f"{n} {one.get('name', '')}" for n, one in enumerate(sources))
        raise DeviceError(
            f"{recording.path}: source {'none' if source is None else source}: the recording has "
            f"the sources {', '.join(names)}, and one line carries one of them; choose with "
            "--source"
        )
    return source or 0


def recording_pieces(recording: Recording, source: int | None = None) -> Iterator[Script]:
    """Yield the reads of a source in pieces at their recorded times, bad frames included.

    Raises
    ------
    DeviceError
        As `chosen_source`.
    """
    chosen = chosen_source(recording, source)
    start: int | None = None
    due: list[float] = []
    frames: list[Any] = []
    packed = encoding_of(recording.header.sources[chosen]) == CAN
    for arrival, data, _, number in recording.reads():
        if number != chosen or not data:
            continue
        start = arrival if start is None else start
        due.append(1e-9 * (arrival - start))
        frames.append(_messages(data) if packed else data)
        if len(due) == READS:
            yield Script(tuple(due), tuple(frames), recording.conditions, 0.0)
            due, frames = [], []
    if due:
        yield Script(tuple(due), tuple(frames), recording.conditions, 0.0)


def _messages(data: bytes) -> list[Any]:
    from tirebench.links.can_bus import message_of

    batch = unpack(data)
    return [] if batch is None else [message_of(batch, row) for row in range(len(batch))]


def write_truth(path: Path, motions: Mapping[int, Motion]) -> None:
    """Write `truth_rows` as CSV.

    Raises
    ------
    DeviceError
        If the file cannot be written.
    """
    rows = list(truth_rows(motions))
    lines = [",".join(rows[0]), *(",".join(f"{x:.9g}" for x in row.values()) for row in rows)]
    try:
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    except OSError as error:
        raise DeviceError(
            f"{path}: cannot be written ({error.strerror}); a file in an existing folder is "
            "needed; choose another"
        ) from None
