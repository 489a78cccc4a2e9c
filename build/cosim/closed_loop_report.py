"""Table and plots of the closed loop, as parts of a page."""

import math
from collections.abc import Mapping

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from cosim.closed_loop import ROADS, BrakingRun, Outcome, Study
from cosim.closed_loop_controller import SlipController
from tirelib.core.arrays import FloatArray
from tirelib.report.figures.compare_plot import Plot, styled_figure
from tirelib.report.page import Part, Table, number
from tirelib.report.style import BLACK, BLUE, FAINT, GREEN, ORANGE

LOOK = {
    "perfect": (BLACK, "solid"),
    "one turn late": (ORANGE, "dash"),
    "once per turn": (BLUE, "dashdot"),
    "strain": (GREEN, "solid"),
}
"""Colour and line of every source."""
SHOWN = ((0, "front left"), (2, "rear left"))
EVERY = 5
"""Steps between two points of a plot."""
NOTE = (
    "The same controller and vehicle, braking from 100 km/h. Once per turn and one turn late are "
    "the truth, only later. More slip than aimed at brakes a little harder on this tire, so "
    "lateness that overshoots may shorten the way. Spread: largest less smallest distance over "
    "wheel angles at the start. Refused: estimates of all wheels and runs that were not valid, the "
    "first turn of each wheel among them; the last valid one was held."
)
_TITLES = {road.name: road.title for road in ROADS}


def parts(study: Study) -> list[Part]:
    """Return the parts of a page: the distances, then a plot for each road."""
    roads = list(dict.fromkeys(outcome.road for outcome in study.outcomes))
    words = " ".join(sentence(study, road) for road in roads)
    return [
        Part(
            "Closed loop: slip control (14-DOF vehicle)",
            "closed_loop",
            words,
            tables=[table(study)],
            plots=[_plot(study, road) for road in roads],
        )
    ]


def table(study: Study) -> Table:
    """Return the distances and what they cost."""
    rows = [
        (
            _TITLES[o.road],
            o.source,
            number(float(o.distances.mean())),
            number(float(np.ptp(o.distances)), 2) if len(o.runs) > 1 else "",
            number(100.0 * o.loss, 2),
            number(100.0 * o.slip_error, 2),
            f"{o.rear_angle:.2f}",
            f"{o.refused}" if o.source == "strain" else "",
        )
        for o in study.outcomes
    ]
    head = (
        "road",
        "knowledge",
        "distance [m]",
        "spread [m]",
        "longer by [%]",
        "rms slip error [%]",
        "rear slip angle [deg]",
        "refused",
    )
    return Table("Stopping with once-per-turn knowledge", head, rows, texts=2, note=NOTE)


def sentence(study: Study, road: str) -> str:
    """Say what once-per-turn knowledge costs on a road."""
    truth, strain = study.of(road, "once per turn"), study.of(road, "strain")
    title = _TITLES[road]
    return (
        f"{title[0].upper()}{title[1:]}: true values once per turn lengthen the way by "
        f"{100.0 * truth.loss:.1f} %, strain tires by {100.0 * strain.loss:.1f} %, with "
        f"{1e3 * _delay(strain):.0f} ms from the middle of a contact to its estimate."
    )


def _delay(outcome: Outcome) -> float:
    known = [run.delay for run in outcome.runs if math.isfinite(run.delay)]
    return float(np.median(known)) if known else math.nan


def _plot(study: Study, road: str) -> Plot:
    """Draw slip, load and brake torque of a front and a rear wheel."""
    figure = make_subplots(
        3,
        2,
        shared_xaxes=True,
        vertical_spacing=0.05,
        horizontal_spacing=0.08,
        column_titles=[f"{name} wheel" for _, name in SHOWN],
    )
    rows: list[tuple[str | float, ...]] = []
    for outcome in (o for o in study.outcomes if o.road == road):
        run = outcome.runs[0]
        for column, (wheel, name) in enumerate(SHOWN, start=1):
            series = _series(run, wheel)
            colour, dash = LOOK[outcome.source]
            _lines(
                figure, column, run.time, series, outcome.source, {"color": colour, "dash": dash}
            )
            rows += [
                (outcome.source, name, *(round(float(x), 5) for x in row))
                for row in np.stack([run.time, *series.values()], axis=1)[::EVERY]
            ]
    strain = study.of(road, "strain").runs[0]
    for column, (wheel, _) in enumerate(SHOWN, start=1):
        told = {
            "slip": 100.0 * strain.known_kappa[:, wheel],
            "load": 1e-3 * strain.known_load[:, wheel],
        }
        _lines(
            figure,
            column,
            strain.time,
            told,
            "estimated from strain",
            {"color": FAINT, "shape": "hv", "width": 1.2},
        )
        figure.add_hline(
            100.0 * SlipController().target, row=1, col=column, line_width=0.8, line_color=FAINT
        )
        figure.update_xaxes(title_text="time since the brakes [s]", row=3, col=column)
    for row, text in enumerate(("slip ratio [%]", "load [kN]", "brake torque [N m]"), start=1):
        figure.update_yaxes(title_text=text, row=row, col=1)
    styled_figure(figure, 680, legend={"orientation": "h", "y": -0.1})
    title = _TITLES[road]
    return Plot(
        f"closed_loop_{road}",
        f"{title[0].upper()}{title[1:]}",
        "One run with each kind of knowledge; the thin line is what the controller is told by the "
        "strain tires. The target is the horizontal line, without a slip angle.",
        figure,
        ("knowledge", "wheel", "time [s]", "slip ratio [%]", "load [kN]", "brake torque [N m]"),
        rows,
    )


def _series(run: BrakingRun, wheel: int) -> dict[str, FloatArray]:
    return {
        "slip": 100.0 * run.kappa[:, wheel],
        "load": 1e-3 * run.load[:, wheel],
        "torque": run.torque[:, wheel],
    }


def _lines(
    figure: go.Figure,
    column: int,
    time: FloatArray,
    series: Mapping[str, FloatArray],
    name: str,
    line: Mapping[str, object],
) -> None:
    for row, values in enumerate(series.values(), start=1):
        figure.add_trace(
            go.Scatter(
                x=time[::EVERY],
                y=values[::EVERY],
                name=name,
                mode="lines",
                line=dict(line),
                legendgroup=name,
                showlegend=(row, column) == (1, 1),
            ),
            row=row,
            col=column,
        )
