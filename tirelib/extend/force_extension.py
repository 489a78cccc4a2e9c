"""One brush effect more or less: the brush fitted to one force, judged on points left out."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from tirelib.diagnose.diagnose import FALSE_ALARM
from tirelib.diagnose.forces.assess import ForceCase
from tirelib.diagnose.forces.diagnose import plain_tires
from tirelib.diagnose.forces.fit import ForceFit, fit_force, with_effect
from tirelib.diagnose.forces.floor import force_floor
from tirelib.diagnose.forces.held_out import ForceFold, errors_of, force_folds
from tirelib.effects import CATALOGUE, Effect
from tirelib.errors import ParameterError, TirelibError
from tirelib.extend.step import Step, added, removed
from tirelib.infer.forces import ForceProblem
from tirelib.infer.select import Hypotheses
from tirelib.threads import one_thread


@dataclass(frozen=True, eq=False)
class ForceExtension(Step[ForceFit]):
    """A step of a brush; errors in [N] or [N m].

    Attributes
    ----------
    case : ForceCase
    """

    case: ForceCase


@one_thread()
def add_brush_effect(
    case: ForceCase,
    effect: Effect,
    *,
    progress: Callable[[str], None] | None = None,
) -> ForceExtension:
    """Return a brush with one effect more; parameters and all strengths are fitted anew.

    Parameters
    ----------
    case : ForceCase
    effect : Effect
        Of stage brush.
    progress : callable, optional

    Raises
    ------
    ParameterError
        If the model has the effect already, or it does not act on the brush.
    CalibrationError
        If the campaign cannot show it.
    ConvergenceError
        If a fit does not settle.
    """
    return ForceExtension(**vars(added(_Force(case, progress), effect)), case=case)


def remove_brush_effect(
    case: ForceCase,
    effect: Effect,
    *,
    progress: Callable[[str], None] | None = None,
) -> ForceExtension:
    """Return a brush without one of its effects; the rest is fitted anew.

    Parameters and errors as for `add_brush_effect`.
    """
    return ForceExtension(**vars(removed(_Force(case, progress), effect)), case=case)


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
        subject = _Force(case, None)
        subject.refuse(effect)
        try:
            before = subject.fitted()
            if subject.dead(before, effect):
                continue
            ratio = subject.with_effect(before, effect).error / before.error
        except TirelibError:
            continue
        if ratio < lowest:
            best, lowest = case, ratio
    return best


class _Force:
    """A brush on one force (`tirelib.extend.step.Subject`)."""

    acts_on = "the brush"

    def __init__(self, case: ForceCase, progress: Callable[[str], None] | None) -> None:
        self.case, self.progress = case, progress
        self.name = case.model.name

    @property
    def effects(self) -> list[Effect]:
        """That the model has."""
        return self.case.effects

    def refuse(self, effect: Effect) -> None:
        """Raise ParameterError if an effect does not act on the brush."""
        if effect.hook != "brush":
            raise ParameterError(
                f"effect {effect.name!r} acts on strain, which forces do not show; leave "
                f"--quantity {self.case.quantity} out, or choose an effect of the brush"
            )

    def fitted(self) -> ForceFit:
        """Return the brush as it is, fitted."""
        case = self.case
        return fit_force(case.problem, case.model.values, case.effects, case.strengths)

    def dead(self, before: ForceFit, effect: Effect) -> str:
        """Return why the points cannot show an effect, or an empty text."""
        return self._problem(before, [effect]).dead.get(effect.name, "")

    def with_effect(self, before: ForceFit, effect: Effect) -> ForceFit:
        """Return the fit with one effect more."""
        return with_effect(self.case.problem, before, effect)

    def without(self, before: ForceFit, kept: Sequence[int]) -> ForceFit:
        """Return the fit with some of the effects."""
        return fit_force(
            self.case.problem,
            before.values,
            [before.effects[k] for k in kept],
            [before.strengths[k] for k in kept],
        )

    def left_out(self) -> Sequence[ForceFold]:
        """Return the points that are left out in turn."""
        return force_folds(self.case.problem)

    def held_out(self, fit: ForceFit, folds: Sequence[ForceFold]) -> tuple[float, ...]:
        """Return the errors on left-out points."""
        if self.progress is not None:
            self.progress("held-out points")
        return errors_of(self.case.problem, fit, folds)

    def floor(self, after: ForceFit) -> float:
        """Return the part of the error that noise and plain tires explain, as errors are told."""
        case = self.case
        if not np.isfinite(case.noise):
            return float("nan")
        problem = self._problem(after, list(CATALOGUE.values()))
        among = Hypotheses(problem, plain_tires(case.quantity))
        floor = force_floor(case.problem, after, among.base, FALSE_ALARM)
        return case.error(after) * floor / after.error

    def _problem(self, fit: ForceFit, catalogue: Sequence[Effect]) -> ForceProblem:
        """Return the problem about a fitted brush."""
        return ForceProblem(
            self.case.problem.bench,
            self.case.quantity,
            fit.values,
            catalogue,
            noise=self.case.noise,
            effects=fit.effects,
            strengths=fit.strengths,
        )
