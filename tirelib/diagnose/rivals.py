"""Effects that look like the leader and serve as well: the campaign cannot tell them apart."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from tirelib.diagnose.plain import BELT
from tirelib.diagnose.refit import Refits, inside
from tirelib.identify.waveform_fit import Data

if TYPE_CHECKING:
    from tirelib.diagnose.diagnose import Finding
    from tirelib.diagnose.stage import Stage

MOST = 2
"""Rivals that are refitted."""


def inseparable(
    data: Data,
    first: "Stage",
    findings: Sequence["Finding"],
    named: Sequence[str],
    refitted: Refits,
) -> list[str]:
    """Return twins of the leader, in range, whose exact refit is no worse.

    No worse is by less than the leader's own threshold: what variants without any effect do. The
    belt's shear beside the leader is no rival, and stands beside its twins as well.
    """
    hidden = [name for name in named if name not in BELT] or list(named)
    if len(hidden) != 1:
        return []
    by_name = {finding.effect.name: finding for finding in findings}
    leader = by_name[hidden[0]]
    beside = [by_name[name] for name in named if name not in hidden]
    twins = [by_name[name] for name, _ in leader.twins]
    rivals = [twin for twin in twins if twin.in_range and twin.level == "alarm"]
    if not rivals:
        return []
    mine = _misfit(data, first, [*beside, leader], refitted)
    return [
        rival.effect.name
        for rival in rivals[:MOST]
        if _misfit(data, first, [*beside, rival], refitted) < mine + leader.threshold
    ]


def _misfit(data: Data, first: "Stage", more: Sequence["Finding"], refitted: Refits) -> float:
    """Return the misfit with some effects more; infinite if the refit fails."""
    base = first.model
    start = [inside(finding.effect, finding.strength) for finding in more]
    effects = [*base.effects, *(f.effect for f in more)]
    model = refitted(base, effects, [*base.strengths, *start])
    if model is None:
        return float("inf")
    white = base.whiten(data.strain - model.on_time(data.points).waveform).ravel()
    return first.ranking.structure.normal(np.zeros((0, white.size)), white).square
