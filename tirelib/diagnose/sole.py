"""What first order does not see: an effect that by itself explains nearly everything.

A belt's shear, a long gage or a lag change the waveform so far out of proportion that the joint
fit, which is of first order, gives their part to others with strengths that cannot be. Where
nothing can be named, those whose shape changes within their range are fitted exactly, one by one.
"""

from collections.abc import Callable, Sequence

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.diagnose.candidates import Candidate, signature
from tirelib.diagnose.refit import Refit
from tirelib.diagnose.stage import ALARM, Stage, within
from tirelib.effects import Effect
from tirelib.errors import TirelibError
from tirelib.identify.waveform_fit import Data

BENT = 0.95
"""Cosine between the change by a small step and by the whole range, below which first order does
not tell the shape."""
ERROR, MISFIT = 0.75, 0.6
"""Shares of the squared error and of the misfit in the metric of structure that have to go."""
START = 0.5
"""Share of the range from which the exact fit starts."""

Fit = Callable[[Stage, Sequence[Effect], Sequence[FloatArray]], Refit | None]


def sole(
    data: Data,
    stage: Stage,
    suspects: Sequence[str],
    refitted: Fit,
    staged: Callable[[Refit], Stage],
) -> tuple[Stage, int] | None:
    """Return the stage with the one effect that explains nearly everything, and its index.

    Parameters
    ----------
    data : Data
    stage : Stage
        Of a model without it.
    suspects : sequence of str
        Effects that may be named.
    refitted : callable
        Return an exact fit with effects from strengths, None if it does not settle.
    staged : callable
        Return the stage of a fit.
    """
    found: list[tuple[Stage, int]] = []
    for index, candidate in enumerate(stage.found.living):
        effect = candidate.effect
        if effect.name not in suspects or not _bent(data, stage, candidate):
            continue
        start = np.array([START * effect.toward])
        model = refitted(stage, [*stage.model.effects, effect], [*stage.model.strengths, start])
        # scores are dear, so the error comes first
        if model is None or model.error**2 > (1.0 - ERROR) * stage.model.error**2:
            continue
        after = staged(model)
        if _explains(stage, after):
            found.append((after, index))
    return min(found, key=lambda pair: pair[0].scores.misfit, default=None)


def _bent(data: Data, stage: Stage, candidate: Candidate) -> bool:
    """Return whether an effect's shape at the end of its range is another than at its start."""
    effect = candidate.effect
    if effect.components > 1:
        return False
    ends = []
    for size in (effect.step, effect.toward):
        try:
            rows = signature(data, stage.model, effect, [size], size)
        except TirelibError:  # there is no tire with so much of it
            return True
        ends.append(stage.ranking.structure.projected(rows[0]))
    start, end = ends
    return float(start @ end) < BENT * float(np.linalg.norm(start) * np.linalg.norm(end))


def _explains(before: Stage, after: Stage) -> bool:
    """Return whether what the effect added last takes is misfit too, with it in its range."""
    model = after.model
    return (
        after.scores.misfit <= (1.0 - MISFIT) * before.scores.misfit
        and after.imitated < ALARM
        and within(model.effects[-1], model.strengths[-1], model.strength_std(-1))
    )
