"""Tables of what a recording holds besides samples: estimates of the run, events and markers.

A recording of the former version holds no estimates.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from tirebench.errors import RecordingError
from tirebench.recording.document import QUANTITIES
from tirebench.recording.new_file import whole
from tirebench.recording.recording import Recording
from tirebench.recording.segments import Segment
from tirebench.recording.topics import ESTIMATE, EVENTS
from tirelib.core.arrays import FloatArray, IntArray
from tirelib.core.units import from_si
from tirelib.core.version import WRITER, __version__

Rows = dict[str, list[Any]]
_ESTIMATED = (
    "run",
    "segment",
    "t",
    "ready",
    "device_time",
    *(f"{name}{end}" for name in QUANTITIES for end in ("", "_std", "_valid")),
    "omega_rad_s",
    "valid",
)
_TEXTS = ("event", "text")
_LARGEST = 2.0**63
"""Numbers are below this, so that tables can hold them; NaN and infinity are written as null."""
_UNITS = {"N": "_N", "deg": "_deg", "rad/s": "_rad_s"}


def results(path: Path, wheel: int | None = None) -> tuple[Rows, Rows]:
    """Return estimates and events of a recording, all wheels or one, as columns.

    Times: ``utc_s`` on the wall clock when the bytes came, and ``t_s`` since the recording began.
    An alarm has two events, ``alarm begins`` and ``alarm ends``.
    """
    estimates: Rows = {
        "utc_s": [],
        "t_s": [],
        "wheel": [],
        **{name: [] for name in _ESTIMATED},
        "flags": [],
    }
    events: Rows = {"utc_s": [], "t_s": [], "event": [], "text": [], "wheel": []}
    recording = Recording(path)
    try:
        header = recording.header
        for channel, moment, data in recording.messages():
            is_event = channel.topic == EVENTS
            number = _wheel_of(str(channel.topic))
            if not is_event and (number is None or wheel not in (None, number)):
                continue
            content = _content(data)
            if wrong := _wrong(content, is_event):
                raise RecordingError(
                    f"{recording.path}: {channel.topic} at {moment} ns: {wrong}; the samples are "
                    "exported, but estimates and events are not; use another recording"
                )
            row = {
                **content,
                "utc_s": 1e-9 * (moment + header.clock),
                "t_s": 1e-9 * (moment - header.monotonic_ns),
            }
            if is_event and content.get("event") == "alarm":
                row["event"] = "alarm ends" if content.get("state") == "off" else "alarm begins"
            if not is_event:
                row |= {"wheel": number, "flags": " ".join(map(str, content.get("flags", [])))}
            for name, column in (events if is_event else estimates).items():
                column.append(row.get(name))
    finally:
        recording.close()
    return _named(estimates), events


def write_results(path: Path, out: Path, ending: str, wheel: int | None = None) -> list[Path]:
    """Write estimates and events beside an export; return the files, without those of no row.

    ``live.csv`` gets ``live.estimates.csv`` and ``live.events.csv``; a campaign's folder
    ``estimates.csv`` and ``events.csv``.

    Raises
    ------
    RecordingError
        If they cannot be written.
    """
    import pandas as pd

    written = []
    for name, rows in zip(("estimates", "events"), results(path, wheel), strict=True):
        file = out / f"{name}{ending}" if out.is_dir() else out.with_suffix(f".{name}{ending}")
        if not rows["utc_s"]:
            continue
        table = pd.DataFrame(rows)
        table.attrs["tirelib"] = __version__  # a Parquet file keeps it
        with whole(file) as new:
            if ending == ".parquet":
                table.to_parquet(new, index=False)
            else:
                table.to_csv(new, index=False)
        written.append(file)
    return written


def write_mdf(path: Path, found: Sequence[Segment], known: Any, out: Path) -> int:
    """Write samples, conditions, estimates and events as one MDF 4.10 file; return the samples.

    Channel groups: one for the strain of each wheel and one for its conditions, on the wheel's
    clock; where that clock starts again, two more, whose names say so. Between two segments stands
    a row of NaN, and a channel has the number of each sample's segment. Then one group for the
    estimates of each wheel and one for the events, since the recording began.
    """
    from asammdf import MDF

    with closing(Recording(path)) as recording:
        begun = datetime.fromtimestamp(1e-9 * recording.header.wall_ns, UTC)
    with MDF(version="4.10") as mdf:
        mdf.start_time = begun
        mdf.header.description = f"written by {WRITER}"
        for prefix, title, mine in _clocks(found):
            _append_samples(mdf, prefix, title, mine)
            _append_conditions(mdf, prefix, f"{title}: conditions", mine, known)
        count = sum(len(segment.strain) for segment in found)
        estimates, events = results(path)
        for wheel in sorted(set(estimates["wheel"])):
            chosen = [row for row, number in enumerate(estimates["wheel"]) if number == wheel]
            rows = {name: [column[row] for row in chosen] for name, column in estimates.items()}
            _append(mdf, rows, f"wheel_{wheel}_", f"wheel {wheel}: estimates")
        if events["t_s"]:
            _append(mdf, events, "", "events")
        mdf.save(out)
    return count


def _clocks(found: Sequence[Segment]) -> Iterator[tuple[str, str, list[Segment]]]:
    """Yield prefix, title and segments of each stretch of a wheel on one clock that goes on."""
    for wheel in dict.fromkeys(segment.wheel for segment in found):
        stretches: list[list[Segment]] = []
        for segment in (one for one in found if one.wheel == wheel):
            if not stretches or segment.t_us < stretches[-1][-1].end_us:
                stretches.append([])
            stretches[-1].append(segment)
        for number, stretch in enumerate(stretches):
            restart = f"restart_{number}_" if number else ""
            title = f"wheel {wheel}" + (f", clock restarted {number} times" if number else "")
            yield f"wheel_{wheel}_{restart}", title, stretch


def _append_samples(mdf: Any, prefix: str, title: str, found: Sequence[Segment]) -> None:
    """Append all strain of a wheel as one channel group."""
    from asammdf import Signal

    times: list[FloatArray] = []
    strain: list[FloatArray] = []
    numbers: list[IntArray] = []
    for segment in found:
        rows = 1e6 * segment.strain
        moments = 1e-6 * segment.t_us + segment.period * np.arange(len(rows), dtype=np.float64)
        if times and moments[0] > times[-1][-1] + 1.5 * segment.period:  # the gap itself
            times.append(np.array([times[-1][-1] + segment.period]))
            strain.append(np.full((1, rows.shape[1]), np.nan))
            numbers.append(numbers[-1][-1:])
        times.append(moments)
        strain.append(rows)
        numbers.append(np.full(len(rows), segment.number))
    clock, values = np.concatenate(times), np.concatenate(strain)
    signals = [
        Signal(values[:, gage], clock, "ustrain", f"{prefix}strain_{gage + 1}")
        for gage in range(values.shape[1])
    ]
    mdf.append(
        [*signals, Signal(np.concatenate(numbers), clock, "", f"{prefix}strain_segment")],
        comment=title,
    )


def _append_conditions(
    mdf: Any, prefix: str, title: str, found: Sequence[Segment], known: Any
) -> None:
    """Append the conditions of a wheel as one channel group."""
    from asammdf import Signal

    from tirebench.wire.conditions import QUANTITIES as CONDITIONS

    courses = [segment.known(known) for segment in found]
    clock = 1e-6 * np.concatenate([course.t_us for course in courses])
    values = np.concatenate([np.array(course.values) for course in courses])
    mdf.append(
        [
            Signal(
                np.asarray(from_si(values[:, column], unit, dimension)),
                clock,
                unit,
                f"{prefix}{name}",
            )
            for column, (name, (unit, dimension)) in enumerate(CONDITIONS.items())
        ],
        comment=title,
    )


def _append(mdf: Any, rows: Rows, prefix: str, title: str) -> None:
    """Append columns as a channel group; a number that is not known is NaN."""
    from asammdf import Signal

    order = np.argsort(rows["t_s"], kind="stable")
    times = np.array(rows["t_s"], dtype=float)[order]
    signals = []
    for name, column in rows.items():
        if name == "t_s":
            continue
        unit = next((u for u, end in _UNITS.items() if name.endswith(end)), "")
        if any(isinstance(value, str) for value in column):
            texts = [str(value or "").encode() for value in column]
            width = max(1, *map(len, texts))
            samples: Any = np.array(texts, dtype=f"S{width}")[order]
            signals.append(Signal(samples, times, "", prefix + name, encoding="utf-8"))
        else:
            values = [np.nan if value is None else float(value) for value in column]
            signals.append(Signal(np.array(values)[order], times, unit, prefix + name))
    mdf.append(signals, comment=title)


def _wheel_of(topic: str) -> int | None:
    """Return the wheel of a topic of estimates; None of another topic."""
    number = topic.removeprefix("/wheel/").removesuffix("/estimate")
    known = number.isascii() and number.isdecimal() and len(number) < 4
    return int(number) if known and topic == ESTIMATE.format(number) else None


def _content(data: bytes) -> Mapping[str, Any]:
    try:
        content = json.loads(data)
    except (ValueError, RecursionError):
        return {}
    return content if isinstance(content, dict) else {}


def _wrong(content: Mapping[str, Any], is_event: bool) -> str:
    """Return the first field that is not what the schemas say, and what it must be, or nothing."""
    for name in _TEXTS if is_event else ():
        if not _is_text(content.get(name, "")):
            return f"{name} = {str(content[name])[:40]!r}; a string is needed"
    for name in ("wheel",) if is_event else _ESTIMATED:
        value = content.get(name)
        if value is not None and not (isinstance(value, int | float) and abs(value) < _LARGEST):
            return f"{name} = {str(value)[:40]!r}; a number or null is needed"
    flags = () if is_event else content.get("flags", ())
    sound = isinstance(flags, list | tuple) and all(map(_is_text, flags))
    return "" if sound else f"flags = {str(flags)[:40]!r}; a list of strings is needed"


def _is_text(value: Any) -> bool:
    return isinstance(value, str) and not any("\ud800" <= sign <= "\udfff" for sign in value)


def _named(estimates: Rows) -> Rows:
    """Return the columns with their units in the names."""
    units = {name: _UNITS.get(unit, "") for name, (unit, _) in QUANTITIES.items()}
    renamed = {}
    for name, column in estimates.items():
        quantity = name.removesuffix("_std")
        renamed[f"{name}{units.get(quantity, '')}"] = column
    return renamed
