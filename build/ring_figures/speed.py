"""Damping and speed (Fig. 6-29, 6-33)."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from tirelib.core.arrays import FloatArray
from tirelib.core.units import from_si
from tirelib.report.figures.ring_panels import (
    PRESSURE,
    RATE,
    SHORT_ANGLE,
    STRAIN,
    draw,
    half_width,
    load_labels,
    speed_labels,
)
from tirelib.report.simulation import Simulation
from tirelib.report.style import (
    CATEGORIES,
    MARKERS,
    label,
    legend_below,
    new_figure,
    sequence,
    styled,
    zero_line,
)


def compression_to_edge(done: Simulation) -> FloatArray:
    """Angle from the strain rate's peak at the exit to the second compressive peak, [rad]."""
    distance: FloatArray = done.peaks.cp2_angle - done.peaks.rate_trail_angle
    return distance


@styled
def figure_6_29(by_damping: Sequence[Simulation]) -> Figure:
    """Pressure, strain and strain rate at several speeds, a column for each damping.

    Source: dissertation, Fig. 6-29.
    """
    figure = new_figure(4.2 * len(by_damping) + 0.8, 10.0)
    grid = figure.subplots(3, len(by_damping), sharey="row", squeeze=False)
    near = half_width(*by_damping)
    for column, done in enumerate(by_damping):
        names = speed_labels(done)
        for axes, quantity, within in zip(
            grid[:, column], (PRESSURE, STRAIN, RATE), (near, 2.5 * near, 2.0 * near), strict=True
        ):
            draw(axes, done, quantity, names, sequence(len(names)), within=within)
            axes.set_xlabel(SHORT_ANGLE)
            if column:
                axes.set_ylabel("")
        together = "" if done.tire.damping else ": the speeds coincide"
        grid[0, column].set_title(f"damping {done.tire.damping:g}{together}")
    figure.suptitle(f"Damping and speed at {load_labels(by_damping[0])[0]}", fontsize=10.5)
    legend_below(figure, [grid[0, 0]])
    return figure


@styled
def figure_6_33(by_damping: Sequence[Simulation]) -> Figure:
    """How far features move with speed, from the lowest speed on; forward (to the entry) is > 0.

    Left the middle of the contact and the distance of Eq. (113), which is to indicate the damping;
    right what makes the distance: the peak of the strain rate, and the compressive peak that does
    not quite stay. Source: dissertation, Fig. 6-33.
    """
    figure = new_figure(11.5, 5.2)
    left, right = figure.subplots(1, 2, sharey=True)
    for number, done in enumerate(by_damping):
        speed = from_si(done.turn_rate * done.tire.ring_radius, "km/h", "speed")
        colour, marker = CATEGORIES[number], MARKERS[number]
        text = f"damping {done.tire.damping:g}"
        for axes, line, name, angle in (
            (left, "-", "distance of Eq. (113)", -compression_to_edge(done)),
            (left, "--", "middle of the contact", done.edges.mean(axis=1)),
            (right, "-", "peak of the strain rate at the exit", done.peaks.rate_trail_angle),
            (right, "--", "second compressive peak", done.peaks.cp2_angle),
        ):
            forward = -np.rad2deg(angle - angle[0])
            axes.plot(speed, forward, line, color=colour, marker=marker, label=f"{name}, {text}")
    left.set_title("Shift of Eq. (113) and of the contact")
    right.set_title("Shift of the two features behind it")
    left.set_ylabel(label("shift since the lowest speed, forward > 0", "deg"))
    for axes in (left, right):
        zero_line(axes)
        axes.set_xlabel(label("speed", "km/h"))
    legend_below(figure, [left, right], columns=3)
    return figure
