"""Every fault of a campaign folder at once."""

import hashlib
from collections.abc import Callable
from pathlib import Path

import numpy as np

from tirelib.campaign import header as header_file
from tirelib.campaign import plan as plan_file
from tirelib.campaign.campaign_fault import CampaignFault, errors_of
from tirelib.campaign.check_folder import copy_problems, extra_files, repeat_problems
from tirelib.campaign.check_gages import gage_findings
from tirelib.campaign.check_order import (
    ForceSign,
    RunSummary,
    force_sign_findings,
    force_sign_of,
    moment_sign_of,
    order_findings,
    summary_of,
)
from tirelib.campaign.check_rig import rig_findings
from tirelib.campaign.check_turns import turn_findings
from tirelib.campaign.finding import RunFinding, gathered
from tirelib.campaign.mdf import read_mdf
from tirelib.campaign.model import CampaignHeader, Run, RunPlan
from tirelib.campaign.runfile import inspect_run
from tirelib.core.errors import FormatError

Progress = Callable[[int, int], None]


def check_campaign(path: str | Path, *, progress: Progress | None = None) -> list[CampaignFault]:
    """Return every fault of a campaign folder, in reading order.

    Parameters
    ----------
    path : str or Path
    progress : callable, optional
        Called with the number of runs done and of all runs.

    Returns
    -------
    problems : list of CampaignFault
        Empty for a sound campaign. A fault that most runs share is one problem.

    Raises
    ------
    FormatError
        If `path` is not a folder that can be read.

    Notes
    -----
    Two gages that are swapped in every run and lie at opposite ends of a row of three or fewer
    look like a tire seen from the other side; that is not found.
    """
    folder = Path(path)
    try:
        next(folder.iterdir(), None)
    except OSError as error:
        raise FormatError(
            f"{folder}: not a readable folder ({error.strerror}); a campaign is a folder with "
            "campaign.toml and runs.csv; check the path"
        ) from None
    header, problems = header_file.parse_header(folder)
    plans, faults = plan_file.parse_plans(folder, header.axes if header else "iso")
    problems += faults
    if header is None:
        problems += _legible(folder, plans, progress)
    else:
        problems += _run_problems(folder, header, plans, progress)
    return [*problems, *repeat_problems(plans), *extra_files(folder)]


def _legible(
    folder: Path, plans: tuple[RunPlan, ...], progress: Progress | None
) -> list[CampaignFault]:
    """Check only that the run files can be read: without a header their meaning is unknown."""
    problems: list[CampaignFault] = []
    for done, plan in enumerate(plans, start=1):
        try:
            read_mdf(folder / plan.file)
        except FormatError as error:
            problems += [CampaignFault.at(plan.file, fault) for fault in error.faults]
        if progress is not None:
            progress(done, len(plans))
    if plans:
        problems.append(
            CampaignFault(
                header_file.FILE,
                "as it stands, the contents of the runs could not be checked",
                "a header without errors is needed for that",
                "correct it and check again",
                "warning",
            )
        )
    return problems


def _run_problems(
    folder: Path, header: CampaignHeader, plans: tuple[RunPlan, ...], progress: Progress | None
) -> list[CampaignFault]:
    findings: list[RunFinding] = []
    summaries: list[RunSummary] = []
    signs: list[ForceSign] = []
    moments: list[ForceSign] = []
    digests: list[tuple[str, str]] = []
    strained: list[bool] = []
    for done, plan in enumerate(plans, start=1):
        run, faults = inspect_run(folder, plan, header)
        findings += [_as_finding(plan.file, fault) for fault in faults]
        if run is not None:
            found = _content(run, header, whole=not errors_of(faults))
            findings += found
            sound = not errors_of([*faults, *(item.problem for item in found)])
            summaries.append(summary_of(run, header, sound=sound))
            signs.append(force_sign_of(run))
            moments.append(moment_sign_of(run))
            digests.append((plan.file, _digest(run)))
            strained += [run.strain is not None] if not errors_of(faults) else []
        if progress is not None:
            progress(done, len(plans))
    wrong, axes = force_sign_findings(signs, header)
    if not wrong and not axes:  # a lateral force that is turned turns what the moment is held to
        wrong, axes = force_sign_findings(moments, header)
    odd = {item.file for item in wrong}
    swapped, order = order_findings([s for s in summaries if s.file not in odd], header)
    problems = [*axes, *order, *gathered([*findings, *swapped, *wrong], len(plans))]
    return [*problems, *copy_problems(digests), *_strain_missing(header, strained)]


def _content(run: Run, header: CampaignHeader, *, whole: bool) -> list[RunFinding]:
    found = gage_findings(run, header, whole=whole)
    if whole:
        found += turn_findings(run, header)
    return found + rig_findings(run, header)


def _as_finding(file: str, problem: CampaignFault) -> RunFinding:
    """Return a fault of reading as a finding; what differs between runs is the place only."""
    channel = problem.where.partition(", channel ")[2]
    return RunFinding(f"{problem.severity} {channel} {problem.given}", file, channel, problem)


def _digest(run: Run) -> str:
    digest = hashlib.sha256()
    if run.strain is not None:
        digest.update(np.ascontiguousarray(run.strain).data)
    for name in sorted(run.rig):
        digest.update(name.encode())
        digest.update(np.ascontiguousarray(run.rig[name]).data)
    return digest.hexdigest()


def _strain_missing(header: CampaignHeader, strained: list[bool]) -> list[CampaignFault]:
    """Warn when sound runs lack the strain that the header declares."""
    missing = strained.count(False)
    if not header.gage_lateral or not missing:
        return []
    return [
        CampaignFault(
            header_file.FILE,
            f"[gages] declares {len(header.gage_lateral)} gages, but {missing} of "
            f"{len(strained)} runs have no strain",
            "runs without strain serve forces only",
            "remove [gages] for a campaign without strain, or add the recordings",
            "warning",
        )
    ]
