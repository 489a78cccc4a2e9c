"""Lateral force: six regressors and the estimator in use, by load and camber (Fig. 4-12, 4-14)."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.core.errors import CalibrationError
from tirelib.estimators.train import Trained
from tirelib.report.figures.regression import (
    RESIDUAL,
    find_regression,
    in_use,
    largest,
    residual_panel,
    rms,
    scatter_levels,
)
from tirelib.report.levels import Level, camber_levels, load_levels
from tirelib.report.style import (
    BLUE,
    GREEN,
    ORANGE,
    PURPLE,
    RED,
    diagonal,
    label,
    legend_below,
    new_figure,
    styled,
)

FORCE = label("lateral force Fy", "N", signed=True)
CAMBERS = (BLUE, GREEN, ORANGE, PURPLE, RED)


def _column(
    agreement: Axes,
    residual: Axes,
    measured: FloatArray,
    estimated: FloatArray,
    levels: Sequence[Level],
    rows: BoolArray | None,
    colours: Sequence[str] | None,
) -> None:
    """Draw one estimator: agreement above, residual below."""
    scatter_levels(agreement, measured, estimated, levels, rows, colours)
    diagonal(agreement, measured, estimated)
    scatter_levels(residual, measured, measured - estimated, levels, rows, colours)
    residual.set_xlabel("measured " + FORCE)


def _finish(figure: Figure, upper: Sequence[Axes], lower: Sequence[Axes], half: float) -> None:
    upper[0].set_ylabel("estimated " + FORCE)
    lower[0].set_ylabel(label(RESIDUAL, "N"))
    for axes in lower:
        residual_panel(axes, half)
    legend_below(figure, upper, columns=7)


@styled
def figure_4_12(trained: Trained) -> Figure:
    """Fy fitted by six regressors and by the estimator in use against measured, by load.

    Source: dissertation, Fig. 4-12, 4-13.

    Raises
    ------
    CalibrationError
        If the campaign holds too little lateral force.
    """
    six = find_regression(trained, "Table 4-1")
    if six is None:
        raise CalibrationError(
            "Table 4-1: Fy was not varied or not measured; the figure needs slip angles"
        )
    held = in_use(trained, "Fy")
    columns = 2 if held else 1
    figure = new_figure(5.4 * columns + 0.6, 7.2)
    grid = figure.subplots(
        2, columns, sharex=True, sharey="row", height_ratios=(2, 1), squeeze=False
    )
    _column(
        grid[0, 0],
        grid[1, 0],
        six.measured,
        six.fitted,
        load_levels(trained.means.load),
        six.rows,
        None,
    )
    rest = six.measured - six.fitted
    grid[0, 0].set_title(
        f"Six regressors (Table 4-1): R\u00b2 = {six.r2:.4f}\nrms {rms(rest):.0f} N, "
        f"held out {six.cross_validated:.0f} N"
    )
    half = largest(rest)
    if held is not None:
        measured, estimated = held
        rows = np.abs(np.rad2deg(trained.links.truth["slip_angle"])) <= 5.5
        rows |= ~np.isfinite(trained.links.truth["slip_angle"])
        levels = load_levels(trained.links.truth["Fz"])
        _column(grid[0, 1], grid[1, 1], measured[rows], estimated[rows], levels, rows, None)
        error = (measured - estimated)[rows]
        grid[0, 1].set_title(f"Estimator in use, held out\nrms {rms(error):.0f} N")
        half = largest(rest, error)
    _finish(figure, grid[0], grid[1], half)
    return figure


@styled
def figure_4_14(trained: Trained) -> Figure:
    """Fy under camber: six regressors fitted at each camber, and one estimator in use for all.

    Source: dissertation, Fig. 4-14 and Table 4-2.

    Raises
    ------
    CalibrationError
        If the campaign holds one camber only.
    """
    tables = [r for r in trained.regressions if r.source == "Table 4-2"]
    if not tables:
        raise CalibrationError(
            "Table 4-2: the camber was not varied; the figure needs camber angles"
        )
    cambers = camber_levels(trained.means.camber)
    colours = [CAMBERS[i % len(CAMBERS)] for i in range(len(cambers))]
    held = in_use(trained, "Fy")
    columns = 3 if held else 2
    figure = new_figure(4.6 * columns, 7.2)
    grid = figure.subplots(
        2, columns, sharex=True, sharey="row", height_ratios=(2, 1), squeeze=False
    )
    parts = []
    for regression in tables:
        _column(
            grid[0, 0],
            grid[1, 0],
            regression.measured,
            regression.fitted,
            cambers,
            regression.rows,
            colours,
        )
        parts.append(regression.measured - regression.fitted)
    lowest = min(regression.r2 for regression in tables)
    held_out = max(regression.cross_validated for regression in tables)
    grid[0, 0].set_title(
        f"Six regressors, refitted at each camber\nR\u00b2 \u2265 {lowest:.4f}, "
        f"held out \u2264 {held_out:.0f} N"
    )
    _unaware(trained, list(grid[:, 1]), cambers, colours, parts)
    if held is not None:
        levels = camber_levels(np.rad2deg(trained.links.values["camber"]))
        measured, estimated = held
        _column(grid[0, 2], grid[1, 2], measured, estimated, levels, None, colours[: len(levels)])
        parts.append(measured - estimated)
        grid[0, 2].set_title(
            f"Estimator in use for all cambers, held out\nrms {rms(parts[-1]):.0f} N"
        )
    _finish(figure, grid[0], grid[1], largest(*parts))
    return figure


def _unaware(
    trained: Trained,
    column: Sequence[Axes],
    cambers: Sequence[Level],
    colours: Sequence[str],
    parts: list[FloatArray],
) -> None:
    """Draw six regressors with one set of coefficients for all cambers."""
    means = trained.means
    near = np.sort(np.argsort(np.abs(means.lateral), kind="stable")[:3])
    design = np.concatenate(
        (np.ones((means.load.size, 1)), means.contact_length[:, near], means.cp1[:, near]), axis=1
    )
    fitted = design @ np.linalg.lstsq(design, means.lateral_force, rcond=None)[0]
    _column(column[0], column[1], means.lateral_force, fitted, cambers, None, colours)
    parts.append(means.lateral_force - fitted)
    column[0].set_title(f"Six regressors, one fit for all cambers\nrms {rms(parts[-1]):.0f} N")
