"""Which effects a brush lacks, by the inference of the library (`tirelib.inference.statistics`)."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tirelib.core.threads import one_thread
from tirelib.effects import Effect
from tirelib.inference.diagnose.diagnose import FALSE_ALARM, Finding, findings_of
from tirelib.inference.diagnose.forces.case import ForceCase
from tirelib.inference.diagnose.forces.models import ForceFit, ForceModels, plain_tires
from tirelib.inference.diagnose.held_out import pooled
from tirelib.inference.statistics.select import Verdict, select

Steps = tuple[tuple[str, ForceFit], ...]
"""Effects one after the other, each with the fit that has it and those before."""


@dataclass(frozen=True, slots=True, eq=False)
class ForceDiagnosis:
    """What a campaign says of a brush.

    Attributes
    ----------
    models : ForceModels
        Everything that was fitted.
    named : tuple of str
        Effects of the smallest members of the confidence set: of one member in the order of what
        each alone gains on held-out points, best first; one whose gain those before it have brought
        already stands behind. Where a law is not right, without effects that lower no error on
        held-out points.
    findings : tuple of Finding
        By rank.
    base, final : ForceFit
        Without and with the named effects, the best member's; of least error.
    alone : mapping
        The base with each of the named effects alone.
    steps : tuple of (name, ForceFit)
        The named effects one after the other.
    """

    models: ForceModels
    verdict: Verdict
    named: tuple[str, ...]
    findings: tuple[Finding, ...]
    base: ForceFit
    final: ForceFit
    alone: Mapping[str, ForceFit]
    steps: Steps

    @property
    def dead(self) -> Mapping[str, str]:
        """Effects that the points cannot show, with the reason."""
        return self.models.problem.dead


@one_thread()
def diagnose_force(
    case: ForceCase,
    catalogue: Sequence[Effect],
    *,
    false_alarm: float = FALSE_ALARM,
    progress: Callable[[str], None] | None = None,
) -> ForceDiagnosis:
    """Tell which effects of a catalogue a brush lacks; those of stage brush are tried.

    `false_alarm` is the probability with which a plain tire is said to lack something.

    Raises
    ------
    ConvergenceError
        If the brush cannot be fitted to the points.
    """
    given, families = case.as_given(catalogue), plain_tires(case.quantity)
    verdict = select(given, families, false_alarm=false_alarm, many=True, progress=progress)
    models = ForceModels(case, verdict.hypotheses, progress)
    base, every = models.at(), dict.fromkeys(name for names in verdict.sets for name in names)
    alone = models.singles(every)
    models.find([base, *alone.values()])
    steps = _in_steps(models, verdict, alone) if verdict.sets else ()
    final = steps[-1][1] if steps else base
    if verdict.kind == "indistinguishable":
        named, steps = tuple(every), ()
    else:
        named = tuple(name for name, _ in steps)
    found = _ordered(findings_of(verdict, given, base.rest, lambda rows: rows), named)
    return ForceDiagnosis(models, verdict, named, found, base, final, alone, steps)


def _ordered(findings: Sequence[Finding], named: Sequence[str]) -> tuple[Finding, ...]:
    """Return findings with the named ones first, in their order; what is not named is no alarm."""
    place = {name: k for k, name in enumerate(named)}
    findings = sorted(findings, key=lambda f: place.get(f.effect.name, len(place)))
    return tuple(f if f.effect.name in place else f.at_most_hint for f in findings)


def _in_steps(models: ForceModels, verdict: Verdict, alone: Mapping[str, ForceFit]) -> Steps:
    """Return the best member's effects in their order, with the models on the way.

    The next one is that which gains most on held-out points alone, of those that gain something
    there beside the ones before; those that do not stand last. Where a law is not right, they go.
    """

    def held_out(fit: ForceFit) -> float:
        return pooled(models.held_out(fit), models.folds)

    def key(name: str) -> float:
        if name not in alone:
            return float("inf")
        error = held_out(alone[name])
        return error if np.isfinite(error) else alone[name].error

    model, steps = models.at(), list[tuple[str, ForceFit]]()
    effects = verdict.hypotheses.effects
    waiting = sorted(verdict.sets[0], key=key)
    while waiting:
        trials = ((name, models.with_effect(model, effects[name])) for name in waiting)
        held = held_out(model)
        best = next((trial for trial in trials if not held_out(trial[1]) >= held), None)
        if best is None:
            if verdict.kind == "form_inadequate" and steps:
                break
            best = waiting[0], models.with_effect(model, effects[waiting[0]])
        waiting.remove(best[0])
        model = best[1]
        steps.append(best)
    return tuple(steps)
