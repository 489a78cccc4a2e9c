"""A verdict in four lines that a test engineer understands: missing, how sure, error, next.

They are written from the document of a diagnosis (``tirelib-diagnosis/1``) alone, of strain or of
forces, so that console, page and file say the same.
"""

import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from tirelib.inference.diagnose.document import listed
from tirelib.inference.statistics.plain import ROUGHLY
from tirelib.report.error_sentences import error_line, is_known, said_error
from tirelib.report.page import number

TITLES = {
    "missing": "What is missing",
    "sure": "How sure",
    "error": "The error",
    "next": "What to do next",
}
"""Title of each line, by its key in a document's `explanation`."""
MISSED = 0.5
"""Chance to be found below which an effect is missed more often than not."""
STANDS_OUT = "stands out"
"""Mark of an effect that stands out beside what is named, where a law does not fit: its level is
that beside the model as it is."""
SHOWN = 3
"""Other effects that a sentence lists by name."""


class Explanation(NamedTuple):
    """Four sentences: what is missing, how sure that is, what the error was and is, what to do."""

    missing: str
    sure: str
    error: str
    next: str


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
        once = ", once its own numbers are fitted to them" if _misfitted(told) else ""
        return (
            "Nothing: these measurements need no effect of the catalogue in addition to the "
            f"model{once}."
        )
    if verdict == "unknown":
        return f"Something that no effect of the catalogue explains.{_lies(told, 'It')}"
    if verdict == "indistinguishable":
        listed = " or ".join(f"{name} ({_title(told, name)})" for name in named)
        return f"One of these, and these measurements do not show which: {listed}."
    entries = {name: _candidate(told, name) for name in named}
    effects = "; ".join(
        f"{name} ({_title(told, name)}), strength {said_strength(entry) if entry else 'unknown'}"
        for name, entry in entries.items()
    )
    if verdict != "form_inadequate":
        return f"{effects}."
    return (
        f"{effects}. More is left than structure explains: a law is not right, or more is missing."
        f"{_lies(told, 'What is left')}"
    )


def mark_of(told: Mapping[str, Any], entry: Mapping[str, Any]) -> str:
    """Return an effect's level as tables and figures mark it.

    What stands out beside the named set has a mark of its own.
    """
    beside = told["verdict"] == "form_inadequate" and entry["effect"] == told["misfit_of"]
    return STANDS_OUT if beside and entry["effect"] not in told["named"] else str(entry["level"])


def _lies(told: Mapping[str, Any], what: str) -> str:
    """Return where the misfit lies and what it goes with."""
    texts = [told["unexplained"].get(key) for key in ("where", "scaling")]
    where, scaling = (text.get("text") if isinstance(text, Mapping) else text for text in texts)
    if not where:
        return ""
    return f" {what} appears {where}" + (f"; it {scaling}." if scaling else ".")


def _sure(told: Mapping[str, Any]) -> str:
    if told["error_unit"] != "noise":
        return (
            "This is open: no set point was measured twice, so the noise is unknown and nothing is "
            "named."
        )
    return " ".join([_by_p(told), *_doubts(told), *_alternatives(told), *_blind(told)])


def _doubts(told: Mapping[str, Any]) -> list[str]:
    """Return a sentence for each named effect whose strength is not plausible."""
    named = filter(None, (_candidate(told, name) for name in told["named"]))
    return [
        f"The strength of {entry['effect']} is outside the plausible "
        f"{' to '.join(number(end, 3) for end in entry['range'])}: measure it in another way "
        "before you believe it."
        for entry in named
        if not entry["in_range"]
    ]


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
            f"In {number(100.0 * told['p'], 2)} % of plain tires, in which nothing is hidden, at "
            f"least as much stands out as in this one (p = {p}; below {level} something would be "
            f"missing).{most}"
        )
    it = "it" if len(told["sets"] and told["sets"][0]) == 1 else "them"
    if told["verdict"] not in ("unknown", "form_inadequate"):
        return (
            f"Without {it} the model is rejected (p = {without}{_least(told)}); with {it} nothing "
            f"stands out from what plain tires show (p = {p})."
        )
    most = f"{stands(told['misfit_of'])} stands out from what plain tires show."
    if told["verdict"] == "unknown":
        return (
            f"Every hypothesis that was tried is rejected (p = {p} of the likeliest, "
            f"{level} is needed): {most}"
        )
    return (
        f"Without {it} the model is rejected (p = {without}{_least(told)}), and with {it} as well "
        f"(p = {p}; {level} is needed): {most}"
    )


