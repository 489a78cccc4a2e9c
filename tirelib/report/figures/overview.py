"""Accuracy at a glance: estimated against measured for every quantity, with 95 % intervals."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from tirelib.estimators.estimate import Estimates
from tirelib.measured.observations import Observations
from tirelib.report.accuracy import (
    QUANTITIES,
    SIGNED,
    TITLE,
    UNIT,
    WIDTH,
    Compared,
    accuracy,
    compare,
)
from tirelib.report.figures.regression import RESIDUAL, largest, residual_panel
from tirelib.report.levels import load_levels
from tirelib.report.style import (
    MARKERS,
    diagonal,
    label,
    legend_below,
    new_figure,
    sequence,
    styled,
)


@styled
def figure_accuracy(observations: Observations, estimates: Estimates) -> Figure:
    """Estimated against measured for each quantity, and the residual with its 95 % interval."""
    parts = [compare(observations, estimates, quantity) for quantity in QUANTITIES]
    parts = [part for part in parts if part.measured.size]
    figure = new_figure(3.75 * max(len(parts), 1) + 0.4, 7.0)
    grid = figure.subplots(2, max(len(parts), 1), sharex="col", height_ratios=(3, 2), squeeze=False)
    for part, upper, lower in zip(parts, grid[0], grid[1], strict=False):
        _column(part, upper, lower)
    legend_below(figure, list(grid[0]), columns=7)
    return figure


def _column(part: Compared, upper: Axes, lower: Axes) -> None:
    row = accuracy(part)
    name, unit, signed = TITLE[part.quantity], UNIT[part.quantity], part.quantity in SIGNED
    levels = load_levels(part.load)
    error = part.measured - part.estimated
    for i, (level, colour) in enumerate(zip(levels, sequence(len(levels)), strict=True)):
        x, marker = part.measured[level.rows], MARKERS[i % len(MARKERS)]
        upper.errorbar(
            x,
            part.estimated[level.rows],
            WIDTH * part.std[level.rows],
            fmt=marker,
            color=colour,
            markersize=3.6,
            elinewidth=0.8,
            label=level.text,
        )
        lower.errorbar(
            x,
            error[level.rows],
            WIDTH * part.std[level.rows],
            fmt=marker,
            color=colour,
            markersize=3.0,
            elinewidth=0.7,
            alpha=0.75,
        )
    diagonal(upper, part.measured, part.estimated)
    digits = {"N": 1, "deg": 3, "%": 3}[unit]
    fit = f"R\u00b2 {row.r2:.5f}" if np.isfinite(row.r2) else "not varied"
    upper.set_title(
        f"{name[0].upper()}{name[1:]}\nrmse {row.rmse:.{digits}f} {unit}, {fit}\n"
        f"intervals hold {100 * row.coverage:.0f} %"
    )
    upper.set_ylabel(label("estimated", unit, signed=signed))
    lower.set_ylabel(label(RESIDUAL, unit))
    lower.set_xlabel(label("measured", unit, signed=signed))
    residual_panel(lower, largest(error - WIDTH * part.std, error + WIDTH * part.std))
    upper.margins(0.06)
    lower.xaxis.set_major_locator(MaxNLocator(5))
