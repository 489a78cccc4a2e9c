"""An extension as JSON (``tirelib-extension/1``)."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from tirelib.core.parameters import TireFile
from tirelib.inference.compare.error import named_errors
from tirelib.inference.diagnose.diagnose import strength_told
from tirelib.inference.diagnose.held_out import NO_POINTS, NO_RUNS
from tirelib.inference.extend.extension import Extension, ForceExtension

FORMAT = "tirelib-extension/1"
NO_REPEATS = (
    "no runs were repeated at equal set points, so the noise is unknown and errors are in "
    "microstrain; repeat some runs"
)


def extension_document(done: Extension | ForceExtension, file: TireFile) -> dict[str, Any]:
    """Return the numbers of an extension and the history of the model that came out."""
    if isinstance(done, Extension):
        head, messages = _strain(done), _strain_messages(done)
    else:
        head, messages = _force(done), _force_messages(done)
    held_out = zip(done.folds, done.held_before, done.held_after, strict=True)
    return {
        "format": FORMAT,
        "action": done.action,
        "effect": done.effect.name,
        "title": done.effect.title,
        "strength": strength_told(done.strength),
        "std": strength_told(done.std),
        "unit": done.effect.unit,
        "range": [done.effect.low, done.effect.high],
        "in_range": "out_of_range" not in done.flags,
        "flags": list(done.flags),
        **head,
        "waterfall": waterfall(file.extra["history"], str(head["quantity"])),
        "held_out": [fold.entry(old, new) for fold, old, new in held_out],
        "effects": list(file.extra["effects"]),
        "history": told_history(file),
        "messages": messages,
    }


def told_history(file: TireFile) -> list[dict[str, Any]]:
    """Return the history of a model without what was before each entry."""
    return [{k: v for k, v in entry.items() if k != "before"} for entry in file.extra["history"]]


def _strain(done: Extension) -> dict[str, Any]:
    return {
        "campaign": done.runs.waves.header.name,
        "quantity": "strain",
        **named_errors(done.given, done.reached),
        "error_refitted": done.refitted.value,
        "runs": run_errors(done),
        "floor": done.floor,
        "delay_us": 1e6 * done.reached.delay,
        **done.pooled,
    }


def _force(done: ForceExtension) -> dict[str, Any]:
    case, errors = done.case, done.errors
    return {
        "campaign": case.name,
        "quantity": case.quantity,
        **errors,
        **case.named_errors(errors["error_before"], errors["error_after"]),
    }


def _strain_messages(done: Extension) -> list[str]:
    known = [] if done.given.known else [NO_REPEATS]
    return known if done.folds else [*known, NO_RUNS]


def _force_messages(done: ForceExtension) -> list[str]:
    messages = list(done.case.messages)
    if done.unit != "noise":
        messages.append(
            f"no condition was repeated, so the noise is unknown and errors are in {done.unit}; "
            "repeat some runs"
        )
    if not any(fold.main for fold in done.folds):
        messages.append(NO_POINTS)
    return messages


def run_errors(done: Extension) -> list[dict[str, Any]]:
    """Return the errors of each run, and of those held out what a fit to the others leaves."""
    waves = done.runs.waves
    out: list[dict[str, Any]] = [
        {
            "run": int(waves.run[k]),
            "load": float(waves.conditions["Fz"][k]),
            "error_before": float(done.given.by_run[k]),
            "error_after": float(done.reached.by_run[k]),
            "held_out": [],
        }
        for k in range(len(waves))
    ]
    for fold, before, after in zip(done.folds, done.out_before, done.out_after, strict=True):
        if before is None or after is None:
            continue
        for row, old, new in zip(
            np.flatnonzero(fold.out), before.by_run, after.by_run, strict=True
        ):
            told = {"condition": fold.name, "error_before": old, "error_after": new}
            out[row]["held_out"].append(told)
    return out


def waterfall(history: Sequence[Mapping[str, Any]], quantity: str) -> list[dict[str, Any]]:
    """Return the fall of the error over a model's history, in the unit of its last step.

    Entries without a quantity are of strain, errors without a unit in their name in noise. Nothing
    is returned if the last entry of the quantity tells no error.
    """
    told = [e for e in history if e.get("quantity", "strain") == quantity]
    names = [key for key in told[-1] if key.startswith("error_after")] if told else []
    if not names:
        return []
    suffix = names[0].removeprefix("error_after")
    unit = suffix.removeprefix("_") or "noise"
    told = [entry for entry in told if f"error_after{suffix}" in entry]

    def row(action: str, effect: str | None, entry: Mapping[str, Any], when: str) -> dict[str, Any]:
        return {
            "action": action,
            "effect": effect,
            "error": entry.get(f"error_{when}{suffix}"),
            "heldout_error": entry.get(f"heldout_error_{when}{suffix}"),
            "unit": unit,
        }

    first = row("start", None, told[0], "before")
    return [first, *(row(e.get("action", "add"), e.get("effect", "?"), e, "after") for e in told)]
