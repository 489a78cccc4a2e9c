"""An extension as JSON (``tirelib-extension/1``)."""

from collections.abc import Mapping, Sequence
from typing import Any

from tirelib.compare.error import named_errors
from tirelib.diagnose.held_out import fold_entry, pooled
from tirelib.extend.extension import Extension
from tirelib.extend.model_file import plain
from tirelib.extend.step import Step
from tirelib.parameters import TireFile

FORMAT = "tirelib-extension/1"
NO_REPEATS = (
    "no runs were repeated at equal set points, so the noise is unknown and errors are in "
    "microstrain; repeat some runs"
)


def extension_document(done: Extension, file: TireFile) -> dict[str, Any]:
    """Return the numbers of an extension and the history of the model that came out."""
    messages = [] if done.given.known else [NO_REPEATS]
    if not done.folds:
        messages.append(
            "nothing can be held out: three loads or two pressures, and four other runs, are needed"
        )
    held_out = [
        fold_entry(fold, old, new)
        for fold, old, new in zip(done.folds, done.held_before, done.held_after, strict=True)
    ]
    head = {
        "campaign": done.runs.waves.header.name, "quantity": "strain",
        **named_errors(done.given, done.reached), "error_refitted": done.refitted.value,
        "floor": done.floor, "delay_us": 1e6 * done.after.delay,
        "heldout_error_before": pooled(done.held_before, done.folds),
        "heldout_error_after": pooled(done.held_after, done.folds),
    }  # fmt: skip
    return step_document(done, file, head, held_out, messages)


def step_document(
    done: Step[Any],
    file: TireFile,
    head: Mapping[str, Any],
    held_out: Sequence[Mapping[str, Any]],
    messages: Sequence[str],
) -> dict[str, Any]:
    """Return ``tirelib-extension/1``: what every step tells, beside its own numbers."""
    return {
        "format": FORMAT,
        "action": done.action,
        "effect": done.effect.name,
        "title": done.effect.title,
        "strength": plain(done.strength),
        "std": plain(done.std),
        "unit": done.effect.unit,
        "range": [done.effect.low, done.effect.high],
        "in_range": "out_of_range" not in done.flags,
        "flags": list(done.flags),
        **head,
        "held_out": list(held_out),
        "effects": list(file.extra["effects"]),
        "history": [
            {key: value for key, value in entry.items() if key != "before"}
            for entry in file.extra["history"]
        ],
        "messages": list(messages),
    }
