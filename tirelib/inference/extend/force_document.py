"""An extension by a brush effect: as JSON (``tirelib-extension/1``), and in the model file."""

from typing import Any

from tirelib.core.parameters import TireFile
from tirelib.inference.compare.forces import UNITS
from tirelib.inference.diagnose.held_out import fold_entry, pooled
from tirelib.inference.extend.document import step_document
from tirelib.inference.extend.force_extension import ForceExtension
from tirelib.inference.extend.model_file import history_entry, refuse_beyond, stepped
from tirelib.inference.identify.brush_model import stored_number


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
    """Return the errors of a step in the unit of the document."""
    case = done.case
    return {
        "error_before": done.given,
        "error_refitted": case.error(done.before),
        "error_after": case.error(done.after),
        "floor": case.told(done.floor, done.after),
        **{
            f"heldout_error_{when}": pooled([case.factor * error for error in errors], done.folds)
            for when, errors in (("before", done.held_before), ("after", done.held_after))
        },
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
    numbers = dict(
        stored_number(name, after.values[name], after.value_std(name), "fitted", source)
        for name in after.names
    )
    refuse_beyond({name: number.value for name, number in numbers.items()})
    entry = history_entry(file, done, _errors(done), case.unit, tuple(numbers))
    told = {"quantity": case.quantity, "campaign": case.name, "data_sha256": data_hash}
    return stepped(file, done, numbers, entry | told)
