"""Radial against shear contact of the rolling ring (Fig. 6-7 to 6-12)."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tirelib.core.arrays import FloatArray
from tirelib.report.figures.ring_panels import (
    ANGLE,
    NORMAL,
    PER_DEGREE,
    PRESSURE,
    RATE,
    SHEAR,
    STRAIN,
    Curve,
    draw,
    half_width,
    inflation_labels,
)
from tirelib.report.simulation import Simulation
from tirelib.report.style import BLACK, CATEGORIES, legend_below, new_figure, sequence, styled

NAMES = {"radial": "radial tread springs only", "shear": "tread in compression and shear"}


def deflection_labels(done: Simulation) -> list[str]:
    """Return labels of the deflections."""
    return [f"{1e3 * d0:g} mm" for d0 in np.round(done.deflection, 7)]


@styled
def figure_6_7(deflections: Simulation, inflations: Simulation) -> Figure:
    """Contact pressure by deflection, and by inflation at one deflection.

    Source: dissertation, Fig. 6-7, with literature tires of Table 6-3; the measured and published
    curves that it compares with are not at hand.
    """
    figure = new_figure(11.0, 4.9)
    left, right = figure.subplots(1, 2)
    names = [f"deflection {text}" for text in deflection_labels(deflections)]
    draw(left, deflections, PRESSURE, names, sequence(len(names)), within=half_width(deflections))
    left.set_title(f"Deflections at {inflation_labels(deflections)[0]}")
    names = inflation_labels(inflations)
    draw(
        right,
        inflations,
        PRESSURE,
        names,
        CATEGORIES[: len(names)],
        within=half_width(inflations),
        edges=True,
    )
    right.set_title(
        f"Inflation at an equal deflection of {deflection_labels(inflations)[0]} (dotted: edges)"
    )
    for axes in (left, right):
        axes.set_xlabel(ANGLE)
    legend_below(figure, [left, right])
    return figure


@styled
def figure_6_9(shear: Simulation, radial: Simulation) -> Figure:
    """Traction of the road on the tire, along its normal and along the road, by deflection.

    Source: dissertation, Fig. 6-9.
    """
    figure = new_figure(11.0, 7.6)
    grid = figure.subplots(2, 2, sharex=True, sharey="row")
    for column, done in enumerate((shear, radial)):
        for axes, quantity in zip(grid[:, column], (NORMAL, SHEAR), strict=True):
            _deflections(axes, done, quantity, half_width(shear, radial))
            if column:
                axes.set_ylabel("")
        grid[0, column].set_title(f"({'ab'[column]}) {NAMES[done.contact]}")
        grid[1, column].set_xlabel(ANGLE)
    legend_below(figure, [grid[0, 0]])
    return figure


@styled
def figure_6_10(shear: Simulation, radial: Simulation) -> Figure:
    """Strain at the innerliner with either contact, by deflection. Source: Fig. 6-10."""
    figure = new_figure(11.0, 4.9)
    panels = figure.subplots(1, 2, sharey=True)
    for axes, done, letter in zip(panels, (shear, radial), "ab", strict=True):
        _deflections(axes, done, STRAIN, 0.8)
        axes.set_title(f"({letter}) {NAMES[done.contact]}")
        axes.set_xlabel(ANGLE)
    panels[1].set_ylabel("")
    legend_below(figure, [panels[0]])
    return figure


@styled
def figure_6_12(shear: Simulation, radial: Simulation) -> Figure:
    """Strain rate below the pressure: how far its peaks are from the contact's edges.

    Source: dissertation, Fig. 6-12.
    """
    figure = new_figure(11.0, 7.8)
    grid = figure.subplots(2, 2, sharex=True, sharey="row")
    for column, done in enumerate((shear, radial)):
        for axes, quantity in zip(grid[:, column], (PRESSURE, RATE), strict=True):
            _deflections(axes, done, quantity, half_width(shear, radial), edges=True)
            if column:
                axes.set_ylabel("")
        _rate_peaks(grid[1, column], done)
        short = 1e3 * (done.contact_angle - _peak_to_peak(done))
        grid[0, column].set_title(
            f"({'ab'[column]}) {NAMES[done.contact]}\npeak to peak minus contact angle: "
            + ", ".join(f"{-x:+.1f}" for x in short).replace("-", "\N{MINUS SIGN}")
            + " mrad"
        )
        grid[1, column].set_xlabel(ANGLE)
    legend_below(figure, [grid[1, 0]])
    return figure


def _peak_to_peak(done: Simulation) -> FloatArray:
    peaks = done.peaks
    distance: FloatArray = peaks.rate_trail_angle - peaks.rate_lead_angle
    return distance


def _rate_peaks(axes: Axes, done: Simulation) -> None:
    """Mark the peaks of the strain rate."""
    peaks = done.peaks
    for side, marker, text in (("lead", ">", "entry"), ("trail", "<", "exit")):
        axes.plot(
            np.rad2deg(getattr(peaks, f"rate_{side}_angle")),
            PER_DEGREE * getattr(peaks, f"rate_{side}"),
            marker,
            color=BLACK,
            markerfacecolor="white",
            markersize=6.0,
            zorder=5,
            label=f"peak of the strain rate at the {text}",
        )


def _deflections(
    axes: Axes, done: Simulation, quantity: Curve, within: float, *, edges: bool = False
) -> None:
    names = deflection_labels(done)
    draw(axes, done, quantity, names, sequence(len(names)), within=within, edges=edges)
