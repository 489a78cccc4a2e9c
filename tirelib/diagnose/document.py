"""A diagnosis with what its reader needs: floor, held-out errors, what is left; as JSON."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tirelib.compare.error import ModelError, named_errors
from tirelib.compare.model import Model
from tirelib.diagnose.diagnose import Diagnosis, Finding
from tirelib.diagnose.fitted import Fitted
from tirelib.diagnose.floor import floor_of
from tirelib.diagnose.guess import Guess
from tirelib.diagnose.held_out import Fold, fold_entry, pooled
from tirelib.diagnose.left import Left, left_of, told_powers
from tirelib.diagnose.told import candidate_told, verdict_told
from tirelib.errors import TirelibError

FORMAT = "tirelib-diagnosis/1"
NO_REPEATS = (
    "no runs were repeated at equal set points, so the noise is unknown: errors are in "
    "microstrain, no effect is named and none is more than a hint; repeat some runs"
)


@dataclass(frozen=True, slots=True)
class Assessment:
    """A diagnosis as it is told.

    Attributes
    ----------
    given : Model
        The model that was diagnosed, as its file has it.
    diagnosis : Diagnosis
    verdict : str
    named : tuple of str
        Empty without repeats.
    findings : tuple of Finding
        At most hints without repeats.
    before, refitted, after : ModelError
        Of the model as it is given, with the numbers of the least error, and with the named
        effects.
    floor : float
        Part of `after` that noise and what plain tires show explain.
    folds : tuple of Fold
        Empty if nothing is named.
    singles : mapping of name to Fitted
        The model with one named effect alone, where that can be fitted.
    left : Left
        What no effect explains.
    messages : tuple of str
    """

    given: Model
    diagnosis: Diagnosis
    verdict: str
    named: tuple[str, ...]
    findings: tuple[Finding, ...]
    before: ModelError
    refitted: ModelError
    after: ModelError
    floor: float
    folds: tuple[Fold, ...]
    singles: Mapping[str, Fitted]
    left: Left
    messages: tuple[str, ...]

    @property
    def final(self) -> Fitted:
        """The model with the named effects."""
        return self.diagnosis.final if self.named else self.diagnosis.base

    def held_out(self, fit: Fitted | None) -> tuple[float, ...]:
        """Return the errors of a model on each fold's runs; none without folds, or a model."""
        return self.diagnosis.models.held_out(fit) if self.folds and fit is not None else ()

    def error_with(self, finding: Finding) -> float:
        """Return the error with one effect alone, to first order unless it is the one named."""
        if self.named == (finding.effect.name,):
            return self.after.value
        return self.refitted.value * float(np.sqrt(max(1.0 - finding.share, 0.0)))


def assess(found: Diagnosis, given: Model) -> Assessment:
    """Return a diagnosis with floor, held-out errors and what is left.

    Parameters
    ----------
    found : Diagnosis
    given : Model
        The model that was diagnosed, as its file has it.
    """
    models = found.models
    verdict, named, findings, messages = found.verdict.kind, found.named, found.findings, []
    before, refitted = models.least_error(found.base, given)
    if not refitted.known:
        verdict, named = "none", ()
        findings = tuple(_hint(finding) for finding in findings)
        messages.append(NO_REPEATS)
    final = found.final if named else found.base
    after = final.reached if named else refitted
    floor = floor_of(after, found.verdict.best, found.verdict.alpha)
    chosen = models.folds if named else ()
    singles = {name: one for name in named if (one := _with_one(found, name)) is not None}
    if chosen:
        models.left_out(found.base, *singles.values(), final)
    if named and not chosen:
        messages.append(
            "nothing can be held out: three loads or two pressures, and four other runs, are needed"
        )
    messages += [
        _too_large(finding)
        for finding in findings
        if finding.effect.name in named and not finding.in_range
    ]
    return Assessment(
        given,
        found,
        verdict,
        named,
        findings,
        before,
        refitted,
        after,
        floor,
        chosen,
        singles,
        _left(found, final),
        tuple(messages),
    )


def _too_large(finding: Finding) -> str:
    effect = finding.effect
    size = ", ".join(f"{x:.3g}" for x in finding.strength)
    return (
        f"{effect.name} explains it, but only at {size} {effect.unit}, and {effect.low:g} to "
        f"{effect.high:g} is plausible: it is larger than thought, or something of the same kind; "
        "measure it in another way before it is believed"
    )


def _hint(finding: Finding) -> Finding:
    return replace(finding, level="hint") if finding.level == "alarm" else finding


def _with_one(found: Diagnosis, name: str) -> Fitted | None:
    """Return the base model with one effect fitted, or None if that fails."""
    try:
        return found.models.at((name,))
    except TirelibError:
        return None


