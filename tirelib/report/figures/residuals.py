"""Residuals of a calibration: over estimate, load and slip angle, and against a normal law."""

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.special import ndtri

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import CalibrationError
from tirelib.estimators.train import Trained
from tirelib.report.accuracy import SIGNED, TITLE, UNIT
from tirelib.report.figures.regression import (
    RESIDUAL,
    find_regression,
    in_use,
    largest,
    residual_panel,
    rms,
    scatter_levels,
)
from tirelib.report.levels import load_levels
from tirelib.report.style import FAINT, label, legend_below, new_figure, styled

DISSERTATION = {"Fz": "Fig. 4-4", "alpha": "Fig. 4-7", "Fy": "Table 4-1"}
"""The dissertation's regression of each quantity."""


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
    rows = [
        _Residuals(
            "in use, held out",
            estimated,
            truth["Fz"],
            np.rad2deg(truth["slip_angle"]),
            measured - estimated,
        )
    ]
    old = find_regression(trained, DISSERTATION.get(quantity, ""))
    if old is not None:
        means, use = trained.means, old.rows
        rows.append(
            _Residuals(
                f"dissertation, {old.source}",
                old.fitted,
                means.load[use],
                means.slip_angle[use],
                old.measured - old.fitted,
            )
        )
    figure = new_figure(13.0, 0.7 + 3.5 * len(rows))
    grid = figure.subplots(len(rows), 4, width_ratios=(1, 1, 1, 0.9), squeeze=False)
    for panels, row in zip(grid, rows, strict=True):
        _draw(list(panels), row, quantity)
    legend_below(figure, [grid[0, 0]], columns=7)
    return figure


@dataclass(frozen=True, slots=True)
class _Residuals:
    """One row of the figure; arrays of shape (n,), as drawn."""

    name: str
    estimated: FloatArray
    load: FloatArray
    angle: FloatArray
    error: FloatArray


def _draw(panels: list[Axes], row: _Residuals, quantity: str) -> None:
    unit, name, error = UNIT[quantity], TITLE[quantity], row.error
    levels = load_levels(row.load)
    across = (
        (row.estimated, label(f"estimated {name}", unit, signed=quantity in SIGNED)),
        (row.load, label("measured vertical load Fz", "N")),
        (row.angle, label("measured slip angle", "deg", signed=True)),
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
    panels[0].set_title(f"{name[0].upper()}{name[1:]}, {row.name}: rms {rms(error):.3g} {unit}")
