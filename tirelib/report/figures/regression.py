"""Regressions over one regressor: load and slip angle (Fig. 4-4, 4-5, 4-7); their common parts."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tirelib.core.arrays import BoolArray, FloatArray, r_squared, rms
from tirelib.core.errors import CalibrationError
from tirelib.core.quantities import Quantity
from tirelib.estimators.dissertation import Regression
from tirelib.estimators.result import TRUTH
from tirelib.estimators.train import Trained
from tirelib.report.accuracy import SAID
from tirelib.report.levels import Level, load_levels, reference_level
from tirelib.report.style import (
    MARKERS,
    label,
    legend_below,
    new_figure,
    sequence,
    styled,
    zero_line,
)

RESIDUAL = "measured \N{MINUS SIGN} estimated"
ANGLE = label("slip angle", "deg", signed=True)
_FIT = np.polynomial.polynomial
_InUse = tuple[FloatArray, FloatArray] | None
"""Measured and estimated values; None where the quantity is not calibrated or not shown."""


def find_regression(trained: Trained, source: str) -> Regression | None:
    """Return the dissertation's regression of a figure or table; None where it was not fitted."""
    return next((r for r in trained.regressions if r.source == source), None)


def needed_regression(trained: Trained, source: str, what: str, needs: str) -> Regression:
    """Return the dissertation's regression of a figure or table.

    Raises
    ------
    CalibrationError
        If it was not fitted: `what` was not varied, and the figure needs `needs`.
    """
    found = find_regression(trained, source)
    if found is None:
        raise CalibrationError(
            f"{source}: {what} was not varied or not measured; the figure needs {needs}"
        )
    return found


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
    said = SAID[quantity]
    return said.told(links.truth[TRUTH[quantity]]), said.told(links.held_out[quantity])


def known_rms(values: FloatArray) -> float:
    """Return the root mean square of the finite values."""
    return rms(values[np.isfinite(values)])


def largest(*parts: FloatArray) -> float:
    """Return the largest finite magnitude."""
    every = np.abs(np.concatenate([part.ravel() for part in parts]))
    every = every[np.isfinite(every)]
    return float(every.max()) if every.size else 1.0


def figure_4_4(trained: Trained) -> Figure:
    """Load against centre contact length with the quadratic (dissertation, Fig. 4-4).

    Raises
    ------
    CalibrationError
        If the campaign did not vary the load.
    """
    found = needed_regression(trained, "Fig. 4-4", "the load", "several loads")
    b = [term.coefficient for term in found.terms]
    return _figure(
        trained,
        found,
        in_use(trained, "Fz"),
        label("contact length l of the centre gage", "mm"),
        SAID["Fz"],
        f"Fz = {b[0]:.0f} {b[1]:+.2f} l {b[2]:+.4f} l\u00b2\nR\u00b2 = {found.r2:.4f}",
        "Residuals of the quadratic\nrms {:.0f} N, held out {:.0f} N",
        "Estimator in use, held out\nrms {:.1f} N",
    )


def figure_4_5(trained: Trained) -> Figure:
    """Slip angle against the in/out ratio of the rate peaks (dissertation, Fig. 4-5)."""
    regressor = label("in/out ratio of peak strain rates", "-", signed=True)
    return _of_angle(trained, "Fig. 4-5", regressor, None)


def figure_4_7(trained: Trained) -> Figure:
    """Slip angle against the slope of the peak rates (dissertation, Fig. 4-7)."""
    regressor = label("slope of peak strain rates", "1/(rad m)", signed=True)
    return _of_angle(trained, "Fig. 4-7", regressor, in_use(trained, "alpha"))


def _of_angle(trained: Trained, source: str, regressor: str, held: _InUse) -> Figure:
    """Draw a regression of the slip angle; thin lines are fits to one load each.

    Raises
    ------
    CalibrationError
        If the campaign did not vary the slip angle.
    """
    found = needed_regression(trained, source, "the slip angle", "slip angles")
    levels, measured = load_levels(trained.means.load), found.measured
    reference, degree = reference_level(levels), len(found.terms) - 1
    figure = _figure(
        trained,
        found,
        held,
        regressor,
        SAID["alpha"],
        f"All loads R\u00b2 = {found.r2:.3f}; {reference.text} alone "
        f"R\u00b2 = {_alone(found, reference.rows[found.rows], degree):.3f}",
        "Residuals: rms {:.2f} deg, held out {:.2f} deg",
        "Estimator in use, held out: rms {:.3f} deg",
        float(np.abs(measured).max()) + 0.5,
    )
    axes, room = figure.axes[0], 0.35 * float(np.ptp(measured))
    for level, colour in zip(levels, sequence(len(levels)), strict=True):
        x, y = (values[level.rows[found.rows]] for values in (found.regressor, measured))
        if x.size > degree + 2:
            ends = np.linspace(float(x.min()), float(x.max()), 60)
            own = _FIT.polyval(ends, _FIT.polyfit(x, y, degree))
            axes.plot(ends, own, color=colour, linewidth=0.9, zorder=2)
    axes.set_ylim(float(measured.min()) - room, float(measured.max()) + room)
    return figure


def _alone(regression: Regression, rows: BoolArray, degree: int) -> float:
    """R2 of the same polynomial, fitted to one load only."""
    x, y = regression.regressor[rows], regression.measured[rows]
    if x.size <= degree + 1:
        return float("nan")
    return r_squared(y, y - _FIT.polyval(x, _FIT.polyfit(x, y, degree)))


@styled
def _figure(
    trained: Trained,
    found: Regression,
    held: _InUse,
    regressor: str,
    said: Quantity,
    title: str,
    rest_title: str,
    own_title: str,
    most: float = np.inf,
) -> Figure:
    """Draw a polynomial in one regressor, its residuals, and those of the estimator in use.

    The titles of the residuals have room for their rms; those in use are drawn up to a magnitude
    `most` of the measured value.
    """
    figure = new_figure(12.5 if held else 9.5, 4.6)
    over, *panels = figure.subplots(1, 3 if held else 2)
    x, levels, rest = (
        found.regressor,
        load_levels(trained.means.load),
        found.measured - found.fitted,
    )
    scatter_levels(over, x, found.measured, levels, found.rows)
    grid = np.linspace(float(x.min()), float(x.max()), 200)
    fitted = _FIT.polyval(grid, [term.coefficient for term in found.terms])
    curve = {"linewidth": 1.6, "zorder": 4, "label": "ordinary least squares, all loads"}
    over.plot(grid, fitted, color="#333333", **curve)
    over.set(xlabel=regressor, ylabel=f"measured {said.label}", title=title)
    scatter_levels(panels[0], found.fitted, rest, levels, found.rows)
    panels[0].set_title(rest_title.format(known_rms(rest), found.cross_validated))
    half = largest(rest)
    if held is not None:
        measured, estimated = held
        rows = np.abs(measured) <= most
        error = (measured - estimated)[rows]
        scatter_levels(
            panels[1], estimated[rows], error, load_levels(trained.links.truth["Fz"]), rows
        )
        panels[1].set_title(own_title.format(known_rms(error)))
        half = largest(rest, error)
    for axes in panels:
        residual_panel(axes, half)
        axes.set_xlabel(f"estimated {said.label}")
        axes.set_ylabel(label(RESIDUAL, said.unit, signed=said.signed))
    legend_below(figure, [over], columns=7)
    return figure
