"""Vertical load from the centre contact length (Fig. 4-4)."""

from matplotlib.figure import Figure

from tirelib.core.errors import CalibrationError
from tirelib.estimators.train import Trained
from tirelib.report.figures.regression import (
    RESIDUAL,
    curve,
    find_regression,
    in_use,
    largest,
    residual_panel,
    rms,
    scatter_levels,
)
from tirelib.report.levels import load_levels
from tirelib.report.style import label, legend_below, new_figure, styled

SOURCE = "Fig. 4-4"


@styled
def figure_4_4(trained: Trained) -> Figure:
    """Load against centre contact length with the quadratic, its residuals, and those in use.

    Source: dissertation, Fig. 4-4.

    Raises
    ------
    CalibrationError
        If the campaign did not vary the load.
    """
    regression = find_regression(trained, SOURCE)
    if regression is None:
        raise CalibrationError(
            f"{SOURCE}: the load was not varied or not measured; the figure needs several loads"
        )
    levels, rows = load_levels(trained.means.load), regression.rows
    b = [term.coefficient for term in regression.terms]
    held = in_use(trained, "Fz")
    figure = new_figure(12.5 if held else 9.0, 4.5)
    panels = figure.subplots(1, 3 if held else 2)
    scatter_levels(panels[0], regression.regressor, regression.measured, levels, rows)
    curve(
        panels[0],
        regression.regressor,
        lambda x: b[0] + b[1] * x + b[2] * x**2,
        "quadratic, ordinary least squares",
    )
    panels[0].set_title(
        f"Fz = {b[0]:.0f} {b[1]:+.2f} l {b[2]:+.4f} l\u00b2\nR\u00b2 = {regression.r2:.4f}"
    )
    panels[0].set_xlabel(label("contact length l of the centre gage", "mm"))
    panels[0].set_ylabel(label("measured vertical load Fz", "N"))
    rest = regression.measured - regression.fitted
    half = largest(rest)
    scatter_levels(panels[1], regression.fitted, rest, levels, rows)
    panels[1].set_title(
        f"Residuals of the quadratic\nrms {rms(rest):.0f} N, held out "
        f"{regression.cross_validated:.0f} N"
    )
    if held is not None:
        measured, estimated = held
        own = load_levels(measured)
        scatter_levels(panels[2], estimated, measured - estimated, own)
        panels[2].set_title(f"Estimator in use, held out\nrms {rms(measured - estimated):.1f} N")
        half = largest(rest, measured - estimated)
    for axes in panels[1:]:
        residual_panel(axes, half)
        axes.set_xlabel(label("estimated vertical load Fz", "N"))
        axes.set_ylabel(label(RESIDUAL, "N"))
    legend_below(figure, panels[:1], columns=7)
    return figure
