"""A diagnosis of forces as JSON (``tirelib-diagnosis/1``)."""

from collections.abc import Sequence
from typing import Any

from tirelib.compare.forces import UNITS
from tirelib.diagnose.forces.assess import ForceAssessment
from tirelib.diagnose.forces.held_out import ForceFold, pooled
from tirelib.diagnose.told import candidate_told, verdict_told
from tirelib.quantities import QUANTITIES

FORMAT = "tirelib-diagnosis/1"


def force_diagnosis_document(told: ForceAssessment) -> dict[str, Any]:
    """Return the numbers; errors are in the noise of a point, in N or Nm without repeats."""
    found, case = told.diagnosis, told.case
    factor = case.factor
    folds = found.models.folds
    held_before, held_final = (found.models.held_out(fit) for fit in (found.base, told.final))
    return {
        "format": FORMAT,
        "campaign": case.name,
        "axes": "iso",
        "quantity": case.quantity,
        "unit": UNITS[case.quantity],
        "noise": case.noise,
        "repeats": case.repeats,
        "points": len(case.problem),
        "error_unit": case.unit,
        "floor": told.floor,
        "error_before": told.before,
        "error_refitted": case.error(found.base),
        "error_after": told.after,
        "residual_rms_before": told.before / factor,
        "residual_rms_after": told.after / factor,
        "residual_rms_unit": UNITS[case.quantity],
        "heldout_error_before": factor * pooled(held_before, folds),
        "heldout_error_after": factor * pooled(held_final, folds),
        "held_out": [
            fold_entry(fold, factor * old, factor * new)
            for fold, old, new in zip(folds, held_before, held_final, strict=True)
        ],
        "steps": [
            {
                "effect": name,
                "error": factor * fit.error,
                "heldout_error": factor * found.held_out(fit),
            }
            for name, fit in (found.steps if told.named else ())
        ],
        "verdict": told.verdict,
        "named": list(told.named),
        "sets": [list(names) for names in told.sets],
        **verdict_told(found.verdict),
        "has": [effect.name for effect in found.base.effects],
        "candidates": [
            candidate_told(
                finding, rank, factor * found.error_with(finding), factor * found.held_with(finding)
            )
            for rank, finding in enumerate(told.findings, start=1)
        ],
        "dead": list(found.dead),
        "dead_reasons": dict(found.dead),
        "unexplained": _unexplained(told),
        "next_test": next_test(told),
        "messages": list(told.messages),
    }


def fold_entry(fold: ForceFold, before: float, after: float) -> dict[str, Any]:
    """Return a left-out part with its errors as they are told."""
    value, unit = fold_value(fold)
    return {
        "condition": fold.name,
        "value": value,
        "unit": unit,
        "points": int(fold.out.sum()),
        "counted": fold.main,
        "error_before": before,
        "error_after": after,
    }


def fold_value(fold: ForceFold) -> tuple[float, str]:
    """Return what a left-out part has in common, with its unit; parts of time by their number."""
    if fold.name in ("time", "cell"):
        return fold.value + 1.0, "1"
    known = QUANTITIES[fold.name]
    return float(known.told(fold.value)), known.unit


def _unexplained(told: ForceAssessment) -> dict[str, Any]:
    left, beyond = told.left, told.verdict in ("unknown", "form_inadequate")
    return {
        "where": left.where if beyond else None,
        "scaling": left.scaling if beyond else None,
        "guess": left.guess if beyond else None,
        "bands": dict(left.bands),
        "powers": {name: {"power": p, "half_width": h} for name, (p, h) in left.powers.items()},
    }


def next_test(told: ForceAssessment) -> dict[str, Any]:
    """Return what to do or to measure next, and why."""
    dead = told.diagnosis.dead
    lacking = {
        name: reason
        for name, reason in dead.items()
        if reason.startswith("no run varies") or "not measured" in reason or "one way" in reason
    }
    by_name = {finding.effect.name: finding.effect for finding in told.findings}
    varies = sorted({v for name in told.named for v in by_name[name].varies_with})
    between: list[str] = []
    if told.verdict == "indistinguishable":
        between = list(told.named)
        what = parting(told, between)
    elif told.verdict == "form_inadequate":
        what = (
            f"add {told.named[0]} (`tirelib add {told.named[0]}`); more is left than plain "
            f"tires leave: more levels of {_and(varies)} would show the right law"
        )
    elif told.verdict == "named":
        what = f"add {told.named[0]} (`tirelib add {told.named[0]}`) and diagnose again"
    elif told.verdict == "unknown":
        what = (
            f"the misfit stands {told.left.where} and {told.left.scaling}: more levels there, or "
            "an effect of your own (--effects)"
        )
    elif told.case.unit != "noise":
        what = "repeat some conditions, best at the ends of load, pressure and slip"
    else:
        what = "none is needed for the effects that this plan can show"
    return {"what": what, "between": between, "would_revive": lacking}


def parting(told: ForceAssessment, names: Sequence[str]) -> str:
    """Say which test parts effects that explain the points alike."""
    by_name = {finding.effect.name: finding.effect for finding in told.findings}
    varied = {v for name in names for v in by_name[name].varies_with}
    conditions = sorted(varied - {"order"})
    if "order" in varied:
        # every run has its slips again
        conditions = [name for name in conditions if not name.startswith("slip")]
        return (
            f"repeat the first {_and(conditions)} at the end, at the highest load and slip: a "
            "drift has gone on, an effect of the condition is back where it was"
        )
    return f"more levels of {_and(conditions)}, to the ends that the rig allows"


def _and(names: Sequence[str]) -> str:
    words = [name.replace("_", " ") for name in names] or ["load, pressure and slip"]
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"
