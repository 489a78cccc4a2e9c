"""What the documents of diagnoses hold, and which part strain and forces share."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.inference.diagnose.diagnose import Finding
from tirelib.inference.diagnose.held_out import Fold, fold_entry, pooled
from tirelib.inference.statistics.select import Verdict

FORMAT = "tirelib-diagnosis/1"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Assessed:
    """What the document of a diagnosis holds.

    Attributes
    ----------
    diagnosis : Diagnosis or ForceDiagnosis
    verdict : str
    named : tuple of str
        Empty without repeats.
    findings : tuple of Finding
        At most hints without repeats.
    floor : float
        Part of the error with the named effects that noise and what plain tires show explain.
    folds : tuple of Fold
        What is left out in turn.
    singles : mapping of name to fit
        The model with one named effect alone, where that can be fitted.
    messages : tuple of str
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

    @property
    def factor(self) -> float:
        """Factor from errors on what was held out to errors in the unit of the document."""
        return 1.0

    def held_out(self, fit: Any) -> tuple[float, ...]:
        """Return the errors of a model on each fold; none without folds, or a model."""
        if not self.folds or fit is None:
            return ()
        return tuple(self.factor * error for error in self.diagnosis.models.held_out(fit))

    def error_with(self, finding: Finding) -> float:
        """Return the error with one effect alone, to first order unless it is named."""
        raise NotImplementedError

    @property
    def shared(self) -> dict[str, Any]:
        """The keys that documents of strain and of forces share."""
        found, verdict = self.diagnosis, self.diagnosis.verdict
        before, after = self.held_out(found.base), self.held_out(self.final)
        return {
            "format": FORMAT,
            "axes": "iso",
            "floor": self.floor,
            "heldout_error_before": pooled(before, self.folds),
            "heldout_error_after": pooled(after, self.folds),
            "held_out": [fold_entry(*each) for each in zip(self.folds, before, after, strict=True)],
            "verdict": self.verdict,
            "named": list(self.named),
            "sets": [list(names) for names in verdict.sets] if self.named else [],
            **verdict_told(verdict),
            "has": [effect.name for effect in found.base.effects],
            "candidates": [
                candidate_told(
                    finding,
                    rank,
                    self.error_with(finding),
                    pooled(self.held_out(self.singles.get(finding.effect.name)), self.folds),
                )
                for rank, finding in enumerate(self.findings, start=1)
            ],
            "dead": list(found.dead),
            "dead_reasons": dict(found.dead),
            "messages": list(self.messages),
        }


def next_step(
    told: Any, words: Mapping[str, Callable[[], str]], lacking: Mapping[str, str]
) -> dict[str, Any]:
    """Return what to do or to measure next, and why.

    Parameters
    ----------
    told : Assessed
    words : mapping of verdict to callable
        What to do after the verdicts that strain and forces answer in their own words.
    lacking : mapping of name to reason
        Effects that other runs would show.
    """
    said = {
        "none": lambda: "none is needed for the effects that this plan can show",
        "named": lambda: (
            f"add {listed(told.named, 'nothing')} (`tirelib add {' '.join(told.named)}`) "
            "and diagnose again"
        ),
        **words,
    }
    between = list(told.named) if told.verdict == "indistinguishable" else []
    return {"what": said[told.verdict](), "between": between, "would_revive": dict(lacking)}


def listed(names: Sequence[str], none: str = "") -> str:
    """Return names as words of a sentence."""
    words = list(names) or [none]
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def verdict_told(found: Verdict) -> dict[str, Any]:
    """Return the statistic of a verdict, its limit, and the p-values behind it."""
    return {
        "false_alarm": found.alpha,
        "misfit": found.best.statistic,
        "misfit_floor": found.best.limit(found.alpha),
        "misfit_of": found.best.against,
        "p": found.best.p,
        "p_std": found.best.p_std,
        "p_without": found.base.p,
        "p_least": found.base.p_of(np.inf)[0],
    }


def candidate_told(
    finding: Finding, rank: int, error_after: float, held_out: float
) -> dict[str, Any]:
    """Return a candidate effect.

    Parameters
    ----------
    finding : Finding
    rank : int
        From one.
    error_after, held_out : float
        Errors with it alone, the second on held-out data; NaN if unknown.
    """
    return {
        "effect": finding.effect.name,
        "title": finding.effect.title,
        "rank": rank,
        "score": finding.score,
        "threshold": finding.threshold,
        "level": finding.level,
        "p": finding.p,
        "p_std": finding.p_std,
        "strength": strength_told(finding.strength),
        "std": strength_told(finding.std),
        "unit": finding.effect.unit,
        "range": [finding.effect.low, finding.effect.high],
        "in_range": finding.in_range,
        "error_after": error_after,
        "heldout_error_after": held_out,
        "share": finding.share,
        "twins": [
            {"effect": twin, "angle_deg": float(np.rad2deg(angle))} for twin, angle in finding.twins
        ],
        "power": finding.power,
    }


def strength_told(strength: FloatArray) -> float | list[float]:
    """Return a strength as a number, or as a list if it has several components."""
    numbers = [float(x) for x in strength]
    return numbers[0] if len(numbers) == 1 else numbers
