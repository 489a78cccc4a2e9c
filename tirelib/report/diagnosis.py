"""The page of a diagnosis of strain or of forces: one HTML file; and the same in Markdown."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go

from tirelib.inference.diagnose.assess import Assessment, ForceAssessment
from tirelib.report.comparison import BRUSH, METHOD, RING
from tirelib.report.error_sentences import fold_name
from tirelib.report.explanation import STANDS_OUT, mark_of, stands, titled
from tirelib.report.figures.before_after import Step, waterfall, waterfall_of
from tirelib.report.figures.compare_plot import Plot, styled_figure
from tirelib.report.figures.left import maps
from tirelib.report.page import TWINS, Part, Table, number, numbers, unit_name, write_parts_page
from tirelib.report.style import BLUE, FAINT, INK, RED

TITLE = "Which effect is missing"
METHOD_TEXT = (
    "An effect counts only if it explains more of these measurements than of plain tires: tires of "
    "several simulators in which nothing is hidden. The score is how much better the model fits "
    "with the effect, in units of what plain tires gain; they exceed the threshold with the "
    "false-alarm probability. Scores are those beside the model as it is. p is the share of plain "
    "tires from which as much stands out once this effect, and no other, is added."
)
FORCE_TEXT = " Named effects stand in the order of what each alone gains on held-out points."
LEAST_SHOWN = 0.01
"""Least score over threshold that has a bar, as its scale is logarithmic."""
_LEVELS = {"alarm": RED, "hint": BLUE, "quiet": FAINT, STANDS_OUT: INK}


def write_diagnosis(
    found: Assessment | ForceAssessment,
    told: Mapping[str, Any],
    folder: Path,
    history: Sequence[Mapping[str, Any]],
) -> tuple[Path, Path]:
    """Write ``diagnosis.html`` and ``diagnosis.md``; return their paths.

    Parameters
    ----------
    told : mapping
        ``tirelib-diagnosis/1`` of it, with its explanation.
    history : sequence of mapping
        History of the model, as its file holds it.
    """
    return write_parts_page(
        folder,
        "diagnosis",
        parts_of(found, told, history),
        title=f"{TITLE}: {told['quantity']}",
        summary=_summary(found, told),
        messages=told["messages"],
        lines=titled(told["explanation"]),
    )


def parts_of(
    found: Assessment | ForceAssessment,
    told: Mapping[str, Any],
    history: Sequence[Mapping[str, Any]] = (),
) -> list[Part]:
    """Return the parts of the page."""
    force = isinstance(found, ForceAssessment)
    effects = [*found.diagnosis.base.effects]
    effects += [f.effect for f in found.findings if f.level != "quiet"]
    shown = dict.fromkeys(f"{effect.name}: {effect.source}" for effect in effects)
    return [
        Part(
            "Candidates",
            "candidates",
            METHOD_TEXT + FORCE_TEXT * force,
            tables=[_candidates(told)],
            plots=[_scores(told)] if told["candidates"] else [],
        ),
        Part("Error", "error", tables=[_errors(told)], plots=_falls(told, history)),
        Part("What is left", "left", _left(told["unexplained"]), plots=maps(found)),
        Part(
            "Effects that this plan cannot show", "blind", tables=dead_effects(told["dead_reasons"])
        ),
        Part("Next", "next", _advice(told["next_test"])),
        Part("Sources", "sources", sources=[*shown, *(BRUSH if force else (*RING, *METHOD))]),
    ]


def dead_effects(dead: Mapping[str, str]) -> list[Table]:
    """Return the table of effects that the plan cannot show, if there are any."""
    rows = [[name, reason] for name, reason in dead.items()]
    return [Table("Dead effects", ["effect", "why"], rows, texts=2)] if rows else []


def _summary(found: Assessment | ForceAssessment, told: Mapping[str, Any]) -> str:
    if isinstance(found, ForceAssessment):
        what = f"{told['quantity']} at {told['points']} points, axes ISO 8855"
    else:
        what = f"{len(found.diagnosis.runs.waves)} straight runs, strain"
    return (
        f"Campaign {told['campaign']}, {what}. Effects in the model: "
        f"{', '.join(told['has']) or 'none'}. {len(told['candidates'])} effects were tried, "
        f"{len(told['dead'])} cannot be shown by this plan."
    )


def _candidates(told: Mapping[str, Any]) -> Table:
    unit = unit_name(told["error_unit"])
    return Table.of(
        "Effects by rank",
        told["candidates"],
        {
            "effect": lambda entry: entry["effect"],
            "level": lambda entry: mark_of(told, entry),
            "in range": lambda entry: "yes" if entry["in_range"] else "no",
            **TWINS,
            "score / threshold": lambda entry: number(entry["score"] / entry["threshold"], 3),
            "p": lambda entry: number(entry["p"], 2),
            "strength": lambda entry: numbers(np.atleast_1d(entry["strength"])),
            "std": lambda entry: numbers(np.atleast_1d(entry["std"])),
            "unit": lambda entry: entry["unit"],
            f"error with it alone [{unit}]": lambda entry: number(entry["error_after"], 3),
            f"held out [{unit}]": lambda entry: number(entry["heldout_error_after"], 3),
            "power": lambda entry: number(entry["power"], 2),
        },
        texts=4,
        note="Twins: effects whose signatures are less than 30 degrees apart. Power: chance that a "
        "third of the range has a score beyond the threshold. Errors with effects that are not "
        "named are linear approximations. Held out: for named effects only.",
    )


def _scores(told: Mapping[str, Any]) -> Plot:
    """Return the scores over their thresholds."""
    candidates = told["candidates"]
    names, marks = [e["effect"] for e in candidates], [mark_of(told, e) for e in candidates]
    ratio = [entry["score"] / entry["threshold"] for entry in candidates]
    figure = go.Figure(
        go.Bar(
            x=[round(each, 4) if each >= LEAST_SHOWN else None for each in ratio],
            y=names,
            orientation="h",
            marker={"color": [_LEVELS[mark] for mark in marks]},
            customdata=np.round(ratio, 4),
            hovertemplate="%{y}: %{customdata:.3g}<extra></extra>",
        )
    )
    figure.add_vline(x=1.0, line={"dash": "dot", "color": FAINT})
    # the place of an annotation on an axis of powers is a power
    place = {"x": 0.0, "y": 1.0, "yref": "paper", "yanchor": "bottom"}
    figure.add_annotation(**place, text="threshold", showarrow=False)
    figure.update_yaxes(autorange="reversed")
    figure.update_xaxes(title="score / threshold", type="log")
    return Plot.of(
        "scores",
        "Score over threshold",
        _caption(told, marks, ratio),
        styled_figure(figure, 160 + 22 * len(names), showlegend=False),
        {"effect": names, "score / threshold": ratio, "level": marks},
    )


def _caption(told: Mapping[str, Any], marks: Sequence[str], ratio: Sequence[float]) -> str:
    """Return what the colors of the scores mean on this page."""
    text = "Orange: alarm; blue: hint; gray: quiet."
    if min(ratio) < LEAST_SHOWN:
        text += f" A score below {LEAST_SHOWN} has no bar."
    if STANDS_OUT in marks:
        return f"{text} Black: {STANDS_OUT} beside what is named, where a law does not fit."
    beyond = any(mark == "quiet" and r > 1.0 for mark, r in zip(marks, ratio, strict=True))
    if beyond and told["verdict"] in ("named", "indistinguishable"):
        text += " A gray effect beyond the threshold is not needed where what is named is fitted."
    return text


def _errors(told: Mapping[str, Any]) -> Table:
    unit, raw = unit_name(told["error_unit"]), unit_name(told["residual_rms_unit"])
    rows = {
        f"noise, from {told['repeats']} repeats [{raw}]": number(told["noise"], 3),
        f"error of the given model [{unit}]": number(told["error_before"], 4),
        f"error with its parameters fitted again [{unit}]": number(told["error_refitted"], 4),
        f"error with the named effects [{unit}]": number(told["error_after"], 4),
        f"floor: the error that noise and what plain tires show explain [{unit}]": number(
            told["floor"], 4
        ),
        "unweighted rms of model minus measurement, as given and with the named effects "
        f"[{raw}]": _pair(told, "residual_rms_before", "residual_rms_after", 4),
        "largest standard score beside the verdict's model, and the score that plain tires "
        "exceed with the false-alarm probability": f"{number(told['misfit'], 3)} "
        f"({stands(told['misfit_of'])}); {number(told['misfit_floor'], 3)}",
    } | {
        f"left out of the fit: {fold_name(fold)}, error there without and with the named "
        f"effects [{unit}]": _pair(fold, "error_before", "error_after", 3)
        for fold in told["held_out"]
    }
    return Table.listed("Errors", rows)


def _pair(told: Mapping[str, Any], first: str, second: str, digits: int) -> str:
    return f"{number(told[first], digits)}; {number(told[second], digits)}"


def _falls(told: Mapping[str, Any], history: Sequence[Mapping[str, Any]]) -> list[Plot]:
    """Return the error's fall with the named effects, and across the model's history."""
    plots = []
    if told.get("steps"):
        first = Step("base", told["error_refitted"], told["heldout_error_before"])
        steps = [Step(s["effect"], s["error"], s["heldout_error"]) for s in told["steps"]]
        plots.append(
            waterfall(
                [first, *steps],
                unit_name(told["error_unit"]),
                told["floor"],
                "fall",
                "Error as the named effects are added one after the other",
            )
        )
    return [*plots, *waterfall_of(history, told["quantity"])]


def _left(unexplained: Mapping[str, Any]) -> str:
    where, scaling, guess = (unexplained[key] for key in ("where", "scaling", "guess"))
    if where is None:
        return "The remaining residual is no larger than what plain tires show."
    if isinstance(where, Mapping):
        where, scaling = where["text"], scaling["text"]
    text = f"The residual that plain tires do not show lies {where}; it {scaling}."
    if isinstance(guess, Mapping):
        text += (
            f" A guess by sparse regression, measured less model: {guess['law']} "
            f"({100 * guess['explained_held_out']:.0f} % of it on left-out conditions). A guess, "
            "not a law."
        )
    elif guess:
        text += f" A guess at its law: {guess}."
    return text


def _advice(step: Mapping[str, Any]) -> str:
    """Return the next test of a document in words."""
    text = f"{step['what'][0].upper()}{step['what'][1:]}."
    revived = step["would_revive"]
    if revived:
        text += (
            f" Other runs would show {', '.join(revived)}: see the effects that this plan cannot "
            "show."
        )
    return text
