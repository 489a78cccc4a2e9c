"""Errors and maps before and after effects were added, step by step and run by run."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import plotly.graph_objects as go

from tirelib.inference.compare.forces import ForceComparison
from tirelib.inference.compare.strain import Comparison
from tirelib.inference.extend.document import waterfall as fall_of
from tirelib.report.error_sentences import fold_name
from tirelib.report.figures.compare_forces import force_plots
from tirelib.report.figures.compare_heat import heat_maps
from tirelib.report.figures.compare_plot import Plot, above, dots, styled_figure
from tirelib.report.page import unit_name
from tirelib.report.style import BLUE, FAINT, RED


def part_errors(told: Mapping[str, Any]) -> list[Plot]:
    """Return the errors of all that is fitted and of each part held out, before and after.

    Parameters
    ----------
    told : mapping
        ``tirelib-explanation/1`` or ``tirelib-extension/1``.
    """
    if not told["held_out"]:
        return []
    unit = unit_name(told["error_unit"])
    names = ["fitted to all", *(f"held out: {fold_name(fold)}" for fold in told["held_out"])]
    rows = [told, *told["held_out"]]
    before, after = ([row[f"error_{when}"] for row in rows] for when in ("before", "after"))
    figure = _bars(names, before, after, unit)
    figure.update_xaxes(tickangle=-25)
    return [
        Plot.of(
            "part-errors",
            "Error of the fitted runs and of each held-out part",
            "Held out: the error on data that were not used in the fit.",
            styled_figure(figure, 420, barmode="group", legend=above()),
            {"part": names, f"before [{unit}]": before, f"after [{unit}]": after},
        )
    ]


def _bars(
    names: Sequence[str], before: Sequence[float], after: Sequence[float], unit: str
) -> go.Figure:
    figure = go.Figure()
    figure.add_bar(x=names, y=before, name="before", marker={"color": RED})
    figure.add_bar(x=names, y=after, name="after", marker={"color": BLUE})
    return figure.update_yaxes(title=f"error [{unit}]", rangemode="tozero")


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
    unit = unit_name(unit)
    last = sorted(steps[-1]["runs"], key=lambda row: (row["load"], row["run"]))
    of_run = {row["run"]: row for row in steps[0]["runs"]}
    first = [of_run[row["run"]] for row in last]
    names = [f"run {row['run']}: {row['load']:.0f} N" for row in last]
    before, after = [row["error_before"] for row in first], [row["error_after"] for row in last]
    out_before = [_worst(row, "error_before") for row in first]
    out_after = [_worst(row, "error_after") for row in last]
    figure = _bars(names, before, after, unit)
    for values, when, colour, symbol in (
        (out_before, "before", RED, "x"),
        (out_after, "after", BLUE, "circle-open"),
    ):
        name = f"{when}, held out of the fit"
        figure.add_scatter(**dots(names, values, name, colour, 8, symbol=symbol, line={"width": 2}))
    figure.update_xaxes(title="runs, by load [N]", tickangle=-60, tickfont={"size": 10})
    return [
        Plot.of(
            "run-errors",
            "The error of each run",
            "Bars: error of the fit to all runs. Marks: error of a fit without the run, because "
            "its load or its pressure was held out (the larger value where both were).",
            styled_figure(figure, 480, barmode="group", legend=above()),
            {
                "run": names,
                f"before [{unit}]": before,
                f"after [{unit}]": after,
                f"before, held out [{unit}]": out_before,
                f"after, held out [{unit}]": out_after,
            },
        )
    ]


def _worst(row: Mapping[str, Any], key: str) -> float | None:
    """Return the largest held-out error of a run; None where it was in every fit."""
    return max((fold[key] for fold in row["held_out"]), default=None)


def maps(before: Comparison | ForceComparison, after: Comparison | ForceComparison) -> list[Plot]:
    """Return the residual of every run before and after, on one colour scale.

    Of a force these are the difference over slip and load, and the force over its slip.
    """
    return _paired(
        [
            force_plots(found)[:2] if isinstance(found, ForceComparison) else heat_maps(found)[:1]
            for found in (before, after)
        ]
    )


def _paired(pair: Sequence[Sequence[Plot]]) -> list[Plot]:
    """Return plots of before and of after, each named, their first ones on one colour scale."""
    scales = [plots[0].figure.data[0] for plots in pair]
    limit = max(float(scale.zmax) for scale in scales)
    for scale in scales:
        scale.update(zmin=-limit, zmax=limit)
    return [
        replace(plot, name=f"{plot.name}-{when}", title=f"{when.capitalize()}: {plot.title}")
        for plots, when in zip(pair, ("before", "after"), strict=True)
        for plot in plots
    ]


class Step(NamedTuple):
    """A model on the way: label, error of its fit, error on held-out points (None if unknown)."""

    label: str
    error: float | None
    held_out: float | None


def waterfall(
    steps: Sequence[Step],
    unit: str,
    floor: float | None,
    name: str = "waterfall",
    title: str = "The model's history",
) -> Plot:
    """Return bars of the error after each step.

    Parameters
    ----------
    unit : str
        Unit of the errors.
    floor : float, optional
        Error that structure leaves without a missing effect; NaN if unknown.
    """
    labels = [f"{k}: {step.label}" if k else step.label for k, step in enumerate(steps)]
    figure = go.Figure()
    errors, held = np.array([step[1:] for step in steps], dtype=np.float64).T  # None becomes NaN
    for values, what, colour in ((errors, "fitted", BLUE), (held, "held out", RED)):
        if np.isfinite(values).any():
            figure.add_bar(
                x=labels,
                y=values,
                name=what,
                marker={"color": colour},
                text=[f"{value:.3g}" if np.isfinite(value) else "" for value in values],
                textposition="outside",
                cliponaxis=False,
            )
    if floor is not None and np.isfinite(floor):
        figure.add_hline(
            y=floor,
            line={"dash": "dot", "color": FAINT},
            annotation_text="floor",
            annotation_position="top left",
        )
    figure.update_yaxes(title=f"error [{unit}]", rangemode="tozero")
    figure.update_xaxes(title="effect added (-: removed)")
    return Plot.of(
        name,
        title,
        "Rms error after each step, fitted anew each time; held out: on points that took no part "
        "in the fit.",
        styled_figure(figure, 380, barmode="group"),
        {"step": labels, f"error [{unit}]": errors, f"held-out error [{unit}]": held},
    )


def waterfall_of(history: Sequence[Mapping[str, Any]], quantity: str) -> list[Plot]:
    """Return the fall across a model's history for one quantity; nothing without entries."""
    rows = fall_of(history, quantity)
    if not rows:
        return []
    unit = rows[0]["unit"]
    last = [e for e in history if e.get("quantity", "strain") == quantity][-1]
    floor = last.get("floor" if unit == "noise" else f"floor_{unit}")
    steps = [Step(_label(**row), row["error"], row["heldout_error"]) for row in rows]
    name, title = f"history-{quantity}", f"The model's history, {quantity}"
    return [waterfall(steps, unit_name(unit), floor, name, title)]


def _label(action: str, effect: str | None, **_: Any) -> str:
    return "before" if effect is None else f"{'-' if action == 'remove' else ''}{effect}"
