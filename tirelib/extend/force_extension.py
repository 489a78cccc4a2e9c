"""One brush effect more or less: both models fitted to one force, and judged on points left out."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.diagnose.forces.assess import ForceCase
from tirelib.diagnose.forces.candidates import ForceCandidates, force_candidates
from tirelib.diagnose.forces.ensemble import force_ensemble
from tirelib.diagnose.forces.fit import ForceFit, fit_force, room
from tirelib.diagnose.forces.held_out import ForceFold, errors_of, force_folds
from tirelib.diagnose.forces.ranking import ForceRanking
from tirelib.effects import Effect
from tirelib.errors import CalibrationError, ParameterError, TirelibError

FLOOR_MEMBERS = 20
SIGNIFICANT = 2.0
"""Standard deviations below which a strength is no different from zero."""
_STARTS = (0.3, -0.3)


@dataclass(frozen=True, slots=True, eq=False)
class ForceExtension:
    """A brush before and after an effect was added or removed, both fitted to one force.

    Attributes
    ----------
    action : str
        add or remove.
    effect : Effect
    strength, std : shape (components,)
        With the effect, in its unit.
    before, after : ForceFit
    floor : float, [N] or [N m]
        Error that variants of the model without a missing effect leave, median.
    folds : tuple of ForceFold
    held_before, held_after : tuple of float
        Errors on left-out points, one per fold.
    flags : tuple of str
        out_of_range, not_significant, no_gain, heldout_worse.
    case : ForceCase
    """

    action: str
    effect: Effect
    strength: FloatArray
    std: FloatArray
    before: ForceFit
    after: ForceFit
    floor: float
    folds: tuple[ForceFold, ...]
    held_before: tuple[float, ...]
    held_after: tuple[float, ...]
    flags: tuple[str, ...]
    case: ForceCase


def add_brush_effect(
    case: ForceCase,
    effect: Effect,
    *,
    progress: Callable[[str], None] | None = None,
    members: int = FLOOR_MEMBERS,
) -> ForceExtension:
    """Return a brush with one effect more; parameters and all strengths are fitted anew.

    Parameters
    ----------
    case : ForceCase
    effect : Effect
        Of stage brush.
    progress : callable, optional
    members : int
        Variants from which the floor is.

    Raises
    ------
    ParameterError
        If the model has the effect already, or it does not act on the brush.
    CalibrationError
        If the campaign cannot show it.
    ConvergenceError
        If a fit does not settle.
    """
    _allowed(case, effect)
    before = fit_force(case.problem, case.model.values, case.effects, case.strengths)
    found = force_candidates(case.problem, before, [effect])
    if effect.name in found.dead:
        raise CalibrationError(
            f"effect {effect.name!r}: this campaign cannot show it: {found.dead[effect.name]}; "
            "measure such runs, or leave the effect out"
        )
    after = _with(case, before, effect)
    return _judged("add", case, effect, before, after, after, progress, members)


def case_for(cases: Sequence[ForceCase], effect: Effect) -> ForceCase:
    """Return the force to which an effect is fitted if none is asked for.

    That of the model's last step with forces, so that its history is of one quantity; else the
    force whose error the effect lowers most; else the first.

    Raises
    ------
    ParameterError
        If the effect does not act on the brush.
    """
    told = [entry.get("quantity") for entry in cases[0].model.history]
    last = [case for name in reversed(told) for case in cases if case.quantity == name]
    if last or len(cases) == 1:
        return (last or list(cases))[0]
    best, lowest = cases[0], np.inf
    for case in cases:
        if effect.name in {each.name for each in case.effects}:
            return case
        _allowed(case, effect)
        try:
            before = fit_force(case.problem, case.model.values, case.effects, case.strengths)
            if effect.name in force_candidates(case.problem, before, [effect]).dead:
                continue
            ratio = _with(case, before, effect).error / before.error
        except TirelibError:
            continue
        if ratio < lowest:
            best, lowest = case, ratio
    return best


def remove_brush_effect(
    case: ForceCase,
    effect: Effect,
    *,
    progress: Callable[[str], None] | None = None,
    members: int = FLOOR_MEMBERS,
) -> ForceExtension:
    """Return a brush without one of its effects; the rest is fitted anew.

    Parameters and errors as for `add_brush_effect`.
    """
    names = [each.name for each in case.effects]
    if effect.name not in names:
        raise ParameterError(
            f"{case.model.name}: it has no effect {effect.name!r} of the brush to remove; it has "
            f"{', '.join(names) or 'none'}"
        )
    before = fit_force(case.problem, case.model.values, case.effects, case.strengths)
    kept = [k for k, name in enumerate(names) if name != effect.name]
    after = fit_force(
        case.problem, before.values, [before.effects[k] for k in kept],
        [before.strengths[k] for k in kept],
    )  # fmt: skip
    return _judged("remove", case, effect, before, after, before, progress, members)


def _allowed(case: ForceCase, effect: Effect) -> None:
    if effect.hook != "brush":
        raise ParameterError(
            f"effect {effect.name!r} acts on strain, which forces do not show; leave --quantity "
            f"{case.quantity} out, or choose an effect of the brush"
        )
    if effect.name in {each.name for each in case.effects}:
        raise ParameterError(
            f"{case.model.name}: it has the effect {effect.name!r} already; choose another one, or "
            "take it out first with --remove"
        )


def _with(case: ForceCase, before: ForceFit, effect: Effect) -> ForceFit:
    """Return the fit with one effect more: the better of two starts."""
    low, high = room(case.problem, before.values, effect)
    best: ForceFit | None = None
    trouble: TirelibError | None = None
    for share in _STARTS:
        start = np.full(effect.components, share * (high if share > 0.0 else -low))
        try:
            found = fit_force(
                case.problem, before.values, [*before.effects, effect], [*before.strengths, start]
            )
        except TirelibError as error:
            trouble = error
            continue
        best = found if best is None or found.error < best.error else best
    if best is None:
        assert trouble is not None  # noqa: S101 - one of two starts failed
        raise trouble
    return best


def _judged(
    action: str,
    case: ForceCase,
    effect: Effect,
    before: ForceFit,
    after: ForceFit,
    having: ForceFit,
    progress: Callable[[str], None] | None,
    members: int,
) -> ForceExtension:
    problem, folds = case.problem, force_folds(case.problem)
    index = [each.name for each in having.effects].index(effect.name)
    strength, std = having.strengths[index], having.strength_std(index)
    if progress is not None:
        progress("held-out points")
    held_before, held_after = errors_of(problem, before, folds), errors_of(problem, after, folds)
    flags = []
    if ((strength < effect.low) | (strength > effect.high)).any():
        flags.append("out_of_range")
    if (np.abs(strength) < SIGNIFICANT * std).all():
        flags.append("not_significant")
    if action == "add" and after.error >= before.error * (1.0 - 1e-6):
        flags.append("no_gain")
    counted = [(new, old) for new, old, f in zip(held_after, held_before, folds, strict=True)
               if f.main]  # fmt: skip
    if any(new > old for new, old in counted):
        flags.append("heldout_worse")
    return ForceExtension(
        action, effect, strength, std, before, after, _floor(case, after, members, progress),
        folds, held_before, held_after, tuple(flags), case,
    )  # fmt: skip


def _floor(
    case: ForceCase, model: ForceFit, members: int, progress: Callable[[str], None] | None
) -> float:
    """Return the median error that variants of a model leave to it, [N] or [N m]."""
    nothing = ForceCandidates((), {}, np.zeros((0, 0)))
    noise = case.noise if np.isfinite(case.noise) else 0.0
    left = force_ensemble(
        case.problem, model, ForceRanking(case.problem, model, nothing), noise=noise,
        members=members, progress=progress,
    ).before  # fmt: skip
    return case.problem.scale * float(np.median(left)) if left.size else float("nan")
