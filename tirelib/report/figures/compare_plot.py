"""Common parts of a comparison's interactive figures: one look, and their data as a table."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import plotly.graph_objects as go
from plotly.subplots import make_subplots
from scipy.special import stdtrit

from tirelib.core.arrays import FloatArray, IntArray
from tirelib.report.style import BLUE, FAINT, INK, RULE

DIVERGING = [
    [0.0, "#0b4f86"],
    [0.25, "#6ea6cd"],
    [0.5, "#f7f7f7"],
    [0.75, "#e59a6f"],
    [1.0, "#9c3a04"],
]
"""Blue: too much compression; red: too much tension."""
ANGLE_TITLE = "wheel angle [deg], entry < 0 < exit"
LEGEND_ABOVE = {"orientation": "h", "y": 1.1, "x": 0.0}
Trace = Mapping[str, Any]
"""A curve: arguments of plotly's `add_scatter` without its places along the axis."""


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


def stacked(
    x: FloatArray, values: Sequence[Trace], differences: Sequence[Trace], *, mode: str = "lines"
) -> go.Figure:
    """Return curves above and the differences between them below, over one axis.

    Parameters
    ----------
    x : shape (n,)
    values, differences : sequence of Trace
        Traces of the upper and of the lower panel.
    mode : str
        lines or markers.
    """
    figure = make_subplots(
        rows=2, cols=1, shared_xaxes=True, row_heights=[0.65, 0.35], vertical_spacing=0.06
    )
    for row, traces in enumerate((values, differences), start=1):
        for trace in traces:
            figure.add_scatter(x=x, mode=mode, row=row, col=1, **trace)
    return figure


def stack_titles(figure: go.Figure, x: str, value: str, unit: str, height: int = 520) -> go.Figure:
    """Return a figure of `stacked` in the common look, with the titles of its axes."""
    figure.update_xaxes(title=x, row=2, col=1)
    figure.update_yaxes(title=value, row=1, col=1)
    figure.update_yaxes(title=f"difference<br>[{unit}]", row=2, col=1)
    return styled_figure(figure, height, legend=LEGEND_ABOVE)


def heat(z: npt.ArrayLike, x: npt.ArrayLike, limit: float, unit: str, **hover: Any) -> go.Figure:
    """Return a map of model less measured, a row for each row of z, on a symmetric colour scale.

    Parameters
    ----------
    z : shape (n_rows, n), in `unit`
    x : shape (n,)
    limit : float
        End of the colour scale to both sides.
    hover
        What else plotly's heat map takes, among it what it says under the pointer.
    """
    return go.Figure(
        go.Heatmap(
            z=z,
            x=x,
            y=list(range(np.shape(z)[0])),
            zmin=-limit,
            zmax=limit,
            colorscale=DIVERGING,
            colorbar={"title": {"text": f"model less<br>measured<br>[{unit}]"}},
            **hover,
        )
    )


def level_means(
    values: FloatArray, level: IntArray, count: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return mean, half of the 95 % confidence interval and number of the values of each level.

    Parameters
    ----------
    values : shape (n,)
        NaN does not count.
    level : shape (n,)
        From 0 to count - 1; others belong to none.

    Returns
    -------
    centre, half, number : shape (count,)
        NaN where there are no values; the half as well where there is one.
    """
    centre, half, number = np.full((3, count), np.nan)
    for k in range(count):
        part = values[(level == k) & np.isfinite(values)]
        number[k] = part.size
        if part.size:
            centre[k] = part.mean()
        if part.size > 1:
            error = part.std(ddof=1) / np.sqrt(part.size)
            half[k] = error * stdtrit(part.size - 1, 0.975)
    return centre, half, number


def confidence(
    figure: go.Figure, x: FloatArray, centre: FloatArray, half: FloatArray, of: str, **place: Any
) -> None:
    """Draw means with a band of 95 % confidence where it is known.

    Parameters
    ----------
    x, centre, half : shape (n,)
        Half the width of the band; NaN where it is unknown.
    of : str
        What the means are over.
    place
        Panel and legend, as plotly's `add_scatter` takes them.
    """
    known = np.isfinite(half)
    if known.any():
        figure.add_scatter(
            x=np.concatenate([x[known], x[known][::-1]]),
            y=np.concatenate([(centre + half)[known], (centre - half)[known][::-1]]),
            fill="toself",
            mode="lines",
            fillcolor="rgba(0,114,178,0.22)",
            line={"width": 0},
            hoverinfo="skip",
            name="95 % confidence",
            legendgroup="band",
            **place,
        )
    figure.add_scatter(
        x=x,
        y=np.round(centre, 4),
        mode="lines+markers",
        line={"color": BLUE},
        name=f"mean over the {of}",
        legendgroup="mean",
        **place,
    )


def noise_band(figure: go.Figure, noise: float, **place: int) -> None:
    """Draw zero and, where the noise is known, the range of 95 % of it, in grey."""
    figure.add_hline(y=0.0, line={"color": FAINT, "width": 1}, **place)
    if np.isfinite(noise):
        grey = {"line_width": 0, "fillcolor": FAINT, "opacity": 0.3}
        figure.add_hrect(y0=-1.96 * noise, y1=1.96 * noise, **grey, **place)


def limit_of(values: np.ndarray) -> float:
    """Return a symmetric colour limit that a few extremes do not rule."""
    size = np.abs(values[np.isfinite(values)])
    return float(np.quantile(size, 0.995)) if size.size else 1.0
