"""The belt's shear, and what stands out beside it: what the joint fit does not see.

Every tire's belt shears and the base ring's does not. On a plain tire that is most of what the fit
leaves. It changes waveforms like much else together, so that the joint fit gives its part to others
or to structure, and structure of that kind hides smooth effects. Beside a fitted shear a plain tire
leaves nothing of which one effect could take much; an effect that is there takes most, and no other
comes near.
"""

from collections.abc import Callable, Collection, Sequence

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.diagnose.candidates import candidates
from tirelib.diagnose.plain import SHEAR, usual
from tirelib.diagnose.refit import FELL, Refit, fall, inside
from tirelib.diagnose.stage import ALARM, Stage, within
from tirelib.diagnose.unlisted import UNLISTED, with_unlisted
from tirelib.effects import Effect
from tirelib.identify.waveform_fit import Data

SHARE, HINTED, INDEPENDENT = 0.6, 0.5, 0.2
"""Shares of the squared error beside the shear that an effect has to take, one that the joint fit
hints at there, and such a one that nothing else has to do with."""
FURTHER = 0.5
"""The same for such a one beside others that are named, whose laws are right but roughly."""
TAKES = 0.01
"""Share of the squared error from which on the shear is fitted beside others."""
APART = 0.8
"""Share of the leader's that the next may take."""
START = 0.25
"""Of its range, from which a shear is fitted."""
ERROR, MISFIT = 0.7, 0.2
"""Shares of the squared error and of the misfit in the metric of structure that the shear by itself
has to take."""

Fit = Callable[[Refit, Sequence[Effect], Sequence[FloatArray]], Refit | None]


def with_shear(stage: Stage, refitted: Fit) -> Refit:
    """Return a stage's model with the belt's shear fitted if it takes anything, else the model.

    Parameters
    ----------
    stage : Stage
        The shear is a candidate of, or nothing is fitted.
    refitted : callable
        Return an exact fit with effects from strengths, None if it does not settle.
    """
    base = stage.model
    if SHEAR.name not in stage.names:
        return base
    start = np.array([START * SHEAR.high])
    found = refitted(base, [*base.effects, SHEAR], [*base.strengths, start])
    return found if found is not None and fall(base, found) >= TAKES else base


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
    if model is stage.model or fall(stage.model, model) < ERROR:
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
    among: Collection[str] | None = None,
) -> tuple[Stage, int] | None:
    """Return the stage with the one effect that takes most beside the shear, and its index.

    The stage has the shear as well, where that is needed beside the effect. What is in no catalogue
    is returned with the stage as it is. Nothing is returned that a plain tire may show.

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
    among : collection of str, optional
        Who may be returned, if not everybody.
    """
    rows = [
        (1.0 - (left / model.error) ** 2, each.effect, strength)
        for each in candidates(data, model, with_unlisted([*catalogue, *model.effects])).living
        if each.effect.name in stage.names
        for strength, left in [each.alone(data, model)]
    ]
    rows.sort(key=lambda row: -row[0])
    if not rows:
        return None
    share, effect, strength = rows[0]
    if among is not None and effect.name not in among:
        return None
    if share < INDEPENDENT or any(other > APART * share for other, _, _ in rows[1:2]):
        return None
    beside = stage if model is stage.model else staged(model)
    least = _least(beside, effect.name, first=among is None)
    if share < least:
        return None
    where = stage.names.index(effect.name)
    if effect in UNLISTED:
        needed = stage.unlisted[where] and not usual(model.effects, effect, strength)
        return (stage, where) if needed else None
    start = inside(effect, strength)
    both = refitted(model, [*model.effects, effect], [*model.strengths, start])
    if both is None or fall(model, both) < least or not _in_range(both):
        return None
    if usual(model.effects, effect, both.strengths[-1]):
        return None
    after = staged(both)
    if after.scores.misfit >= beside.scores.misfit:
        return None
    base = stage.model
    if model is base or (fall(base, model) >= FELL and _has_shear(both)):
        return after, where
    # what shear there is stands for structure, so the effect has to do without
    alone = refitted(both, [*base.effects, effect], [*base.strengths, both.strengths[-1]])
    if alone is None or fall(base, alone) < least or not _in_range(alone):
        return None
    return staged(alone), where


def _least(beside: Stage, name: str, *, first: bool) -> float:
    """Return the share that an effect has to take, by what the joint fit says beside the shear."""
    if name not in beside.names:
        return SHARE
    where = beside.names.index(name)
    ratio = float(beside.ratio[where])
    if not beside.in_range[where] or ratio < 1.0:
        return SHARE
    independent = bool(beside.independent[where])
    if not first:
        return FURTHER if independent else SHARE
    return INDEPENDENT if independent else HINTED


def on_top(stage: Stage, model: Refit, least: float, staged: Callable[[Refit], Stage]) -> Stage:
    """Return the stage with the belt's shear on top of what it has, if that is needed as well.

    It has to take a share of the squared error, and must replace nothing.

    Parameters
    ----------
    stage : Stage
    model : Refit
        `with_shear` of it.
    least : float
        Least share.
    staged : callable
        Return the stage of a fit.
    """
    names = [effect.name for effect in stage.model.effects]
    if fall(stage.model, model) < least or not _has_shear(model):
        return stage
    if model.needed(names) != stage.model.needed(names):
        return stage
    after = staged(model)
    return after if after.scores.misfit < stage.scores.misfit else stage


def _has_shear(model: Refit) -> bool:
    """Return whether a model needs its shear, and that is in its range."""
    where = model.effects.index(SHEAR)
    fits = within(SHEAR, model.strengths[where], model.strength_std(where))
    return fits and model.needed([SHEAR.name]) == [SHEAR.name]


def _in_range(model: Refit) -> bool:
    """Return whether what was added last may be named."""
    return within(model.effects[-1], model.strengths[-1], model.strength_std(-1))
