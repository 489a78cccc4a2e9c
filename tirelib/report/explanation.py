"""A verdict in four lines that a test engineer understands: missing, how sure, error, next.

They are written from the document of a diagnosis (``tirelib-diagnosis/1``) alone, of strain or of
forces, so that console, page and file say the same.
"""

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, TypeGuard

import numpy as np

from tirelib.diagnose.told import listed
from tirelib.infer.plain import ROUGHLY
from tirelib.report.page import number, unit_name

TITLES = {
    "missing": "What is missing",
    "sure": "How sure",
    "error": "The error",
    "next": "What to do next",
}
"""Title of each line, by its key in a document's `explanation`."""
SENSE = 3
"""Significant digits of an error in a sentence."""
SHOWN = 3
"""Other effects that a sentence lists by name."""


@dataclass(frozen=True, slots=True)
class Explanation:
    """Four sentences.

    Attributes
    ----------
    missing, sure, error, next : str
        What is missing, how sure that is, what the error was and is, what to do.
    """

    missing: str
    sure: str
    error: str
    next: str

    @property
    def lines(self) -> tuple[tuple[str, str], ...]:
        """The sentences with what each is about."""
        return titled(asdict(self))


def titled(lines: Mapping[str, str]) -> tuple[tuple[str, str], ...]:
    """Return a document's `explanation` as titles and sentences."""
    return tuple((TITLES[key], said) for key, said in lines.items())


def explained(
    told: Mapping[str, Any],
    model: str = "M.toml",
    folder: str = "DIR",
    effect_files: Sequence[str | Path] = (),
) -> Explanation:
    """Return a diagnosis in four lines.

    Parameters
    ----------
    told : mapping
        ``tirelib-diagnosis/1``.
    model, folder : str
        The model file and the campaign's folder, as commands name them.
    effect_files : sequence of str or Path
        Files with effects of the user's own.
    """
    files = [word for file in effect_files for word in ("--effects", str(file))]
    given = ["--model", model, "--data", folder, *files]
    return Explanation(_missing(told), _sure(told), error_line(told), _next(told, given))


def _missing(told: Mapping[str, Any]) -> str:
    named, verdict = list(told["named"]), told["verdict"]
    if verdict == "none" and told["error_unit"] != "noise":
        return "This is not known: without the noise of repeated runs no effect can be tested."
    if verdict == "none":
        return (
            "Nothing: these measurements need no effect of the catalogue in addition to the model."
        )
    if verdict == "unknown":
        where = told["unexplained"].get("where")
        text = where.get("text") if isinstance(where, Mapping) else where
        stands = f" It appears {text}." if text else ""
        return f"Something that no effect of the catalogue explains.{stands}"
    if verdict == "indistinguishable":
        listed = " or ".join(f"{name} ({_title(told, name)})" for name in named)
        return f"One of these, and these measurements do not show which: {listed}."
    effects = "; ".join(
        f"{name} ({_title(told, name)}), strength {_strength(told, name)}" for name in named
    )
    if verdict != "form_inadequate":
        return f"{effects}."
    return (
        f"{effects}. More is left than structure explains: a law is not right, or more is missing."
    )


def _sure(told: Mapping[str, Any]) -> str:
    if told["error_unit"] != "noise":
        return (
            "This is open: no set point was measured twice, so the noise is unknown and nothing is "
            "named."
        )
    return " ".join([_by_p(told), *_doubts(told), *_alternatives(told), *_blind(told)])


def _doubts(told: Mapping[str, Any]) -> list[str]:
    """Return a sentence for each named effect whose strength is not plausible."""
    out = []
    for entry in filter(None, (_candidate(told, name) for name in told["named"])):
        low, high = (number(end, 3) for end in entry["range"])
        if not entry["in_range"]:
            out.append(
                f"The strength of {entry['effect']} is outside the plausible {low} to {high}: "
                "measure it in another way before you believe it."
            )
    return out


