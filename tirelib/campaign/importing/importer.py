"""Files and a map to a campaign folder. All faults of the map and the files come at once.

The campaign is written beside its place, checked as `tirelib campaign check` does, and moved there
only when it is sound: an import that fails leaves nothing behind.
"""

import math
import shutil
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import mkdtemp

import numpy as np

from tirelib.campaign import header as header_file
from tirelib.campaign import plan as plan_file
from tirelib.campaign.campaign_fault import CampaignFault, errors_of
from tirelib.campaign.check import check_campaign
from tirelib.campaign.finding import RunFinding, gathered
from tirelib.campaign.importing.convert import Piece, clocks_of, convert
from tirelib.campaign.importing.defects import mended
from tirelib.campaign.importing.formats import read_table
from tirelib.campaign.importing.mapfile import parse_map
from tirelib.campaign.importing.plans import (
    ImportedRun,
    imported_run,
    plan_problems,
    with_starts,
)
from tirelib.campaign.importing.rules import ImportMap
from tirelib.campaign.importing.unmapped import Unmapped
from tirelib.campaign.model import CampaignHeader, Run, RunPlan
from tirelib.campaign.timebase import gage_time_problems
from tirelib.campaign.write import write_campaign
from tirelib.core.errors import FormatError, ParameterError

Progress = Callable[[str], None]

_UNEVEN = 0.01  # samples that lie this share of a step off the uniform clock are reported


@dataclass(frozen=True, slots=True)
class ImportReport:
    """Result of an import.

    Attributes
    ----------
    campaign : Path
    header : CampaignHeader
    runs : tuple of ImportedRun
    notes : tuple of str
        What was found out and is worth knowing.
    warnings : tuple of CampaignFault
        Warnings of the map, and of the check of the campaign.
    """

    campaign: Path
    header: CampaignHeader
    runs: tuple[ImportedRun, ...]
    notes: tuple[str, ...]
    warnings: tuple[CampaignFault, ...]


def import_campaign(
    files: Sequence[str | Path],
    map_file: str | Path,
    out: str | Path,
    *,
    overwrite: bool = False,
    progress: Progress | None = None,
) -> ImportReport:
    """Make a campaign folder from measured files.

    Parameters
    ----------
    files : sequence of str or Path
        In order of measurement; one run each, unless the map names a run column.
    map_file : str or Path
        See docs/howto/importing.md.
    out : str or Path
        The campaign folder.
    overwrite : bool
        Replace a campaign that is already there.
    progress : callable, optional
        Called with the name of each file that is read.

    Raises
    ------
    FormatError
        With every fault of the map and the files, or of the campaign that they would make.
    ParameterError
        If no file is given, or a campaign is already there.
    OSError
        If the folder cannot be written.
    """
    folder = Path(out)
    old = _old_files(folder)
    if old and not overwrite:
        raise ParameterError(
            f"{folder}: a campaign is already there ({old[0].name}); a new or empty folder is "
            "needed; name another one, or ask for overwrite (--force)"
        )
    work = _Import([Path(file) for file in files], map_file, progress)
    header, imported = work.survey()
    folder.parent.mkdir(parents=True, exist_ok=True)
    staging = Path(mkdtemp(prefix=".import-", dir=folder.parent))
    try:
        write_campaign(staging / "campaign", header, work.runs(header, imported))
        warnings = _checked(staging / "campaign", folder, work.rules, imported)
        _move(staging / "campaign", folder, old)
    finally:
        shutil.rmtree(staging, ignore_errors=True)
    notes = tuple(dict.fromkeys(work.notes))
    said = (*work.rules.warnings, *work.unmapped.warnings(), *warnings)
    return ImportReport(folder, header, tuple(imported), notes, said)


