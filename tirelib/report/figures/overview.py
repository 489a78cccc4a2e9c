"""Estimates against measurements: by quantity, turn by turn (Fig. 4-8), and their residuals."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from scipy.special import ndtri

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import CalibrationError
from tirelib.estimators.estimate import Estimates
from tirelib.estimators.train import Trained
from tirelib.measured.observations import Observations
from tirelib.report.accuracy import (
    QUANTITIES,
    SAID,
    WIDTH,
    Compared,
    accuracy,
    compare,
)
from tirelib.report.figures.regression import (
    ANGLE,
    RESIDUAL,
    find_regression,
    in_use,
    known_rms,
    largest,
    residual_panel,
    scatter_levels,
)
from tirelib.report.levels import load_levels
from tirelib.report.style import (
    BLACK,
    FAINT,
    MARKERS,
    diagonal,
    label,
    legend_below,
    new_figure,
    sequence,
    styled,
    zero_line,
)

DISSERTATION = {"Fz": "Fig. 4-4", "alpha": "Fig. 4-7", "Fy": "Table 4-1"}
"""The dissertation's regression of each quantity."""


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
    name, _, unit, signed = SAID[part.quantity]
    levels = load_levels(part.load)
    error = part.measured - part.estimated
    for i, (level, colour) in enumerate(zip(levels, sequence(len(levels)), strict=True)):
        x, half = part.measured[level.rows], WIDTH * part.std[level.rows]
        look: dict[str, Any] = {"fmt": MARKERS[i % len(MARKERS)], "color": colour}
        above = look | {"markersize": 3.6, "elinewidth": 0.8, "label": level.text}
        below = look | {"markersize": 3.0, "elinewidth": 0.7, "alpha": 0.75}
        upper.errorbar(x, part.estimated[level.rows], half, **above)
        lower.errorbar(x, error[level.rows], half, **below)
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


@styled
def figure_4_8(observations: Observations, estimates: Estimates) -> Figure:
    """Measured and estimated slip angle, turn after turn, load after load, with the residual.

    Source: dissertation, Fig. 4-8.
    """
    measured = np.rad2deg(observations.truth["slip_angle"])
    value, std = np.rad2deg(estimates.value["alpha"]), np.rad2deg(estimates.std["alpha"])
    good = estimates.valid["alpha"] & np.isfinite(measured)
    levels = load_levels(np.where(good, observations.truth["Fz"], np.nan))
    figure = new_figure(12.5, 6.2)
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    start = 0
    for level, colour in zip(levels, sequence(len(levels)), strict=True):
        rows = np.flatnonzero(level.rows)
        at = start + np.arange(rows.size)
        upper.step(at, measured[rows], where="mid", color=FAINT, linewidth=1.4, label="measured")
        look: dict[str, Any] = {"fmt": "o", "color": colour, "markersize": 3.2, "elinewidth": 0.9}
        error, half = measured[rows] - value[rows], WIDTH * std[rows]
        upper.errorbar(at, value[rows], half, **look, label=f"estimated, {level.text}")
        lower.errorbar(at, error, half, **look)
        upper.text(
            start + 0.5 * rows.size,
            1.02,
            f"{level.text}: rms {known_rms(error):.2f} deg",
            transform=upper.get_xaxis_transform(),
            ha="center",
            va="bottom",
            fontsize=9.5,
        )
        start += rows.size
        for axes in (upper, lower):
            axes.axvline(start - 0.5, color=BLACK, linewidth=0.6, alpha=0.5)
    zero_line(upper)
    zero_line(lower)
    upper.set_ylabel(ANGLE)
    lower.set_ylabel(label(RESIDUAL, "deg"))
    lower.set_xlabel("valid turn, in order of measurement within each load [-]")
    upper.set_xlim(-1, max(start, 1))
    upper.grid(visible=False, axis="x")
    lower.grid(visible=False, axis="x")
    legend_below(figure, [upper], columns=6)
    return figure


@styled
def figure_residuals(trained: Trained, quantity: str) -> Figure:
    """Held-out residuals of the estimator in use; below, those of the dissertation's regression.

    Each row has a scale of its own, so that a pattern shows.

    Raises
    ------
    CalibrationError
        If the quantity was not calibrated.
    """
    held = in_use(trained, quantity)
    if held is None:
        reason = trained.links.refused.get(quantity, "no reason is known")
        raise CalibrationError(f"residuals of {quantity}: it is not calibrated: {reason}")
    measured, estimated = held
    truth = trained.links.truth
    angle, error = np.rad2deg(truth["slip_angle"]), measured - estimated
    rows = [("in use, held out", estimated, truth["Fz"], angle, error)]
    old = find_regression(trained, DISSERTATION.get(quantity, ""))
    if old is not None:
        load, angle = trained.means.load[old.rows], trained.means.slip_angle[old.rows]
        name = f"dissertation, {old.source}"
        rows.append((name, old.fitted, load, angle, old.measured - old.fitted))
    figure = new_figure(13.0, 0.7 + 3.5 * len(rows))
    grid = figure.subplots(len(rows), 4, width_ratios=(1, 1, 1, 0.9), squeeze=False)
    for panels, row in zip(grid, rows, strict=True):
        _draw_residuals(list(panels), quantity, *row)
    legend_below(figure, [grid[0, 0]], columns=7)
    return figure


def _draw_residuals(
    panels: list[Axes],
    quantity: str,
    what: str,
    estimated: FloatArray,
    load: FloatArray,
    angle: FloatArray,
    error: FloatArray,
) -> None:
    """Draw a row of the figure: residuals over the estimate, the load and the slip angle."""
    unit, name = SAID[quantity].unit, SAID[quantity].title
    levels = load_levels(load)
    across = (
        (estimated, f"estimated {SAID[quantity].label}"),
        (load, label("measured vertical load Fz", "N")),
        (angle, label("measured slip angle", "deg", signed=True)),
    )
    for axes, (x, text) in zip(panels, across, strict=False):
        scatter_levels(axes, x, error, levels)
        residual_panel(axes, largest(error))
        axes.set_xlabel(text)
    panels[0].set_ylabel(label(RESIDUAL, unit))
    for axes in panels[1:3]:
        axes.sharey(panels[0])
        axes.tick_params(labelleft=False)
    place = ndtri((np.arange(error.size) + 0.5) / error.size)
    panels[3].plot(place, np.sort(error), "o", markersize=3.5, color="#333333")
    panels[3].plot(place, place * float(np.std(error)), color=FAINT, linewidth=1.0)
    panels[3].set_title("against a normal law")
    panels[3].set_xlabel("normal quantile [-]")
    panels[3].set_ylabel(label(RESIDUAL, unit))
    panels[0].set_title(f"{name[0].upper()}{name[1:]}, {what}: rms {known_rms(error):.3g} {unit}")
