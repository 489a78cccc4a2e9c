"""A folder of measurements as a Campaign."""

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from tirelib.campaign import header as header_file
from tirelib.campaign import plan as plan_file
from tirelib.campaign.campaign_fault import raise_errors
from tirelib.campaign.model import CampaignHeader, Run, RunPlan
from tirelib.campaign.runfile import load_run
from tirelib.core.errors import FormatError

MEASURED = (".csv", ".tsv", ".txt", ".dat", ".mat", ".parquet", ".tdx", ".tyd", ".tydex")
"""Suffixes of measured files that an import reads."""


@dataclass(frozen=True, slots=True)
class Campaign:
    """A campaign: its header, its plan, and the place of each run.

    Attributes
    ----------
    path : Path
        The folder.
    header : CampaignHeader
    plans : tuple of RunPlan
        In order of measurement.
    """

    path: Path
    header: CampaignHeader
    plans: tuple[RunPlan, ...]

    def load(self, plan: RunPlan) -> Run:
        """Read one run, in SI and ISO.

        Raises
        ------
        FormatError
            With every fault of the run file.
        """
        return load_run(self.path, plan, self.header)

    def runs(self) -> Iterator[Run]:
        """Yield every run in order of measurement, one in memory at a time.

        Raises
        ------
        FormatError
            At the first run file with a fault, with all faults of that file.
        """
        return (self.load(plan) for plan in self.plans)

    def content_hash(self) -> str:
        """Return the SHA-256, in hex, of campaign.toml, runs.csv and the run files.

        It depends on names and bytes only, not on where the folder lies.

        Raises
        ------
        FormatError
            If a file cannot be read.
        """
        digest = hashlib.sha256()
        for name in (header_file.FILE, plan_file.FILE, *(plan.file for plan in self.plans)):
            try:
                content = (self.path / name).read_bytes()
            except OSError as error:
                raise FormatError(
                    f"{self.path / name}: it cannot be read ({error.strerror}); the hash covers "
                    "every file of the campaign; restore it or take its row out of runs.csv"
                ) from None
            digest.update(f"{name}\0{len(content)}\0".encode())
            digest.update(content)
        return digest.hexdigest()


def read_campaign(path: str | Path) -> Campaign:
    """Read ``campaign.toml`` and ``runs.csv`` of a folder; the runs are read on demand.

    Raises
    ------
    FormatError
        With every fault of both files.
    """
    folder = Path(path)
    if not folder.is_dir():
        raise FormatError(
            f"{folder}: no such folder; a campaign is a folder with campaign.toml and runs.csv; "
            "check the path"
        )
    raw = [file.name for file in sorted(folder.iterdir()) if file.suffix.lower() in MEASURED]
    parts = (folder / header_file.FILE, folder / plan_file.FILE)
    if raw and not any(part.exists() for part in parts):
        raise FormatError(
            f"{folder}: holds measured files ({raw[0]}, ...) and no campaign.toml; a campaign is "
            "needed; make one with `tirelib import`: its --suggest drafts the map"
        )
    header, problems = header_file.parse_header(folder)
    plans, faults = plan_file.parse_plans(folder, header.axes if header else "iso")
    problems += faults
    raise_errors(problems, prefix=f"{folder}/")
    if header is None:  # parse_header gives an error whenever it gives no header
        raise FormatError(f"{folder}: no header; campaign.toml is needed; write it")
    return Campaign(folder, header, plans)
