"""Strain and strain rate over wheel angle with the features that are read from them."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pages.turns import TypicalTurns
from tirelib.inference.compare.sentences import millimetres
from tirelib.report.style import (
    BLACK,
    BLUE,
    CATEGORIES,
    MARKERS,
    ORANGE,
    label,
    legend_below,
    new_figure,
    sequence,
    styled,
    zero_line,
)

ANGLE = label("wheel angle from the middle of the contact", "deg")
STRAIN = label("strain", "microstrain")
RATE = label("strain rate", "microstrain/deg")
PER_DEGREE = 1e6 * float(np.pi / 180.0)
"""From 1/rad to microstrain per degree."""


def mark(axes: Axes, angle: float, value: float, marker: str, text: str) -> None:
    """Mark a found peak; `angle` in rad, `value` as drawn."""
    axes.plot(
        np.rad2deg(angle),
        value,
        marker,
        color=BLACK,
        markersize=6.5,
        markerfacecolor="white",
        markeredgewidth=1.4,
        zorder=5,
        label=text,
    )


@styled
def figure_3_7(turns: TypicalTurns) -> Figure:
    """Strain and strain rate of the centre gage, one turn each, with the peaks that were found.

    Source: dissertation, Fig. 3-7, 3-8.
    """
    figure = new_figure(9.5, 7.6)
    upper, lower = figure.subplots(2, 1, sharex=True)
    trace, found = turns.trace, turns.features
    centre, phi = trace.centre_gage, np.rad2deg(trace.phi)
    for row, (text, colour) in enumerate(
        zip(turns.labels, sequence(len(turns.labels)), strict=True)
    ):
        upper.plot(phi, 1e6 * trace.strain[row, centre], color=colour, label=text)
        lower.plot(phi, PER_DEGREE * trace.rate[row, centre], color=colour, label=text)
    for row in range(len(turns.labels)):
        for name, marker, text in (
            ("cp1", "v", "CP1: first compressive peak"),
            ("tp", "^", "TP: largest tension"),
            ("cp2", "s", "CP2: second compressive peak"),
        ):
            angle = getattr(found, f"{name}_angle")[row, centre]
            mark(upper, angle, 1e6 * getattr(found, name)[row, centre], marker, text)
        for edge, rate, marker, text in (
            ("lead", "rate_lead", ">", "leading edge: largest rate"),
            ("trail", "rate_trail", "<", "trailing edge: smallest rate"),
        ):
            angle = getattr(found, edge)[row, centre]
            mark(lower, angle, PER_DEGREE * getattr(found, rate)[row, centre], marker, text)
    upper.set_title("Strain of the centre gage above its offset, one turn at each load")
    upper.set_ylabel(STRAIN)
    lower.set_title("Strain rate: its extremes are read as the edges of the contact")
    lower.set_ylabel(RATE)
    lower.set_xlabel(ANGLE)
    lower.set_xlim(phi[0], phi[-1])
    for axes in (upper, lower):
        zero_line(axes)
    legend_below(figure, (upper, lower), columns=5)
    return figure


@styled
def figure_4_1(turns: TypicalTurns, row: int = 0) -> Figure:
    """All gages in one turn under slip: strain, rate, and the slope of the peak rates.

    Source: dissertation, Fig. 4-1, 4-6.
    """
    figure = new_figure(12.0, 4.9)
    left, middle, right = figure.subplots(1, 3)
    trace, found = turns.trace, turns.features
    phi = np.rad2deg(trace.phi)
    order = np.argsort(trace.lateral)
    lateral = 1e3 * trace.lateral
    for place, gage in enumerate(order):
        colour, text = (
            CATEGORIES[place % len(CATEGORIES)],
            f"gage at y = {millimetres(trace.lateral[gage])}",
        )
        left.plot(phi, 1e6 * trace.strain[row, gage], color=colour, label=text)
        middle.plot(phi, PER_DEGREE * trace.rate[row, gage], color=colour, label=text)
        peak = PER_DEGREE * found.rate_lead[row, gage]
        right.plot(lateral[gage], peak, MARKERS[place % 10], color=colour, markersize=8, label=text)
        mark(left, found.cp1_angle[row, gage], 1e6 * found.cp1[row, gage], "v", "CP1")
        for edge, rate in (("lead", "rate_lead"), ("trail", "rate_trail")):
            angle, value = getattr(found, edge)[row, gage], getattr(found, rate)[row, gage]
            mark(
                middle, angle, PER_DEGREE * value, ">" if edge == "lead" else "<", f"{edge}ing edge"
            )
    near = np.argsort(np.abs(trace.lateral), kind="stable")[:3]
    line = np.polyfit(lateral[near], PER_DEGREE * found.rate_lead[row, near], 1)
    ends = np.array([lateral[near].min(), lateral[near].max()])
    right.plot(
        ends,
        np.polyval(line, ends),
        color=BLACK,
        linewidth=1.4,
        linestyle="--",
        label="line through the three middle gages",
    )
    left.set_title(f"Strain, {turns.labels[row]}")
    middle.set_title("Strain rate with the edges found")
    right.set_title(f"Peak rate at the leading edge\nslope {line[0]:+.2f} microstrain/(deg mm)")
    left.set_ylabel(STRAIN)
    middle.set_ylabel(RATE)
    right.set_ylabel(label("peak strain rate", "microstrain/deg"))
    right.set_xlabel(label("lateral position y", "mm", signed=True))
    for axes in (left, middle):
        axes.set_xlabel(label("wheel angle", "deg"))
        axes.set_xlim(phi[0], phi[-1])
        zero_line(axes)
    legend_below(figure, (left, middle, right), columns=5)
    return figure


@styled
def figure_4_17_turns(turns: TypicalTurns, axes_row: list[Axes]) -> None:
    """Draw the centre gage of each turn into its own axes, with CP1 and CP2 marked."""
    trace, found = turns.trace, turns.features
    centre, phi = trace.centre_gage, np.rad2deg(trace.phi)
    for row, axes in enumerate(axes_row):
        axes.plot(
            phi, 1e6 * trace.strain[row, centre], color=BLUE, label="strain of the centre gage"
        )
        for name, marker, text in (("cp1", "v", "CP1, before"), ("cp2", "s", "CP2, after")):
            value = 1e6 * getattr(found, name)[row, centre]
            angle = getattr(found, f"{name}_angle")[row, centre]
            axes.axhline(value, color=ORANGE, linewidth=0.9, linestyle=":", zorder=1.2)
            mark(axes, angle, value, marker, f"{text} the contact")
        deeper = 1e6 * (found.cp1[row, centre] - found.cp2[row, centre])
        axes.set_title(f"{turns.labels[row]}\nCP1 \N{MINUS SIGN} CP2 = {deeper:+.0f} microstrain")
        axes.set_xlabel(label("wheel angle", "deg"))
        axes.set_xlim(phi[0], phi[-1])
    axes_row[0].set_ylabel(STRAIN)
