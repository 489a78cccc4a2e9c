"""Which effects a brush lacks, by the inference of the library (`tirelib.infer`)."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.diagnose.diagnose import FALSE_ALARM, Finding, findings_of
from tirelib.diagnose.forces.fit import ForceFit, Problem, fit_force, with_effect
from tirelib.diagnose.forces.held_out import ForceFold, errors_of, force_folds, pooled
from tirelib.effects import Effect
from tirelib.errors import TirelibError
from tirelib.forked import forked
from tirelib.infer.forces import ForceProblem
from tirelib.infer.plain import Family, covering, load
from tirelib.infer.select import Verdict, select
from tirelib.threads import one_thread

TABLES = Path(__file__).parents[2] / "infer"
"""Where the tables of what plain tires show are (`build/force_tires/learn.py`)."""

Alone = Mapping[str, tuple[ForceFit, tuple[float, ...]]]
"""The base with one effect, by its name, and its errors on what is held out."""


@dataclass(frozen=True, slots=True, eq=False)
class ForceDiagnosis:
    """What a campaign says of a brush.

    Attributes
    ----------
    problem : Problem
    verdict : Verdict
    named : tuple of str
        Effects of the smallest members of the confidence set: of one member in the order of what
        each alone gains on held-out points, best first; one whose gain those before it have brought
        already stands behind. Where a law is not right, without effects that lower no error on
        held-out points.
    findings : tuple of Finding
        By rank.
    dead : mapping of name to reason
    base, final : ForceFit
        Without and with the named effects, the best member's; of least error.
    folds : tuple of ForceFold
    held_before, held_final : tuple of float
        Per fold, [N] or [N m].
    alone : mapping
        The base with each of the named effects alone.
    steps : tuple of (name, error, held-out error)
        The named effects one after the other, [N] or [N m].
    """

    problem: Problem
    verdict: Verdict
    named: tuple[str, ...]
    findings: tuple[Finding, ...]
    dead: Mapping[str, str]
    base: ForceFit
    final: ForceFit
    folds: tuple[ForceFold, ...]
    held_before: tuple[float, ...]
    held_final: tuple[float, ...]
    alone: Alone
    steps: tuple[tuple[str, float, float], ...]

    @property
    def exceeds(self) -> bool:
        """Whether more is left than plain tires leave."""
        return self.verdict.kind in ("unknown", "form_inadequate")

    def error_with(self, finding: Finding) -> float:
        """Return the rms with one effect alone, to first order unless it is named, SI."""
        if finding.effect.name in self.alone:
            return self.alone[finding.effect.name][0].error
        return self.base.error * float(np.sqrt(max(1.0 - finding.share, 0.0)))

    def held_with(self, finding: Finding) -> float:
        """Return the held-out error with one effect alone, SI; NaN unless it is named."""
        if finding.effect.name not in self.alone:
            return float("nan")
        return pooled(self.alone[finding.effect.name][1], self.folds)


@cache
def plain_tires(quantity: str) -> tuple[Family, ...]:
    """Return the families of plain tires that come with the library, for one force."""
    return covering(load(TABLES / f"plain_{quantity}.npz")[0])


@one_thread()
def diagnose_force(
    problem: Problem,
    values: Mapping[str, float],
    catalogue: Sequence[Effect],
    *,
    noise: float,
    effects: Sequence[Effect] = (),
    strengths: Sequence[FloatArray] = (),
    false_alarm: float = FALSE_ALARM,
    progress: Callable[[str], None] | None = None,
) -> ForceDiagnosis:
    """Tell which effects of a catalogue a brush lacks.

    Parameters
    ----------
    problem : Problem
    values : mapping
        Of the model's brush.
    catalogue : sequence of Effect
        Those of stage brush are tried.
    noise : float, [N] or [N m]
        Of a point, from repeats; NaN without.
    effects, strengths
        That the model has already.
    false_alarm : float
        Probability with which a plain tire is said to lack something.
    progress : callable, optional

    Raises
    ------
    ConvergenceError
        If the brush cannot be fitted to the points.
    """
    given = ForceProblem(
        problem.bench,
        problem.quantity,
        values,
        catalogue,
        noise=noise,
        effects=effects,
        strengths=strengths,
    )
    families = plain_tires(problem.quantity)
    verdict = select(given, families, false_alarm=false_alarm, many=True, progress=progress)
    base = fit_force(problem, values, effects, strengths)
    folds = force_folds(problem)
    if progress is not None:
        progress("held-out points")
    held_before = errors_of(problem, base, folds)
    every = dict.fromkeys(name for names in verdict.sets for name in names)
    by_name = verdict.hypotheses.effects
    alone = _alone(problem, base, [by_name[name] for name in every], folds)
    named, final, steps = list(every), base, _Steps(())
    if verdict.sets:
        final, order, steps = _in_steps(problem, base, verdict, alone, folds)
        if verdict.kind != "indistinguishable":
            named = order
    return ForceDiagnosis(
        problem,
        verdict,
        tuple(named),
        _ordered(
            findings_of(verdict, given, problem.measured - base.predicted, lambda rows: rows), named
        ),
        given.dead,
        base,
        final,
        folds,
        held_before,
        errors_of(problem, final, folds) if named else held_before,
        alone,
        steps if verdict.kind != "indistinguishable" else (),
    )


_Steps = tuple[tuple[str, float, float], ...]


def _ordered(findings: Sequence[Finding], named: Sequence[str]) -> tuple[Finding, ...]:
    """Return findings with the named ones first, in their order; what is not named is no alarm."""
    place = {name: k for k, name in enumerate(named)}
    findings = sorted(findings, key=lambda f: place.get(f.effect.name, len(place)))
    return tuple(
        replace(f, level="hint") if f.level == "alarm" and f.effect.name not in place else f
        for f in findings
    )


def _alone(
    problem: Problem, base: ForceFit, effects: Sequence[Effect], folds: Sequence[ForceFold]
) -> Alone:
    """Return the base with each of some effects alone; without those that cannot be fitted."""
    calls = [partial(_with_one, problem, base, effect, folds) for effect in effects]
    found = forked(calls, [*base.effects, *effects])
    pairs = zip(effects, found, strict=True)
    return {effect.name: each for effect, each in pairs if each is not None}


def _with_one(
    problem: Problem, base: ForceFit, effect: Effect, folds: Sequence[ForceFold]
) -> tuple[ForceFit, tuple[float, ...]] | None:
    try:
        best = with_effect(problem, base, effect)
    except TirelibError:
        return None
    return best, errors_of(problem, best, folds)


def _in_steps(
    problem: Problem,
    base: ForceFit,
    verdict: Verdict,
    alone: Alone,
    folds: Sequence[ForceFold],
) -> tuple[ForceFit, list[str], _Steps]:
    """Return the model with the best member's effects, their order, and the steps to it.

    The next one is that which gains most on held-out points alone, of those that gain something
    there beside the ones before; those that do not stand last. Where a law is not right, they go.
    """
    counted = [fold for fold in folds if fold.main]
    fit = verdict.best.fit
    start = dict(zip(fit.names, zip(fit.effects, fit.strengths, strict=True), strict=True))

    def joined(model: ForceFit, name: str) -> ForceFit:
        effect, strength = start[name]
        return fit_force(
            problem, model.values, [*model.effects, effect], [*model.strengths, strength]
        )

    def key(name: str) -> float:
        if name not in alone:
            return float("inf")
        one, errors = alone[name]
        error = pooled(errors, folds)
        return error if np.isfinite(error) else one.error

    model, steps = base, list[tuple[str, float, float]]()
    held = pooled(errors_of(problem, base, counted), counted)
    waiting = sorted(verdict.sets[0], key=key)
    while waiting:
        for name in waiting:
            trial = joined(model, name)
            error = pooled(errors_of(problem, trial, counted), counted)
            if not error >= held:
                break
        else:
            if verdict.kind == "form_inadequate" and steps:
                break
            name = waiting[0]
            trial = joined(model, name)
            error = pooled(errors_of(problem, trial, counted), counted)
        waiting.remove(name)
        model, held = trial, error
        steps.append((name, trial.error, error))
    return model, [name for name, _, _ in steps], tuple(steps)