def _by_p(told: Mapping[str, Any]) -> str:
    """Return the p-values of the verdict in words."""
    p, without, level = (number(told[key], 2) for key in ("p", "p_without", "false_alarm"))
    if told["verdict"] == "none":
        first = max(told["candidates"], key=lambda e: e["score"] / e["threshold"], default=None)
        most = ""
        if first is not None:
            most = (
                f" The most conspicuous effect, {first['effect']}, reaches "
                f"{number(first['score'] / first['threshold'], 2)} of the score that would count."
            )
        return (
            f"A share of {p} of plain tires, in which nothing is hidden, show as much as this one "
            f"(p = {p}; below {level} something would be missing).{most}"
        )
    it = "it" if len(told["sets"] and told["sets"][0]) == 1 else "them"
    if told["verdict"] not in ("unknown", "form_inadequate"):
        return (
            f"Without {it} the model is rejected (p = {without}{_least(told)}); with {it} nothing "
            f"stands out from what plain tires show (p = {p})."
        )
    stands = f"{_stands(told['misfit_of'])} stands out from what plain tires show."
    if told["verdict"] == "unknown":
        return (
            f"Every hypothesis that was tried is rejected (p = {p} of the likeliest, "
            f"{level} is needed): {stands}"
        )
    return (
        f"Without {it} the model is rejected (p = {without}{_least(told)}), and with {it} as well "
        f"(p = {p}; {level} is needed): {stands}"
    )


def _least(told: Mapping[str, Any]) -> str:
    """Say where the p-value without an effect is as small as it can be."""
    least = told["p_without"] <= told["p_least"]
    return ", the smallest value that the table of plain tires can give" if least else ""


def _stands(name: str) -> str:
    """Return what has the largest score in words."""
    return f"the law of {name.removeprefix(ROUGHLY)}" if name.startswith(ROUGHLY) else name


def _alternatives(told: Mapping[str, Any]) -> list[str]:
    """Return a sentence on other effects that explain the measurements equally well."""
    if told["verdict"] == "indistinguishable":
        return ["They explain these measurements equally well."]
    sets = told["sets"]
    if len(sets) > 1:
        listed = "; or ".join(_other(names, sets[0]) for names in sets[1 : 1 + SHOWN])
        return [f"Not ruled out: {listed}."]
    if not told["named"]:
        return []
    named = set(told["named"])
    others = [
        e["effect"]
        for e in told["candidates"]
        if e["effect"] not in named and e["level"] != "quiet"
    ]
    if others:
        return [f"Also conspicuous, but not needed in addition to what is named: {_some(others)}."]
    return ["No other effect of the catalogue explains these measurements as well."]


def _other(names: Sequence[str], best: Sequence[str]) -> str:
    """Return another set in words: of a large one, by what differs from the best."""
    new, gone = ([n for n in a if n not in b] for a, b in ((names, best), (best, names)))
    if len(best) <= SHOWN or not gone:
        return " with ".join(names)
    return f"{listed(new, '')} in the place of {listed(gone, '')}"


def _blind(told: Mapping[str, Any]) -> list[str]:
    dead = told["dead"]
    if not dead:
        return []
    return [f"This plan cannot show {len(dead)} effects at all ({_some(dead)})."]


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
    anew = "" if not _known(again) or _said(again) == _said(before) else _said(again)
    own = "the model's own numbers fitted anew"
    noise = told["error_unit"] == "noise"
    if not (told.get("named") or told.get("action")):
        rms = f" ({left[0]} {raw})" if noise else ""
        also = f", {anew} with {own}" if anew else ""
        return f"It is {_said(before)} {unit}{rms}{also}.{_floor(told, after)}"
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
    return f"{said} {ways[0].title()} {it}, {own} leave {anew}." if anew else said


def journey_explained(
    told: Mapping[str, Any], journey: Mapping[str, Any], folder: Path, out: Path
) -> dict[str, str]:
    """Return the four sentences of a whole journey, by key.

    Parameters
    ----------
    told : mapping
        ``tirelib-diagnosis/1`` of the first model.
    journey : mapping
        ``tirelib-explanation/1``: the errors of the models in the end.
    folder, out : Path
        Folders of the campaign, and of the journey's files.
    """
    lines = asdict(explained(told, journey["steps"][0]["model"], str(folder)))
    if journey["added"]:
        lines["error"] = error_line({**journey, "verdict": told["verdict"]})
        last = journey["steps"][-1]["model"]
        lines["next"] = (
            f"The model with {listed(journey['added'])} is {last}. To look for more: tirelib "
            f"diagnose {folder} --model {last} --out {out / 'diagnosed-again'}"
        )
    return lines


def unmoved(told: Mapping[str, Any]) -> list[str]:
    """Return sentences on held-out errors that did not fall.

    Parameters
    ----------
    told : mapping
        ``tirelib-diagnosis/1``, ``tirelib-extension/1`` or ``tirelib-explanation/1``.
    """
    before, after = told["heldout_error_before"], told["heldout_error_after"]
    pairs = [(f"The error of the {_what(told)} held out", before, after)]
    folds = told["held_out"] if len(told["held_out"]) > 1 else ()
    pairs += [
        (f"The error with {fold_name(fold)} held out", fold["error_before"], fold["error_after"])
        for fold in folds
    ]
    return [
        f"{what} did not fall: {_said(old)} before, {_said(new)} after."
        for what, old, new in pairs
        if _known(old) and _known(new) and not _fell(old, new)
    ]


