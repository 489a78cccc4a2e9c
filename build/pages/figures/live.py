"""The live strip: strain of the last turn, and estimates turn after turn with the rig's values."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pages.figures.strain import ANGLE, STRAIN
from tirelib.core.arrays import FloatArray, IntArray
from tirelib.inference.compare.sentences import millimetres
from tirelib.report.accuracy import QUANTITIES, SAID, WIDTH
from tirelib.report.style import (
    BLACK,
    BLUE,
    CATEGORIES,
    FAINT,
    SKY,
    label,
    legend_below,
    new_figure,
    styled,
    zero_line,
)


@dataclass(frozen=True, slots=True)
class LastTurn:
    """Strain over wheel angle of one turn of a run.

    `phi` [rad] has shape (m,), `strain` (gages, m), `lateral` [m] (gages,).
    """

    run: int
    phi: FloatArray
    strain: FloatArray
    lateral: FloatArray


@dataclass(frozen=True, slots=True)
class Strip:
    """Estimates in the order of the line, in the units of reports.

    `time` [s] since the first sample, `run`, and for each quantity `value`, `std` and `truth` have
    shape (turns,); NaN where there is none.
    """

    time: FloatArray
    run: IntArray
    value: Mapping[str, FloatArray]
    std: Mapping[str, FloatArray]
    truth: Mapping[str, FloatArray]


@styled
def figure_live(last: LastTurn, strip: Strip) -> Figure:
    """Strain of the last turn above; below a row for each quantity, right its difference."""
    figure = new_figure(12.0, 12.5)
    halves = figure.subfigures(2, 1, squeeze=False, height_ratios=(1.0, 2.5))
    top, below = halves[0, 0], halves[1, 0]
    strain = top.subplots()
    _draw_strain(strain, last)
    grid = below.subplots(len(QUANTITIES), 2, sharex=True, width_ratios=(1.5, 1.0))
    for (left, right), name in zip(grid, QUANTITIES, strict=True):
        _draw_quantity(left, right, strip, name)
    grid[0, 1].set_title("Estimated \N{MINUS SIGN} measured")
    _name_runs(grid[0, 0], strip)
    for axes in grid[-1]:
        axes.set_xlabel(label("time since the first sample on the line", "s"))
    legend_below(figure, [strain, grid[0, 0]], columns=5)
    return figure


def _draw_strain(axes: Axes, last: LastTurn) -> None:
    phi = np.rad2deg(last.phi)
    for place, gage in enumerate(np.argsort(last.lateral)):
        axes.plot(
            phi,
            1e6 * last.strain[gage],
            color=CATEGORIES[place % len(CATEGORIES)],
            label=f"gage at y = {millimetres(last.lateral[gage])}",
        )
    known = phi[np.isfinite(last.strain).any(axis=0)]
    axes.set_xlim(known[0], known[-1])
    axes.set_title(f"Strain of the last turn, run {last.run}")
    axes.set_xlabel(ANGLE)
    axes.set_ylabel(STRAIN)
    zero_line(axes)


def _draw_quantity(left: Axes, right: Axes, strip: Strip, name: str) -> None:
    value, truth = strip.value[name], strip.truth[name]
    half = WIDTH * strip.std[name]
    for rows in _stretches(strip, name):
        time = strip.time[rows]
        left.plot(
            time,
            truth[rows],
            color=BLACK,
            linewidth=3.2,
            alpha=0.45,
            solid_capstyle="butt",
            label="measured by the rig, mean of the run",
        )
        error = value[rows] - truth[rows]
        for axes, middle in ((left, value[rows]), (right, error)):
            axes.fill_between(
                time,
                middle - half[rows],
                middle + half[rows],
                color=SKY,
                alpha=0.45,
                linewidth=0,
                label="95 % band",
            )
            axes.plot(
                time, middle, "o-", color=BLUE, markersize=3.8, linewidth=1.1, label="estimated"
            )
    for axes in (left, right):
        for change in np.flatnonzero(np.diff(strip.run)):
            axes.axvline(
                0.5 * (strip.time[change] + strip.time[change + 1]),
                color=FAINT,
                linewidth=0.8,
                linestyle=":",
                zorder=1.2,
            )
    zero_line(right)
    left.set_ylabel(_label(SAID[name].title, name))
    right.set_ylabel(_label("difference", name))


def _label(text: str, name: str) -> str:
    """Return a label in two lines, for the rows are low."""
    return label(text, SAID[name].unit, signed=SAID[name].signed).replace(" [", "\n[", 1)


def _stretches(strip: Strip, name: str) -> Iterator[slice]:
    """Yield stretches of turns of one run that have an estimate."""
    known = np.isfinite(strip.value[name]) & np.isfinite(strip.std[name])
    start = None
    for i in range(len(known) + 1):
        ends = i == len(known) or not known[i] or (i > 0 and strip.run[i] != strip.run[i - 1])
        if start is not None and ends:
            yield slice(start, i)
            start = None
        if i < len(known) and known[i] and start is None:
            start = i


def _name_runs(axes: Axes, strip: Strip) -> None:
    """Write the number of each run above its turns."""
    changes = [0, *(np.flatnonzero(np.diff(strip.run)) + 1), len(strip.run)]
    for first, stop in pairwise(changes):
        axes.annotate(
            f"run {strip.run[first]}",
            (float(strip.time[first:stop].mean()), 1.0),
            xycoords=("data", "axes fraction"),
            xytext=(0, 3),
            textcoords="offset points",
            ha="center",
            va="bottom",
            color=FAINT,
            fontsize=9.0,
        )
