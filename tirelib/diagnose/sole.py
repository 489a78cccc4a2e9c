"""What the joint fit does not see: an effect that by itself explains most of the error.

A belt's shear changes waveforms like much else together, so that the joint fit gives its part to
others or to structure. Where nothing else is named, what takes much of the plain error is fitted
exactly.
"""

from collections.abc import Callable, Sequence

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.diagnose.refit import Refit
from tirelib.diagnose.stage import ALARM, Stage, within
from tirelib.effects import Effect
from tirelib.identify.waveform_fit import Data

TRIED = 0.4
"""Share of the squared error that an effect takes to first order from which it is fitted."""
ERROR, MISFIT = 0.7, 0.2
"""Shares of the squared error and of the misfit in the metric of structure that have to go."""

Fit = Callable[[Refit, Sequence[Effect], Sequence[FloatArray]], Refit | None]


def sole(
    data: Data,
    stage: Stage,
    suspects: Sequence[str],
    refitted: Fit,
    staged: Callable[[Refit], Stage],
) -> tuple[Stage, int] | None:
    """Return the stage with the one effect that explains most, and its index.

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
    model = stage.model
    found: list[tuple[Refit, int]] = []
    for index, candidate in enumerate(stage.found.living):
        effect = candidate.effect
        if effect.name not in suspects:
            continue
        strength, left = candidate.alone(data, model)
        if left**2 > (1.0 - TRIED) * model.error**2:
            continue
        start = np.clip(strength, 0.9 * effect.low, 0.9 * effect.high)
        after = refitted(model, [*model.effects, effect], [*model.strengths, start])
        if after is not None and after.error**2 <= (1.0 - ERROR) * model.error**2:
            found.append((after, index))
    # scores are dear, so the error comes first
    for after, index in sorted(found, key=lambda pair: pair[0].error):
        with_it = staged(after)
        if _explains(stage, with_it, float(stage.limit[index])):
            return with_it, index
    return None


def _explains(before: Stage, after: Stage, limit: float) -> bool:
    """Return whether what the effect added last takes is misfit too, with it in its range."""
    model, gone = after.model, before.scores.misfit - after.scores.misfit
    return (
        gone >= max(MISFIT * before.scores.misfit, ALARM * limit)
        and after.imitated < ALARM
        and within(model.effects[-1], model.strengths[-1], model.strength_std(-1))
    )
