"""Contact shapes by slip angle (Fig. 4-2)."""

import numpy as np
from matplotlib.figure import Figure

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import CalibrationError
from tirelib.estimators.estimate import Estimates
from tirelib.estimators.train import averaging
from tirelib.measured.observations import Observations
from tirelib.report.levels import angle_levels, load_levels, reference_level
from tirelib.report.style import BLUE, FAINT, RED, label, new_figure, styled

MOST_SHAPES = 17
ZERO = "nearest to zero slip angle"


def contact_area(lateral: FloatArray, length: FloatArray) -> float:
    """Return the contact area between the outermost gages by the trapezoidal rule.

    Examples
    --------
    >>> contact_area(np.array([-1.0, 0.0, 1.0]), np.array([2.0, 2.0, 2.0]))
    4.0
    """
    order = np.argsort(lateral)
    return float(np.trapezoid(length[order], lateral[order]))


@styled
def figure_4_2(observations: Observations, estimates: Estimates) -> Figure:
    """Contact shapes from the contact lengths at all gages, one outline for each slip angle.

    The figure shows run means of the middle load, without camber, run means. Source: dissertation,
    Fig. 4-2.

    Raises
    ------
    CalibrationError
        If no slip angle was measured.
    """
    features = observations.features
    average = averaging(observations)

    def edge(angle: FloatArray) -> FloatArray:
        along = -1e3 * angle * estimates.radius[:, None]
        return np.stack([average(x) for x in along.T], axis=1)

    lead, trail = edge(features.lead), edge(features.trail)
    load, angle = average(observations.truth["Fz"]), average(observations.truth["slip_angle"])
    camber, kappa = average(features.camber), average(observations.truth["slip_ratio"])
    plain = ~(np.abs(camber) > np.deg2rad(0.5)) & ~(np.abs(kappa) > 0.02)
    levels = load_levels(np.where(plain, load, np.nan))
    level = reference_level(levels)
    angles = angle_levels(np.where(level.rows, np.rad2deg(angle), np.nan))[:MOST_SHAPES]
    if not angles:
        raise CalibrationError("the slip angle was not measured; the contact shapes need it")
    order = np.argsort(features.lateral)
    lateral = 1e3 * features.lateral[order]
    columns = min(6, len(angles) + 1)
    lines = -(-(len(angles) + 1) // columns)
    figure = new_figure(2.05 * columns + 0.5, 2.75 * lines + 0.8)
    grid = figure.subplots(lines, columns, sharex=True, sharey=True, squeeze=False)
    for axes in grid.ravel()[len(angles) :]:
        axes.set_axis_off()
    upright_shape = min(angles, key=lambda shape: abs(shape.value))
    straight = [side[upright_shape.rows].mean(axis=0)[order] for side in (lead, trail)]
    for axes, shape in zip(grid.ravel(), angles, strict=False):
        front, rear = lead[shape.rows].mean(axis=0)[order], trail[shape.rows].mean(axis=0)[order]
        axes.fill_between(lateral, rear, front, color=BLUE, alpha=0.16, linewidth=0)
        axes.vlines(lateral, rear, front, color=BLUE, linewidth=0.9, alpha=0.6)
        axes.plot(lateral, front, "o-", color=BLUE, markersize=4.5, label="leading edge")
        axes.plot(lateral, rear, "s-", color=RED, markersize=4.5, label="trailing edge")
        area = contact_area(lateral, front - rear) / 100.0
        axes.plot(lateral, straight[0], ":", color=FAINT, linewidth=1.3, label=ZERO)
        axes.plot(lateral, straight[1], ":", color=FAINT, linewidth=1.3)
        axes.set_title(f"{shape.text}\n{area:.0f} cm\u00b2")
        axes.set_xlim(lateral[-1] * 1.15, lateral[0] * 1.15)
    figure.supxlabel(label("lateral position y, left is left", "mm", signed=True), fontsize=10)
    figure.supylabel(label("forward x", "mm", signed=True), fontsize=10)
    figure.suptitle(
        f"Contact between the outer gages at {level.text}, slip angle above each "
        "(ISO 8855), seen through the tire from above",
        fontsize=10.5,
    )
    handles, texts = grid[0, 0].get_legend_handles_labels()
    grid.ravel()[-1].legend(handles, texts, loc="center")
    return figure
