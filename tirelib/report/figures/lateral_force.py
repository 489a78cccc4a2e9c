"""Lateral force: six regressors and the estimator in use, by load and camber (Fig. 4-12, 4-14)."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.core.errors import CalibrationError
from tirelib.estimators.train import Trained
from tirelib.report.figures.regression import (
    RESIDUAL,
    in_use,
    known_rms,
    largest,
    needed_regression,
    residual_panel,
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
SMALL_ANGLE = 5.5
"""Slip angle, [deg], up to which the dissertation regresses."""
CAMBERS = (BLUE, GREEN, ORANGE, PURPLE, RED)


class _Columns:
    """A figure with a column for each estimator: agreement above, residual below, one scale."""

    def __init__(self, count: int, width: float) -> None:
        self.figure = new_figure(width, 7.2)
        grid = self.figure.subplots(
            2, count, sharex=True, sharey="row", height_ratios=(2, 1), squeeze=False
        )
        self.upper, self.lower = list(grid[0]), list(grid[1])
        self.errors: list[FloatArray] = []

    def draw(
        self,
        column: int,
        measured: FloatArray,
        estimated: FloatArray,
        levels: Sequence[Level],
        rows: BoolArray | None = None,
        colours: Sequence[str] | None = None,
    ) -> float:
        """Draw an estimator, and return the rms of its error."""
        upper, lower, error = self.upper[column], self.lower[column], measured - estimated
        scatter_levels(upper, measured, estimated, levels, rows, colours)
        diagonal(upper, measured, estimated)
        scatter_levels(lower, measured, error, levels, rows, colours)
        lower.set_xlabel("measured " + FORCE)
        self.errors.append(error)
        return known_rms(error)

    def finished(self) -> Figure:
        """Return the figure with its labels and its legend."""
        self.upper[0].set_ylabel("estimated " + FORCE)
        self.lower[0].set_ylabel(label(RESIDUAL, "N"))
        for axes in self.lower:
            residual_panel(axes, largest(*self.errors))
        legend_below(self.figure, self.upper, columns=7)
        return self.figure


@styled
def figure_4_12(trained: Trained) -> Figure:
    """Fy fitted by six regressors and by the estimator in use against measured, by load.

    Source: dissertation, Fig. 4-12, 4-13.

    Raises
    ------
    CalibrationError
        If the campaign holds too little lateral force.
    """
    six = needed_regression(trained, "Table 4-1", "Fy", "slip angles")
    held = in_use(trained, "Fy")
    columns = _Columns(2 if held else 1, 11.4 if held else 6.0)
    levels = load_levels(trained.means.load)
    left = columns.draw(0, six.measured, six.fitted, levels, six.rows)
    columns.upper[0].set_title(
        f"Six regressors (Table 4-1): R\u00b2 = {six.r2:.4f}\nrms {left:.0f} N, "
        f"held out {six.cross_validated:.0f} N"
    )
    if held is not None:
        angle = trained.links.truth["slip_angle"]
        rows = (np.abs(np.rad2deg(angle)) <= SMALL_ANGLE) | ~np.isfinite(angle)
        levels = load_levels(trained.links.truth["Fz"])
        left = columns.draw(1, held[0][rows], held[1][rows], levels, rows)
        columns.upper[1].set_title(f"Estimator in use, held out\nrms {left:.0f} N")
    return columns.finished()


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
    columns = _Columns(3 if held else 2, 13.8 if held else 9.2)
    for each in tables:
        columns.draw(0, each.measured, each.fitted, cambers, each.rows, colours)
    lowest, held_out = min(r.r2 for r in tables), max(r.cross_validated for r in tables)
    columns.upper[0].set_title(
        f"Six regressors, refitted at each camber\nR\u00b2 \u2265 {lowest:.4f}, "
        f"held out \u2264 {held_out:.0f} N"
    )
    measured = trained.means.lateral_force
    left = columns.draw(1, measured, _unaware(trained), cambers, None, colours)
    columns.upper[1].set_title(f"Six regressors, one fit for all cambers\nrms {left:.0f} N")
    if held is not None:
        levels = camber_levels(np.rad2deg(trained.links.values["camber"]))
        left = columns.draw(2, *held, levels, None, colours[: len(levels)])
        columns.upper[2].set_title(f"Estimator in use for all cambers, held out\nrms {left:.0f} N")
    return columns.finished()


def _unaware(trained: Trained) -> FloatArray:
    """Return Fy by six regressors with one set of coefficients for all cambers."""
    means = trained.means
    near = np.sort(np.argsort(np.abs(means.lateral), kind="stable")[:3])
    one = np.ones((means.load.size, 1))
    design = np.concatenate((one, means.contact_length[:, near], means.cp1[:, near]), axis=1)
    found = np.linalg.lstsq(design, means.lateral_force, rcond=None)[0]
    return np.asarray(design @ found)
