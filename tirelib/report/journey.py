"""The page of a whole journey: before and after, the errors of each run, links and commands."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from tirelib.compare.force_curves import Curve, curves_of, ranked, slip_of
from tirelib.compare.forces import UNITS, ForceComparison
from tirelib.compare.strain import Comparison
from tirelib.report.explanation import fold_name, titled
from tirelib.report.figures.compare_forces import force_plots
from tirelib.report.figures.compare_heat import DEGREES, heat_maps
from tirelib.report.figures.compare_plot import ANGLE_TITLE, Plot, styled_figure
from tirelib.report.figures.compare_waveforms import HALF
from tirelib.report.figures.waterfall import waterfall_of
from tirelib.report.page import Table, number
from tirelib.report.parts_page import Part, write_parts_page
from tirelib.report.style import BLUE, FAINT, INK, RED

TITLE = "What the model lacked"
_SLIPS = {
    "slip_angle": ("slip_angle", float(np.rad2deg(1.0)), "slip angle [deg] (ISO 8855)"),
    "slip_ratio": ("slip_ratio", 1.0, "slip ratio [-] (ISO 8855)"),
}
WORDS = {"noise": "noise", "ustrain": "microstrain"}


@dataclass(frozen=True, slots=True)
class Journey:
    """Results of the steps of a journey.

    Attributes
    ----------
    before, after : Comparison or ForceComparison
        Comparisons of the first and of the last model; the same if nothing was added.
    document : mapping
        ``tirelib-explanation/1``.
    steps : sequence of mapping
        ``tirelib-extension/1`` of each effect that was added.
    history : sequence of mapping
        History of the last model.
    """

    before: Comparison | ForceComparison
    after: Comparison | ForceComparison
    document: Mapping[str, Any]
    steps: Sequence[Mapping[str, Any]]
    history: Sequence[Mapping[str, Any]]


def write_journey(journey: Journey, folder: Path) -> tuple[Path, Path]:
    """Write ``index.html`` and ``index.md`` into a folder; return their paths.

    Raises
    ------
    OSError
        If the folder cannot be written.
    """
    told = journey.document
    links = [(page["title"], page["path"]) for page in told["pages"]]
    return write_parts_page(
        folder,
        "index",
        parts_of(journey),
        title=TITLE,
        summary=_summary(told),
        answer="",
        messages=told["messages"],
        lines=titled(told["explanation"]),
        links=links,
        commands=told["commands"],
    )


def _summary(told: Mapping[str, Any]) -> str:
    added = ", ".join(told["added"]) or "nothing"
    return f"Campaign {told['campaign']}, {told['quantity']}. Added to the model: {added}."


def parts_of(journey: Journey) -> list[Part]:
    """Return the parts of the page."""
    before, after = journey.before, journey.after
    if isinstance(before, ForceComparison) or isinstance(after, ForceComparison):
        assert isinstance(before, ForceComparison)  # noqa: S101 - both are of one quantity
        assert isinstance(after, ForceComparison)  # noqa: S101
        curves, maps, errors = (
            _force_curves(before, after),
            _force_maps(before, after),
            part_errors(journey.document),
        )
    else:
        curves, maps = waveforms(before, after), _maps(before, after)
        errors = run_errors(journey.steps, before.error.unit)
    fall = waterfall_of(journey.history, journey.document["quantity"])
    return [
        Part(
            "The error, step by step",
            "error",
            tables=[_table(journey)],
            plots=[fall] if fall is not None else [],
        ),
        Part(
            "Each part of the measurements, before and after",
            "runs",
            tables=_held_out(journey),
            plots=errors,
        ),
        Part("Measured, before and after", "curves", plots=curves),
        Part("Where the model fails, before and after", "maps", plots=maps),
    ]


def _table(journey: Journey) -> Table:
    told = journey.document
    unit = WORDS.get(told["error_unit"], told["error_unit"])
    raw = WORDS.get(told["residual_rms_unit"], told["residual_rms_unit"])
    return Table.of(
        "The models",
        told["steps"],
        {
            "model": lambda step: step["model"],
            "what it has": lambda step: step["what"],
            f"error [{unit}]": lambda step: number(step["error"], 3),
            f"held out [{unit}]": lambda step: number(step["heldout_error"], 3),
            f"rms left [{raw}]": lambda step: number(step["residual_rms_raw"], 3),
        },
        texts=2,
        note="Held out: the error on runs that were not used in the fit.",
    )


def _held_out(journey: Journey) -> list[Table]:
    """Return what was held out of the fits, of the first model and of the last."""
    told = journey.document
    unit = WORDS.get(told["error_unit"], told["error_unit"])
    if not told["held_out"]:
        return []
    return [
        Table.of(
            "Held out of the fit",
            told["held_out"],
            {
                "held out": fold_name,
                f"before [{unit}]": lambda fold: number(fold["error_before"], 3),
                f"after [{unit}]": lambda fold: number(fold["error_after"], 3),
            },
        )
    ]


def part_errors(told: Mapping[str, Any]) -> list[Plot]:
    """Return the errors of all that is fitted and of each part held out, before and after.

    Parameters
    ----------
    told : mapping
        ``tirelib-explanation/1`` or ``tirelib-extension/1``.
    """
    if not told["held_out"]:
        return []
    unit = WORDS.get(told["error_unit"], told["error_unit"])
    names = ["fitted to all", *(f"held out: {fold_name(fold)}" for fold in told["held_out"])]
    rows = [told, *told["held_out"]]
    figure = go.Figure()
    for when, colour in (("before", RED), ("after", BLUE)):
        figure.add_bar(
            x=names, y=[row[f"error_{when}"] for row in rows], name=when, marker={"color": colour}
        )
    figure.update_yaxes(title=f"error [{unit}]", rangemode="tozero")
    figure.update_xaxes(tickangle=-25)
    styled_figure(figure, 420, barmode="group", legend={"orientation": "h", "y": 1.12, "x": 0.0})
    data = [
        [name, row["error_before"], row["error_after"]]
        for name, row in zip(names, rows, strict=True)
    ]
    return [
        Plot(
            "part-errors",
            "Error of the fitted runs and of each held-out part",
            "Held out: the error on data that were not used in the fit.",
            figure,
            ["part", f"before [{unit}]", f"after [{unit}]"],
            data,
        )
    ]


def run_errors(steps: Sequence[Mapping[str, Any]], unit: str) -> list[Plot]:
    """Return the error of each run before the first step and after the last, with those held out.

    Parameters
    ----------
    steps : sequence of mapping
        ``tirelib-extension/1`` of strain.
    unit : str
        Unit of the errors.
    """
    if not steps or "runs" not in steps[0]:
        return []
    told = WORDS.get(unit, unit)
    first = {row["run"]: row for row in steps[0]["runs"]}
    last = sorted(steps[-1]["runs"], key=lambda row: (row["load"], row["run"]))
    names = [f"run {row['run']}: {row['load']:.0f} N" for row in last]
    before = [first[row["run"]]["error_before"] for row in last]
    after = [row["error_after"] for row in last]
    out_before = [_worst(first[row["run"]], "error_before") for row in last]
    out_after = [_worst(row, "error_after") for row in last]
    figure = go.Figure()
    figure.add_bar(x=names, y=before, name="before", marker={"color": RED})
    figure.add_bar(x=names, y=after, name="after", marker={"color": BLUE})
    for values, name, colour, symbol in (
        (out_before, "before, held out of the fit", RED, "x"),
        (out_after, "after, held out of the fit", BLUE, "circle-open"),
    ):
        figure.add_scatter(
            x=names,
            y=values,
            mode="markers",
            name=name,
            marker={"color": colour, "symbol": symbol, "size": 8, "line": {"width": 2}},
        )
    figure.update_yaxes(title=f"error [{told}]", rangemode="tozero")
    figure.update_xaxes(title="runs, by load", tickangle=-60, tickfont={"size": 10})
    styled_figure(figure, 480, barmode="group", legend={"orientation": "h", "y": 1.12, "x": 0.0})
    rows = [list(row) for row in zip(names, before, after, out_before, out_after, strict=True)]
    return [
        Plot(
            "run-errors",
            "The error of each run",
            "Bars: error of the fit to all runs. Marks: error of a fit without the run, because "
            "its load or its pressure was held out (the larger value where both were).",
            figure,
            [
                "run",
                f"before [{told}]",
                f"after [{told}]",
                f"before, held out [{told}]",
                f"after, held out [{told}]",
            ],
            rows,
        )
    ]


def _worst(row: Mapping[str, Any], key: str) -> float | None:
    """Return the largest held-out error of a run; None where it was in every fit."""
    return max((fold[key] for fold in row["held_out"]), default=None)


def waveforms(before: Comparison, after: Comparison) -> list[Plot]:
    """Return measured and modelled waveforms of the worst, the median and the best run."""
    plots: list[Plot] = []
    seen: set[int] = set()
    for name, i in zip(("worst", "median", "best"), reversed(before.ranked()), strict=True):
        if i not in seen:
            plots.append(_waveform(before, after, i, name))
        seen.add(i)
    return plots


def _waveform(before: Comparison, after: Comparison, i: int, name: str) -> Plot:
    c = before.chosen.waves.conditions
    measured = 1e6 * before.chosen.strain[i]
    models = [1e6 * found.prediction.strain[i] for found in (before, after)]
    left = [1e6 * found.difference[i] for found in (before, after)]
    figure = make_subplots(
        rows=2, cols=1, shared_xaxes=True, row_heights=[0.62, 0.38], vertical_spacing=0.06
    )
    figure.add_scatter(
        x=DEGREES, y=measured, name="measured", line={"color": INK, "width": 2.5}, row=1, col=1
    )
    for k, (word, colour, dash) in enumerate((("before", RED, "dash"), ("after", BLUE, "solid"))):
        figure.add_scatter(
            x=DEGREES,
            y=models[k],
            name=f"model {word}",
            row=1,
            col=1,
            line={"color": colour, "width": 1.8, "dash": dash},
        )
        figure.add_scatter(
            x=DEGREES,
            y=left[k],
            name=f"model {word} minus measured",
            row=2,
            col=1,
            line={"color": colour, "width": 1.5, "dash": dash},
            showlegend=False,
        )
    for edge in np.rad2deg(after.prediction.edges[i]):
        figure.add_vline(x=float(edge), line={"color": FAINT, "width": 1, "dash": "dot"})
    figure.update_xaxes(range=[-HALF, HALF], dtick=20)
    figure.update_xaxes(title=ANGLE_TITLE, row=2, col=1)
    figure.update_yaxes(title="strain [microstrain]", tickformat=",", row=1, col=1)
    figure.update_yaxes(title="difference<br>[microstrain]", row=2, col=1)
    styled_figure(figure, 540, legend={"orientation": "h", "y": 1.1, "x": 0.0})
    size = [1e6 * float(found.run_rms[i]) for found in (before, after)]
    rows = np.round(np.stack([DEGREES, measured, *models, *left], axis=1), 3).tolist()
    return Plot(
        f"waveform-{name}",
        f"{name.capitalize()} run of before: {before.run[i]} ({c['Fz'][i]:,.0f} N, "
        f"{c['pressure'][i] / 1e5:.2f} bar, {c['speed'][i] * 3.6:.0f} km/h)",
        f"The difference, corrected for set points, was {size[0]:.0f} microstrain rms and is now "
        f"{size[1]:.0f}. Shown is the strain minus its mean over the turn, averaged over the "
        "gages, tension positive. Dotted: edges of the contact of the model after.",
        figure,
        [
            "wheel angle [deg]",
            *(
                f"{what} [microstrain]"
                for what in (
                    "measured",
                    "model before",
                    "model after",
                    "before less measured",
                    "after less measured",
                )
            ),
        ],
        rows,
    )


def _maps(before: Comparison, after: Comparison) -> list[Plot]:
    """Return the residual of every run before and after, on one colour scale."""
    plots = [heat_maps(found)[0] for found in (before, after)]
    limit = max(float(plot.figure.data[0].zmax) for plot in plots)
    for plot in plots:
        plot.figure.data[0].update(zmin=-limit, zmax=limit)
    return _named(plots[:1], "before") + _named(plots[1:], "after")


def _force_curves(before: ForceComparison, after: ForceComparison) -> list[Plot]:
    """Return measured and modelled forces on the worst, the median and the best curve of before."""
    named = ranked(curves_of(before))
    return [_force_curve(before, after, named[name], name) for name in reversed(list(named))]


def _force_curve(before: ForceComparison, after: ForceComparison, curve: Curve, name: str) -> Plot:
    unit, k = UNITS[before.quantity], curve.member
    slip, factor, title = _SLIPS[slip_of(before.quantity)]
    x, measured = factor * getattr(before.data, slip)[k], before.measured[k]
    figure = make_subplots(
        rows=2, cols=1, shared_xaxes=True, row_heights=[0.62, 0.38], vertical_spacing=0.06
    )
    figure.add_scatter(
        x=x,
        y=measured,
        mode="markers",
        name="measured",
        row=1,
        col=1,
        marker={"color": INK, "size": 7, "symbol": "circle-open"},
    )
    columns = [x, measured]
    for found, word, colour, symbol in (
        (before, "before", RED, "x"),
        (after, "after", BLUE, "circle"),
    ):
        marker = {"color": colour, "size": 5, "symbol": symbol}
        figure.add_scatter(
            x=x,
            y=found.predicted[k],
            mode="markers",
            name=f"model {word}",
            marker=marker,
            row=1,
            col=1,
        )
        figure.add_scatter(
            x=x,
            y=found.difference[k],
            mode="markers",
            showlegend=False,
            name=f"model {word} minus measured",
            marker=marker,
            row=2,
            col=1,
        )
        columns += [found.predicted[k], found.difference[k]]
    figure.add_hline(y=0.0, line={"color": FAINT, "width": 1}, row=2, col=1)
    figure.update_xaxes(title=title, row=2, col=1)
    figure.update_yaxes(title=f"{before.quantity} [{unit}] (ISO 8855)", row=1, col=1)
    figure.update_yaxes(title=f"difference<br>[{unit}]", row=2, col=1)
    styled_figure(figure, 540, legend={"orientation": "h", "y": 1.1, "x": 0.0})
    size = [float(np.sqrt(np.mean(found.difference[k] ** 2))) for found in (before, after)]
    return Plot(
        f"curve-{name}",
        f"{name.capitalize()} curve of before: {curve.words}",
        f"The difference was {number(size[0], 3)} {unit} rms and is {number(size[1], 3)}. The "
        "models are computed at the conditions of each point.",
        figure,
        [
            title,
            *(
                f"{what} [{unit}]"
                for what in (
                    "measured",
                    "model before",
                    "before less measured",
                    "model after",
                    "after less measured",
                )
            ),
        ],
        np.round(np.stack(columns, axis=1), 5).tolist(),
    )


def _force_maps(before: ForceComparison, after: ForceComparison) -> list[Plot]:
    """Return difference over slip and load and the force over its slip, before and after."""
    pairs = [force_plots(found)[:2] for found in (before, after)]
    maps = [pair[0] for pair in pairs]
    limit = max(float(plot.figure.data[0].zmax) for plot in maps)
    for plot in maps:
        plot.figure.data[0].update(zmin=-limit, zmax=limit)
    return [
        plot
        for pair, when in zip(pairs, ("before", "after"), strict=True)
        for plot in _named(pair, when)
    ]


def _named(plots: Sequence[Plot], when: str) -> list[Plot]:
    """Return plots with names of their own, that say whether they are of before or after."""
    return [
        replace(plot, name=f"{plot.name}-{when}", title=f"{when.capitalize()}: {plot.title}")
        for plot in plots
    ]
