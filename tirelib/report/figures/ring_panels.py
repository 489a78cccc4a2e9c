"""Figures of the rolling ring: curves over wheel angle, edges, names, and all at a glance."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tirelib.core.arrays import FloatArray
from tirelib.core.units import from_si
from tirelib.report.simulation import MICRO, Simulation
from tirelib.report.style import (
    BLACK,
    FAINT,
    label,
    legend_below,
    new_figure,
    sequence,
    styled,
    zero_line,
)

ANGLE = label("wheel angle from below the axle, entry < 0 < exit", "deg")
SHORT_ANGLE = label("wheel angle, entry < 0 < exit", "deg")
PER_DEGREE = MICRO * float(np.pi / 180.0)


@dataclass(frozen=True, slots=True)
class Curve:
    """A curve of `Simulation`: its field, factor to the plot's unit, and axis label.

    A `traction` ends at the edges of the contact, which lie between the angles of the grid.
    """

    field: str
    factor: float
    label: str
    traction: bool = False


PRESSURE = Curve("pressure", 1e-3, label("contact pressure, inward", "N/mm"), True)
NORMAL = Curve("normal", 1e-3, label("normal to the road, on the tire", "N/mm"), True)
SHEAR = Curve(
    "shear", 1e-3, label("along the road, on the tire,\ntoward the exit > 0", "N/mm"), True
)
RADIAL = Curve("u", 1e3, label("radial displacement u, outward > 0", "mm"))
TANGENTIAL = Curve("v", 1e3, label("tangential displacement v,\ntoward the exit > 0", "mm"))
STRAIN = Curve("strain", MICRO, label("strain, tension > 0", "microstrain"))
RATE = Curve("rate", PER_DEGREE, label("strain rate", "microstrain/deg"))


def curve(done: Simulation, quantity: Curve, point: int) -> tuple[FloatArray, FloatArray]:
    """Return angles [rad] and values as drawn; a traction is zero at the contact's edges."""
    phi, values = done.phi, quantity.factor * getattr(done, quantity.field)[point]
    if quantity.traction:
        place = np.searchsorted(phi, done.edges[point])
        phi, values = np.insert(phi, place, done.edges[point]), np.insert(values, place, 0.0)
    return phi, values


def draw(
    axes: Axes,
    done: Simulation,
    quantity: Curve,
    labels: Sequence[str],
    colours: Sequence[str],
    *,
    within: float,
    line: str = "-",
    edges: bool = False,
) -> None:
    """Draw one curve per operating point for |phi| <= within [rad]; `edges` marks both edges."""
    for point, (text, colour) in enumerate(zip(labels, colours, strict=True)):
        phi, values = curve(done, quantity, point)
        shown = np.abs(phi) <= within
        axes.plot(np.rad2deg(phi[shown]), values[shown], line, color=colour, label=text)
        for edge in np.rad2deg(done.edges[point]) if edges else ():
            axes.axvline(edge, color=colour, linewidth=0.9, linestyle=":", zorder=1.4)
    zero_line(axes)
    axes.set_xlim(-np.rad2deg(within), np.rad2deg(within))
    axes.set_ylabel(quantity.label)


def half_width(*several: Simulation) -> float:
    """Return an angle that shows every contact with some room, [rad]."""
    return 1.25 * float(max(np.abs(done.edges).max() for done in several))


def load_labels(done: Simulation) -> list[str]:
    """Return labels of the loads."""
    return [f"{load:.0f} N" for load in done.load]


def inflation_labels(done: Simulation) -> list[str]:
    """Return labels of the inflation pressures."""
    return [f"{1e-5 * p:g} bar" for p in done.inflation]


def speed_labels(done: Simulation) -> list[str]:
    """Return labels of the speeds."""
    speed = from_si(done.turn_rate * done.tire.ring_radius, "km/h", "speed")
    return [f"{v:.0f} km/h" for v in speed]


def point_labels(done: Simulation) -> list[str]:
    """Return a label of each operating point: the load, and whatever else varies."""
    parts = [load_labels(done)]
    if np.ptp(done.inflation) > 0.0:
        parts.append(inflation_labels(done))
    if np.ptp(done.turn_rate) > 0.0:
        parts.append(speed_labels(done))
    texts = [", ".join(words) for words in zip(*parts, strict=True)]
    if len(set(texts)) == len(texts):
        return texts
    return [f"{text} ({number})" for number, text in enumerate(texts, 1)]


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