class _Import:
    """The files and the map of one import; keeps the pieces of the file read last."""

    def __init__(
        self, files: Sequence[Path], map_file: str | Path, progress: Progress | None
    ) -> None:
        if not files:
            raise ParameterError("no file is given; at least one is needed; name the files")
        self.files = files
        self.progress = progress
        self.notes: list[str] = []
        self.changes: list[str] = []  # of the data, by choice of the map
        self.rules, self.problems = parse_map(map_file, files[0].stem)
        self.unmapped = Unmapped(self.rules)
        self._last: tuple[int, list[Piece]] | None = None

    def survey(self) -> tuple[CampaignHeader, list[ImportedRun]]:
        """Read every file once; return the header with its rate, and the plan of every run."""
        faults = [str(problem) for problem in errors_of(self.problems)]
        found: list[RunFinding] = []
        imported: list[ImportedRun] = []
        clocks: list[tuple[str, int, float]] = []
        missing = False  # runs are missing, so that problems of the plan may be wrong
        for place, file in enumerate(self.files):
            if file in self.files[:place]:
                faults.append(f"{file}: it is named twice; each file is read once; drop one")
                continue
            try:
                pieces, findings = self.read(place)
            except FormatError as error:
                faults += error.problems
                missing = True
                continue
            found += findings
            missing |= bool(findings) and not pieces
            for piece in pieces:
                clocks += [_clock(piece)] if _has_strain(piece) and not findings else []
                imported.append(imported_run(piece, self.rules))
            if self.progress is not None:
                self.progress(file.name)
        header = self.header(clocks)
        problems = gathered(found, max(len(imported), len(self.files)))
        if self.rules.sound and not missing:
            problems += plan_problems(imported, self.rules)
        faults += [str(problem) for problem in problems]
        if not faults and not imported:
            faults = [
                f"{self.rules.file}: every run is skipped; at least one is needed; take a "
                "skip out of [runs]"
            ]
        if faults:
            raise FormatError(faults)
        return header, with_starts(imported) if self.rules.run_column else imported

    def read(self, place: int) -> tuple[list[Piece], list[RunFinding]]:
        """Return the runs of a file and its faults."""
        if self._last is not None and self._last[0] == place:
            return self._last[1], []
        self._last = None  # one file in memory at a time
        table = read_table(self.files[place], self.rules.csv)
        self.unmapped.look(table)
        changes = [note for note in table.notes if note.startswith("text = ")]
        self.notes += [f"{table.file}: {note}" for note in table.notes]
        table, done = mended(
            table, self.rules.defects, clocks_of(self.rules, table), self.rules.run_column
        )
        self.notes += [f"{table.file}: {note}" for note in done]
        self.changes += [f"{Path(table.file).name}: {note}" for note in (*changes, *done)]
        pieces, findings = convert(table, self.rules, place)
        self._last = (place, pieces)
        return pieces, findings

    def header(self, clocks: Sequence[tuple[str, int, float]]) -> CampaignHeader:
        """Return the header; its rate is that of all time columns together, if not declared."""
        made = dict.fromkeys(note for note in (self.rules.header.rig_note, *self.changes) if note)
        header = replace(self.rules.header, rig_note="; ".join(made))
        if not header.gage_lateral or math.isfinite(header.rate) or not clocks:
            return header
        rate = sum(steps for _, steps, _ in clocks) / sum(duration for _, _, duration in clocks)
        rate = float(f"{rate:.10g}")  # ten digits: the resolution of a clock in seconds
        self.notes.append(f"rate of the gages from the time columns: {rate:.10g} Hz")
        return replace(header, rate=rate)

    def runs(self, header: CampaignHeader, imported: Sequence[ImportedRun]) -> Iterator[Run]:
        """Yield every run, one file in memory at a time."""
        plans = {item.plan.run: item.plan for item in imported}
        for place in range(len(self.files)):
            for piece in self.read(place)[0]:
                yield self.run(piece, plans[piece.number], header)

    def run(self, piece: Piece, plan: RunPlan, header: CampaignHeader) -> Run:
        if piece.strain is None or piece.gage_time is None:
            return Run(plan, rig=piece.rig, rig_time=piece.rig_time if piece.rig else None)
        problems = gage_time_problems(piece.source, piece.gage_time, header.rate)
        if problems:
            raise FormatError([str(problem) for problem in problems])
        start = float(piece.gage_time[0])
        even = start + np.arange(piece.gage_time.size) / header.rate
        off = float(np.max(np.abs(piece.gage_time - even)))
        if off * header.rate > _UNEVEN:
            self.notes.append(
                f"{piece.source}: the times of the gages lie up to {1e3 * off:.3g} ms off an even "
                f"clock of {header.rate:g} Hz; the campaign has the even clock"
            )
        return Run(
            plan,
            piece.strain,
            header.rate,
            start,
            piece.trigger,
            piece.rig,
            piece.rig_time if piece.rig else None,
        )


def _has_strain(piece: Piece) -> bool:
    return piece.strain is not None and piece.gage_time is not None and piece.gage_time.size > 1


def _clock(piece: Piece) -> tuple[str, int, float]:
    """Return source, number of steps and duration of a piece's gages."""
    times = piece.gage_time if piece.gage_time is not None else np.zeros(1)
    return piece.source, times.size - 1, float(times[-1] - times[0])


def _old_files(folder: Path) -> list[Path]:
    files = [folder / header_file.FILE, folder / plan_file.FILE, *folder.glob("runs/*.mf4")]
    return [file for file in files if file.exists()]


def _checked(
    written: Path, folder: Path, rules: ImportMap, imported: Sequence[ImportedRun]
) -> list[CampaignFault]:
    """Return the warnings of the check; raise its errors in terms of the files and the map."""
    sources = {item.plan.file: item.source for item in imported}
    problems = [_translated(p, sources, rules.file) for p in check_campaign(written)]
    errors = errors_of(problems)
    if errors:
        raise FormatError(
            [
                f"{folder}: not written, for `tirelib campaign check` would find {len(errors)} "
                "error(s); a sound campaign is needed; correct what follows, or leave a run out "
                "with skip = true",
                *map(str, errors),
            ]
        )
    return problems


def _translated(problem: CampaignFault, sources: dict[str, str], map_file: str) -> CampaignFault:
    def translated(text: str) -> str:
        for file, source in sources.items():
            text = text.replace(file, source)
        return text.replace(header_file.FILE, map_file)

    return replace(
        problem,
        where=translated(problem.where),
        given=translated(problem.given),
        remedy=translated(problem.remedy),
        allowed=translated(problem.allowed),
    )


def _move(written: Path, folder: Path, old: Sequence[Path]) -> None:
    for file in old:
        file.unlink()
    (folder / "runs").mkdir(parents=True, exist_ok=True)
    for file in (written / "runs").iterdir():
        file.replace(folder / "runs" / file.name)
    for name in (plan_file.FILE, header_file.FILE):
        (written / name).replace(folder / name)
