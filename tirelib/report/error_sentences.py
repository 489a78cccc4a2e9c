"""The error before and after, and what was held out, in sentences."""

from collections.abc import Mapping
from typing import Any, TypeGuard

import numpy as np

from tirelib.report.page import number, unit_name

SENSE = 3
"""Digits of a number in a sentence."""


def error_line(told: Mapping[str, Any]) -> str:
    """Return the error before and after, and that of the held-out data.

    Parameters
    ----------
    told : mapping
        ``tirelib-diagnosis/1`` or ``tirelib-extension/1``.
    """
    unit = "times the noise" if told["error_unit"] == "noise" else unit_name(told["error_unit"])
    before, after = told["error_before"], told["error_after"]
    raw = f"{unit_name(told['residual_rms_unit'])} rms"
    raw += ", errors of the set points included" if told["quantity"] == "strain" else ""
    left = [number(told[f"residual_rms_{when}"], SENSE) for when in ("before", "after")]
    again = told.get("error_refitted")
    anew = (
        "" if not is_known(again) or said_error(again) == said_error(before) else said_error(again)
    )
    own = "the model's own numbers fitted anew"
    noise = told["error_unit"] == "noise"
    if not (told.get("named") or told.get("action")):
        rms = f" ({left[0]} {raw})" if noise else ""
        also = f", {anew} with {own}" if anew else ""
        return f"It is {said_error(before)} {unit}{rms}{also}.{_floor(told, after)}"
    several = len(told.get("named", ())) > 1 and told.get("verdict") != "indistinguishable"
    it = "them" if several else "it"
    ways = ["with", "without"] if told.get("action") == "remove" else ["without", "with"]
    parted = after < before and told["residual_rms_after"] > told["residual_rms_before"]
    rms = f" ({left[0]} to {left[1]} {raw})" if noise and not parted else ""
    said = f"It {_moves(before, after)} {unit} {ways[1]} {it}{rms}.{_floor(told, after)}"
    if parted:
        said += (
            f" The rms that includes the errors of the set points rose from {left[0]} to {left[1]} "
            f"{unit_name(told['residual_rms_unit'])}."
        )
    said += f" {held_out_line(told)}"
    if not anew:
        return said
    said += f" {ways[0].title()} {it}, {own} leave {anew}"
    if ways[1] == "without" or (is_known(again) and not again < after):
        return f"{said}."
    said += f" on the {runs_or_points(told)} that they are fitted to: less, "
    held_out, with_it = (told.get(f"heldout_error_{when}") for when in ("before", "after"))
    if is_known(held_out) and is_known(with_it) and _fell(held_out, with_it):
        return (
            f"{said}but {said_error(held_out)} on those held out. Numbers that cover for a missing "
            "effect fit, and do not predict."
        )
    return f"{said}but of a shape that plain tires do not show."


def unmoved(told: Mapping[str, Any]) -> list[str]:
    """Return sentences on held-out errors that did not fall.

    Parameters
    ----------
    told : mapping
        ``tirelib-diagnosis/1``, ``tirelib-extension/1`` or ``tirelib-explanation/1``.
    """
    before, after = told["heldout_error_before"], told["heldout_error_after"]
    what, folds = runs_or_points(told), told["held_out"] if len(told["held_out"]) > 1 else ()
    ends = [(fold["error_before"], fold["error_after"]) for fold in folds]
    whole = is_known(before) and is_known(after)
    if len(folds) > 2 and whole and not any(_may_have_fallen(*pair) for pair in ends):
        return [
            f"The error on the {what} held out fell in none of {len(folds)} parts: "
            f"{said_error(before)} before, {said_error(after)} after, on average."
        ]
    names = [f"of the {what} held out", *(f"with {fold_name(fold)} held out" for fold in folds)]
    return [
        f"The error {name} did not fall: {said_error(old)} before, {said_error(new)} after."
        for name, (old, new) in zip(names, [(before, after), *ends], strict=True)
        if not _may_have_fallen(old, new)
    ]


def held_out_line(told: Mapping[str, Any]) -> str:
    """Return whether the held-out errors fell, and name those that did not."""
    before, after = told.get("heldout_error_before"), told.get("heldout_error_after")
    if not is_known(before) or not is_known(after):
        return "Nothing could be held out of the fit to check it."
    if _fell(before, after):
        fell = f"On what was held out of the fit it {_moves(before, after)}{_worst(told)}."
        return " ".join([fell, *unmoved(told)])
    return " ".join(unmoved(told))


def _worst(told: Mapping[str, Any]) -> str:
    """Name the held-out part with the largest error, where there are several."""
    folds = [
        fold
        for fold in told.get("held_out", ())
        if is_known(fold["error_before"]) and is_known(fold["error_after"])
    ]
    if len(folds) < 2:
        return ""
    worst = max(folds, key=lambda fold: float(fold["error_after"]))
    moved = _moves(worst["error_before"], worst["error_after"])
    return f" (worst: {fold_name(worst)}, where it {moved})"


def fold_name(fold: Mapping[str, Any]) -> str:
    """Return the name of a held-out part."""
    names = {
        "time": f"part {fold['value']:.0f} of the time",
        "cell": f"part {fold['value']:.0f} of the conditions",
    }
    size = f"{fold['runs']} runs" if "runs" in fold else f"{fold['points']} points"
    usual = f"the {fold['condition']} {number(fold['value'], 4)} {fold['unit']}"
    return f"{names.get(fold['condition'], usual)} ({size})"


def _may_have_fallen(before: Any, after: Any) -> bool:
    """Whether an error fell, or is not known."""
    return not (is_known(before) and is_known(after)) or _fell(before, after)


def _fell(before: float, after: float) -> bool:
    """Whether an error fell by what a reader of the sentence can see."""
    return after < before and said_error(after) != said_error(before)


def _moves(before: float, after: float) -> str:
    """Return in words how an error changes."""
    if said_error(before) == said_error(after):
        return f"stays at {said_error(after)}"
    return (
        f"{'falls' if after < before else 'rises'} from {said_error(before)} to {said_error(after)}"
    )


def _floor(told: Mapping[str, Any], after: float) -> str:
    floor = told.get("floor")
    if not is_known(floor):
        return ""
    if said_error(floor) == said_error(after):
        if told.get("verdict") in ("unknown", "form_inadequate"):
            return " Noise and the structure of a tire can be as large, but not of this shape."
        raw = ""
        if told["error_unit"] == "noise":
            size = number(told["residual_rms_after"], SENSE)
            raw = f", {size} {unit_name(told['residual_rms_unit'])}"
        unit = "times the noise" if raw else unit_name(told["error_unit"])
        return (
            f" What is left ({said_error(after)} {unit}{raw}) is no more than simulated tires "
            "leave; a missing effect of this size cannot be excluded."
        )
    return f" Noise and the structure of a tire explain {said_error(floor)} of what is left."


def runs_or_points(told: Mapping[str, Any]) -> str:
    """Return what a document's measurements are."""
    return "points" if told["quantity"] != "strain" else "runs"


def said_error(value: float) -> str:
    """Return an error with the digits that sentences use: 30, 6.7, 0.48."""
    return number(value, SENSE if abs(value) >= 10.0 else 2)


def is_known(value: Any) -> TypeGuard[float]:
    """Whether a document's value is a finite number."""
    return isinstance(value, int | float) and bool(np.isfinite(value))
