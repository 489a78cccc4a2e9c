"""An extension by a brush effect: as JSON (``tirelib-extension/1``), and in the model file."""

from dataclasses import replace
from typing import Any

import numpy as np

from tirelib import __version__
from tirelib.diagnose.forces.document import fold_entry
from tirelib.diagnose.forces.held_out import pooled
from tirelib.errors import FormatError
from tirelib.extend.document import FORMAT
from tirelib.extend.force_extension import ForceExtension
from tirelib.extend.model_file import plain, written
from tirelib.identify.brush_model import STORED, stored_number
from tirelib.parameters import Number, TireFile
from tirelib.parameters.tire import range_fault


def force_extension_document(done: ForceExtension, file: TireFile) -> dict[str, Any]:
    """Return the numbers of an extension and the history of the model that came out."""
    case, factor = done.case, done.case.factor
    messages = list(case.messages)
    if case.unit != "noise":
        messages.append(
            f"no condition was repeated, so the noise is unknown and errors are in {case.unit}; "
            "repeat some runs"
        )
    if not any(fold.main for fold in done.folds):
        messages.append("nothing can be held out: too few conditions vary")
    return {
        "format": FORMAT,
        "campaign": case.name,
        "quantity": case.quantity,
        "action": done.action,
        "effect": done.effect.name,
        "title": done.effect.title,
        "strength": plain(done.strength),
        "std": plain(done.std),
        "unit": done.effect.unit,
        "range": [done.effect.low, done.effect.high],
        "in_range": "out_of_range" not in done.flags,
        "flags": list(done.flags),
        "noise": case.noise,
        "error_unit": case.unit,
        "error_before": factor * done.before.error,
        "error_after": factor * done.after.error,
        "floor": factor * done.floor,
        "heldout_error_before": factor * pooled(done.held_before, done.folds),
        "heldout_error_after": factor * pooled(done.held_after, done.folds),
        "held_out": [
            fold_entry(fold, factor * old, factor * new)
            for fold, old, new in zip(done.folds, done.held_before, done.held_after, strict=True)
        ],
        "effects": list(file.extra["effects"]),
        "history": [
            {key: value for key, value in entry.items() if key != "before"}
            for entry in file.extra["history"]
        ],
        "messages": messages,
    }


def force_extended_file(file: TireFile, done: ForceExtension, data_hash: str) -> TireFile:
    """Return the model file of an extension: fitted numbers, effects and a history entry.

    Raises
    ------
    FormatError
        If a fitted number lies where no tire's can.
    """
    case, after = done.case, done.after
    source = f"{case.quantity} of {case.name}, {len(case.problem)} points"
    numbers: dict[str, Number] = dict(file.numbers)
    faults = []
    for name in after.names:
        stored, number = stored_number(
            name, after.values[name], after.value_std(name), "fitted", source
        )
        if (fault := range_fault(stored, number.value)) is not None:
            faults.append(f"{stored} after the fit: {fault}; the effect is not added")
        numbers[stored] = number
    if faults:
        raise FormatError(faults)
    fitted = {effect.name for effect in (*done.before.effects, *after.effects)}
    others = [e for e in file.extra.get("effects", []) if e.get("effect") not in fitted]
    effects = [
        {
            "effect": effect.name,
            "strength": plain(after.strengths[k]),
            "std": plain(after.strength_std(k)),
            "unit": effect.unit,
        }
        for k, effect in enumerate(after.effects)
    ]
    history = [*file.extra.get("history", []), _entry(file, done, data_hash)]
    extra = {**file.extra, "effects": [*others, *effects], "history": history}
    return replace(file, numbers=numbers, extra=extra)


def _entry(file: TireFile, done: ForceExtension, data_hash: str) -> dict[str, Any]:
    case, factor = done.case, done.case.factor
    # an error without noise is in another unit, under another name
    suffix = "" if case.unit == "noise" else f"_{case.unit}"
    errors = {
        "error_before": factor * done.before.error,
        "error_after": factor * done.after.error,
        "floor": factor * done.floor,
        "heldout_error_before": factor * pooled(done.held_before, done.folds),
        "heldout_error_after": factor * pooled(done.held_after, done.folds),
    }
    names = [STORED[name] for name in done.after.names]
    return {
        "action": done.action,
        "effect": done.effect.name,
        "quantity": case.quantity,
        "strength": plain(done.strength),
        "std": plain(done.std),
        "unit": done.effect.unit,
        **{f"{name}{suffix}": value for name, value in errors.items() if np.isfinite(value)},
        "campaign": case.name,
        "data_sha256": data_hash,
        "tirelib": __version__,
        "before": {
            "effects": list(file.extra.get("effects", [])),
            "written": names,
            "numbers": {n: written(file.numbers[n]) for n in names if n in file.numbers},
        },
    }
