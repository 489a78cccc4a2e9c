"""Common parts of the regression figures: a curve with its data, and its residuals."""

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.axes import Axes

from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.estimators.dissertation import Regression
from tirelib.estimators.train import Trained
from tirelib.report.accuracy import FACTOR, TRUTH
from tirelib.report.levels import Level
from tirelib.report.style import MARKERS, sequence, zero_line

RESIDUAL = "measured \N{MINUS SIGN} estimated"


def find_regression(trained: Trained, source: str) -> Regression | None:
    """Return the dissertation's regression of a figure or table; None where it was not fitted."""
    return next((r for r in trained.regressions if r.source == source), None)


def scatter_levels(
    axes: Axes,
    x: FloatArray,
    y: FloatArray,
    levels: Sequence[Level],
    rows: BoolArray | None = None,
    colours: Sequence[str] | None = None,
) -> None:
    """Scatter y over x, each level with its colour, marker and legend entry.

    With `rows`, x and y hold only the rows that are true there, while the levels count all.
    """
    colours = colours or sequence(len(levels))
    for i, (level, colour) in enumerate(zip(levels, colours, strict=True)):
        here = level.rows if rows is None else level.rows[rows]
        if here.any():
            axes.scatter(
                x[here],
                y[here],
                s=26,
                marker=MARKERS[i % len(MARKERS)],
                color=colour,
                edgecolors="white",
                linewidths=0.4,
                zorder=3,
                label=level.text,
            )


def curve(axes: Axes, x: FloatArray, value: Callable[[FloatArray], FloatArray], text: str) -> None:
    """Draw a fitted curve over the range of x."""
    grid = np.linspace(float(x.min()), float(x.max()), 200)
    axes.plot(grid, value(grid), color="#333333", linewidth=1.6, zorder=4, label=text)


def residual_panel(axes: Axes, half: float) -> None:
    """Set a residual axes up: zero line and symmetric limits."""
    zero_line(axes)
    if np.isfinite(half) and half > 0.0:
        axes.set_ylim(-1.12 * half, 1.12 * half)


def in_use(trained: Trained, quantity: str) -> tuple[FloatArray, FloatArray] | None:
    """Return measured and held-out estimated values in the report's unit, one row a measurement."""
    links = trained.links
    if quantity not in links.held_out:
        return None
    factor = FACTOR[quantity]
    return links.truth[TRUTH[quantity]] * factor, links.held_out[quantity] * factor


def rms(values: FloatArray) -> float:
    """Return the root mean square of the finite values."""
    values = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(values**2))) if values.size else float("nan")


def largest(*parts: FloatArray) -> float:
    """Return the largest finite magnitude."""
    every = np.abs(np.concatenate([part.ravel() for part in parts]))
    every = every[np.isfinite(every)]
    return float(every.max()) if every.size else 1.0
