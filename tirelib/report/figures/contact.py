"""Contact lengths over slip angle (Fig. 4-3)."""

import numpy as np
from matplotlib.figure import Figure

from tirelib.core.errors import CalibrationError
from tirelib.estimators.dissertation import Means
from tirelib.inference.compare.sentences import millimetres
from tirelib.report.levels import angle_levels, load_levels, reference_level, upright
from tirelib.report.style import (
    CATEGORIES,
    MARKERS,
    label,
    legend_below,
    new_figure,
    styled,
)

FEWEST_ANGLES = 3


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
