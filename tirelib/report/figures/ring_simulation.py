"""One simulation at a glance: shape, displacements, pressure, shear, strain, strain rate."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tirelib.report.figures.ring_panels import (
    PRESSURE,
    RADIAL,
    RATE,
    SHEAR,
    SHORT_ANGLE,
    STRAIN,
    TANGENTIAL,
    draw,
    half_width,
    point_labels,
)
from tirelib.report.simulation import Simulation
from tirelib.report.style import BLACK, FAINT, label, legend_below, new_figure, sequence, styled


@styled
def figure_simulation(done: Simulation, name: str) -> Figure:
    """All results of the ring model at its operating points.

    Above: belt in the wheel's plane, radial and tangential displacement, strain. Below: contact
    pressure, shear, strain rate.
    """
    figure = new_figure(14.0, 8.6)
    grid = figure.subplots(2, 4)
    colours, labels = sequence(len(done)), point_labels(done)
    near = half_width(done)
    _shape(grid[0, 0], done, colours)
    panels = (
        (grid[0, 1], RADIAL, np.pi, "Belt, radial"),
        (grid[0, 2], TANGENTIAL, np.pi, "Belt, tangential"),
        (grid[0, 3], PRESSURE, near, "Contact pressure"),
        (grid[1, 0], SHEAR, near, "Traction along the road"),
        (grid[1, 1], STRAIN, np.pi, "Strain, whole turn"),
        (grid[1, 2], STRAIN, 2.0 * near, "Strain, near the contact"),
        (grid[1, 3], RATE, 2.0 * near, "Strain rate, near the contact"),
    )
    for axes, quantity, within, title in panels:
        draw(axes, done, quantity, labels, colours, within=within, edges=within < np.pi)
        axes.set_title(title)
        axes.set_xlabel(SHORT_ANGLE)
        if within == np.pi:
            axes.set_xticks(np.arange(-180, 181, 90))
    figure.suptitle(
        f"{name}, {done.contact} contact, damping {done.tire.damping:g}; dotted: edges of the "
        "contact",
        fontsize=10.5,
    )
    legend_below(figure, [grid[0, 1]])
    return figure


def _shape(axes: Axes, done: Simulation, colours: list[str]) -> None:
    """Draw belt and road; the wheel rolls to the right."""
    x, z = done.belt()
    for point, colour in enumerate(colours):
        axes.plot(1e3 * x[point], 1e3 * z[point], color=colour)
        road = -1e3 * (done.tire.free_radius - done.deflection[point])
        axes.axhline(road, color=colour, linewidth=0.9, linestyle="--")
    r = 1e3 * done.tire.ring_radius
    circle = np.linspace(0.0, 2.0 * np.pi, 181)
    axes.plot(r * np.sin(circle), r * np.cos(circle), ":", color=FAINT, linewidth=1.0)
    axes.plot(0.0, 0.0, "+", color=BLACK, markersize=8)
    axes.set_aspect("equal")
    axes.set_title("Belt, unloaded (dotted), and road")
    axes.set_xlabel(label("forward x, rolling to the right", "mm"))
    axes.set_ylabel(label("upward z from the axle", "mm"))
