"""A diagnosis of forces as JSON (``tirelib-diagnosis/1``)."""

from collections.abc import Sequence
from typing import Any

from tirelib.inference.compare.forces import UNITS
from tirelib.inference.diagnose.forces.assess import ForceAssessment
from tirelib.inference.diagnose.held_out import pooled
from tirelib.inference.diagnose.told import listed, next_step


def force_diagnosis_document(told: ForceAssessment) -> dict[str, Any]:
    """Return the numbers; errors are in the noise of a point, in N or Nm without repeats."""
    found, case = told.diagnosis, told.case
    return {
        **told.shared,
        "campaign": case.name,
        "quantity": case.quantity,
        "unit": UNITS[case.quantity],
        "noise": case.noise,
        "repeats": case.repeats,
        "points": len(case.problem),
        "error_unit": case.unit,
        "error_before": told.before,
        "error_refitted": case.error(found.base),
        "error_after": told.after,
        "residual_rms_before": told.before / case.factor,
        "residual_rms_after": told.after / case.factor,
        "residual_rms_unit": UNITS[case.quantity],
        "steps": [
            {
                "effect": name,
                "error": case.factor * fit.error,
                "heldout_error": pooled(told.held_out(fit), told.folds),
            }
            for name, fit in (found.steps if told.named else ())
        ],
        "unexplained": _unexplained(told),
        "next_test": next_test(told),
    }


def _unexplained(told: ForceAssessment) -> dict[str, Any]:
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


def next_test(told: ForceAssessment) -> dict[str, Any]:
    """Return what to do or to measure next, and why."""
    by_name = {finding.effect.name: finding.effect for finding in told.findings}
    varies = sorted({v for name in told.named for v in by_name[name].varies_with})
    words = {
        "indistinguishable": lambda: parting(told, told.named),
        "form_inadequate": lambda: (
            f"add {listed(told.named, 'nothing')} (`tirelib add {' '.join(told.named)}`); more is "
            f"left than plain tires leave: more levels of {_and(varies)} would show the right law"
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
    lacking = {
        name: reason
        for name, reason in told.diagnosis.dead.items()
        if reason.startswith("no run varies") or "not measured" in reason or "one way" in reason
    }
    return next_step(told, words, lacking)


def parting(told: ForceAssessment, names: Sequence[str]) -> str:
    """Say which test distinguishes effects that explain the points equally well."""
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
    return listed([name.replace("_", " ") for name in names], "load, pressure and slip")