def diagnosis_document(told: Assessment) -> dict[str, Any]:
    """Return the numbers as ``tirelib-diagnosis/1``; strains in microstrain, angles in deg."""
    found = told.diagnosis
    held_before, held_final = told.held_out(found.base), told.held_out(told.final)
    return {
        "format": FORMAT,
        "campaign": found.runs.waves.header.name,
        "axes": "iso",
        "quantity": "strain",
        "unit": "ustrain",
        **named_errors(told.before, told.after),
        "error_refitted": told.refitted.value,
        "repeats": found.runs.noise.repeats,
        "floor": told.floor,
        "heldout_error_before": pooled(held_before, told.folds),
        "heldout_error_after": pooled(held_final, told.folds),
        "held_out": [
            fold_entry(fold, before, after)
            for fold, before, after in zip(told.folds, held_before, held_final, strict=True)
        ],
        "delay_us": 1e6 * told.after.delay,
        "verdict": told.verdict,
        "named": list(told.named),
        "sets": [list(names) for names in found.verdict.sets] if told.named else [],
        **verdict_told(found.verdict),
        "has": [effect.name for effect in found.base.effects],
        "candidates": [
            candidate_told(
                finding,
                rank,
                told.error_with(finding),
                pooled(told.held_out(told.singles.get(finding.effect.name)), told.folds),
            )
            for rank, finding in enumerate(told.findings, start=1)
        ],
        "dead": list(found.dead),
        "dead_reasons": dict(found.dead),
        "unexplained": _unexplained(told),
        "next_test": next_test(told),
        "messages": list(told.messages),
    }


def _left(found: Diagnosis, final: Fitted) -> Left:
    """Return what is left; how it grows by the guessed law, where there is one."""
    points = found.problem.data.points
    if found.beyond is None:
        return left_of(final.reached, points)
    left = left_of(final.reached, points, found.beyond)
    if found.guess is None:
        return left
    powers = {**left.powers, **found.guess.powers}
    return replace(left, powers=powers, scaling=told_powers(powers))


def _unexplained(told: Assessment) -> dict[str, Any]:
    left, guess = told.left, told.diagnosis.guess
    if not told.diagnosis.exceeds:
        return {"where": None, "scaling": None, "guess": None}
    start, stop = np.rad2deg(left.span)
    return {
        "where": {
            "text": left.where,
            "from_deg": float(start),
            "to_deg": float(stop),
            "sectors": dict(left.sectors),
            "gages": _gages(told),
        },
        "scaling": {
            "text": left.scaling,
            **{
                name: None
                if power is None
                else {"exponent": power.value, "low": power.low, "high": power.high}
                for name, power in left.powers.items()
            },
        },
        "guess": None if guess is None else _guess(guess),
    }


def _gages(told: Assessment) -> list[dict[str, float]]:
    """Return the rms residual of each gage in use, in microstrain."""
    found = told.diagnosis
    waves = found.runs.waves
    out = []
    for gage in found.runs.gages:
        rest = told.after.prediction.strain - waves.strain[:, gage]
        out.append(
            {
                "lateral_mm": 1e3 * waves.header.gage_lateral[gage],
                "rms_ustrain": 1e6 * float(np.sqrt(np.mean(rest**2))),
            }
        )
    return out


def _guess(guess: Guess) -> dict[str, Any]:
    return {
        "law": guess.law,
        "explained_held_out": guess.explained,
        "terms": [
            {
                "shape": term.shape,
                "powers": dict(term.powers),
                "coefficient": 1e6 * term.coefficient,
                "std": 1e6 * term.std,
                "unit": "ustrain",
            }
            for term in guess.terms
        ],
        "note": "measured less model; a guess by sparse regression, kept on left-out conditions: "
        "where and how it grows is often right, why is not told",
    }


def next_test(told: Assessment) -> dict[str, Any]:
    """Return what to do or to measure next, and why."""
    by_name = {finding.effect.name: finding.effect for finding in told.findings}
    dead = told.diagnosis.dead
    lacking = {name: reason for name, reason in dead.items() if reason.startswith("no run has")}
    varies = [set(by_name[name].varies_with) for name in told.named]
    every = {name for names in varies for name in names}
    common = {name for name in every if all(name in names for names in varies)}
    between: list[str] = []
    if told.verdict == "indistinguishable":
        between = list(told.named)
        differ = sorted(every - common) or sorted(every)
        what = f"more levels of {_and(differ)}, to the ends that the rig allows: there " + (
            f"{_and(between)} part" if len(between) > 1 else "it shows"
        )
    elif told.verdict == "form_inadequate":
        what = (
            f"{_and(told.named)} is needed but its law does not fit: more levels of "
            f"{_and(sorted(every))} would show the right law"
        )
    elif told.verdict == "named":
        what = f"add {told.named[0]} (`tirelib add {told.named[0]}`) and diagnose again"
    elif told.verdict == "unknown":
        what = (
            f"the misfit stands {told.left.where}; it {told.left.scaling}: more levels there, or "
            "an effect of your own (--effects)"
        )
    elif not told.after.known:
        what = "repeat some runs at equal set points, best at the ends of load, pressure and speed"
    else:
        what = "none is needed for the effects that this plan can show"
    return {"what": what, "between": between, "would_revive": lacking}


def _and(names: Sequence[str]) -> str:
    words = list(names) or ["load, pressure and speed"]
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"
