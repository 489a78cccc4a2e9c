"""The page of an identification: what each number is, how well it is known, what would help."""

from collections.abc import Mapping, Sequence
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go

from tirelib.report.figures.compare_plot import DIVERGING, Plot, styled_figure
from tirelib.report.page import DASH, INTERVAL, Part, Table, number, write_parts_page
from tirelib.report.style import BLUE, FAINT, RED

TITLE = "What the campaign says of the tire"
WIDEST = 100.0
"""End of the axis of intervals to either side, %; what reaches further is cut off there."""


def write_identification(
    document: Mapping[str, Any], folder: Path, *, commands: Sequence[str]
) -> tuple[Path, Path]:
    """Write ``identification.html`` and ``.md`` of a ``tirelib-identification/1``.

    Parameters
    ----------
    document : mapping
    folder : Path
    commands : sequence of str
        What to do next, as commands.

    Raises
    ------
    OSError
        If the folder cannot be written.
    """
    return write_parts_page(
        folder,
        "identification",
        parts_of(document),
        title=TITLE,
        summary=f"Campaign {document['campaign']}, tire {document['tire']}, axes ISO 8855.",
        messages=document["reasons"],
        lines=[("Found", _answer(document)), *(("Next", command) for command in commands)],
    )


def parts_of(document: Mapping[str, Any]) -> list[Part]:
    """Return the parts of the page: ring, brush, and what belongs to each."""
    parts, brush = [], document["brush"]
    if document["parameters"]:
        parts.append(_part("ring", _ring_text(document), document))
    if brush is not None:
        more = [_stiffness(brush["stiffness"]), _left(document["forces"])]
        parts.append(_part("brush", _brush_text(document), brush, more))
    return parts


def _part(name: str, text: str, found: Mapping[str, Any], more: Sequence[Table] = ()) -> Part:
    """Return the part of one fit: its numbers, how well they are known, what would help."""
    parameters, title = found["parameters"], f"Parameters of the {name}"
    return Part(
        name.capitalize(),
        name,
        text,
        tables=[_parameters(title, parameters), _help(parameters), *more],
        plots=[
            _intervals(f"{name}-intervals", parameters),
            _correlation(f"{name}-correlation", parameters, found["correlation"]),
        ],
    )


def _answer(document: Mapping[str, Any]) -> str:
    brush = document["brush"]
    every = [*document["parameters"], *(brush["parameters"] if brush else [])]
    known = [entry for entry in every if "not_identifiable" not in entry["flags"]]
    return (
        f"The campaign determines {len(known)} of {len(every)} parameters to within 25\u00a0% "
        "(95\u00a0% intervals); the others have the flag not_identifiable."
    )


def _ring_text(document: Mapping[str, Any]) -> str:
    stiffness = document["vertical_stiffness"]
    unit = "times the noise" if document["error_unit"] == "noise" else "microstrain"
    text = (
        f"Fitted to the strain of {len(document['runs'])} straight runs. It leaves "
        f"{document['rms_ustrain']:.3g} of {document['strain_rms_ustrain']:.4g} microstrain rms; "
        f"the error is {document['error']:.3g} {unit}. Vertical stiffness at "
        f"{stiffness['load_N']:,.0f} N: model {stiffness['model']:.4g} N/mm"
    )
    measured = stiffness["measured"]
    return text + ("." if measured is None else f", measured {measured:.4g} N/mm.")


def _brush_text(document: Mapping[str, Any]) -> str:
    brush = document["brush"]
    at = brush["reference"]
    return (
        f"Fitted to {document['forces']['points']} points. Values hold at {at['load_N']:,.0f} N "
        f"and {number(at['pressure_bar'])} bar. {' '.join(brush['notes'])}"
    )


def _parameters(title: str, parameters: Sequence[Mapping[str, Any]]) -> Table:
    return Table.of(
        title,
        parameters,
        {
            "parameter": lambda entry: entry["name"],
            "meaning": lambda entry: entry["meaning"],
            "unit": lambda entry: entry["unit"],
            "value": lambda entry: number(entry["value"], 4),
            **INTERVAL,
        },
        texts=3,
    )


