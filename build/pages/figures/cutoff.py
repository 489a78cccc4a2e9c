"""Why the low-pass of `tirelib.measured.signal.lowpass` is chosen by order and not in Hz."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pages.cutoff_study import CutOffStudy
from tirelib.measured.signal.lowpass import DEFAULT_ORDER, SUITABLE_ORDERS
from tirelib.report.style import (
    BLACK,
    BLUE,
    GREEN,
    MARKERS,
    ORANGE,
    RED,
    label,
    legend_below,
    new_figure,
    styled,
    zero_line,
)

SPEED_COLOURS = (BLUE, GREEN, ORANGE)
FIXED = 300.0
"""Cut-off of the dissertation, [Hz], at 65 km/h."""


@styled
def figure_cut_off(study: CutOffStudy) -> Figure:
    """Shift and scatter of contact angle and CP1 over the cut-off, by order and in Hz."""
    figure = new_figure(12.0, 11.0)
    grid = figure.subplots(4, 2, sharex="col", sharey="row")
    rows = (
        ("shift", np.rad2deg(study.angle_shift), label("shift of contact angle", "deg")),
        ("scatter", np.rad2deg(study.angle_scatter), label("scatter of contact angle", "deg")),
        ("shift", 1e6 * study.cp1_shift, label("shift of CP1", "microstrain")),
        ("scatter", 1e6 * study.cp1_scatter, label("scatter of CP1", "microstrain")),
    )
    for line, (kind, values, name) in enumerate(rows):
        for i, speed in enumerate(study.speed):
            text = f"{3.6 * speed:.0f} km/h"
            style = {"marker": MARKERS[i], "color": SPEED_COLOURS[i % 3], "markersize": 4.0}
            grid[line, 0].plot(study.order, values[i], label=text, **style)
            grid[line, 1].plot(study.order * study.turn_rate[i], values[i], label=text, **style)
        grid[line, 0].set_ylabel(name)
        for axes in grid[line]:
            axes.set_xscale("log")
            if kind == "scatter":
                axes.set_yscale("log")
            else:
                zero_line(axes)
    for axes in grid[:, 0]:
        axes.axvspan(*SUITABLE_ORDERS, color=GREEN, alpha=0.10, linewidth=0, label="allowed orders")
        axes.axvline(DEFAULT_ORDER, color=BLACK, linewidth=1.2, label="default order 24")
    for axes in grid[:, 1]:
        axes.axvline(FIXED, color=RED, linewidth=1.4, linestyle="--", label="fixed 300 Hz")
    _at_fixed(grid[0, 1], grid[2, 1], study)
    grid[0, 0].set_title(
        "Cut-off by order: shifts agree at all speeds\n(shift: from the value at order 24)"
    )
    grid[3, 0].set_xlabel(label("cut-off order", "cycles per turn"))
    grid[3, 1].set_xlabel(label("cut-off", "Hz"))
    legend_below(figure, (grid[0, 0], grid[0, 1]), columns=6)
    return figure


def _at_fixed(angle: Axes, cp1: Axes, study: CutOffStudy) -> None:
    """Add to the titles the order of a fixed cut-off at each speed."""
    orders = ", ".join(f"{FIXED / rate:.0f}" for rate in study.turn_rate)
    shifts = ", ".join(_signed(x, 2) for x in np.rad2deg(study.fixed_angle_shift))
    angle.set_title(
        f"Cut-off in Hz: 300 Hz are orders {orders}\nand shift the contact angle by {shifts} deg"
    )
    shifts = ", ".join(_signed(1e6 * x, 0) for x in study.fixed_cp1_shift)
    cp1.set_title(f"300 Hz shift CP1 by {shifts} microstrain")


def _signed(value: float, decimals: int) -> str:
    """Return a shift as text; a cut-off that does not suit the turn rate has none."""
    return f"{value:+.{decimals}f}" if np.isfinite(value) else "(refused)"
