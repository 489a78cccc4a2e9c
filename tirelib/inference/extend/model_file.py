"""A model file after an effect was added or removed, and the way back."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from tirelib.core.errors import FormatError
from tirelib.core.parameters import NUMBERS, Number, TireFile
from tirelib.core.parameters.tire import range_fault
from tirelib.core.version import __version__
from tirelib.inference.diagnose.diagnose import strength_told
from tirelib.inference.extend.extension import Extension, ForceExtension
from tirelib.inference.identify.brush_law import stored_number
from tirelib.model.base import BARE, coordinates


def extended_file(file: TireFile, done: Extension | ForceExtension, data_hash: str) -> TireFile:
    """Return the model file of an extension: fitted numbers, effects and a history entry.

    Effects of the file that the step did not fit stay as they are.

    Raises
    ------
    FormatError
        If a fitted number lies where no tire's can.
    """
    if isinstance(done, Extension):
        names, numbers = _ring(file, done)
        told = {"campaign": done.runs.waves.header.name}
    else:
        numbers = _brush(done)
        names, told = tuple(numbers), {"quantity": done.case.quantity, "campaign": done.case.name}
    entry = _history_entry(file, done, names) | told | {"data_sha256": data_hash}
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


def _ring(file: TireFile, done: Extension) -> tuple[tuple[str, ...], dict[str, Number]]:
    """Return the names of what was fitted to strain, and the numbers that are finite."""
    runs = done.runs.waves
    source = f"strain waveforms of {runs.header.name}, {len(runs)} straight runs"
    fitted = {c.name: (float(done.after.values[c.name]), c) for c in coordinates(done.after.values)}
    _refuse_beyond({name: value for name, (value, _) in fitted.items()})
    std = np.sqrt(np.diag(done.after.covariance))
    numbers = {
        name: _number(
            file.numbers.get(name),
            value,
            coordinate.spread(value, float(std[k])),
            coordinate.unit == 0.0,
            source,
        )
        for k, (name, (value, coordinate)) in enumerate(fitted.items())
        if np.isfinite(value)
    }
    return tuple(fitted), numbers


def _brush(done: ForceExtension) -> dict[str, Number]:
    """Return the numbers that were fitted to a force."""
    case, after = done.case, done.after
    source = f"{case.quantity} of {case.name}, {len(case.bench.points)} points"
    numbers = dict(
        stored_number(name, after.values[name], after.value_std(name), "fitted", source)
        for name in after.problem.names
    )
    _refuse_beyond({name: number.value for name, number in numbers.items()})
    return numbers


def _refuse_beyond(values: Mapping[str, float]) -> None:
    """Raise FormatError for fitted values, by name in a file, that lie where no tire's can."""
    faults = [
        f"{name} after the fit: {fault}; the effect is not added"
        for name, value in values.items()
        if (fault := range_fault(name, value)) is not None
    ]
    if faults:
        raise FormatError(faults)


def _history_entry(
    file: TireFile, done: Extension | ForceExtension, names: Sequence[str]
) -> dict[str, Any]:
    """Return what the history holds of a step that wrote these numbers, and of the file before it.

    Without noise errors stand under names that end in their unit; unknown ones are left out.
    """
    suffix = "" if done.unit == "noise" else f"_{done.unit}"
    return {
        "action": done.action,
        "effect": done.effect.name,
        "strength": strength_told(done.strength),
        "std": strength_told(done.std),
        "unit": done.effect.unit,
        **{f"{name}{suffix}": value for name, value in done.errors.items() if np.isfinite(value)},
        "tirelib": __version__,
        "before": {
            "effects": list(file.extra.get("effects", [])),
            "written": list(names),
            "numbers": {n: _written(file.numbers[n]) for n in names if n in file.numbers},
        },
    }


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


def _written(number: Number) -> dict[str, Any]:
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
