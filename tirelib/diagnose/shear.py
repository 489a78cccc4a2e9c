"""The belt's shear, and what stands out beside it: what the joint fit does not see.

Every tire's belt shears and the base ring's does not. On a plain tire that is most of what the fit
leaves. It changes waveforms like much else together, so that the joint fit gives its part to others
or to structure, and structure of that kind hides smooth effects. Beside a fitted shear a plain tire
leaves nothing of which one effect could take much; an effect that is there takes most, and no other
comes near.
"""

from collections.abc import Callable, Sequence

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.diagnose.candidates import candidates
from tirelib.diagnose.refit import FELL, Refit, fall
from tirelib.diagnose.stage import ALARM, Stage, within
from tirelib.diagnose.unlisted import UNLISTED
from tirelib.effects import CATALOGUE, Effect
from tirelib.identify.waveform_fit import Data

SHARE, HINTED = 0.6, 0.5
"""Shares of the squared error beside the shear that an effect has to take, and one that the joint
fit hints at."""
APART = 0.8
"""Share of the leader's that the next may take."""
START = 0.25
"""Of its range, from which a shear is fitted."""
ERROR, MISFIT = 0.7, 0.2
"""Shares of the squared error and of the misfit in the metric of structure that the shear by itself
has to take."""
SHEAR = CATALOGUE["belt_shear"]

Fit = Callable[[Refit, Sequence[Effect], Sequence[FloatArray]], Refit | None]


def with_shear(base: Refit, refitted: Fit) -> Refit:
    """Return a model with the belt's shear fitted, if that takes anything; else the model.

    Parameters
    ----------
    base : Refit
    refitted : callable
        Return an exact fit with effects from strengths, None if it does not settle.
    """
    if SHEAR in base.effects:
        return base
    start = np.array([START * SHEAR.high])
    found = refitted(base, [*base.effects, SHEAR], [*base.strengths, start])
    return found if found is not None and fall(base, found) >= FELL else base


def shear_itself(
    stage: Stage, model: Refit, staged: Callable[[Refit], Stage]
) -> tuple[Stage, int] | None:
    """Return the stage with the belt's shear, and its index, if that explains most.

    Parameters
    ----------
    stage : Stage
        Of a model without it.
    model : Refit
        `with_shear` of it.
    staged : callable
        Return the stage of a fit.
    """
    if model is stage.model or SHEAR.name not in stage.names or fall(stage.model, model) < ERROR:
        return None
    where, after = stage.names.index(SHEAR.name), staged(model)  # scores are dear
    gone = stage.scores.misfit - after.scores.misfit
    explains = (
        gone >= max(MISFIT * stage.scores.misfit, ALARM * float(stage.limit[where]))
        and after.imitated < ALARM
        and _in_range(model)
    )
    return (after, where) if explains else None


def beside_shear(
    data: Data,
    stage: Stage,
    model: Refit,
    catalogue: Sequence[Effect],
    refitted: Fit,
    staged: Callable[[Refit], Stage],
) -> tuple[Stage, int] | None:
    """Return the stage with the one effect that takes most beside the belt's shear, and its index.

    What is in no catalogue is returned with the stage as it is.

    Parameters
    ----------
    data : Data
    stage : Stage
        Of a model without it.
    model : Refit
        `with_shear` of it.
    catalogue : sequence of Effect
        That may be named.
    refitted : callable
        Return an exact fit with effects from strengths, None if it does not settle.
    staged : callable
        Return the stage of a fit.
    """
    base = stage.model
    index = {name: k for k, name in enumerate(stage.names)}
    rows = [
        (1.0 - (left / model.error) ** 2, each.effect, strength)
        for each in candidates(data, model, [*catalogue, *UNLISTED]).living
        if each.effect.name in index
        for strength, left in [each.alone(data, model)]
    ]
    rows.sort(key=lambda row: -row[0])
    if not rows:
        return None
    share, effect, strength = rows[0]
    where = index[effect.name]
    hinted = bool(stage.in_range[where]) and float(stage.ratio[where]) >= 1.0
    least = HINTED if hinted else SHARE
    if share < least or any(other > APART * share for other, _, _ in rows[1:2]):
        return None
    if effect in UNLISTED:
        return (stage, where) if stage.unlisted[where] else None
    start = np.clip(strength, 0.9 * effect.low, 0.9 * effect.high)
    both = refitted(model, [*model.effects, effect], [*model.strengths, start])
    if both is None or fall(model, both) < least or not _in_range(both):
        return None
    alone = both
    if model is not base:
        given = [*base.strengths, both.strengths[-1]]
        found = refitted(both, [*base.effects, effect], given)
        if found is None or fall(base, found) < FELL or not _in_range(found):
            return None
        alone = found
    after = staged(alone)
    return (after, where) if after.scores.misfit < stage.scores.misfit else None


def _in_range(model: Refit) -> bool:
    """Return whether what was added last may be named."""
    return within(model.effects[-1], model.strengths[-1], model.strength_std(-1))