def _least(told: Mapping[str, Any]) -> str:
    """Say where the p-value without an effect is as small as it can be."""
    least = told["p_without"] <= told["p_least"]
    return ", the smallest value that the table of plain tires can give" if least else ""


def stands(name: str) -> str:
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
    if told["verdict"] == "form_inadequate":
        return []
    if others:
        return [f"Also conspicuous, but not needed in addition to what is named: {_some(others)}."]
    return ["No other effect of the catalogue explains these measurements as well."]


def _other(names: Sequence[str], best: Sequence[str]) -> str:
    """Return another set in words: of a large one, by what differs from the best."""
    new, gone = ([n for n in a if n not in b] for a, b in ((names, best), (best, names)))
    if len(best) <= SHOWN or not gone:
        return " with ".join(names)
    return f"{listed(new, '')} in the place of {listed(gone, '')}"


def _enough(told: Mapping[str, Any]) -> str:
    """Return for which effects no further run is needed: those that the plan does not miss."""
    chances = {e["effect"]: e.get("power") for e in told["candidates"]}
    missed = [name for name, chance in chances.items() if chance is not None and chance < MISSED]
    out = []
    if len(missed) < len(chances):
        out.append("No further run is needed for the effects that this plan finds.")
    if missed:
        out.append(
            f"At a third of its plausible strength it would mostly miss {_some(missed)}: only "
            "other runs would show such an effect."
        )
    return " ".join(out) or "This plan can show no effect: vary load, pressure or speed."


def _blind(told: Mapping[str, Any]) -> list[str]:
    dead = told["dead"]
    if not dead:
        return []
    return [f"This plan cannot show {len(dead)} effects at all ({_some(dead)})."]


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
    lines = explained(told, journey["steps"][0]["model"], str(folder))._asdict()
    if journey["added"]:
        lines["error"] = error_line({**journey, "verdict": told["verdict"]})
        last = journey["steps"][-1]["model"]
        lines["next"] = (
            f"The model with {listed(journey['added'])} is {last}. To look for more: tirelib "
            f"diagnose {folder} --model {last} --out {out / 'diagnosed-again'}"
        )
    return lines


def _next(told: Mapping[str, Any], given: Sequence[str]) -> str:
    if told["verdict"] in ("named", "form_inadequate"):
        option = () if told["quantity"] == "strain" else ("--quantity", told["quantity"])
        command = ["tirelib", "add", *told["named"], *given, *option, "--out", "M2.toml"]
        beside = [e["effect"] for e in told["candidates"] if mark_of(told, e) == STANDS_OUT]
        more = f" What stands out in addition is {listed(beside)}." if beside else ""
        return (
            f"Add {'it' if len(told['named']) == 1 else 'them together'}: {shlex.join(command)}; "
            f"then diagnose again with the new model.{more}"
        )
    what = str(told["next_test"]["what"]).rstrip(".")
    if told["verdict"] == "none" and _misfitted(told):
        as_it_is, anew = said_error(told["error_before"]), said_error(told["error_refitted"])
        return (
            "Fit the model to these measurements with tirelib identify: as it is, its error is "
            f"{as_it_is} times the noise, and {anew} with its numbers fitted anew."
        )
    if told["verdict"] == "none" and told["error_unit"] == "noise":
        return _enough(told)
    return f"{what[0].upper()}{what[1:]}."


def _misfitted(told: Mapping[str, Any]) -> bool:
    """Whether the model's numbers are not those of this tire: fitted anew they leave half or less.

    A factor of two is no threshold of a verdict; it decides what is advised.
    """
    again = told.get("error_refitted")
    return is_known(again) and 2.0 * again < told["error_before"]


def _candidate(told: Mapping[str, Any], name: str) -> Mapping[str, Any] | None:
    return next((entry for entry in told["candidates"] if entry["effect"] == name), None)


def _title(told: Mapping[str, Any], name: str) -> str:
    entry = _candidate(told, name)
    title = str(entry["title"]).rstrip(".") if entry is not None else "in no catalogue"
    return title[0].lower() + title[1:]


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
