"""Table and plot of the stability control, as a part of a page."""

import math
from collections.abc import Sequence

import numpy as np
from plotly.subplots import make_subplots

from cosim.closed_loop_report import EVERY, LOOK
from cosim.closed_loop_stability import StabilityController, StabilityOutcome, Swerve
from tirelib.report.figures.compare_plot import Plot, styled_figure
from tirelib.report.page import Part, Table, number
from tirelib.report.style import FAINT

UNCONTROLLED = "no control"
LOOKS = {UNCONTROLLED: (FAINT, "dot"), **LOOK}
SHOWN = 12.0
"""Slip angle and side slip up to which the plot reaches [deg]; without control they leave it."""
NOTE = (
    "A sine with dwell; the rear wheels on a more slippery road, vehicle and virtual tires alike; "
    "the calibration is of a dry one. Largest of the runs. Refused: estimates that were not valid, "
    "the first turn of each wheel among them; the last valid one was held."
)


def part(outcomes: Sequence[StabilityOutcome]) -> Part:
    """Return the part of a page."""
    return Part(
        "Closed loop: stability control (14-DOF vehicle)",
        "stability",
        sentence(outcomes),
        tables=[table(outcomes)],
        plots=[_plot(outcomes)],
    )


def table(outcomes: Sequence[StabilityOutcome]) -> Table:
    """Return what the vehicle did with each kind of knowledge."""
    rows = [
        (
            o.source,
            f"{math.degrees(o.worst('rear_angle')):.2f}",
            f"{math.degrees(o.worst('largest_side_slip')):.2f}",
            number(3.6 * o.worst("lost_speed"), 3),
            number(max(float(run.torque.max()) for run in o.runs), 3),
            str(sum(run.refused for run in o.runs)) if o.source == "strain" else "",
        )
        for o in outcomes
    ]
    head = (
        "knowledge",
        "rear slip angle [deg]",
        "side slip [deg]",
        "speed lost [km/h]",
        "largest torque [N m]",
        "refused",
    )
    return Table("Sine with dwell, the rear wheels on a slippery road", head, rows, note=NOTE)


def sentence(outcomes: Sequence[StabilityOutcome]) -> str:
    """Say what the controller holds with each kind of knowledge."""
    found = {o.source: math.degrees(o.worst("rear_angle")) for o in outcomes}
    road = Swerve()
    return (
        f"At {3.6 * road.speed:.0f} km/h the rear slip angle reaches {found['perfect']:.1f} deg "
        f"with perfect knowledge, {found['one turn late']:.1f} deg one turn late, "
        f"{found['once per turn']:.1f} deg once per turn, {found['strain']:.1f} deg with strain "
        f"tires, and {found[UNCONTROLLED]:.0f} deg without control."
    )


def _plot(outcomes: Sequence[StabilityOutcome]) -> Plot:
    """Draw the rear slip angle, the side slip and the torque of the front brakes."""
    figure = make_subplots(3, 1, shared_xaxes=True, vertical_spacing=0.05)
    rows: list[tuple[str | float, ...]] = []
    for outcome in outcomes:
        run = outcome.runs[0]
        colour, dash = LOOKS[outcome.source]
        rear = np.degrees(run.alpha[:, 2:].mean(axis=1))
        series = (rear, np.degrees(run.side_slip), run.torque[:, :2] @ np.array([1.0, -1.0]))
        for row, values in enumerate(series, start=1):
            figure.add_scatter(
                x=run.time[::EVERY],
                y=values[::EVERY],
                name=outcome.source,
                mode="lines",
                line={"color": colour, "dash": dash},
                legendgroup=outcome.source,
                showlegend=row == 1,
                row=row,
                col=1,
            )
        rows += [
            (outcome.source, *(round(float(x), 5) for x in values))
            for values in np.stack([run.time, *series], axis=1)[::EVERY]
        ]
    strain = next(o for o in outcomes if o.source == "strain").runs[0]
    figure.add_scatter(
        x=strain.time[::EVERY],
        y=np.degrees(strain.known_alpha[::EVERY, 2:].mean(axis=1)),
        name="estimated from strain",
        mode="lines",
        line={"color": FAINT, "shape": "hv", "width": 1.2},
        row=1,
        col=1,
    )
    for limit in (-1.0, 1.0):
        figure.add_hline(
            limit * math.degrees(StabilityController().threshold),
            row=1,
            col=1,
            line_width=0.8,
            line_color=FAINT,
        )
    for row, text in enumerate(
        ("rear slip angle [deg]", "side slip [deg]", "front brakes, left less right [N m]"), start=1
    ):
        figure.update_yaxes(title_text=text, row=row, col=1)
    figure.update_yaxes(range=[-SHOWN, SHOWN], row=1, col=1)
    figure.update_yaxes(range=[-SHOWN, SHOWN], row=2, col=1)
    figure.update_xaxes(title_text="time [s]", row=3, col=1)
    styled_figure(figure, 680, legend={"orientation": "h", "y": -0.1})
    return Plot(
        "closed_loop_stability",
        "Sine with dwell",
        "One run with each kind of knowledge; beyond the horizontal lines the controller brakes.",
        figure,
        (
            "knowledge",
            "time [s]",
            "rear slip angle [deg]",
            "side slip [deg]",
            "brake torque left less right [N m]",
        ),
        rows,
    )
