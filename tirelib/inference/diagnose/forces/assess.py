"""What the document of a force diagnosis holds, from a campaign and a model file."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tirelib.campaign import Campaign
from tirelib.core.errors import CalibrationError
from tirelib.core.parameters import TireFile
from tirelib.effects import Effect
from tirelib.inference.compare.force_model import (
    ForceModel,
    force_model_of,
    quantities_of,
    slips,
    usable_points,
)
from tirelib.inference.compare.forces import UNITS
from tirelib.inference.diagnose.diagnose import FALSE_ALARM, Finding
from tirelib.inference.diagnose.forces.diagnose import ForceDiagnosis, diagnose_force
from tirelib.inference.diagnose.forces.fit import ForceFit, MeasuredForce
from tirelib.inference.diagnose.forces.left import ForceLeft, left_of
from tirelib.inference.diagnose.told import Assessed
from tirelib.inference.identify.force_bench import Changes
from tirelib.inference.identify.force_data import force_data
from tirelib.inference.identify.force_noise import force_noise
from tirelib.inference.identify.force_notes import noise_note, taken_as_zero
from tirelib.inference.identify.force_points import ForcePoints, force_points
from tirelib.inference.problems.force_plan import varies
from tirelib.inference.problems.forces import ForceProblem

MOST_POINTS = 4000
"""Points that are fitted; of a longer sweep passes are left out evenly."""
LEAST_POINTS = 12
NO_FIT = 0.5
"""Share of the measured rms that a fitted brush may leave before it does not fit at all."""
IN_ORDER = 0.8
"""Correlation with the order of measurement from which a condition cannot be split from drift."""
NO_REPEATS = (
    "no condition was repeated, so the noise is unknown: errors are in {unit}, no effect is named "
    "and none is more than a hint; repeat some runs, or pass a sweep's conditions twice"
)


@dataclass(frozen=True, slots=True, eq=False)
class ForceCase:
    """One force of a campaign, ready to be fitted.

    Attributes
    ----------
    name : str
        Name of the campaign.
    model : ForceModel
    problem : MeasuredForce
        At the points that are fitted.
    whole : MeasuredForce
        At all points, for which errors are reported.
    noise : float, [N] or [N m]
        Standard deviation of a point; NaN without repeats.
    repeats : int
    messages : tuple of str
    """

    name: str
    model: ForceModel
    problem: MeasuredForce
    whole: MeasuredForce
    noise: float
    repeats: int
    messages: tuple[str, ...]

    @property
    def quantity(self) -> str:
        """Fy, Fx or Mz."""
        return self.problem.quantity

    @property
    def unit(self) -> str:
        """Unit of errors: noise, N or Nm."""
        return "noise" if np.isfinite(self.noise) else UNITS[self.quantity]

    @property
    def factor(self) -> float:
        """Factor from an rms in SI to an error in the unit of the document."""
        return 1.0 / self.noise if np.isfinite(self.noise) else 1.0

    def rms(self, values: Mapping[str, float], changes: Changes) -> float:
        """Return the rms of measured less predicted over all points, SI."""
        rest = self.whole.measured - self.whole.predict(values, changes)
        return float(np.sqrt(np.mean(rest**2)))

    def error(self, fit: ForceFit) -> float:
        """Return the error of a fitted brush in the unit of the document."""
        return self.factor * self.rms(fit.values, fit.changes)

    def told(self, part: float, fit: ForceFit) -> float:
        """Return a part of a fitted brush's rms, SI, as a part of its error."""
        return self.error(fit) * part / fit.error

    @property
    def given(self) -> float:
        """The error of the model as its file has it."""
        return self.factor * self.rms(self.model.values, self.model.changes)

    @property
    def effects(self) -> list[Effect]:
        """Effects that the model has."""
        return [used.effect for used in self.model.used]

    @property
    def strengths(self) -> list[np.ndarray]:
        """Their strengths, arrays of components."""
        return [used.components for used in self.model.used]

    def as_given(self, catalogue: Sequence[Effect]) -> ForceProblem:
        """Return the force as the inference sees it, about the model as its file has it."""
        return ForceProblem(
            self.problem.bench,
            self.quantity,
            self.model.values,
            catalogue,
            noise=self.noise,
            effects=self.effects,
            strengths=self.strengths,
        )


def force_case(
    campaign: Campaign, file: TireFile, effects: Mapping[str, Effect], quantity: str | None
) -> ForceCase:
    """Return the force of a campaign that is asked for, else the one with the largest lack of fit.

    Parameters and errors as for `force_cases`.
    """
    return max(force_cases(campaign, file, effects, quantity), key=_lack)