def held_out_line(told: Mapping[str, Any]) -> str:
    """Return whether the held-out errors fell, and name those that did not."""
    before, after = told.get("heldout_error_before"), told.get("heldout_error_after")
    if not _known(before) or not _known(after):
        return "Nothing could be held out of the fit to check it."
    if _fell(before, after):
        fell = f"On what was held out of the fit it {_moves(before, after)}."
        return " ".join([fell, *unmoved(told)])
    return " ".join(unmoved(told))


def fold_name(fold: Mapping[str, Any]) -> str:
    """Return the name of a held-out part."""
    names = {
        "time": f"part {fold['value']:.0f} of the time",
        "cell": f"part {fold['value']:.0f} of the conditions",
    }
    size = f"{fold['runs']} runs" if "runs" in fold else f"{fold['points']} points"
    usual = f"the {fold['condition']} {number(fold['value'], 4)} {fold['unit']}"
    return f"{names.get(fold['condition'], usual)} ({size})"


def _fell(before: float, after: float) -> bool:
    """Whether an error fell by what a reader of the sentence can see."""
    return after < before and _said(after) != _said(before)


def _moves(before: float, after: float) -> str:
    """Return in words how an error changes."""
    if _said(before) == _said(after):
        return f"stays at {_said(after)}"
    return f"{'falls' if after < before else 'rises'} from {_said(before)} to {_said(after)}"


def _floor(told: Mapping[str, Any], after: float) -> str:
    floor = told.get("floor")
    if not _known(floor):
        return ""
    if _said(floor) == _said(after):
        if told.get("verdict") in ("unknown", "form_inadequate"):
            return " Noise and the structure of a tire can be as large, but not of this shape."
        return " All that is left is noise and the structure of a tire."
    return f" Noise and the structure of a tire explain {_said(floor)} of what is left."


def _next(told: Mapping[str, Any], given: Sequence[str]) -> str:
    if told["verdict"] in ("named", "form_inadequate"):
        option = () if told["quantity"] == "strain" else ("--quantity", told["quantity"])
        command = ["tirelib", "add", *told["named"], *given, *option, "--out", "M2.toml"]
        return (
            f"Add {'it' if len(told['named']) == 1 else 'them together'}: {shlex.join(command)}; "
            "then diagnose again with the new model."
        )
    what = str(told["next_test"]["what"]).rstrip(".")
    if told["verdict"] == "none" and told["error_unit"] == "noise":
        return "No further run is needed for the effects that this plan can show."
    return f"{what[0].upper()}{what[1:]}."


def _candidate(told: Mapping[str, Any], name: str) -> Mapping[str, Any] | None:
    return next((entry for entry in told["candidates"] if entry["effect"] == name), None)


def _title(told: Mapping[str, Any], name: str) -> str:
    entry = _candidate(told, name)
    title = str(entry["title"]).rstrip(".") if entry is not None else "in no catalogue"
    return title[0].lower() + title[1:]


def _strength(told: Mapping[str, Any], name: str) -> str:
    entry = _candidate(told, name)
    return "unknown" if entry is None else said_strength(entry)


def said_strength(entry: Mapping[str, Any]) -> str:
    """Return a strength with its standard deviation and unit as text."""
    value, std = (np.atleast_1d(entry[key]) for key in ("strength", "std"))
    unit = "" if entry["unit"] == "1" else f" {entry['unit']}"
    size = " and ".join(
        f"{number(float(x), 3)} \u00b1 {number(float(s), 1)}"
        for x, s in zip(value, std, strict=True)
    )
    return f"{size}{unit}"


def _some(names: Sequence[str]) -> str:
    listed = list(dict.fromkeys(names))
    more = f" and {len(listed) - SHOWN} more" if len(listed) > SHOWN else ""
    return ", ".join(listed[:SHOWN]) + more


def _what(told: Mapping[str, Any]) -> str:
    return "points" if told["quantity"] != "strain" else "runs"


def _said(value: float) -> str:
    """Return an error with the digits that sentences use: 30, 6.7, 0.48."""
    return number(value, SENSE if abs(value) >= 10.0 else 2)


def _known(value: Any) -> TypeGuard[float]:
    return isinstance(value, int | float) and bool(np.isfinite(value))
