"""Residuals of a calibration: over estimate, load and slip angle, and against a normal law."""

import numpy as np
from matplotlib.figure import Figure
from scipy.stats import norm

from tirelib.arrays import FloatArray
from tirelib.errors import CalibrationError
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
from tirelib.report.style import FAINT, ORANGE, label, legend_below, new_figure, styled

DISSERTATION = {"Fz": "Fig. 4-4", "alpha": "Fig. 4-7", "Fy": "Table 4-1"}
"""The dissertation's regression of each quantity."""


@styled
def figure_residuals(trained: Trained, quantity: str) -> Figure:
    """Held-out residuals of the estimator in use, with the dissertation's regression behind.

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
    error, unit = measured - estimated, UNIT[quantity]
    load, angle = trained.links.truth["Fz"], np.rad2deg(trained.links.truth["slip_angle"])
    levels = load_levels(load)
    figure = new_figure(13.0, 4.4)
    panels = figure.subplots(1, 4, width_ratios=(1, 1, 1, 0.9))
    across = (
        (estimated, label("estimated", unit, signed=quantity in SIGNED)),
        (load, label("measured Fz", "N")),
        (angle, label("measured slip angle", "deg", signed=True)),
    )
    behind = _behind(trained, quantity)
    for i, (axes, (x, name)) in enumerate(zip(panels, across, strict=False)):
        if behind is not None:
            axes.scatter(
                behind[i], behind[3], s=16, facecolors="none", edgecolors=ORANGE, linewidths=0.9,
                label=f"dissertation's regression, rms {rms(behind[3]):.3g} {unit}",
            )  # fmt: skip
        scatter_levels(axes, x, error, levels)
        residual_panel(axes, largest(error) if behind is None else largest(error, behind[3]))
        axes.set_xlabel(name)
        axes.sharey(panels[0])
    panels[0].set_ylabel(label(RESIDUAL, unit))
    for axes in panels[1:3]:
        axes.tick_params(labelleft=False)
    place = norm.ppf((np.arange(error.size) + 0.5) / error.size)
    panels[3].plot(place, np.sort(error), "o", markersize=3.5, color="#333333")
    panels[3].plot(place, place * float(np.std(error)), color=FAINT, linewidth=1.0)
    panels[3].set_title("In use: is the error normal?")
    panels[3].set_xlabel("normal quantile [-]")
    panels[3].set_ylabel(label(RESIDUAL, unit))
    panels[0].set_title(
        f"{TITLE[quantity][0].upper()}{TITLE[quantity][1:]}, in use, held out:\nrms {rms(error):.3g} {unit}"
    )
    legend_below(figure, [panels[0]], columns=7)
    return figure


def _behind(
    trained: Trained, quantity: str
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray] | None:
    """Fitted value, load, slip angle and residual of the dissertation's regression."""
    regression = find_regression(trained, DISSERTATION.get(quantity, ""))
    if regression is None:
        return None
    means, rows = trained.means, regression.rows
    rest = regression.measured - regression.fitted
    return regression.fitted, means.load[rows], means.slip_angle[rows], rest