def force_cases(
    campaign: Campaign, file: TireFile, effects: Mapping[str, Effect], quantity: str | None = None
) -> list[ForceCase]:
    """Return the force that is asked for, else every force to which the slips matter.

    Raises
    ------
    CalibrationError
        If the model has no brush, the force is not measured, or there are too few points.
    """
    model = force_model_of(file, effects)
    points = force_points(force_data(campaign))
    wanted = quantities_of(campaign, points, quantity)
    points = usable_points(campaign, model, points)
    notes = taken_as_zero(campaign)
    return [_case(campaign.header.name, model, points, name, notes) for name in wanted]


def _case(
    name: str, model: ForceModel, points: ForcePoints, quantity: str, notes: Sequence[str]
) -> ForceCase:
    points = points.take(np.isfinite(getattr(points.data, quantity)))
    if len(points) < LEAST_POINTS:
        raise CalibrationError(
            f"{name}: {quantity} is measured at {len(points)} points; {LEAST_POINTS} are needed to "
            "tell effects apart; add runs with other loads, pressures and slips"
        )
    if not slips(points.data, quantity):
        slip = "slip ratio" if quantity == "Fx" else "slip angle"
        raise CalibrationError(
            f"{name}: one {slip} only, so {quantity} says nothing about the brush; "
            "add runs with slip"
        )
    messages = list(notes)
    whole = points
    if len(points) > MOST_POINTS:
        step = int(np.ceil(len(points) / MOST_POINTS))
        points = points.take(np.arange(0, len(points), step))
        messages.append(
            f"{len(whole)} points, passes of the sweep; one in {step} is fitted ({len(points)})"
        )
    measured = getattr(whole.data, quantity)
    noise, _, repeats = force_noise(whole, measured)
    messages += noise_note(quantity, noise, float(np.sqrt(np.mean(measured**2))))
    problem = MeasuredForce.of(model.bench(points), quantity, noise)
    every = MeasuredForce.of(model.bench(whole), quantity, noise)
    return ForceCase(name, model, problem, every, noise, repeats, tuple(messages))


def _lack(case: ForceCase) -> float:
    if np.isfinite(case.noise):
        return case.given
    return case.given / float(np.sqrt(np.mean(case.whole.measured**2)))


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ForceAssessment(Assessed):
    """What the document of the diagnosis of one force holds.

    Attributes
    ----------
    case : ForceCase
    left : ForceLeft
        What no effect explains.
    """

    diagnosis: ForceDiagnosis
    case: ForceCase
    left: ForceLeft

    @property
    def factor(self) -> float:
        """Factor from an rms in SI to an error in the unit of the document."""
        return self.case.factor

    def error_with(self, finding: Finding) -> float:
        """Return the error with one effect alone, to first order unless it is named."""
        return self.factor * self.diagnosis.error_with(finding)

    @property
    def before(self) -> float:
        """The error of the model as it is given."""
        return self.case.given

    @property
    def after(self) -> float:
        """The error with the named effects."""
        return self.case.error(self.final)


def assess_forces(
    case: ForceCase,
    catalogue: Sequence[Effect],
    *,
    false_alarm: float = FALSE_ALARM,
    progress: Callable[[str], None] | None = None,
) -> ForceAssessment:
    """Return the diagnosis of a force with what its reader needs.

    Parameters
    ----------
    case : ForceCase
    catalogue : sequence of Effect
    false_alarm : float
        Probability with which a plain tire is said to lack something.
    progress : callable, optional
    """
    found = diagnose_force(
        case.problem,
        case.model.values,
        catalogue,
        noise=case.noise,
        effects=case.effects,
        strengths=case.strengths,
        false_alarm=false_alarm,
        progress=progress,
    )
    messages = list(case.messages)
    verdict, named, findings = found.verdict.kind, found.named, found.findings
    share = found.final.error / float(np.sqrt(np.mean(case.problem.measured**2)))
    if share > NO_FIT:
        verdict, named = "unknown", ()
        messages.append(
            f"the brush does not fit at all: {100 * share:.0f} % of {case.quantity} is left after "
            "a fit; no effect is named; look for a wrong unit, sign or tire with `tirelib compare`"
        )
    if not np.isfinite(case.noise):
        verdict, named = ("none" if share <= NO_FIT else verdict), ()
        messages.append(NO_REPEATS.format(unit=case.unit))
    if not named:
        findings = tuple(replace(f, level="hint") if f.level == "alarm" else f for f in findings)
    if not findings:
        messages.append(
            "this campaign varies nothing with which an effect could show: see the dead effects"
        )
    if named and not any(fold.main for fold in found.models.folds):
        messages.append("nothing can be held out: too few conditions vary")
    if named:
        messages += _instead(found) if verdict == "form_inadequate" else []
        messages += _in_order(case, [f.effect for f in findings if f.effect.name in named])
    final = found.final if named else found.base
    return ForceAssessment(
        diagnosis=found,
        verdict=verdict,
        named=named,
        findings=findings,
        floor=case.told(found.models.floor(final), final),
        folds=found.models.folds,
        singles=found.alone,
        messages=tuple(messages),
        case=case,
        left=left_of(case.problem, final),
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
    at = case.problem.bench.conditions
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
