"""Slip angle: the dissertation's two regressions and the estimator in use (Fig. 4-5, 4-7, 4-8)."""

import numpy as np
from matplotlib.figure import Figure

from tirelib.core.errors import CalibrationError
from tirelib.estimators.dissertation import Regression
from tirelib.estimators.estimate import Estimates
from tirelib.estimators.train import Trained
from tirelib.measured.observations import Observations
from tirelib.report.accuracy import WIDTH
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
from tirelib.report.levels import load_levels, reference_level
from tirelib.report.style import (
    BLACK,
    FAINT,
    label,
    legend_below,
    new_figure,
    sequence,
    styled,
    zero_line,
)

ANGLE = label("slip angle", "deg", signed=True)


def _regression(trained: Trained, source: str) -> Regression:
    found = find_regression(trained, source)
    if found is None:
        raise CalibrationError(
            f"{source}: the slip angle was not varied or not measured; the figure needs slip angles"
        )
    return found


def _draw(trained: Trained, regression: Regression, regressor: str, beside: bool) -> Figure:
    levels, rows = load_levels(trained.means.load), regression.rows
    held = in_use(trained, "alpha") if beside else None
    figure = new_figure(12.5 if held else 9.5, 4.6)
    panels = figure.subplots(1, 3 if held else 2)
    x, measured = regression.regressor, regression.measured
    b = [term.coefficient for term in regression.terms]
    scatter_levels(panels[0], x, measured, levels, rows)
    curve(
        panels[0],
        x,
        lambda v: np.asarray(np.polynomial.polynomial.polyval(v, b), dtype=np.float64),
        "fit over all loads",
    )
    for level, colour in zip(levels, sequence(len(levels)), strict=True):
        here = level.rows[rows]
        if here.sum() > len(b) + 1:
            own = np.polynomial.polynomial.polyfit(x[here], measured[here], len(b) - 1)
            ends = np.linspace(float(x[here].min()), float(x[here].max()), 60)
            panels[0].plot(
                ends,
                np.polynomial.polynomial.polyval(ends, own),
                color=colour,
                linewidth=0.9,
                zorder=2,
            )
    alone = _alone(regression, reference_level(levels).rows[rows], len(b) - 1)
    panels[0].set_title(
        f"All loads R\u00b2 = {regression.r2:.3f}; {reference_level(levels).text} alone "
        f"R\u00b2 = {alone:.3f}"
    )
    panels[0].set_xlabel(regressor)
    panels[0].set_ylabel("measured " + ANGLE)
    low, high = float(measured.min()), float(measured.max())
    room = 0.35 * (high - low)
    panels[0].set_ylim(low - room, high + room)
    rest = measured - regression.fitted
    half = largest(rest)
    scatter_levels(panels[1], regression.fitted, rest, levels, rows)
    panels[1].set_title(
        f"Residuals: rms {rms(rest):.2f} deg, held out {regression.cross_validated:.2f} deg"
    )
    if held is not None:
        true, estimated = held
        small = np.abs(true) <= float(np.abs(measured).max()) + 0.5
        own_levels = load_levels(trained.links.truth["Fz"])
        scatter_levels(panels[2], estimated[small], (true - estimated)[small], own_levels, small)
        panels[2].set_title(
            f"Estimator in use, held out: rms {rms((true - estimated)[small]):.3f} deg"
        )
        half = largest(rest, (true - estimated)[small])
    for axes in panels[1:]:
        residual_panel(axes, half)
        axes.set_xlabel("estimated " + ANGLE)
        axes.set_ylabel(label(RESIDUAL, "deg", signed=True))
    legend_below(figure, panels[:1], columns=7)
    return figure


def _alone(
    regression: Regression, rows: np.ndarray[tuple[int], np.dtype[np.bool_]], degree: int
) -> float:
    """R2 of the same polynomial, fitted to one load only."""
    x, y = regression.regressor[rows], regression.measured[rows]
    if x.size <= degree + 1:
        return float("nan")
    rest = y - np.polynomial.polynomial.polyval(x, np.polynomial.polynomial.polyfit(x, y, degree))
    return 1.0 - float(np.sum(rest**2) / np.sum((y - y.mean()) ** 2))


@styled
def figure_4_5(trained: Trained) -> Figure:
    """Slip angle against the in/out ratio of the rate peaks with the quadratic and its residuals.

    Source: dissertation, Fig. 4-5.

    Raises
    ------
    CalibrationError
        If the campaign did not vary the slip angle.
    """
    regression = _regression(trained, "Fig. 4-5")
    return _draw(
        trained, regression, label("in/out ratio of peak strain rates", "-", signed=True), False
    )


@styled
def figure_4_7(trained: Trained) -> Figure:
    """Slip angle against the slope of the peak rates, residuals, the estimator in use beside it.

    Source: dissertation, Fig. 4-7.

    Raises
    ------
    CalibrationError
        If the campaign did not vary the slip angle.
    """
    regression = _regression(trained, "Fig. 4-7")
    return _draw(
        trained, regression, label("slope of peak strain rates", "1/(rad m)", signed=True), True
    )


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
        upper.errorbar(
            at,
            value[rows],
            WIDTH * std[rows],
            fmt="o",
            color=colour,
            markersize=3.2,
            elinewidth=0.9,
            label=f"estimated, {level.text}",
        )
        error = measured[rows] - value[rows]
        lower.errorbar(
            at, error, WIDTH * std[rows], fmt="o", color=colour, markersize=3.2, elinewidth=0.9
        )
        upper.text(
            start + 0.5 * rows.size,
            1.02,
            f"{level.text}: rms {rms(error):.2f} deg",
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
