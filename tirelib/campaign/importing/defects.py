"""Defects of recordings that a map decides upon: their treatment, and the notes on it.

Without a choice in the map each of them is refused. A choice acts on the rows of a table before
units and axes are looked at; what it did is noted, with the rows, in the report and the campaign.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tirelib.campaign.importing.columns import BoolArray, FloatArray, IntArray, Table

CHOICES = {
    "repeated_time": ("drop",),
    "backward_time": ("drop", "join"),
    "missing": ("drop", "interpolate"),
    "text": ("missing",),
}
"""Keys of a map, and their allowed values."""


@dataclass(frozen=True, slots=True)
class Defects:
    """Treatments that a map requests; empty where the defect is refused.

    Attributes
    ----------
    repeated_time : str
        ``drop``: of the rows with one time the first is kept.
    backward_time : str
        ``drop``: rows whose time is before one that was reached are left out; ``join``: what
        follows a fall of the time is another segment, shifted to begin one step after the last.
    missing : str
        Rows in which a mapped number is NaN or infinite: ``drop`` them, or ``interpolate`` each
        column in time between its neighbours.
    text : str
        ``missing``: text in a column of numbers is a missing number.
    """

    repeated_time: str = ""
    backward_time: str = ""
    missing: str = ""
    text: str = ""


@dataclass(frozen=True, slots=True)
class Clock:
    """A mapped time column, and the other mapped columns that it times."""

    name: str
    mapped: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class _Change:
    """What a choice of the map did to some rows, and to which."""

    key: str
    choice: str
    rows: IntArray
    what: str


def mended(
    table: Table, defects: Defects, clocks: Sequence[Clock], run_column: str
) -> tuple[Table, list[str]]:
    """Return a table after the choices of a map, and a note for everything that was changed.

    Parameters
    ----------
    table : Table
    defects : Defects
    clocks : sequence of Clock
    run_column : str
        Column that divides the rows into runs, within which time is checked; may be empty.
    """
    notes: list[str] = []
    for clock in clocks:
        if clock.name in table.columns:
            table, said = _on_clock(table, defects, clock, run_column)
            notes += said
    return table, notes


def _on_clock(
    table: Table, defects: Defects, clock: Clock, run_column: str
) -> tuple[Table, list[str]]:
    own = table.columns[clock.name]
    size = own.values.size
    group = {
        name: column.values.copy()
        for name, column in table.columns.items()
        if not column.constant and column.values.size == size and column.clock in ("", clock.name)
    }
    if clock.name not in group or size < 2:
        return table, []
    runs = group.get(run_column, np.zeros(size))
    keep = np.ones(size, dtype=np.bool_)
    mapped = [n for n in (clock.name, *clock.mapped) if n in group]
    changes = [
        *_missing(group, keep, mapped, clock.name, defects.missing),
        *_backward(group[clock.name], keep, runs, defects.backward_time),
        *_repeated(group[clock.name], keep, runs, defects.repeated_time),
    ]
    changed = {
        name: replace(table.columns[name], values=values[keep]) for name, values in group.items()
    }
    return table.kept(keep, {**table.columns, **changed}), [
        f'{each.key} = "{each.choice}": {each.rows.size} {each.what} ({table.places(each.rows)})'
        for each in changes
    ]


def _missing(
    group: dict[str, FloatArray], keep: BoolArray, names: Sequence[str], clock: str, choice: str
) -> list[_Change]:
    """Drop or fill the rows without numbers; a row without a time can only be dropped."""
    lost = {name: ~np.isfinite(group[name]) for name in names}
    rows = np.any(list(lost.values()), axis=0)
    if not choice or not rows.any():
        return []
    if choice == "drop":
        keep &= ~rows
        return [_change("missing", choice, rows, "rows without a number were left out")]
    timed = ~lost[clock]
    keep &= timed
    notes = []
    for name in names:
        holes = lost[name] & timed
        sound = ~lost[name] & timed
        if name == clock or not holes.any() or not sound.any():
            continue
        group[name][holes] = np.interp(group[clock][holes], group[clock][sound], group[name][sound])
        longest = int(np.diff(np.flatnonzero(np.diff(np.r_[0, holes, 0]))).max(initial=0))
        notes.append(
            _change(
                "missing",
                choice,
                holes,
                f"numbers of column {name!r} were interpolated in time, up to {longest} in a row",
            )
        )
    if lost[clock].any():
        notes.append(_change("missing", choice, lost[clock], "rows without a time were left out"))
    return notes


def _backward(times: FloatArray, keep: BoolArray, runs: FloatArray, choice: str) -> list[_Change]:
    """Leave out rows whose time falls back, or shift what follows; changes times in place."""
    if not choice:
        return []
    rows = np.flatnonzero(keep & np.isfinite(times))
    same = np.diff(runs[rows]) == 0
    steps = np.diff(times[rows])
    falls = np.flatnonzero(same & (steps < 0.0)) + 1
    if not falls.size:
        return []
    if choice == "join":
        step = float(np.median(steps[same & (steps > 0.0)]))
        shift = np.zeros(rows.size)
        shift[falls] = step - steps[falls - 1]
        total = np.cumsum(shift)
        starts = np.flatnonzero(np.diff(runs[rows], prepend=np.nan) != 0)
        total -= np.repeat(total[starts] - shift[starts], np.diff(np.r_[starts, rows.size]))
        times[rows] += total
        at = np.zeros(times.size, dtype=np.bool_)
        at[rows[falls]] = True
        return [
            _change(
                "backward_time",
                choice,
                at,
                f"segments were joined to those before, {step:.6g} apart in the time's unit",
            )
        ]
    wrong = np.zeros(times.size, dtype=np.bool_)
    for run in np.unique(runs[rows]):
        inside = rows[runs[rows] == run]
        before, now = times[inside][:-1], times[inside][1:]
        reached = np.maximum.accumulate(before)
        wrong[inside[1:]] = (now < reached) | ((now == reached) & (before < reached))
    keep &= ~wrong
    return [_change("backward_time", choice, wrong, "rows whose time fell back were left out")]


def _repeated(times: FloatArray, keep: BoolArray, runs: FloatArray, choice: str) -> list[_Change]:
    """Leave out all but the first row of a time."""
    rows = np.flatnonzero(keep & np.isfinite(times))
    again = np.zeros(times.size, dtype=np.bool_)
    again[rows[1:]] = (np.diff(times[rows]) == 0.0) & (np.diff(runs[rows]) == 0)
    if not choice or not again.any():
        return []
    keep &= ~again
    return [
        _change(
            "repeated_time", choice, again, "rows with the time of the row before were left out"
        )
    ]


def _change(key: str, choice: str, rows: BoolArray, what: str) -> _Change:
    return _Change(key, choice, np.flatnonzero(rows), what)
