"""A diagnosis of strain or of a force as JSON (``tirelib-diagnosis/1``)."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from tirelib.core.arrays import rms
from tirelib.core.quantities import QUANTITIES
from tirelib.inference.compare.error import named_errors
from tirelib.inference.diagnose.assess import Assessed, Assessment, ForceAssessment
from tirelib.inference.diagnose.guess import Guess
from tirelib.inference.diagnose.held_out import pooled

FORMAT = "tirelib-diagnosis/1"


def diagnosis_document(told: Assessment | ForceAssessment) -> dict[str, Any]:
    """Return the numbers of a diagnosis.

    Strains are in microstrain, angles in deg; errors in the noise of a run or of a point, without
    repeats in microstrain, N or Nm.
    """
    return _shared(told) | (_strain(told) if isinstance(told, Assessment) else _force(told))


def _shared(told: Assessed) -> dict[str, Any]:
    """Return the keys that documents of strain and of forces share."""
    found, verdict = told.diagnosis, told.diagnosis.verdict
    before, after = told.held_out(found.base), told.held_out(told.final)
    folds = told.folds
    return {
        "format": FORMAT,
        "axes": "iso",
        "floor": told.floor,
        "heldout_error_before": pooled(before, folds),
        "heldout_error_after": pooled(after, folds),
        "held_out": [f.entry(old, new) for f, old, new in zip(folds, before, after, strict=True)],
        "verdict": told.verdict,
        "named": list(told.named),
        "sets": [list(names) for names in verdict.sets] if told.named else [],
        "false_alarm": verdict.alpha,
        "misfit": verdict.best.statistic,
        "misfit_floor": verdict.best.limit(verdict.alpha),
        "misfit_of": verdict.best.against,
        "p": verdict.best.p,
        "p_std": verdict.best.p_std,
        "p_without": verdict.base.p,
        "p_least": verdict.base.p_of(np.inf)[0],
        "has": [effect.name for effect in found.base.effects],
        "candidates": [
            finding.entry(
                rank,
                told.error_with(finding),
                pooled(told.held_out(told.singles.get(finding.effect.name)), folds),
            )
            for rank, finding in enumerate(told.findings, start=1)
        ],
        "dead": list(found.dead),
        "dead_reasons": dict(found.dead),
        "messages": list(told.messages),
    }


def _strain(told: Assessment) -> dict[str, Any]:
    return {
        "campaign": told.diagnosis.runs.waves.header.name,
        "quantity": "strain",
        "unit": "ustrain",
        **named_errors(told.before, told.after),
        "error_refitted": told.refitted.value,
        "repeats": told.diagnosis.runs.noise.repeats,
        "delay_us": 1e6 * told.after.delay,
        "unexplained": _strain_left(told),
        "next_test": next_test(told),
    }


def _force(told: ForceAssessment) -> dict[str, Any]:
    found, case = told.diagnosis, told.case
    return {
        "campaign": case.name,
        "quantity": case.quantity,
        "unit": QUANTITIES[case.quantity].unit,
        "repeats": case.repeats,
        "points": len(case.bench.points),
        **case.named_errors(told.before, told.after),
        "error_refitted": found.base.error,
        "steps": [
            {
                "effect": name,
                "error": fit.error,
                "heldout_error": pooled(told.held_out(fit), told.folds),
            }
            for name, fit in (found.steps if told.named else ())
        ],
        "unexplained": _force_left(told),
        "next_test": force_next_test(told),
    }


def _force_left(told: ForceAssessment) -> dict[str, Any]:
    left, beyond = told.left, told.verdict in ("unknown", "form_inadequate")
    return {
        "where": left.where if beyond else None,
        "scaling": left.scaling if beyond else None,
        "guess": left.guess if beyond else None,
        "bands": dict(left.bands),
        "powers": {
            name: {"power": p.value, "half_width": p.half} for name, p in left.powers.items()
        },
    }


def _strain_left(told: Assessment) -> dict[str, Any]:
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
    runs, model = told.diagnosis.runs, told.after.prediction.strain
    return [
        {
            "lateral_mm": 1e3 * runs.waves.header.gage_lateral[gage],
            "rms_ustrain": 1e6 * rms(model - runs.waves.strain[:, gage]),
        }
        for gage in runs.gages
    ]


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
        "where and how it grows is often right, the reason is not part of it",
    }


def listed(names: Sequence[str], none: str = "") -> str:
    """Return names as words of a sentence."""
    words = list(names) or [none]
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def _next_step(
    told: Any, words: Mapping[str, Callable[[], str]], revived_by: Sequence[str]
) -> dict[str, Any]:
    """Return what to do or to measure next, and why.

    `words` say it after the verdicts that strain and forces answer in their own words; reasons of
    dead effects with one of the last words are such that other runs would show them.
    """
    said = {
        "none": lambda: "none is needed for the effects that this plan can show",
        "named": lambda: f"add {_add(told)} and diagnose again",
        **words,
    }
    dead = told.diagnosis.dead.items()
    return {
        "what": said[told.verdict](),
        "between": list(told.named) if told.verdict == "indistinguishable" else [],
        "would_revive": {name: why for name, why in dead if any(w in why for w in revived_by)},
    }


def _add(told: Any) -> str:
    return f"{listed(told.named, 'nothing')} (`tirelib add {' '.join(told.named)}`)"


def _varied(told: Any) -> list[set[str]]:
    """Return with which conditions each named effect varies."""
    by_name = {finding.effect.name: finding.effect for finding in told.findings}
    return [set(by_name[name].varies_with) for name in told.named]


def next_test(told: Assessment) -> dict[str, Any]:
    """Return what to do or to measure next on strain, and why."""
    varies, named = _varied(told), told.named
    every = {name for names in varies for name in names}
    common = {name for name in every if all(name in names for names in varies)}

    def conditions(names: Sequence[str]) -> str:
        return listed(names, "load, pressure and speed")

    def parting() -> str:
        differ = sorted(every - common) or sorted(every)
        return f"more levels of {conditions(differ)}, to the ends that the rig allows: there " + (
            f"{conditions(named)} part" if len(named) > 1 else "it shows"
        )

    words = {
        "indistinguishable": parting,
        "form_inadequate": lambda: (
            f"{conditions(named)} is needed but its law does not fit: more levels of "
            f"{conditions(sorted(every))} would show the right law"
        ),
        "unknown": lambda: (
            f"the misfit stands {told.left.where}; it {told.left.scaling}: more levels there, or "
            "an effect of your own (--effects)"
        ),
    }
    if not told.after.known:
        words["none"] = lambda: (
            "repeat some runs at equal set points, best at the ends of load, pressure and speed"
        )
    return _next_step(told, words, ["no run has"])


def force_next_test(told: ForceAssessment) -> dict[str, Any]:
    """Return what to do or to measure next on a force, and why."""
    varied = {name for names in _varied(told) for name in names}

    def conditions(names: set[str]) -> str:
        words = [name.replace("_", " ") for name in sorted(names)]
        return listed(words, "load, pressure and slip")

    def parting() -> str:
        apart = varied - {"order"}
        if apart == varied:
            return f"more levels of {conditions(apart)}, to the ends that the rig allows"
        # every run has its slips again
        apart = {name for name in apart if not name.startswith("slip")}
        return (
            f"repeat the first {conditions(apart)} at the end, at the highest load and slip: a "
            "drift has gone on, an effect of the condition is back where it was"
        )

    words = {
        "indistinguishable": parting,
        "form_inadequate": lambda: (
            f"add {_add(told)}; more is left than plain tires leave: more levels of "
            f"{conditions(varied)} would show the right law"
        ),
        "unknown": lambda: (
            f"the misfit stands {told.left.where} and {told.left.scaling}: more levels there, or "
            "an effect of your own (--effects)"
        ),
    }
    if told.case.unit != "noise":
        words["none"] = lambda: (
            "repeat some conditions, best at the ends of load, pressure and slip"
        )
    return _next_step(told, words, ["no run", "not measured"])