def _help(parameters: Sequence[Mapping[str, Any]]) -> Table:
    return Table.of(
        "Flags, and the test that would help most",
        [entry for entry in parameters if entry["flags"]],
        {
            "parameter": lambda entry: entry["name"],
            "flags": lambda entry: ", ".join(entry["flags"]),
            "would help": lambda entry: entry["helps"] or DASH,
        },
        texts=3,
    )


def _stiffness(entries: Sequence[Mapping[str, Any]]) -> Table:
    return Table.of(
        "Slip stiffness by load and pressure",
        entries,
        {
            "over": lambda entry: entry["slip"].replace("_", " "),
            "load [N]": lambda entry: number(entry["load_N"], 4),
            "pressure [bar]": lambda entry: number(entry["pressure_bar"], 3),
            "value": lambda entry: number(entry["value"], 4),
            **INTERVAL,
            "unit": lambda entry: entry["unit"],
        },
    )


def _left(forces: Mapping[str, Any]) -> Table:
    rows = [{"force": name, **entry} for name, entry in forces.items() if isinstance(entry, dict)]
    return Table.of(
        "What the brush leaves",
        rows,
        {
            "force": lambda row: row["force"],
            "rms error": lambda row: f"{number(row['rmse'], 3)} {row['unit']}",
            "of the peak [%]": lambda row: number(row["rmse_percent_of_peak"], 2),
            "R2": lambda row: number(row["r2"], 4),
        },
    )


def _intervals(name: str, parameters: Sequence[Mapping[str, Any]]) -> Plot:
    """Return each 95 % interval about its value, in per cent of the value."""
    shown = [entry for entry in parameters if entry["value"] and isfinite(entry["value"])]
    figure = go.Figure()
    rows = []
    for entry in shown:
        ends = [100.0 * (entry[k] - entry["value"]) / abs(entry["value"]) for k in ("low", "high")]
        rows.append([entry["name"], *(round(end, 3) for end in ends), ", ".join(entry["flags"])])
        cut = np.clip(ends, -WIDEST, WIDEST).tolist()
        colour = RED if "not_identifiable" in entry["flags"] else BLUE
        figure.add_scatter(
            x=cut,
            y=[entry["name"]] * 2,
            mode="lines+markers",
            line={"color": colour, "width": 4},
            marker={"symbol": "line-ns-open", "size": 10, "color": colour},
            hovertemplate=f"{entry['name']}: {ends[0]:+.3g} to {ends[1]:+.3g} %<extra></extra>",
            showlegend=False,
        )
    for limit in (-25.0, 0.0, 25.0):
        figure.add_vline(
            x=limit, line={"color": FAINT, "width": 1, "dash": "dot" if limit else None}
        )
    figure.update_xaxes(title="95 % interval about the value [%]", range=[-WIDEST, WIDEST])
    figure.update_yaxes(autorange="reversed")
    styled_figure(figure, 130 + 26 * len(shown))
    return Plot(
        name,
        "How well each number is known",
        "Blue: within 25 % to either side. Red: not identifiable, which is wider, or hardly "
        "narrower than what was known before. Intervals are cut off at 100 %.",
        figure,
        ["parameter", "low [%]", "high [%]", "flags"],
        rows,
    )


def _correlation(
    name: str, parameters: Sequence[Mapping[str, Any]], correlation: Sequence[Sequence[float]]
) -> Plot:
    """Return the correlations of the fitted numbers, as a map."""
    names, values = [entry["name"] for entry in parameters], np.array(correlation, dtype=float)
    figure = go.Figure(
        go.Heatmap(
            z=np.round(values, 3),
            x=names,
            y=names,
            zmin=-1.0,
            zmax=1.0,
            colorscale=DIVERGING,
            hovertemplate="%{y}, %{x}: %{z:.2f}<extra></extra>",
            colorbar={"title": {"text": "correlation"}},
        )
    )
    figure.update_yaxes(autorange="reversed", showgrid=False)
    figure.update_xaxes(tickangle=-60, showgrid=False)
    styled_figure(figure, 260 + 24 * len(names))
    return Plot(
        name,
        "Numbers that trade places",
        "Near 1 or -1 the campaign knows a combination of two numbers better than each of them.",
        figure,
        ["parameter", *names],
        [[each, *np.round(row, 4).tolist()] for each, row in zip(names, values, strict=True)],
    )
