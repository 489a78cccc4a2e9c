"""Contact length (Fig. 4-3), cornering curves and their trends (Fig. 4-20, 4-23)."""

from typing import cast

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.optimize import minimize_scalar

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import CalibrationError
from tirelib.estimators.cornering import CorneringTrend, magic_formula
from tirelib.estimators.dissertation import Means
from tirelib.inference.compare.sentences import millimetres
from tirelib.report.figures.regression import scatter_levels
from tirelib.report.levels import angle_levels, load_levels, reference_level, upright
from tirelib.report.style import (
    CATEGORIES,
    FAINT,
    MARKERS,
    label,
    legend_below,
    new_figure,
    sequence,
    styled,
    zero_line,
)

UNKNOWN_PEAK = 0.25
"""A peak force less certain than this share of itself was not reached by the measurement."""
FEWEST_ANGLES = 3


def bend_factor(angle: FloatArray, force: FloatArray, stiffness: float, peak: float) -> float:
    """Return the Magic Formula's E at given stiffness [N/deg] and peak [N], by least squares."""
    result = minimize_scalar(
        lambda e: float(np.sum((force - magic_formula(angle, stiffness, peak, e)) ** 2)),
        bounds=(-10.0, 1.0),
        method="bounded",
    )
    return float(cast(float, result.x))


@styled
def figure_4_20(means: Means, trend: CorneringTrend) -> Figure:
    """Measured lateral force over slip angle at each load with the Magic Formula.

    Source: dissertation, Fig. 4-20.
    """
    figure = new_figure(10.0, 5.6)
    axes = figure.subplots()
    levels = load_levels(np.where(upright(means), means.load, np.nan))
    grid = np.linspace(float(means.slip_angle.min()), float(means.slip_angle.max()), 300)
    scatter_levels(axes, means.slip_angle, means.lateral_force, levels)
    for level, colour in zip(levels, sequence(len(levels)), strict=True):
        angle, force = means.slip_angle[level.rows], means.lateral_force[level.rows]
        near = int(np.argmin(np.abs(trend.load - level.value)))
        if abs(trend.load[near] - level.value) >= 0.1 * float(means.load.mean()):
            continue
        stiffness, peak = float(trend.stiffness[near]), float(trend.peak[near])
        bend = bend_factor(angle, -force, stiffness, peak)
        inside = (grid >= angle.min()) & (grid <= angle.max())
        axes.plot(grid[inside], -magic_formula(grid[inside], stiffness, peak, bend), color=colour)
    axes.plot([], [], color=FAINT, label="Magic Formula")
    zero_line(axes)
    axes.axvline(0.0, color=FAINT, linewidth=0.9, zorder=1.5)
    axes.set_title(
        "Cornering curves, measured: a positive slip angle gives a negative lateral force"
    )
    axes.set_xlabel(label("measured slip angle", "deg", signed=True))
    axes.set_ylabel(label("measured lateral force Fy", "N", signed=True))
    legend_below(figure, [axes], columns=6)
    return figure


@styled
def figure_4_23(trend: CorneringTrend) -> Figure:
    """Cornering stiffness and peak force against centre contact length, with error bars.

    Source: dissertation, Fig. 4-23.
    """
    figure = new_figure(11.0, 4.8)
    left, right = figure.subplots(1, 2)
    _trend(left, trend, trend.stiffness, trend.stiffness_std, trend.stiffness_fit)
    left.set_title("Cornering stiffness (at zero slip angle)")
    left.set_ylabel(label("cornering stiffness, magnitude", "N/deg"))
    _trend(right, trend, trend.peak, trend.peak_std, trend.peak_fit)
    right.set_title("Peak lateral force")
    right.set_ylabel(label("peak lateral force, magnitude", "N"))
    legend_below(figure, (left, right), columns=4)
    return figure


def _trend(
    axes: Axes, trend: CorneringTrend, value: FloatArray, std: FloatArray, fit: FloatArray
) -> None:
    known = std < UNKNOWN_PEAK * value
    colours = sequence(value.size)
    grid = np.linspace(float(trend.contact_length.min()), float(trend.contact_length.max()), 100)
    axes.plot(
        grid,
        np.polynomial.polynomial.polyval(grid, fit),
        color="#333333",
        zorder=2,
        label="quadratic in the contact length",
    )
    for i in np.flatnonzero(known):
        axes.errorbar(
            trend.contact_length[i],
            value[i],
            1.96 * std[i],
            fmt=MARKERS[i % 10],
            color=colours[i],
            capsize=4,
            markersize=7,
            label=f"{round(trend.load[i], -2):.0f} N",
        )
    if (~known).any():
        axes.plot(
            trend.contact_length[~known],
            value[~known],
            "o",
            markerfacecolor="white",
            markeredgecolor=FAINT,
            markersize=8,
            label="not reached by the data: no interval",
        )
    axes.plot([], [], color=FAINT, marker="_", linestyle="none", label="bars: 95 % interval")
    axes.set_xlabel(label("contact length of the centre gage", "mm"))
    axes.set_ylim(bottom=0.0)


@styled
def figure_4_3(means: Means) -> Figure:
    """Contact length of each gage over slip angle, and its scatter in percent.

    Source: dissertation, Fig. 4-3.

    Raises
    ------
    CalibrationError
        If the slip angle was not varied.
    """
    level = reference_level(load_levels(np.where(upright(means), means.load, np.nan)))
    if len(angle_levels(means.slip_angle[level.rows])) < FEWEST_ANGLES:
        raise CalibrationError(
            f"{level.text}: fewer than {FEWEST_ANGLES} slip angles without camber; the figure "
            "needs them"
        )
    figure = new_figure(11.0, 4.6)
    left, right = figure.subplots(1, 2, width_ratios=(3, 2))
    order = np.argsort(means.lateral)
    line = np.argsort(means.slip_angle[level.rows])
    names = []
    for place, gage in enumerate(order):
        length = means.contact_length[level.rows, gage]
        colour = CATEGORIES[place % len(CATEGORIES)]
        text = f"y = {millimetres(means.lateral[gage])}"
        left.plot(
            means.slip_angle[level.rows][line],
            length[line],
            marker=MARKERS[place % 10],
            color=colour,
            label=text,
        )
        share = 100.0 * float(np.std(length, ddof=1) / np.mean(length))
        bar = right.bar(place, share, color=colour, width=0.65)
        right.bar_label(bar, fmt="%.1f %%", padding=3)
        names.append(millimetres(means.lateral[gage]).removesuffix(" mm"))
    left.set_title(f"Contact length at {level.text}")
    left.set_xlabel(label("slip angle", "deg", signed=True))
    left.set_ylabel(label("contact length", "mm"))
    right.set_title("Standard deviation over the slip angles")
    right.set_xticks(range(len(names)), names)
    right.set_xlabel(label("lateral position y of the gage", "mm", signed=True))
    right.set_ylabel(label("standard deviation / mean", "%"))
    right.grid(visible=False, axis="x")
    right.margins(y=0.15)
    legend_below(figure, [left])
    return figure
