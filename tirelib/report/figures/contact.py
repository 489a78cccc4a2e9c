"""Contact shapes and lengths over slip angle (Fig. 4-2, 4-3)."""

import numpy as np
from matplotlib.figure import Figure

from tirelib.arrays import FloatArray
from tirelib.errors import CalibrationError
from tirelib.estimators.calibration import Estimates
from tirelib.estimators.dissertation import Means
from tirelib.estimators.train import averaging
from tirelib.observations import Observations
from tirelib.report.levels import angle_levels, load_levels, reference_level, upright
from tirelib.report.style import (
    BLUE,
    CATEGORIES,
    FAINT,
    MARKERS,
    RED,
    label,
    legend_below,
    millimetres,
    new_figure,
    styled,
)

MOST_SHAPES = 17
FEWEST_ANGLES = 3
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


@styled
def figure_4_3(means: Means) -> Figure:
    """Contact length of each gage over slip angle, and its scatter in percent.

    Source: dissertation, Fig. 4-3.

    Raises
    ------
    CalibrationError
        If the slip angle was not varied.
    """
    level = reference_level(load_levels(np.where(upright(means), means.load, np.nan)))
    if len(angle_levels(means.slip_angle[level.rows])) < FEWEST_ANGLES:
        raise CalibrationError(
            f"{level.text}: fewer than {FEWEST_ANGLES} slip angles without camber; the figure "
            "needs them"
        )
    figure = new_figure(11.0, 4.6)
    left, right = figure.subplots(1, 2, width_ratios=(3, 2))
    order = np.argsort(means.lateral)
    line = np.argsort(means.slip_angle[level.rows])
    names = []
    for place, gage in enumerate(order):
        length = means.contact_length[level.rows, gage]
        colour = CATEGORIES[place % len(CATEGORIES)]
        text = f"y = {millimetres(means.lateral[gage])}"
        left.plot(
            means.slip_angle[level.rows][line],
            length[line],
            marker=MARKERS[place % 10],
            color=colour,
            label=text,
        )
        share = 100.0 * float(np.std(length, ddof=1) / np.mean(length))
        bar = right.bar(place, share, color=colour, width=0.65)
        right.bar_label(bar, fmt="%.1f %%", padding=3)
        names.append(millimetres(means.lateral[gage]).removesuffix(" mm"))
    left.set_title(f"Contact length at {level.text}")
    left.set_xlabel(label("slip angle", "deg", signed=True))
    left.set_ylabel(label("contact length", "mm"))
    right.set_title("Standard deviation over the slip angles")
    right.set_xticks(range(len(names)), names)
    right.set_xlabel(label("lateral position y of the gage", "mm", signed=True))
    right.set_ylabel(label("standard deviation / mean", "%"))
    right.grid(visible=False, axis="x")
    right.margins(y=0.15)
    legend_below(figure, [left])
    return figure
