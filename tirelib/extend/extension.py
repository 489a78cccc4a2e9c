"""One effect more or less: both models fitted to the campaign, and judged on runs left out."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.compare.model import Model, UsedEffect
from tirelib.diagnose.candidates import IN_BASE, candidates
from tirelib.diagnose.floor import FLOOR_MEMBERS, ErrorUnit, structural_floor
from tirelib.diagnose.held_out import Fold, folds, held_out_errors
from tirelib.diagnose.refit import Refit, refit
from tirelib.effects import Effect
from tirelib.errors import CalibrationError, ParameterError
from tirelib.identify.campaign_data import StraightRuns
from tirelib.identify.waveform_fit import Data

START_INSIDE = 0.9
"""Share of the range within which a refit starts."""
SIGNIFICANT = 2.0
"""Standard deviations below which a strength is no different from zero."""


@dataclass(frozen=True, slots=True)
class Extension:
    """A model before and after an effect was added or removed, both fitted.

    Attributes
    ----------
    action : str
        add or remove.
    effect : Effect
    strength, std : shape (components,)
        With the effect, in its unit.
    before, after : Refit
    unit : ErrorUnit
    floor : float
        Error that the structure of the ring leaves, in `unit`.
    folds : tuple of Fold
    held_before, held_after : tuple of float
        Errors on left-out runs, one per fold.
    flags : tuple of str
        out_of_range, not_significant, no_gain, heldout_worse.
    runs : StraightRuns
    """

    action: str
    effect: Effect
    strength: FloatArray
    std: FloatArray
    before: Refit
    after: Refit
    unit: ErrorUnit
    floor: float
    folds: tuple[Fold, ...]
    held_before: tuple[float, ...]
    held_after: tuple[float, ...]
    flags: tuple[str, ...]
    runs: StraightRuns


def add_effect(
    runs: StraightRuns,
    model: Model,
    effect: Effect,
    *,
    progress: Callable[[str], None] | None = None,
    members: int = FLOOR_MEMBERS,
) -> Extension:
    """Return a model with one effect more; values and all strengths are fitted anew.

    Parameters
    ----------
    runs : StraightRuns
    model : Model
    effect : Effect
    progress : callable, optional
    members : int
        Variants from which the floor is.

    Raises
    ------
    ParameterError
        If the model has the effect already, or strain cannot have it.
    CalibrationError
        If the campaign cannot show it.
    ConvergenceError
        If a fit does not settle.
    """
    used = strain_effects(model)
    _allowed(effect, model)
    data = runs.data(with_deflection=False)
    before = _fitted(data, model, used, progress)
    start = _start(data, before, effect)
    after = refit(
        data, before.values, [*before.effects, effect], [*before.strengths, start],
        progress=progress,
    )  # fmt: skip
    index = len(after.effects) - 1
    strength, std = after.strengths[index], after.strength_std(index)
    return _judged("add", effect, strength, std, before, after, data, runs, members, progress)


def remove_effect(
    runs: StraightRuns,
    model: Model,
    effect: Effect,
    *,
    progress: Callable[[str], None] | None = None,
    members: int = FLOOR_MEMBERS,
) -> Extension:
    """Return a model without one of its effects; the rest is fitted anew.

    Parameters and errors as for `add_effect`.
    """
    used = strain_effects(model)
    names = [each.effect.name for each in used]
    if effect.name not in names:
        raise ParameterError(
            f"{model.name}: it has no effect {effect.name!r} of strain to remove; it has "
            f"{', '.join(names) or 'none'}"
        )
    data = runs.data(with_deflection=False)
    before = _fitted(data, model, used, progress)
    index = names.index(effect.name)
    kept = [k for k in range(len(names)) if k != index]
    after = refit(
        data, before.values, [before.effects[k] for k in kept],
        [before.strengths[k] for k in kept], progress=progress,
    )  # fmt: skip
    strength, std = before.strengths[index], before.strength_std(index)
    return _judged("remove", effect, strength, std, before, after, data, runs, members, progress)


def strain_effects(model: Model) -> list[UsedEffect]:
    """Return a model's effects that strain shows; those of the brush are not among them."""
    return [each for each in model.used if each.effect.hook != "brush"]


def known_effect(name: str, catalogue: Mapping[str, Effect]) -> Effect:
    """Return an effect by name.

    Raises
    ------
    ParameterError
        If there is none; with the nearest names.
    """
    if name in catalogue:
        return catalogue[name]
    near = get_close_matches(name, catalogue, n=3)
    hint = f"did you mean {' or '.join(near)}?" if near else f"known: {', '.join(catalogue)}"
    raise ParameterError(f"effect {name!r} is not known; {hint}")


def _allowed(effect: Effect, model: Model) -> None:
    if effect.name in {each.effect.name for each in model.used}:
        raise ParameterError(
            f"{model.name}: it has the effect {effect.name!r} already; choose another one, or "
            "take it out first with --remove"
        )
    if effect.name in IN_BASE:
        raise ParameterError(
            f"effect {effect.name!r}: the base model has it as a fitted number; choose another one"
        )
    if effect.hook == "brush":
        raise ParameterError(
            f"effect {effect.name!r} acts on the brush, which strain does not show; choose an "
            "effect of another stage"
        )


def _fitted(
    data: Data,
    model: Model,
    used: Sequence[UsedEffect],
    progress: Callable[[str], None] | None,
) -> Refit:
    strengths = [np.atleast_1d(np.asarray(each.strength, dtype=float)) for each in used]
    return refit(data, model.values, [each.effect for each in used], strengths, progress=progress)


def _start(data: Data, before: Refit, effect: Effect) -> FloatArray:
    """Return the strength that serves best to first order, within the range.

    Raises
    ------
    CalibrationError
        If the plan shows nothing of the effect.
    """
    found = candidates(data, before, [effect])
    if effect.name in found.dead:
        raise CalibrationError(
            f"effect {effect.name!r}: this campaign cannot show it: {found.dead[effect.name]}; "
            "measure such runs, or leave the effect out"
        )
    own = found.living[0].own
    rest = before.whiten(data.strain - before.waveform).ravel()
    weights = np.linalg.lstsq(own.T, rest, rcond=None)[0]
    start: FloatArray = np.clip(
        weights * effect.scale, START_INSIDE * effect.low, START_INSIDE * effect.high
    )
    return start


def _judged(
    action: str,
    effect: Effect,
    strength: FloatArray,
    std: FloatArray,
    before: Refit,
    after: Refit,
    data: Data,
    runs: StraightRuns,
    members: int,
    progress: Callable[[str], None] | None,
) -> Extension:
    unit, chosen = ErrorUnit.of(runs, data), folds(data)
    floor = structural_floor(data, after, unit, members=members, progress=progress)
    held_before = held_out_errors(data, before, chosen, unit, progress=progress)
    held_after = held_out_errors(data, after, chosen, unit, progress=progress)
    flags = []
    if ((strength < effect.low) | (strength > effect.high)).any():
        flags.append("out_of_range")
    if (np.abs(strength) < SIGNIFICANT * std).all():
        flags.append("not_significant")
    if action == "add" and after.error >= before.error * (1.0 - 1e-6):
        flags.append("no_gain")
    if any(new > old for new, old in zip(held_after, held_before, strict=True)):
        flags.append("heldout_worse")
    return Extension(
        action, effect, strength, std, before, after, unit, floor, chosen, held_before,
        held_after, tuple(flags), runs,
    )  # fmt: skip
