"""Findings of the content checks, and the one line for a fault that many runs share."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

from tirelib.campaign.campaign_fault import CampaignFault, Severity

SHARED_BY = 4
"""From this many runs on, and from half of all, a shared fault gets one line for all of them."""

_NAMED = 3


@dataclass(frozen=True, slots=True)
class RunFinding:
    """A problem of one run with its subject, so that equal problems of several runs can be joined.

    Attributes
    ----------
    key : str
        Kind of fault and channel, the same in every run that has it.
    file : str
        The run file.
    channel : str
        Empty for the run as a whole.
    problem : CampaignFault
    """

    key: str
    file: str
    channel: str
    problem: CampaignFault


def finding(
    key: str,
    file: str,
    channel: str,
    given: str,
    allowed: str,
    remedy: str,
    *,
    at: str = "",
    warning: bool = False,
) -> RunFinding:
    """Return a finding whose place is `file`, `channel` and, where that helps, `at`."""
    where = ", ".join(part for part in (file, channel and f"channel {channel}", at) if part)
    severity: Severity = "warning" if warning else "error"
    problem = CampaignFault(where, given, allowed, remedy, severity)
    return RunFinding(f"{key} {channel} {severity}", file, channel, problem)


def gathered(findings: Iterable[RunFinding], n_runs: int) -> list[CampaignFault]:
    """Return the problems in their order; one that most runs share becomes one line."""
    by_key: dict[str, list[RunFinding]] = {}
    listed = list(findings)
    for item in listed:
        by_key.setdefault(item.key, []).append(item)
    problems: list[CampaignFault] = []
    for item in listed:
        same = by_key[item.key]
        files = list(dict.fromkeys(other.file for other in same))
        if len(files) < SHARED_BY or 2 * len(files) < n_runs:
            problems.append(item.problem)
        elif item is same[0]:
            named = ", ".join(files[:_NAMED])
            where = f"{len(files)} of {n_runs} runs ({named}, ...)"
            where += f", channel {item.channel}" if item.channel else ""
            given = f"{item.problem.given} in the first of them"
            problems.append(replace(item.problem, where=where, given=given))
    return problems
