"""The page of a diagnosis: one self-contained HTML file; and the same in Markdown."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tirelib.diagnose.document import Assessment, exceeds, next_test
from tirelib.diagnose.held_out import pooled
from tirelib.diagnose.left import Left, left_of
from tirelib.report.comparison import METHOD, RING
from tirelib.report.figures.compare_plot import (
    ANGLE_TITLE,
    Plot,
    heat,
    limit_of,
    styled_figure,
)
from tirelib.report.figures.waterfall import waterfall_of
from tirelib.report.findings import advice, dead_effects, score_bars
from tirelib.report.page import Table, number, numbers
from tirelib.report.parts_page import Part, write_parts_page
from tirelib.waveforms import GRID

TITLE = "Which effect is missing"
METHOD_TEXT = (
    "Every hypothesis - no effect, one, two or three - is fitted together with the tire's numbers. "
    "What stands out beside it is compared with what plain tires show, tires of three simulators "
    "in which nothing is hidden: the standard score of an effect is its likelihood ratio in units "
    "of theirs. The p-value of a hypothesis is the share of plain tires with as large a score. "
    "Every hypothesis with a p-value above the false-alarm probability stays in the set, and its "
    "smallest members are the verdict. Scores in this table are those beside the model as it is; "
    "the p-value is that of the hypothesis that this effect is missing and no other."
)


def write_diagnosis(
    told: Assessment,
    folder: Path,
    history: Sequence[Mapping[str, Any]],
    lines: Sequence[tuple[str, str]],
) -> tuple[Path, Path]:
    """Write ``diagnosis.html`` and ``diagnosis.md``; return their paths.

    Parameters
    ----------
    told : Assessment
    folder : Path
    history : sequence of mapping
        History of the model, as its file holds it.
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
        parts_of(told, history),
        title=TITLE,
        summary=_summary(told),
        messages=told.messages,
        lines=lines,
    )


def parts_of(told: Assessment, history: Sequence[Mapping[str, Any]] = ()) -> list[Part]:
    """Return the parts of the page."""
    found = told.diagnosis
    fall = waterfall_of(history, "strain")
    before = left_of(told.refitted, found.problem.data.points)
    plots = [_map(told, before, "before", "Without the named effects")]
    if told.named:
        plots.append(_map(told, told.left, "after", f"With {', '.join(told.named)}"))
    return [
        Part(
            "Candidates",
            "candidates",
            METHOD_TEXT,
            tables=[_candidates(told)],
            plots=[score_bars(told.findings)],
        ),
        Part("Error", "error", tables=[_errors(told)], plots=[fall] if fall else []),
        Part("What is left", "left", _left_text(told), plots=plots),
        Part(
            "Effects that this plan cannot show", "blind", tables=dead_effects(told.diagnosis.dead)
        ),
        Part("Next", "next", advice(next_test(told))),
        Part("Sources", "sources", sources=_sources(told)),
    ]


def _summary(told: Assessment) -> str:
    found = told.diagnosis
    has = ", ".join(effect.name for effect in found.base.effects) or "none"
    return (
        f"Campaign {found.runs.waves.header.name}, {len(found.runs.waves)} straight runs, strain. "
        f"Effects in the model: {has}. {len(told.findings)} effects were tried."
    )


def _unit(told: Assessment) -> str:
    return "noise" if told.after.known else "microstrain"


def _candidates(told: Assessment) -> Table:
    unit = _unit(told)
    return Table.of(
        "Effects by rank",
        told.findings,
        {
            "effect": lambda f: f.effect.name,
            "level": lambda f: f.level,
            "in range": lambda f: "yes" if f.in_range else "no",
            "twins (angle)": lambda f: ", ".join(
                f"{twin} {np.rad2deg(angle):.0f}\u00b0" for twin, angle in f.twins
            ),
            "score / threshold": lambda f: number(f.score / f.threshold, 3),
            "p": lambda f: number(f.p, 2),
            "strength": lambda f: numbers(f.strength),
            "std": lambda f: numbers(f.std),
            "unit": lambda f: f.effect.unit,
            f"error with it [{unit}]": lambda f: number(told.error_with(f), 3),
            f"held out [{unit}]": lambda f: number(
                pooled(told.held_after.get(f.effect.name, ()), told.folds), 3
            ),
            "power": lambda f: number(f.power, 2),
        },
        texts=4,
        note="Twins: effects whose signatures are less than 30 degrees apart. Power: chance that "
        "a third of the range has a score beyond the threshold. Errors with "
        "effects that are not named are linear approximations.",
    )


