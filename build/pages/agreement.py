"""Do the library, the FMU and the bench say the same? Estimates as JSON, turn against turn.

Turns are matched by their order within each run. Every number of a turn that an estimate consists
of is compared; what may be used (``valid``) must agree, too.
"""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tirelib.core.errors import CalibrationError
from tirelib.estimators.edge import EDGE_UNIT
from tirelib.report.accuracy import SAID
from tirelib.report.page import DASH, Table

Turn = Mapping[str, Any]
TOLERANCE = 1e-9
"""Largest difference of library and FMU, relative to the largest number of that quantity."""


@dataclass(frozen=True, slots=True)
class Compared:
    """One quantity in two documents: `largest` difference in `unit`, and `relative`.

    `turns` counts the turns with a number in both; `relative` is the largest difference over the
    largest magnitude of the quantity.
    """

    title: str
    unit: str
    turns: int
    largest: float
    relative: float


@dataclass(frozen=True, slots=True)
class Agreement:
    """Two documents of estimates against each other.

    Attributes
    ----------
    title : str
    tolerance : float
        Largest relative difference that counts as equal; 0 for equal to the last bit. NaN where
        equality is not asked for.
    rows : sequence of Compared
    apart : sequence of str
        What else differs: runs, numbers of turns, what may be used.
    """

    title: str
    tolerance: float
    rows: Sequence[Compared]
    apart: Sequence[str]

    @property
    def faults(self) -> list[str]:
        """Return a sentence on every difference that is not allowed."""
        if math.isnan(self.tolerance):
            return []
        limit = "exactly 0" if self.tolerance == 0.0 else f"below {self.tolerance:g}"
        found = [f"{self.title}: {text}" for text in self.apart]
        for row in self.rows:
            if row.turns == 0 and row.title == SAID["Fz"].title:
                found.append(f"{self.title}: not one turn with a {row.title} to compare")
            bad = row.relative > 0.0 if self.tolerance == 0.0 else row.relative >= self.tolerance
            if bad:
                found.append(
                    f"{self.title}: {row.title} differs by up to {row.largest:.3g} {row.unit} "
                    f"(relative {row.relative:.3g}); {limit} is allowed"
                )
        return found


def read_turns(file: str | Path) -> list[Turn]:
    """Return the turns of a document of estimates.

    Raises
    ------
    CalibrationError
        If the file is not such a document.
    """
    try:
        turns = json.loads(Path(file).read_text(encoding="utf-8"))["turns"]
        return [dict(turn) for turn in turns]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise CalibrationError(
            f"{file}: {type(error).__name__} {error}; JSON of `tirelib estimate`, `tirelib fmu "
            "run` or `tirebench run` is needed; write it anew"
        ) from None


def agreement(
    title: str,
    first: Sequence[Turn],
    second: Sequence[Turn],
    tolerance: float,
    *,
    same_runs: bool = True,
) -> Agreement:
    """Compare two documents; with ``same_runs=False`` only the runs of the first."""
    one, other = by_run(first), by_run(second)
    apart = []
    if same_runs and list(one) != list(other):
        apart.append(f"runs {_few(one)} and {_few(other)}")
    pairs: list[tuple[Turn, Turn]] = []
    for run, turns in one.items():
        others = other.get(run, [])
        if len(turns) != len(others):
            apart.append(f"run {run} has {len(turns)} and {len(others)} turns")
        pairs += zip(turns, others, strict=False)
    for key in ("valid", *(f"{name}_valid" for name in EDGE_UNIT)):
        count = sum(a.get(key) != b.get(key) for a, b in pairs)
        if count:
            apart.append(f"'{key}' differs in {count} turns")
    rows = []
    for text, unit, keys in _quantities(first):
        rows.append(_compare(text, unit, keys, pairs))
        lonely = sum(
            (_number(a, key) is None) != (_number(b, key) is None) for a, b in pairs for key in keys
        )
        if lonely:
            apart.append(f"{text} is there in one and missing in the other {lonely} times")
    return Agreement(title, tolerance, rows, apart)


def agreement_table(agreements: Sequence[Agreement], note: str) -> Table:
    """Return a row for each quantity; for each comparison turns and largest difference.

    The relative difference stands beside it unless none at all is allowed.
    """
    faults = [fault for one in agreements for fault in one.faults]
    columns = ["quantity", "unit"]
    for one in agreements:
        columns += ["turns", one.title, *([] if one.tolerance == 0.0 else ["relative"])]
    rows = []
    for parts in zip(*(one.rows for one in agreements), strict=True):
        cells = [parts[0].title, parts[0].unit]
        for one, part in zip(agreements, parts, strict=True):
            cells += [str(part.turns), difference(part.largest)]
            if one.tolerance != 0.0:
                cells.append(difference(part.relative))
        rows.append(cells)
    title = "Library = FMU = bench"
    if faults:
        title = "NOT EQUAL: library, FMU and bench differ"
        note = "NOT EQUAL. " + ". ".join(faults) + ". " + note
    return Table(title, columns, rows, texts=2, note=note)


def difference(value: float) -> str:
    """Return a difference with two digits; 0 only if the values are equal."""
    if not math.isfinite(value):
        return DASH
    return "0" if value == 0.0 else f"{value:.1e}"


def by_run(turns: Sequence[Turn]) -> dict[int, list[Turn]]:
    """Return the turns of each run, in order."""
    runs: dict[int, list[Turn]] = {}
    for turn in turns:
        runs.setdefault(int(turn["run"]), []).append(turn)
    return runs


def _quantities(turns: Sequence[Turn]) -> list[tuple[str, str, list[str]]]:
    """Return title, unit and keys of all that is compared."""
    found = []
    for name, (unit, _) in EDGE_UNIT.items():
        found.append((SAID[name].title, unit, [name]))
        found.append((f"standard deviation of {SAID[name].title}", unit, [f"{name}_std"]))
    lengths = [key for key in (turns[0] if turns else ()) if key.startswith("contact_length_")]
    return [
        *found,
        ("contact lengths", "mm", lengths),
        ("turn rate", "rad/s", ["omega_rad_s"]),
    ]


def _compare(
    title: str, unit: str, keys: Sequence[str], pairs: Sequence[tuple[Turn, Turn]]
) -> Compared:
    turns, largest, size = 0, 0.0, 0.0
    for first, second in pairs:
        known = [
            (a, b)
            for key in keys
            if (a := _number(first, key)) is not None and (b := _number(second, key)) is not None
        ]
        turns += bool(known)
        for a, b in known:
            largest, size = max(largest, abs(a - b)), max(size, abs(a), abs(b))
    if not turns:
        return Compared(title, unit, 0, math.nan, math.nan)
    return Compared(title, unit, turns, largest, largest / size if size else 0.0)


def _number(turn: Turn, key: str) -> float | None:
    value = turn.get(key)
    return None if value is None else float(value)


def _few(runs: Mapping[int, object]) -> str:
    numbers = [str(run) for run in runs]
    return ", ".join(numbers[:8]) + (", ..." if len(numbers) > 8 else "")
