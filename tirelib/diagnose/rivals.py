"""Effects that look like the leader and serve as well: the campaign cannot tell them apart."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from tirelib.diagnose.refit import Refit, refit
from tirelib.effects import Effect
from tirelib.errors import TirelibError
from tirelib.identify.waveform_fit import Data

if TYPE_CHECKING:
    from tirelib.diagnose.diagnose import Finding
    from tirelib.diagnose.stage import Stage

MOST = 2
"""Rivals that are refitted."""


def inseparable(
    data: Data, first: "Stage", findings: Sequence["Finding"], named: Sequence[str]
) -> list[str]:
    """Return twins of the leader, in range, whose exact refit is no worse.

    No worse is by less than the leader's own threshold: what variants without any effect do.
    """
    if len(named) != 1:
        return []
    by_name = {finding.effect.name: finding for finding in findings}
    leader = by_name[named[0]]
    twins = [by_name[name] for name, _ in leader.twins]
    rivals = [twin for twin in twins if twin.in_range and twin.level == "alarm"]
    if not rivals:
        return []
    mine = _misfit(data, first, leader.effect, leader.strength)
    return [
        rival.effect.name
        for rival in rivals[:MOST]
        if _misfit(data, first, rival.effect, rival.strength) < mine + leader.threshold
    ]


def _misfit(data: Data, first: "Stage", effect: Effect, strength: np.ndarray) -> float:
    """Return the misfit with one effect more; infinite if the refit fails."""
    base = first.model
    start = np.clip(strength, 0.9 * effect.low, 0.9 * effect.high)
    try:
        model: Refit = refit(
            data, base.values, [*base.effects, effect], [*base.strengths, start], delay=base.delay
        )
    except TirelibError:
        return float("inf")
    white = base.whiten(data.strain - model.on_time(data.points).waveform).ravel()
    return first.ranking.structure.normal(np.zeros((0, white.size)), white).square