def _errors(told: Assessment) -> Table:
    verdict, unit = told.diagnosis.verdict, _unit(told)
    best = verdict.best
    limit = best.limit(verdict.alpha)
    rows = [
        [
            "noise of a run's waveform, from repeats [microstrain]",
            number(1e6 * told.before.noise, 3),
        ],
        [f"error of the given model [{unit}]", number(told.before.value, 4)],
        [f"error with its parameters fitted again [{unit}]", number(told.refitted.value, 4)],
        [f"error with the named effects [{unit}]", number(told.after.value, 4)],
        [
            f"floor: the error that noise and what plain tires show explain [{unit}]",
            number(told.floor, 4),
        ],
        [
            "unweighted rms of model minus measurement, as given and with the named effects "
            "[microstrain]",
            f"{number(1e6 * told.before.rms, 4)}; {number(1e6 * told.after.rms, 4)}",
        ],
        [
            "largest standard score beside the verdict's model, and the score that plain tires "
            "exceed with the false-alarm probability",
            f"{number(best.statistic, 3)} ({best.against}); {number(limit, 3)}",
        ],
    ]
    for k, fold in enumerate(told.folds):
        after = [
            f"{name}: {number(errors[k], 3)}" for name, errors in told.held_after.items() if errors
        ]
        rows.append(
            [
                f"highest {fold.name} left out of the fit ({int(fold.out.sum())} runs): "
                f"error there without, and with one effect [{unit}]",
                f"{number(told.held_before[k], 3)}; {', '.join(after)}",
            ]
        )
    return Table("Errors", ["", "value"], rows)


def _left_text(told: Assessment) -> str:
    guess = told.diagnosis.guess
    if not exceeds(told):
        return "The remaining residual is no larger than what plain tires show."
    text = (
        f"The residual that plain tires do not show lies {told.left.where}; it {told.left.scaling}."
    )
    if guess is not None:
        text += (
            f" A guess by sparse regression, measured less model: {guess.law} "
            f"({100 * guess.explained:.0f} % of it on left-out conditions). A guess, not a law."
        )
    return text


def _sources(told: Assessment) -> list[str]:
    shown = [f.effect for f in told.findings if f.level != "quiet" or f.effect.name in told.named]
    return [*(f"{effect.name}: {effect.source}" for effect in shown), *RING, *METHOD]


def _map(told: Assessment, left: Left, name: str, title: str) -> Plot:
    points, run = told.diagnosis.problem.data.points, told.diagnosis.runs.waves.run
    order = np.lexsort((points.speed, points.pressure, np.round(points.load, -2)))
    data = left.white[order]
    unit = _unit(told)
    limit = limit_of(told.refitted.white_of(told.refitted.rest))
    degrees = np.rad2deg(GRID)
    figure = heat(
        np.round(data, 2),
        np.round(degrees, 2),
        limit,
        unit,
        hovertemplate="%{x:.0f} deg: %{z:.3g} " + unit + "<extra></extra>",
    )
    figure.update_xaxes(title=ANGLE_TITLE, range=[-180, 180], dtick=30)
    marks = list(range(0, len(order), max(1, len(order) // 10)))
    figure.update_yaxes(
        title="runs, by load",
        tickvals=marks,
        showgrid=False,
        ticktext=[f"run {run[order[k]]}: {points.load[order[k]]:.0f} N" for k in marks],
    )
    styled_figure(figure, 480)
    labels = [f"run {run[k]}: {points.load[k]:.0f} N [{unit}]" for k in order]
    rows = [[round(float(a), 3), *np.round(data[:, j], 3).tolist()] for j, a in enumerate(degrees)]
    return Plot(
        f"residual-{name}",
        title,
        "Model minus measurement, with set-point errors weighted down as in the fit. One colour "
        "scale for both maps. Red: the model shows too much tension; blue: too much compression.",
        figure,
        ["wheel angle [deg]", *labels],
        rows,
    )
