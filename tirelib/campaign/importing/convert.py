"""The table of a file and a map to runs in SI and ISO; every fault is kept.

Times, numbers and lengths are looked at here; what a tire test can show, the checks of a campaign
look at afterwards.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from tirelib.campaign.campaign_fault import CampaignFault
from tirelib.campaign.finding import RunFinding
from tirelib.campaign.importing.columns import Column, Table
from tirelib.campaign.importing.defects import Clock
from tirelib.campaign.importing.mapheader import GAGE_TIME, is_gage, strain_number
from tirelib.campaign.importing.mapped import MappedTable
from tirelib.campaign.importing.rules import ImportMap
from tirelib.campaign.importing.signs import sign_findings
from tirelib.campaign.model import BoolArray, FloatArray
from tirelib.campaign.plan import SET_POINTS
from tirelib.campaign.timebase import gage_time_problems
from tirelib.core.units import from_si, to_si

_SAME = 1e-9  # a set point's column varies by less within a run, relative


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """One run, SI and ISO, before it is written into a campaign.

    Attributes
    ----------
    number : int
    source : str
        File, and run where the file holds several.
    rows : int
        Number of rows of the rig quantities, of the gages where there are none.
    rig : mapping of quantity to array, shape (n_rig,)
    rig_time : array, shape (n_rig,), or None, [s]
    strain : array, shape (n_gages, n_samples), or None
    gage_time : array, shape (n_samples,), or None, [s]
    trigger : bool array, shape (n_samples,), or None
    points : mapping of column of ``runs.csv`` to float
        Set points that the file's columns give, in the units of ``runs.csv`` and the map's axes.
    """

    number: int
    source: str
    rows: int
    rig: dict[str, FloatArray] = field(default_factory=dict)
    rig_time: FloatArray | None = None
    strain: FloatArray | None = None
    gage_time: FloatArray | None = None
    trigger: BoolArray | None = None
    points: dict[str, float] = field(default_factory=dict)


def clocks_of(rules: ImportMap, table: Table) -> list[Clock]:
    """Return the mapped time columns, each with the mapped columns that it times."""
    channels = rules.channels
    time = channels["time"].column if "time" in channels else ""
    fast = channels[GAGE_TIME].column if GAGE_TIME in channels else time
    timed: dict[str, list[str]] = {}
    for quantity, rule in channels.items():
        if quantity in ("time", GAGE_TIME) or rule.column not in table.columns:
            continue
        clock = (fast if is_gage(quantity) else time) or table.columns[rule.column].clock
        timed.setdefault(clock, []).append(rule.column)
    return [Clock(name, tuple(columns)) for name, columns in timed.items() if name]


def convert(table: Table, rules: ImportMap, number: int) -> tuple[list[Piece], list[RunFinding]]:
    """Apply a map to the table of one file.

    Parameters
    ----------
    table : Table
    rules : ImportMap
    number : int
        Number of the run, when the file holds one.

    Returns
    -------
    pieces : list of Piece
        In the order of the rows; without those that the map skips. Empty when a column is missing
        or cannot be used.
    findings : list of RunFinding
        Every fault.
    """
    work = _Conversion(table, rules)
    columns = work.columns()
    rig = [q for q in columns if not is_gage(q) and q not in ("time", GAGE_TIME)]
    gages = [q for q in columns if is_gage(q)]
    rig_time = work.times(columns, rig, "time") if rig else None
    gage_time = work.times(columns, gages, GAGE_TIME) if gages else None
    spans = work.spans(number, [t for t in (rig_time, gage_time) if t is not None])
    if work.found or not rules.sound:
        work.look(columns, _distinct(rig_time, gage_time))
        return [], work.found
    clocks = {**dict.fromkeys(rig, rig_time), **dict.fromkeys(gages, gage_time)}
    values = {q: work.si(q, columns[q], clock) for q, clock in clocks.items() if clock is not None}
    work.check_finite(columns, values, spans)
    pieces = [work.piece(run, span, values, rig_time, gage_time) for run, span in spans]
    return pieces, work.found


class _Conversion(MappedTable):
    """One file on its way into runs."""

    def spans(self, number: int, clocks: Sequence[FloatArray]) -> list[tuple[int, slice]]:
        """Return number and rows of each run that the map does not skip."""
        skipped = {run for run, entry in self.rules.runs.items() if entry.skip}
        whole = [(number, slice(None))]
        if not self.rules.run_column:
            return [item for item in whole if item[0] not in skipped]
        column = self.table.columns.get(self.rules.run_column)
        if column is None or self.found:
            return []
        where = f"column {column.name!r} (run_column)"
        lengths = sorted({clock.size for clock in clocks} | {column.values.size})
        if len(lengths) > 1 and not column.constant:
            self.fault(
                "length",
                where,
                f"rows of {' and '.join(map(str, lengths))} samples",
                "run_column divides rows of one length",
                "give a file for each run",
            )
            return []
        runs = column.rows(clocks[0].size)
        wrong = np.flatnonzero(~((runs >= 0) & (runs == np.floor(runs)) & np.isfinite(runs)))
        if wrong.size:
            self.fault(
                "run",
                where,
                f"{runs[wrong[0]]:g} in {self.table.places(wrong)}",
                "a whole number, 0 or more, is needed",
                "correct the column",
            )
            return []
        edges = np.flatnonzero(np.diff(runs)) + 1
        spans = [
            (int(runs[start]), slice(int(start), int(stop)))
            for start, stop in zip([0, *edges], [*edges, runs.size], strict=True)
        ]
        seen: set[int] = set()
        for run, span in spans:
            if run in seen:
                self.fault(
                    "run",
                    where,
                    f"run {run} comes again in {self.table.places(np.array([span.start]))}",
                    "the rows of a run must be consecutive",
                    "sort the rows, or renumber the runs",
                )
            seen.add(run)
        return [item for item in spans if item[0] not in skipped]

    def look(self, columns: dict[str, Column], clocks: Sequence[FloatArray]) -> None:
        """Note what else is wrong in a file that cannot be imported as it stands."""
        if any(entry.skip for entry in self.rules.runs.values()):
            return  # what is wrong may stand in a run that is skipped
        if not self.rules.run_column:
            for times in clocks:
                self.check_growth(self.table.file, slice(None), times)
        rows = np.empty(max((item.values.size for item in columns.values()), default=0))
        values = {
            quantity: self.si(quantity, column, rows)
            for quantity, column in columns.items()
            if quantity not in ("time", GAGE_TIME)
        }
        self.check_finite(columns, values, [(0, slice(None))])
        rig = {q: v for q, v in values.items() if not is_gage(q) and v.size == rows.size}
        if self.rules.sound:
            self.found += sign_findings(self.table.file, rig, self.rules)

    def piece(
        self,
        run: int,
        span: slice,
        values: dict[str, FloatArray],
        rig_time: FloatArray | None,
        gage_time: FloatArray | None,
    ) -> Piece:
        """Return one run, and note the faults of its clocks, signs and set points."""
        source = self.table.file + (f", run {run}" if self.rules.run_column else "")
        before = len(self.found)
        for times in _distinct(rig_time, gage_time):
            self.check_growth(source, span, times)
        strains = sorted((number, q) for q in values if (number := strain_number(q)) is not None)
        gages = None if gage_time is None else gage_time[span]
        if gages is not None and len(self.found) == before:
            for problem in gage_time_problems(source, gages, self.rate(gages)):
                named = replace(
                    problem, allowed=problem.allowed.replace("campaign.toml", self.rules.file)
                )
                self.found.append(RunFinding("gage time", source, "", named))
        trigger = values.get("trigger")
        piece = Piece(
            number=run,
            source=source,
            rows=0,
            rig={q: samples[span] for q, samples in values.items() if not is_gage(q)},
            rig_time=None if rig_time is None else rig_time[span],
            strain=np.stack([values[q][span] for _, q in strains]) if strains else None,
            gage_time=gages,
            trigger=None if trigger is None else trigger[span] > 0.5,
            points=dict(self.points(source, span)),
        )
        clock = piece.rig_time if piece.rig_time is not None else piece.gage_time
        self.found += sign_findings(source, piece.rig, self.rules)
        return replace(piece, rows=0 if clock is None else clock.size)

    def rate(self, times: FloatArray) -> float:
        """Return the declared rate of the gages, else that of the times, [Hz]."""
        if np.isfinite(self.rules.header.rate):
            return self.rules.header.rate
        return (times.size - 1) / float(times[-1] - times[0])

    def check_growth(self, source: str, span: slice, times: FloatArray) -> None:
        """Note times that are not a number, occur twice or decrease."""
        rows = np.arange(times.size, dtype=np.intp)[span]
        inside = times[span]
        steps = np.diff(inside)
        for wrong, given, choice in (
            (~np.isfinite(inside), "no finite time", 'missing = "drop"'),
            (
                np.append(False, steps == 0.0),
                "the time of the preceding row occurs again",
                'repeated_time = "drop"',
            ),
            (
                np.append(False, steps < 0.0),
                "the time decreases",
                'backward_time = "drop" or, for segments that follow each other, "join"',
            ),
        ):
            if wrong.any():
                count = int(np.count_nonzero(wrong))
                first = int(np.flatnonzero(wrong)[0])
                problem = CampaignFault(
                    f"{source}, time",
                    f"{given} in {self.table.places(rows[wrong])} (t = {inside[first]:.6g} s"
                    + (f", {count} in all)" if count > 1 else ")"),
                    "time must increase from row to row",
                    f"sort out the clock at its source, or say {choice} in the map",
                )
                self.found.append(RunFinding(given, source, "time", problem))

    def points(self, source: str, span: slice) -> Iterator[tuple[str, float]]:
        """Yield the set points that columns give; note one that changes within the run."""
        for target in SET_POINTS:
            rule = self.rules.set_points.get(target.name)
            column = self.table.columns.get(rule.column) if rule is not None else None
            if rule is None or column is None:
                continue
            inside = column.values if column.constant else column.values[span]
            low, high = (float(inside.min()), float(inside.max())) if inside.size else (np.nan,) * 2
            if not high - low <= _SAME * max(abs(low), abs(high)):
                problem = CampaignFault(
                    f"{source}, column {column.name!r} ({target.name})",
                    f"the set point goes from {low:g} to {high:g} within the run",
                    "one value a run is needed",
                    "map another column, divide the runs, or import a sweep",
                )
                self.found.append(RunFinding(f"point {target.name}", source, column.name, problem))
            else:
                si = to_si(low, rule.unit, target.dimension)
                yield target.name, from_si(si, target.unit, target.dimension)


def _distinct(*clocks: npt.NDArray[np.float64] | None) -> list[FloatArray]:
    """Return the clocks that are there, one that serves twice once."""
    present = [clock for clock in clocks if clock is not None]
    if len(present) == 2 and np.array_equal(present[0], present[1], equal_nan=True):
        return present[:1]
    return present
