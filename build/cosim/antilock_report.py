"""Table and plots of the anti-lock stops, as a part of a page."""

from collections.abc import Sequence

import numpy as np
from plotly.subplots import make_subplots

from cosim.antilock import END_SPEED, KINDS, SPEED, AntiLockStudy
from cosim.antilock_roads import Road
from tirelib.report.figures.compare_plot import Plot, styled_figure
from tirelib.report.page import Part, Table, number
from tirelib.report.style import BLACK, GREEN, ORANGE

LOOK = {
    "perfect": (BLACK, "dot"),
    "strain": (GREEN, "solid"),
    "today": (ORANGE, "solid"),
}
"""Colour and line of every kind of knowledge."""
SHOWN = ("turn", "split_left_entering")
"""Roads that are drawn."""
SIDES = ((0, "front left"), (1, "front right"))
EVERY = 5
"""Steps between two points of a plot."""
DEEPEST = -0.4
"""Slip ratio down to which the plot reaches."""
NOTE = (
    "Vehicle: 14 degrees of freedom. Today: four wheel speeds, a gyroscope, an accelerometer, all "
    "ideal, and the classical control cycle. Strain: load and slip angle from four strain tires "
    "beside these sensors. Perfect: the controller of strain with the truth. Yaw, way aside, "
    "slip and the front wheels' angle are the largest; yaw and way aside from the course on which "
    "the brakes were put on. Steering is the sum of all changes of that angle by a driver who "
    "holds the course. Refused: estimates that were not valid, "
    "the first turn of each wheel among them."
)


def part(study: AntiLockStudy) -> Part:
    """Return the part of a page."""
    shown = [road for road in study.roads if road.name in SHOWN]
    return Part(
        "Closed loop: anti-lock braking on roads of unknown friction (14-DOF vehicle)",
        "antilock",
        sentence(study),
        tables=[table(study)],
        plots=[_plot(study, road) for road in shown],
    )


def table(study: AntiLockStudy) -> Table:
    """Return what every stop took."""
    rows = []
    for road in study.roads:
        for kind in KINDS:
            run = study.runs[road.name, kind]
            found = run.figures()
            rows.append(
                (
                    road.title,
                    kind,
                    number(found["distance_m"], 4),
                    f"{found['largest_yaw_deg']:.2f}",
                    f"{found['largest_aside_m']:.2f}",
                    f"{100.0 * found['largest_slip']:.0f}",
                    f"{found['largest_steer_deg']:.2f}",
                    f"{found['steering_deg']:.1f}",
                    str(run.refused) if kind == "strain" else "",
                )
            )
    head = (
        "road",
        "knowledge",
        "way [m]",
        "yaw [deg]",
        "aside [m]",
        "slip [%]",
        "wheel angle [deg]",
        "steering [deg]",
        "refused",
    )
    title = f"Stops from {3.6 * SPEED:.0f} to {3.6 * END_SPEED:.0f} km/h"
    return Table(title, head, rows, texts=2, note=NOTE)


def sentence(study: AntiLockStudy) -> str:
    """Say what the tires are worth, over all roads of a kind."""
    words = []
    for name, kind in (("on even roads", ""), ("on split roads", "split"), ("in a turn", "turn")):
        roads = [road for road in study.roads if _kind(road) == kind]
        if roads:
            words.append(f"{name} {_compare(study, roads)}")
    return (
        f"With strain tires beside today's sensors, against these alone, the way to "
        f"{3.6 * END_SPEED:.0f} km/h is {'; '.join(words)}."
    )


def _kind(road: Road) -> str:
    return next((kind for kind in ("split", "turn") if road.name.startswith(kind)), "")


def _compare(study: AntiLockStudy, roads: Sequence[Road]) -> str:
    names = [road.name for road in roads]

    def mean(kind: str, figure: str) -> float:
        return study.mean(names, kind, figure)

    share = 100.0 * (mean("strain", "distance_m") / mean("today", "distance_m") - 1.0)
    told = f"{abs(share):.1f} % {'shorter' if share < 0.0 else 'longer'}"
    aside = mean("strain", "largest_aside_m"), mean("today", "largest_aside_m")
    if max(aside) < 0.05:
        return told
    return f"{told}, with {aside[0]:.2f} m to the side in place of {aside[1]:.2f} m"


def _plot(study: AntiLockStudy, road: Road) -> Plot:
    """Draw slip and torque of both front wheels, and the yaw and the steering."""
    figure = make_subplots(
        3,
        2,
        shared_xaxes=True,
        vertical_spacing=0.06,
        horizontal_spacing=0.09,
        column_titles=["front left", "front right"],
    )
    rows: list[tuple[str | float, ...]] = []
    for kind in KINDS:
        run = study.runs[road.name, kind]
        colour, dash = LOOK[kind]
        last = (np.degrees(run.yaw), np.degrees(run.steer))
        for column, (wheel, _) in enumerate(SIDES, start=1):
            slip = 100.0 * np.maximum(run.kappa[:, wheel], DEEPEST)
            series = (slip, run.torque[:, wheel], last[column - 1])
            for row, values in enumerate(series, start=1):
                figure.add_scatter(
                    x=run.time[::EVERY],
                    y=values[::EVERY],
                    name=kind,
                    mode="lines",
                    line={"color": colour, "dash": dash, "width": 1.6},
                    legendgroup=kind,
                    showlegend=(row, column) == (1, 1),
                    row=row,
                    col=column,
                )
        table = (
            run.time,
            100.0 * run.kappa[:, 0],
            100.0 * run.kappa[:, 1],
            run.torque[:, 0],
            run.torque[:, 1],
            *last,
        )
        rows += [
            (kind, *(round(float(x), 5) for x in values))
            for values in np.stack(table, axis=1)[::EVERY]
        ]
    for row, text in enumerate(("slip ratio [%]", "brake torque [N m]"), start=1):
        figure.update_yaxes(title_text=text, row=row, col=1)
    figure.update_yaxes(range=[100.0 * DEEPEST, 5.0], row=1)
    figure.update_yaxes(title_text="yaw from the course [deg]", row=3, col=1)
    figure.update_yaxes(title_text="steering angle [deg]", row=3, col=2)
    figure.update_xaxes(title_text="time since the brakes [s]", row=3)
    styled_figure(figure, 720, legend={"orientation": "h", "y": -0.1})
    return Plot(
        f"antilock-{road.name}",
        f"{road.title[0].upper()}{road.title[1:]}",
        f"A slip ratio below {100.0 * DEEPEST:.0f} % is drawn there. ISO 8855: left is positive.",
        figure,
        (
            "knowledge",
            "time [s]",
            "slip ratio front left [%]",
            "front right [%]",
            "torque front left [N m]",
            "front right [N m]",
            "yaw [deg]",
            "steering [deg]",
        ),
        rows,
    )
