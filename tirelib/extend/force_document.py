"""An extension by a brush effect: as JSON (``tirelib-extension/1``), and in the model file."""

from dataclasses import replace
from typing import Any

import numpy as np

from tirelib import __version__
from tirelib.compare.forces import UNITS
from tirelib.diagnose.forces.document import fold_entry
from tirelib.diagnose.forces.held_out import pooled
from tirelib.errors import FormatError
from tirelib.extend.document import step_document
from tirelib.extend.force_extension import ForceExtension
from tirelib.extend.model_file import plain, written
from tirelib.identify.brush_model import STORED, stored_number
from tirelib.parameters import Number, TireFile
from tirelib.parameters.tire import range_fault


def force_extension_document(done: ForceExtension, file: TireFile) -> dict[str, Any]:
    """Return the numbers of an extension and the history of the model that came out."""
    case = done.case
    messages = list(case.messages)
    if case.unit != "noise":
        messages.append(
            f"no condition was repeated, so the noise is unknown and errors are in {case.unit}; "
            "repeat some runs"
        )
    if not any(fold.main for fold in done.folds):
        messages.append("nothing can be held out: too few conditions vary")
    held_out = [
        fold_entry(fold, case.factor * old, case.factor * new)
        for fold, old, new in zip(done.folds, done.held_before, done.held_after, strict=True)
    ]
    errors = _errors(done)
    head = {
        "campaign": case.name,
        "quantity": case.quantity,
        "noise": case.noise,
        "error_unit": case.unit,
        **errors,
        "residual_rms_before": errors["error_before"] / case.factor,
        "residual_rms_after": errors["error_after"] / case.factor,
        "residual_rms_unit": UNITS[case.quantity],
    }
    return step_document(done, file, head, held_out, messages)


def _errors(done: ForceExtension) -> dict[str, float]:
    """Return the errors of a step as they are told."""
    case = done.case
    return {
        "error_before": case.given,
        "error_refitted": case.error(done.before),
        "error_after": case.error(done.after),
        "floor": done.floor,
        "heldout_error_before": case.factor * pooled(done.held_before, done.folds),
        "heldout_error_after": case.factor * pooled(done.held_after, done.folds),
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
    case = done.case
    # an error without noise is in another unit, under another name
    suffix = "" if case.unit == "noise" else f"_{case.unit}"
    names = [STORED[name] for name in done.after.names]
    return {
        "action": done.action,
        "effect": done.effect.name,
        "quantity": case.quantity,
        "strength": plain(done.strength),
        "std": plain(done.std),
        "unit": done.effect.unit,
        **{f"{name}{suffix}": value for name, value in _errors(done).items() if np.isfinite(value)},
        "campaign": case.name,
        "data_sha256": data_hash,
        "tirelib": __version__,
        "before": {
            "effects": list(file.extra.get("effects", [])),
            "written": names,
            "numbers": {n: written(file.numbers[n]) for n in names if n in file.numbers},
        },
    }
