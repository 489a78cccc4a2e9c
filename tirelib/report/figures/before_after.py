"""Figures of two models on the same measurements: before and after an effect was added."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import plotly.graph_objects as go

from tirelib.core.quantities import QUANTITIES
from tirelib.inference.compare.force_curves import Curve, curves_of, ranked, slip_of
from tirelib.inference.compare.forces import UNITS, ForceComparison
from tirelib.inference.compare.strain import Comparison
from tirelib.report.error_sentences import fold_name
from tirelib.report.figures.compare_forces import force_plots
from tirelib.report.figures.compare_heat import DEGREES, heat_maps
from tirelib.report.figures.compare_plot import (
    Plot,
    Trace,
    noise_band,
    stack_titles,
    stacked,
    styled_figure,
)
from tirelib.report.figures.compare_waveforms import waveform_axes
from tirelib.report.page import number, unit_name
from tirelib.report.style import BLUE, INK, RED


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
    told = unit_name(unit)
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
    looks = (("before", RED, "dash"), ("after", BLUE, "solid"))
    figure = stacked(
        DEGREES,
        [
            {"y": measured, "name": "measured", "line": {"color": INK, "width": 2.5}},
            *(
                {"y": y, "name": f"model {word}", "line": {"color": colour, "dash": dash}}
                for y, (word, colour, dash) in zip(models, looks, strict=True)
            ),
        ],
        [
            {
                "y": y,
                "name": f"model {word} minus measured",
                "line": {"color": colour, "width": 1.5, "dash": dash},
                "showlegend": False,
            }
            for y, (word, colour, dash) in zip(left, looks, strict=True)
        ],
    )
    waveform_axes(figure, after.prediction.edges[i])
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


def maps(before: Comparison, after: Comparison) -> list[Plot]:
    """Return the residual of every run before and after, on one colour scale."""
    plots = [heat_maps(found)[0] for found in (before, after)]
    limit = max(float(plot.figure.data[0].zmax) for plot in plots)
    for plot in plots:
        plot.figure.data[0].update(zmin=-limit, zmax=limit)
    return _named(plots[:1], "before") + _named(plots[1:], "after")


def force_curves(before: ForceComparison, after: ForceComparison) -> list[Plot]:
    """Return measured and modelled forces on the worst, the median and the best curve of before."""
    named = ranked(curves_of(before))
    return [_force_curve(before, after, named[name], name) for name in reversed(list(named))]


def _force_curve(before: ForceComparison, after: ForceComparison, curve: Curve, name: str) -> Plot:
    unit, k = UNITS[before.quantity], curve.member
    slip = slip_of(before.quantity)
    title = QUANTITIES[slip].label
    x, measured = QUANTITIES[slip].told(getattr(before.data, slip)[k]), before.measured[k]
    looks = ((before, "before", RED, "x"), (after, "after", BLUE, "circle"))
    columns = [x, measured]
    values: list[Trace] = [
        {
            "y": measured,
            "name": "measured",
            "marker": {"color": INK, "size": 7, "symbol": "circle-open"},
        }
    ]
    differences: list[Trace] = []
    for found, word, colour, symbol in looks:
        marker = {"color": colour, "size": 5, "symbol": symbol}
        values.append({"y": found.predicted[k], "name": f"model {word}", "marker": marker})
        differences.append(
            {
                "y": found.difference[k],
                "name": f"model {word} minus measured",
                "marker": marker,
                "showlegend": False,
            }
        )
        columns += [found.predicted[k], found.difference[k]]
    figure = stacked(x, values, differences, mode="markers")
    noise_band(figure, before.noise, row=2, col=1)
    stack_titles(figure, title, f"{before.quantity} [{unit}] (ISO 8855)", unit)
    size = [float(np.sqrt(np.mean(found.difference[k] ** 2))) for found in (before, after)]
    return Plot(
        f"curve-{name}",
        f"{name.capitalize()} curve of before: {curve.words}",
        f"The difference was {number(size[0], 3)} {unit} rms and is {number(size[1], 3)}. The "
        "models are computed at the conditions of each point. Grey: 95 % of the noise.",
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


def force_maps(before: ForceComparison, after: ForceComparison) -> list[Plot]:
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
