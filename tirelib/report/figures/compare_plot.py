"""Common parts of a comparison's interactive figures: one look, and their data as a table."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import plotly.graph_objects as go

from tirelib.report.style import FAINT, INK, RULE

DIVERGING = [
    [0.0, "#0b4f86"],
    [0.25, "#6ea6cd"],
    [0.5, "#f7f7f7"],
    [0.75, "#e59a6f"],
    [1.0, "#9c3a04"],
]
"""Blue: too much compression; red: too much tension."""
ANGLE_TITLE = "wheel angle [deg], entry < 0 < exit"


@dataclass(frozen=True, slots=True)
class Plot:
    """An interactive figure with its data.

    Attributes
    ----------
    name, title, caption : str
    figure : plotly figure
    columns : sequence of str
        Names with units.
    rows : sequence of rows
        The data that the figure shows, for the download.
    """

    name: str
    title: str
    caption: str
    figure: go.Figure
    columns: Sequence[str]
    rows: Sequence[Sequence[Any]]


def styled_figure(figure: go.Figure, height: int, **layout: Any) -> go.Figure:
    """Return the figure in the common look."""
    figure.update_layout(
        template="none",
        height=height,
        font={"color": INK, "size": 13},
        paper_bgcolor="white",
        plot_bgcolor="white",
        hoverlabel={"font": {"size": 12}},
        margin={"l": 75, "r": 25, "t": 45, "b": 60},
        **layout,
    )
    rule = {"gridcolor": RULE, "linecolor": FAINT, "zerolinecolor": FAINT, "automargin": True}
    figure.update_xaxes(ticks="outside", title_standoff=10, **rule)
    figure.update_yaxes(ticks="outside", **rule)
    return figure


def limit_of(values: np.ndarray) -> float:
    """Return a symmetric colour limit that a few extremes do not rule."""
    size = np.abs(values[np.isfinite(values)])
    return float(np.quantile(size, 0.995)) if size.size else 1.0
