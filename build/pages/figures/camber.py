"""Slip and camber together: contact lengths saturate, compressive peaks survive (Fig. 4-16)."""

import numpy as np
from matplotlib.figure import Figure

from tirelib.estimators.dissertation import Means
from tirelib.inference.compare.sentences import millimetres
from tirelib.report.figures.lateral_force import CAMBERS
from tirelib.report.levels import camber_levels
from tirelib.report.style import MARKERS, label, legend_below, new_figure, styled


@styled
def figure_4_16(means: Means) -> Figure:
    """Contact length and CP1 at the two outer gages over slip angle, a line for each camber.

    Source: dissertation, Fig. 4-16.
    """
    order = np.argsort(means.lateral)
    outer = (int(order[-1]), int(order[0]))
    levels = camber_levels(means.camber)
    figure = new_figure(11.0, 7.6)
    grid = figure.subplots(2, 2, sharex=True, sharey="row")
    for column, gage in enumerate(outer):
        side = "left" if means.lateral[gage] > 0 else "right"
        place = f"y = {millimetres(means.lateral[gage])} ({side})"
        grid[0, column].set_title(f"Contact length at {place}")
        grid[1, column].set_title(f"First compressive peak CP1 at {place}")
        for i, level in enumerate(levels):
            rows = np.flatnonzero(level.rows)
            rows = rows[np.argsort(means.slip_angle[rows])]
            for line, values in enumerate((means.contact_length, means.cp1)):
                grid[line, column].plot(
                    means.slip_angle[rows],
                    values[rows, gage],
                    marker=MARKERS[i % 10],
                    color=CAMBERS[i % len(CAMBERS)],
                    markersize=4.5,
                    label=level.text,
                )
        grid[1, column].set_xlabel(label("slip angle", "deg", signed=True))
    grid[0, 0].set_ylabel(label("contact length", "mm"))
    grid[1, 0].set_ylabel(label("CP1", "microstrain"))
    legend_below(figure, [grid[0, 0]])
    return figure
