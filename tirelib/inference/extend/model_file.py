"""A model file after an effect was added or removed, and the way back."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from tirelib.core.errors import FormatError
from tirelib.core.parameters import NUMBERS, Number, TireFile
from tirelib.core.parameters.tire import range_fault
from tirelib.core.version import __version__
from tirelib.inference.diagnose.held_out import pooled
from tirelib.inference.diagnose.told import strength_told
from tirelib.inference.extend.extension import Extension
from tirelib.inference.extend.step import Step
from tirelib.model.base import BARE, coordinates


def extended_file(file: TireFile, done: Extension, data_hash: str) -> TireFile:
    """Return the model file of an extension: fitted numbers, effects and a history entry.

    Raises
    ------
    FormatError
        If a fitted number lies where no tire's can.
    """
    name = done.runs.waves.header.name
    fitted = {c.name: (float(done.after.values[c.name]), c) for c in coordinates(done.after.values)}
    refuse_beyond({name: value for name, (value, _) in fitted.items()})
    numbers = {}
    for index, (value, coordinate) in enumerate(fitted.values()):
        if np.isfinite(value):
            numbers[coordinate.name] = _number(
                file.numbers.get(coordinate.name),
                value,
                coordinate.spread(value, float(np.sqrt(done.after.covariance[index, index]))),
                coordinate.unit == 0.0,
                f"strain waveforms of {name}, {len(done.runs.waves)} straight runs",
            )
    errors = {
        "error_before": done.given.value,
        "error_after": done.reached.value,
        "floor": done.floor,
        "heldout_error_before": pooled(done.held_before, done.folds),
        "heldout_error_after": pooled(done.held_after, done.folds),
    }
    unit = "noise" if done.given.known else "ustrain"
    entry = history_entry(file, done, errors, unit, tuple(fitted))
    return stepped(file, done, numbers, entry | {"campaign": name, "data_sha256": data_hash})


def refuse_beyond(values: Mapping[str, float]) -> None:
    """Refuse fitted values, by name in a file, that lie where no tire's can.

    Raises
    ------
    FormatError
        With all of them.
    """
    faults = [
        f"{name} after the fit: {fault}; the effect is not added"
        for name, value in values.items()
        if (fault := range_fault(name, value)) is not None
    ]
    if faults:
        raise FormatError(faults)


def history_entry(
    file: TireFile, done: Step[Any], errors: Mapping[str, float], unit: str, names: Sequence[str]
) -> dict[str, Any]:
    """Return what the history holds of a step, and of the file before it.

    Parameters
    ----------
    file : TireFile
        Before the step.
    done : Step
    errors : mapping
        By name; one that is not known is left out.
    unit : str
        Unit of the errors: without noise they stand under names that end in it.
    names : sequence of str
        Numbers of the file that the step wrote.
    """
    suffix = "" if unit == "noise" else f"_{unit}"
    return {
        "action": done.action,
        "effect": done.effect.name,
        "strength": strength_told(done.strength),
        "std": strength_told(done.std),
        "unit": done.effect.unit,
        **{f"{name}{suffix}": value for name, value in errors.items() if np.isfinite(value)},
        "tirelib": __version__,
        "before": {
            "effects": list(file.extra.get("effects", [])),
            "written": list(names),
            "numbers": {n: written(file.numbers[n]) for n in names if n in file.numbers},
        },
    }


def stepped(
    file: TireFile, done: Step[Any], numbers: Mapping[str, Number], entry: Mapping[str, Any]
) -> TireFile:
    """Return a file with the numbers, the effects and the history entry of a step.

    Effects of the file that the step did not fit stay as they are.
    """
    fitted = {effect.name for effect in (*done.before.effects, *done.after.effects)}
    kept = [each for each in file.extra.get("effects", []) if each.get("effect") not in fitted]
    effects = [
        {
            "effect": effect.name,
            "strength": strength_told(done.after.strengths[k]),
            "std": strength_told(done.after.strength_std(k)),
            "unit": effect.unit,
        }
        for k, effect in enumerate(done.after.effects)
    ]
    history = [*file.extra.get("history", []), entry]
    extra = {**file.extra, "effects": [*kept, *effects], "history": history}
    return replace(file, numbers={**file.numbers, **numbers}, extra=extra)


def undone_file(file: TireFile) -> tuple[TireFile, Mapping[str, Any]]:
    """Return the model file as it was before its last history entry, and that entry.

    Raises
    ------
    FormatError
        If there is no entry, or it does not hold what was before.
    """
    history = list(file.extra.get("history", []))
    if not history:
        raise FormatError(f"{file.name}: its history is empty; there is nothing to undo")
    last = history.pop()
    before = last.get("before") if isinstance(last, dict) else None
    if not isinstance(before, dict) or not {"effects", "numbers"} <= set(before):
        raise FormatError(
            f"{file.name}, history[{len(history)}]: it does not hold the numbers and effects that "
            "were before; `tirelib add --remove` takes an effect out and fits anew"
        )
    try:
        old = {name: _read(table) for name, table in before["numbers"].items() if name in NUMBERS}
    except (KeyError, TypeError, ValueError) as error:
        raise FormatError(
            f"{file.name}, history[{len(history)}].before.numbers: {error!r}; a table with value, "
            "kind and source for each is needed"
        ) from error
    # an entry says which numbers its step wrote; those of strain without it wrote the ring's
    fitted = set(before.get("written", [coordinate.name for coordinate in BARE]))
    numbers = {name: number for name, number in file.numbers.items() if name not in fitted} | old
    extra = {**file.extra, "effects": before["effects"], "history": history}
    return replace(file, numbers=numbers, extra=extra), last


def _number(old: Number | None, value: float, fit_std: float, factor: bool, source: str) -> Number:
    """Return a number after a fit; what structure adds to its uncertainty is kept."""
    if old is None:
        return Number(value, fit_std, "fitted", source)
    share = abs(value / old.value) if factor else 1.0
    std = max(fit_std, share * old.std) if np.isfinite(old.std) else fit_std
    notes = dict(old.notes)
    interval = notes.get("interval_SI")
    if isinstance(interval, list) and len(interval) == 2:
        notes["interval_SI"] = [value + share * (float(end) - old.value) for end in interval]
    return Number(value, std, "fitted", source, notes)


def written(number: Number) -> dict[str, Any]:
    """Return a number as a history entry holds it."""
    table: dict[str, Any] = {
        "value_SI": number.value,
        "kind": number.kind,
        "source": number.source,
        "notes": dict(number.notes),
    }
    if np.isfinite(number.std):
        table["std_SI"] = number.std
    return table


def _read(table: Mapping[str, Any]) -> Number:
    return Number(
        float(table["value_SI"]),
        float(table.get("std_SI", np.nan)),
        str(table["kind"]),
        str(table["source"]),
        dict(table.get("notes", {})),
    )
