"""A diagnosis with what its reader needs: floor, held-out errors, messages, what is left.

Without repeats, or with a brush that does not fit at all, nothing is named.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tirelib.effects import Effect
from tirelib.inference.compare.error import NOISE, ModelError
from tirelib.inference.compare.model import TireModel
from tirelib.inference.diagnose.diagnose import FALSE_ALARM, Diagnosis, Finding
from tirelib.inference.diagnose.forces.case import ForceCase
from tirelib.inference.diagnose.forces.diagnose import ForceDiagnosis, diagnose_force
from tirelib.inference.diagnose.held_out import NO_POINTS, NO_RUNS, Fold
from tirelib.inference.diagnose.left import ForceLeft, Left, force_left, left_of, told_powers
from tirelib.inference.diagnose.strain_models import Fitted, floor_of
from tirelib.inference.problems.force_plan import varies

NO_FIT = 0.5
"""Share of the measured rms that a fitted brush may leave before it does not fit at all."""
IN_ORDER = 0.8
"""Correlation with the order of measurement from which a condition cannot be split from drift."""
NO_REPEATS = (
    "no runs were repeated at equal set points, so the noise is unknown: errors are in "
    "microstrain, no effect is named and none is more than a hint; repeat some runs"
)
NO_FORCE_REPEATS = (
    "no condition was repeated, so the noise is unknown: errors are in {unit}, no effect is named "
    "and none is more than a hint; repeat some runs, or pass a sweep's conditions twice"
)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Assessed:
    """What the document of a diagnosis holds.

    Attributes
    ----------
    named : tuple of str
        Empty without repeats.
    findings : tuple of Finding
        At most hints without repeats.
    floor : float
        Part of the error with the named effects that noise and what plain tires show explain.
    folds : tuple of Fold
        What is left out in turn; none of strain if nothing is named.
    singles : mapping of name to fit
        The model with one named effect alone, where that can be fitted.
    """

    diagnosis: Any
    verdict: str
    named: tuple[str, ...]
    findings: tuple[Finding, ...]
    floor: float
    folds: tuple[Fold, ...]
    singles: Mapping[str, Any]
    messages: tuple[str, ...]

    @property
    def final(self) -> Any:
        """The model with the named effects."""
        return self.diagnosis.final if self.named else self.diagnosis.base

    def held_out(self, fit: Any) -> tuple[float, ...]:
        """Return the errors of a model on each fold; none without folds, or a model."""
        if not self.folds or fit is None:
            return ()
        held: tuple[float, ...] = self.diagnosis.models.held_out(fit)
        return held

    def error_with(self, finding: Finding) -> float:
        """Return the error with one effect alone, to first order unless it is named."""
        raise NotImplementedError


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Assessment(Assessed):
    """What the document of a strain diagnosis holds.

    Attributes
    ----------
    given : TireModel
        The model that was diagnosed, as its file has it.
    before, refitted, after : ModelError
        Errors of the model as it is given, with the numbers of the least error, and with the named
        effects.
    left : Left
        What no effect explains.
    """

    diagnosis: Diagnosis
    given: TireModel
    before: ModelError
    refitted: ModelError
    after: ModelError
    left: Left

    def error_with(self, finding: Finding) -> float:
        """Return the error with one effect alone, to first order unless it is the one named."""
        if self.named == (finding.effect.name,):
            return self.after.value
        return self.refitted.value * float(np.sqrt(max(1.0 - finding.share, 0.0)))


def assess(found: Diagnosis, given: TireModel) -> Assessment:
    """Return a diagnosis of a model, as its file has it, with what its reader needs."""
    models = found.models
    verdict, named, findings, messages = found.verdict.kind, found.named, found.findings, []
    if models.yardstick.unit != NOISE:
        verdict, named = "none", ()
        findings = tuple(finding.at_most_hint for finding in findings)
        messages.append(NO_REPEATS)
    final = found.final if named else found.base
    chosen = models.folds if named else ()
    singles = models.singles(named)
    held = (found.base, *singles.values(), final) if chosen else ()
    before, refitted = models.least_error(found.base, given, held)
    after = final.reached if named else refitted
    if named and not chosen:
        messages.append(NO_RUNS)
    messages += [_too_large(f) for f in findings if f.effect.name in named and not f.in_range]
    return Assessment(
        diagnosis=found,
        verdict=verdict,
        named=named,
        findings=findings,
        floor=floor_of(after, found.verdict.best, found.verdict.alpha),
        folds=chosen,
        singles=singles,
        messages=tuple(messages),
        given=given,
        before=before,
        refitted=refitted,
        after=after,
        left=_left(found, final),
    )


def _too_large(finding: Finding) -> str:
    effect = finding.effect
    size = ", ".join(f"{x:.3g}" for x in finding.strength)
    return (
        f"{effect.name} explains it, but only at {size} {effect.unit}, and {effect.low:g} to "
        f"{effect.high:g} is plausible: it is larger than thought, or something of the same kind; "
        "measure it in another way before it is believed"
    )


def _left(found: Diagnosis, final: Fitted) -> Left:
    """Return what is left; how it grows by the guessed law, where there is one."""
    left = left_of(final.reached, found.problem.data.points, found.beyond)
    if found.guess is None:
        return left
    powers = {**left.powers, **found.guess.powers}
    return replace(left, powers=powers, scaling=told_powers(powers))


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ForceAssessment(Assessed):
    """What the document of the diagnosis of one force holds.

    Attributes
    ----------
    left : ForceLeft
        What no effect explains.
    """

    diagnosis: ForceDiagnosis
    case: ForceCase
    left: ForceLeft

    def error_with(self, finding: Finding) -> float:
        """Return the error with one effect alone, to first order unless it is named."""
        if finding.effect.name in self.singles:
            return float(self.singles[finding.effect.name].error)
        return self.diagnosis.base.error * float(np.sqrt(max(1.0 - finding.share, 0.0)))

    @property
    def before(self) -> float:
        """The error of the model as it is given."""
        return self.case.given

    @property
    def after(self) -> float:
        """The error with the named effects."""
        return float(self.final.error)


def assess_forces(
    case: ForceCase,
    catalogue: Sequence[Effect],
    *,
    false_alarm: float = FALSE_ALARM,
    progress: Callable[[str], None] | None = None,
) -> ForceAssessment:
    """Return the diagnosis of a force with what its reader needs; arguments of `diagnose_force`."""
    found = diagnose_force(case, catalogue, false_alarm=false_alarm, progress=progress)
    messages = list(case.messages)
    verdict, named, findings = found.verdict.kind, found.named, found.findings
    share = found.final.error / case.size
    if share > NO_FIT:
        verdict, named = "unknown", ()
        messages.append(
            f"the brush does not fit at all: {100 * share:.0f} % of {case.quantity} is left after "
            "a fit; no effect is named; look for a wrong unit, sign or tire with `tirelib compare`"
        )
    if not np.isfinite(case.noise):
        verdict, named = ("none" if share <= NO_FIT else verdict), ()
        messages.append(NO_FORCE_REPEATS.format(unit=case.unit))
    if not named:
        findings = tuple(finding.at_most_hint for finding in findings)
    if not findings:
        messages.append(
            "this campaign varies nothing with which an effect could show: see the dead effects"
        )
    if named and not any(fold.main for fold in found.models.folds):
        messages.append(NO_POINTS)
    if named:
        messages += _instead(found) if verdict == "form_inadequate" else []
        messages += _in_order(case, [f.effect for f in findings if f.effect.name in named])
    final = found.final if named else found.base
    return ForceAssessment(
        diagnosis=found,
        verdict=verdict,
        named=named,
        findings=findings,
        floor=found.models.floor(final),
        folds=found.models.folds,
        singles=found.alone,
        messages=tuple(messages),
        case=case,
        left=force_left(final),
    )


def _instead(found: ForceDiagnosis) -> list[str]:
    """Say which effects would serve as well in the place of named ones, and what is not needed."""
    best, out = found.verdict.sets[0], []
    for names in found.verdict.sets[1:]:
        (gone,), (new,) = (sorted(set(a) - set(b)) for a, b in ((best, names), (names, best)))
        if gone in found.named:
            out.append(f"{new} serves as well in the place of {gone}")
    if idle := [name for name in best if name not in found.named]:
        out.append(
            f"{' and '.join(idle)} would be needed as well, but no error on held-out points falls "
            "with it"
        )
    return out


def _in_order(case: ForceCase, effects: Sequence[Effect]) -> list[str]:
    """Say which conditions went with the order of measurement, if a named effect has to do with it.

    A condition counts if a named effect goes with it, or a named drift may stand for it.
    """
    at = case.bench.conditions
    names = {name for effect in effects for name in effect.varies_with}
    every = {"load", "pressure", "camber", "temperature", "speed"}
    out = []
    for name in sorted(every if "order" in names else names & every):
        if not varies(at, name):
            continue
        together = float(np.corrcoef(getattr(at, name), at.order)[0, 1])
        if abs(together) > IN_ORDER:
            out.append(
                f"{name} went with the order of measurement (correlation {together:.2f}): an "
                f"effect of {name} and a drift can hardly be distinguished; repeat the first "
                f"{name} at the end to know"
            )
    return out
