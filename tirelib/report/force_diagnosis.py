"""The page of a diagnosis of forces: one self-contained HTML file; and the same in Markdown."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tirelib.diagnose.forces.assess import ForceAssessment
from tirelib.diagnose.forces.document import exceeds, fold_words, next_test
from tirelib.diagnose.forces.held_out import pooled
from tirelib.report.comparison import BRUSH
from tirelib.report.figures.compare_plot import Plot
from tirelib.report.figures.force_left import residual_map
from tirelib.report.figures.waterfall import Step, waterfall, waterfall_of
from tirelib.report.findings import advice, dead_effects, score_bars
from tirelib.report.page import Table, number
from tirelib.report.parts_page import Part, write_parts_page

METHOD_TEXT = (
    "Every effect has a score: how much better the points are explained with it than without, "
    "beside everything that plain tires show in addition to a brush, as a standard score. The "
    "threshold is the score that plain tires exceed with the false-alarm probability. Beside no "
    "effect of a named set may anything exceed it. Named effects stand in the order of what each "
    "alone gains on held-out points."
)


def answer_of(told: ForceAssessment) -> str:
    """Return the verdict in plain words."""
    names, unit = ", ".join(told.named), told.case.unit
    before, after, floor = (number(e, 3) for e in (told.before, told.after, told.floor))
    fall = f"the error falls from {before} to {after} {unit} (floor {floor})"
    return {
        "none": f"No effect stands out: the error {before} {unit} (floor {floor}) gives no reason "
        "to name one.",
        "named": f"Missing: {names}. With {'them' if len(told.named) > 1 else 'it'} {fall}.",
        "form_inadequate": f"Missing: {names}: {fall}. More is left than plain "
        "tires leave, so a law has the wrong form or more is missing.",
        "indistinguishable": f"One of {names} is missing; this campaign cannot distinguish them: "
        f"{fall}.",
        "unknown": "Something is missing that no effect of the catalogue explains; error "
        f"{before} {unit} (floor {floor}).",
    }[told.verdict]


def write_force_diagnosis(
    told: ForceAssessment, folder: Path, lines: Sequence[tuple[str, str]] = ()
) -> tuple[Path, Path]:
    """Write ``diagnosis.html`` and ``diagnosis.md``; return their paths.

    Parameters
    ----------
    told : ForceAssessment
    folder : Path
    lines : sequence of (title, sentence)
        The verdict in four lines (`tirelib.report.explanation`).

    Raises
    ------
    OSError
        If the folder cannot be written.
    """
    return write_parts_page(
        folder,
        "diagnosis",
        parts_of(told),
        title=f"Which effect is missing: {told.case.quantity}",
        summary=_summary(told),
        answer=answer_of(told),
        messages=told.messages,
        lines=lines,
    )


def parts_of(told: ForceAssessment) -> list[Part]:
    """Return the parts of the page."""
    found = told.diagnosis
    maps = [residual_map(told, found.base, "before", "Without the named effects")]
    if told.named:
        maps.append(residual_map(told, found.final, "after", f"With {', '.join(told.named)}"))
    return [
        Part(
            "Candidates",
            "candidates",
            METHOD_TEXT,
            tables=[_candidates(told)],
            plots=[score_bars(told.findings)] if told.findings else [],
        ),
        Part("Error", "error", tables=[_errors(told)], plots=_fall(told)),
        Part("What is left", "left", _left_text(told), plots=maps),
        Part(
            "Effects that this plan cannot show", "blind", tables=dead_effects(told.diagnosis.dead)
        ),
        Part("Next", "next", advice(next_test(told))),
        Part("Sources", "sources", sources=_sources(told)),
    ]


def _summary(told: ForceAssessment) -> str:
    case = told.case
    has = ", ".join(effect.name for effect in case.effects) or "none"
    return (
        f"Campaign {case.name}, {case.quantity} at {len(case.problem)} points, axes ISO 8855. "
        f"Effects in the model: {has}. {len(told.findings)} effects were tried, "
        f"{len(told.diagnosis.dead)} cannot be shown by this plan."
    )


def _candidates(told: ForceAssessment) -> Table:
    unit, factor = told.case.unit, told.case.factor
    rows = [
        [
            f.effect.name,
            f.level,
            "yes" if f.in_range else "no",
            ", ".join(f"{twin} {np.rad2deg(angle):.0f}\u00b0" for twin, angle in f.twins),
            number(f.score / f.threshold, 3),
            ", ".join(number(float(x), 3) for x in f.strength),
            ", ".join(number(float(x), 2) for x in f.std),
            f.effect.unit,
            number(factor * told.diagnosis.error_with(f), 3),
            number(factor * told.diagnosis.held_with(f), 3),
            number(f.power, 2),
        ]
        for f in told.findings
    ]
    return Table(
        "Effects by rank",
        [
            "effect",
            "level",
            "in range",
            "twins (angle)",
            "score / threshold",
            "strength",
            "std",
            "unit",
            f"error with it alone [{unit}]",
            f"held out [{unit}]",
            "power",
        ],
        rows,
        texts=4,
        note="Twins: effects whose signatures are less than 30 degrees apart. Power: chance that a "
        "third of the range has a score beyond the threshold. Held out: for named effects only.",
    )


def _errors(told: ForceAssessment) -> Table:
    found, factor, unit = told.diagnosis, told.case.factor, told.case.unit
    rows = [
        [
            f"noise of a point, from {told.case.repeats} repeated cells "
            f"[{'Nm' if told.case.quantity == 'Mz' else 'N'}]",
            number(told.case.noise, 3),
        ],
        [f"error of the given model [{unit}]", number(told.before, 4)],
        [
            f"error with its parameters fitted again [{unit}]",
            number(told.case.error(found.base), 4),
        ],
        [f"error with the named effects [{unit}]", number(told.after, 4)],
        [
            f"floor: the error that noise and what plain tires show explain [{unit}]",
            number(told.floor, 4),
        ],
    ]
    for fold, old, new in zip(found.folds, found.held_before, found.held_final, strict=True):
        rows.append(
            [
                f"left out of the fit: {fold_words(fold)} ({int(fold.out.sum())} points), "
                f"error there without and with the named effects [{unit}]",
                f"{number(factor * old, 3)}; {number(factor * new, 3)}",
            ]
        )
    return Table("Errors", ["", "value"], rows)


def _fall(told: ForceAssessment) -> list[Plot]:
    found, factor = told.diagnosis, told.case.factor
    if not told.named or not found.steps:
        return []
    first = Step("base", factor * found.base.error, factor * pooled(found.held_before, found.folds))
    steps = [Step(name, factor * e, factor * h) for name, e, h in found.steps]
    history = waterfall_of(told.case.model.history, told.case.quantity)
    plots = [
        waterfall(
            [first, *steps],
            told.case.unit,
            told.floor,
            "fall",
            "Error as the named effects are added one after the other",
        )
    ]
    if history is not None:
        plots.append(history)
    return plots


def _left_text(told: ForceAssessment) -> str:
    if not exceeds(told):
        return "The remaining residual is no larger than what plain tires leave of a brush."
    guess = f" A guess at its law: {told.left.guess}." if told.left.guess else ""
    return f"The remaining residual lies {told.left.where}; it {told.left.scaling}.{guess}"


def _sources(told: ForceAssessment) -> Sequence[str]:
    shown = [f.effect for f in told.findings if f.level != "quiet"]
    shown += [effect for effect in told.case.effects if effect not in shown]
    return [*(f"{effect.name}: {effect.source}" for effect in shown), *BRUSH]
