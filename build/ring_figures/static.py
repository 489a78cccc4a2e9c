"""The standing ring of chapter 5 (Fig. 5-10, 5-22, 5-24)."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ring_figures.cases import StaticRing
from tirelib.physics.strain.deformation import ContactDeformation, arc_nodes, contact_deformation
from tirelib.report.figures.ring_panels import ANGLE, PRESSURE, RADIAL, STRAIN
from tirelib.report.simulation import MICRO
from tirelib.report.style import (
    BLACK,
    label,
    legend_below,
    new_figure,
    sequence,
    styled,
    zero_line,
)

NODES = 201


def deformation_from_strain(ring: StaticRing) -> ContactDeformation:
    """Invert the strain between the contact's edges, Eq. (36)-(40)."""
    half = ring.contact.half_angle
    nodes = arc_nodes(-half, half, NODES)
    strain = np.stack(
        [np.interp(at, ring.phi, e) for at, e in zip(nodes, ring.strain, strict=True)]
    )
    return contact_deformation(
        strain,
        -half,
        half,
        deflection=ring.contact.deflection,
        ring_radius=ring.tire.ring_radius,
        free_radius=ring.tire.free_radius,
        liner_offset=ring.tire.innerliner_offset,
    )


@styled
def figure_5_10(ring: StaticRing) -> Figure:
    """Radial deformation in the contact from the strain there, by load.

    Source: dissertation, Fig. 5-10; here the strain is that of the ring itself, so that the
    deformation behind it is known.
    """
    figure = new_figure(9.5, 5.4)
    axes = figure.subplots()
    found = deformation_from_strain(ring)
    for point, (text, colour) in enumerate(_loads(ring)):
        phi = found.angle[point]
        inside = np.abs(ring.phi) <= phi[-1]
        axes.plot(
            np.rad2deg(phi),
            1e3 * found.deformation[point],
            color=colour,
            label=f"{text}, from strain",
        )
        axes.plot(
            np.rad2deg(ring.phi[inside])[::12],
            1e3 * ring.u[point, inside][::12],
            "o",
            color=BLACK,
            markersize=3.0,
            label="the ring's own",
        )
    axes.set_title("Radial deformation between the edges of the contact, from strain")
    axes.set_xlabel(ANGLE)
    axes.set_ylabel(RADIAL.label)
    legend_below(figure, [axes], columns=3)
    return figure


@styled
def figure_5_22(ring: StaticRing) -> Figure:
    """Draw the static contact pressure by load; as it is, and over its mean, where the shape shows.

    Source: dissertation, Fig. 5-22 (a).
    """
    figure = new_figure(11.0, 4.9)
    left, right = figure.subplots(1, 2)
    contact = ring.contact
    for point, (text, colour) in enumerate(_loads(ring)):
        phi, q, half = contact.angle[point], contact.pressure[point], contact.half_angle[point]
        left.plot(np.rad2deg(phi), 1e-3 * q, color=colour, label=text)
        inside = np.abs(phi) <= half
        mean = np.trapezoid(q[inside], phi[inside]) / (2.0 * half)
        right.plot(phi[inside] / half, q[inside] / mean, color=colour, label=text)
    left.set_title("Contact pressure of the standing ring")
    left.set_xlabel(ANGLE)
    left.set_ylabel(PRESSURE.label)
    right.set_title("Its shape")
    right.set_xlabel(label("angle / half contact angle, entry < 0 < exit", "1"))
    right.set_ylabel(label("pressure / mean pressure", "1"))
    for axes in (left, right):
        zero_line(axes)
    legend_below(figure, [left])
    return figure


@styled
def figure_5_24(ring: StaticRing) -> Figure:
    """Strain of the standing ring at the innerliner, by load.

    Source: dissertation, Fig. 5-24 (b).
    """
    figure = new_figure(11.0, 4.9)
    wide, near = figure.subplots(1, 2)
    _strain(wide, ring, 180.0, "Strain of the standing ring, whole turn")
    _strain(near, ring, 40.0, "Near the contact")
    wide.set_xticks(np.arange(-180, 181, 90))
    legend_below(figure, [near])
    return figure


def _strain(axes: Axes, ring: StaticRing, within: float, title: str) -> None:
    phi = np.rad2deg(ring.phi)
    shown = np.abs(phi) <= within
    for point, (text, colour) in enumerate(_loads(ring)):
        axes.plot(phi[shown], MICRO * ring.strain[point, shown], color=colour, label=text)
    zero_line(axes)
    axes.set_xlim(-within, within)
    axes.set_title(title)
    axes.set_xlabel(ANGLE)
    axes.set_ylabel(STRAIN.label)


def _loads(ring: StaticRing) -> list[tuple[str, str]]:
    """Return name and colour of every load."""
    texts = [f"{load:.0f} N" for load in ring.contact.load]
    return list(zip(texts, sequence(len(texts)), strict=True))
