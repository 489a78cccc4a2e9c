"""Checks of the folder: files that are not listed, copies, repeats."""

import csv
from collections.abc import Sequence
from pathlib import Path

from tirelib.campaign import plan as plan_file
from tirelib.campaign.campaign_fault import CampaignFault
from tirelib.campaign.model import RunPlan

_SUFFIXES = frozenset({".mf4", ".mdf", ".dat"})


def extra_files(folder: Path) -> list[CampaignFault]:
    """Return a warning for each recording in the folder that ``runs.csv`` does not list.

    None where ``runs.csv`` names no files at all: that is the fault to mend first.
    """
    listed = _listed(folder)
    if listed is None:
        return []
    return [
        CampaignFault(
            file,
            "the file is not listed in runs.csv",
            "every recording has its row",
            "add a row, or take the file away",
            "warning",
        )
        for file in sorted(
            path.relative_to(folder).as_posix()
            for path in folder.rglob("*")
            if path.suffix.lower() in _SUFFIXES
        )
        if file not in listed
    ]


def _listed(folder: Path) -> set[str] | None:
    """Return the files that the rows name, also in faulty rows; None without a column."""
    try:
        with (folder / plan_file.FILE).open(encoding="utf-8-sig", newline="") as stream:
            table = csv.DictReader(stream)
            rows = [{k.strip(): v for k, v in row.items() if k} for row in table]
    except (OSError, UnicodeDecodeError, csv.Error):
        return None
    if "file" not in {name.strip() for name in table.fieldnames or ()}:
        return None
    return {(row.get("file") or "").strip().removeprefix("./") for row in rows}


def repeat_problems(plans: Sequence[RunPlan]) -> list[CampaignFault]:
    """Return a warning when no set point was measured twice; sweeps repeat within themselves."""
    if not plans or any(plan.kind == "sweep" for plan in plans):
        return []
    points = [
        tuple(f"{getattr(plan, c.quantity):.6g}" for c in plan_file.SET_POINTS) for plan in plans
    ]
    if len(set(points)) < len(points):
        return []
    return [
        CampaignFault(
            plan_file.FILE,
            f"none of the {len(points)} set points was measured twice",
            "a few repeats are needed to measure the noise",
            "repeat some runs; without repeats the noise is unknown and diagnosis gives hints only",
            "warning",
        )
    ]


def copy_problems(digests: Sequence[tuple[str, str]]) -> list[CampaignFault]:
    """Return an error for each run whose samples are those of an earlier one.

    Parameters
    ----------
    digests : sequence of (file, digest of its samples)
    """
    first: dict[str, str] = {}
    problems: list[CampaignFault] = []
    for file, digest in digests:
        if digest in first:
            problems.append(
                CampaignFault(
                    file,
                    f"duplicate run: its samples are those of {first[digest]}",
                    "a repeat is a new measurement with its own noise",
                    "name the right file, or remove the copy",
                )
            )
        first.setdefault(digest, file)
    return problems
