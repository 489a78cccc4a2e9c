"""Common parts of interactive figures: one look, and their data as a table."""

import base64
import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots
from scipy.special import stdtrit

from tirelib.core.arrays import FloatArray, IntArray
from tirelib.measured.waveforms import GRID
from tirelib.report.style import BLUE, FAINT, INK, RULE

DIVERGING = [
    [0.0, "#0b4f86"],
    [0.25, "#6ea6cd"],
    [0.5, "#f7f7f7"],
    [0.75, "#e59a6f"],
    [1.0, "#9c3a04"],
]
"""Blue: too much compression; red: too much tension."""
DEGREES = np.rad2deg(GRID)
ANGLE_TITLE = "wheel angle [deg], entry < 0 < exit"
SYMBOLS = ("circle", "square", "triangle-up", "diamond", "cross", "x")
Trace = Mapping[str, Any]
"""Arguments of plotly's `add_scatter`."""


@dataclass(frozen=True, slots=True)
class Plot:
    """An interactive figure with its data.

    Attributes
    ----------
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

    @property
    def height(self) -> int:
        """Height on a page, in pixels."""
        return int(self.figure.layout.height)

    @property
    def csv(self) -> str:
        """The data as a CSV file, in base 64."""
        text = io.StringIO()
        csv.writer(text).writerows([self.columns, *self.rows])
        return base64.b64encode(text.getvalue().encode()).decode()

    @classmethod
    def of(
        cls,
        name: str,
        title: str,
        caption: str,
        figure: go.Figure,
        data: Mapping[str, Any] | Iterable[tuple[str, Any]],
        digits: int | None = None,
    ) -> "Plot":
        """Return a plot with its data by column, as they are or rounded to so many decimals."""
        names, columns = zip(*(data.items() if isinstance(data, Mapping) else data), strict=True)
        if digits is not None:
            rows = np.round(np.stack(columns, axis=1), digits).tolist()
        else:
            listed = (x.tolist() if isinstance(x, np.ndarray) else x for x in columns)
            rows = [list(row) for row in zip(*listed, strict=True)]
        return cls(name, title, caption, figure, names, rows)


def dots(x: Any, y: Any, name: str, colour: str, size: int = 7, **marker: Any) -> dict[str, Any]:
    """Return points as arguments of plotly's `add_scatter`."""
    marker = {"color": colour, "size": size, **marker}
    return {"x": x, "y": y, "name": name, "mode": "markers", "marker": marker}


def line(x: Any, y: Any, name: str, colour: str, **look: Any) -> dict[str, Any]:
    """Return a line as arguments of plotly's `add_scatter`."""
    return {"x": x, "y": y, "name": name, "mode": "lines", "line": {"color": colour, **look}}


def above(height: float = 1.12) -> dict[str, Any]:
    """Return a legend in one row above a figure, at a height in parts of its own."""
    return {"orientation": "h", "y": height, "x": 0.0}


def level_line(figure: go.Figure, y: float = 0.0, dash: str = "solid", /, **place: Any) -> None:
    """Draw a thin level line through a panel."""
    figure.add_hline(y=y, line={"color": FAINT, "width": 1, "dash": dash}, **place)


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
    values: Sequence[Trace],
    differences: Sequence[Trace],
    titles: tuple[str, str],
    unit: str,
    noise: float | None = None,
) -> go.Figure:
    """Return curves above and the differences between them below, over one axis.

    Parameters
    ----------
    values, differences : sequence of Trace
        Traces of the upper and of the lower panel.
    titles : (x, y)
        Of the common axis, and of the upper panel.
    unit : str
        That of the differences.
    noise : float, optional
        Its 95 % are a grey band behind the differences.
    """
    figure = make_subplots(
        rows=2, cols=1, shared_xaxes=True, row_heights=[0.65, 0.35], vertical_spacing=0.06
    )
    for row, traces in enumerate((values, differences), start=1):
        for trace in traces:
            figure.add_scatter(**trace, row=row, col=1)
    if noise is not None:
        noise_band(figure, noise, row=2, col=1)
    figure.update_xaxes(title=titles[0], row=2, col=1)
    figure.update_yaxes(title=titles[1], row=1, col=1)
    figure.update_yaxes(title=f"difference<br>[{unit}]", row=2, col=1)
    return styled_figure(figure, 520, legend=above(1.1))


def heat(
    z: FloatArray,
    x: FloatArray,
    x_title: str,
    unit: str,
    height: int,
    limit: float | None = None,
    digits: int = 3,
    **hover: Any,
) -> go.Figure:
    """Return a map of model less measured, a row for each row of z, on a symmetric colour scale.

    Parameters
    ----------
    z : shape (n_rows, n), in `unit`
    x : shape (n,)
    limit : float, optional
        End of the colour scale to both sides; by default one that a few extremes do not rule.
    digits : int
        Decimals of z on the page.
    hover
        What else plotly's heat map takes, among it what it says under the pointer.
    """
    limit = limit_of(z) if limit is None else limit
    figure = go.Figure(
        go.Heatmap(
            z=np.round(z, digits),
            x=np.round(x, 4),
            y=list(range(len(z))),
            zmin=-limit,
            zmax=limit,
            colorscale=DIVERGING,
            colorbar={"title": {"text": f"model less<br>measured<br>[{unit}]"}},
            **{"hovertemplate": "%{x:.3g}: %{z:.3g} " + unit + "<extra></extra>", **hover},
        )
    )
    figure.update_xaxes(title=x_title)
    figure.update_yaxes(showgrid=False)
    return styled_figure(figure, height)


def turn_map(z: FloatArray, unit: str, height: int, **more: Any) -> go.Figure:
    """Return a `heat` over the whole turn of the wheel, `GRID`."""
    more.setdefault("hovertemplate", "%{x:.0f} deg: %{z:.3g} " + unit + "<extra></extra>")
    figure = heat(z, DEGREES, ANGLE_TITLE, unit, height, digits=2, **more)
    return figure.update_xaxes(range=[-180, 180], dtick=30)


def ticks(
    figure: go.Figure, places: Sequence[float], texts: Sequence[str], title: str | None = None
) -> None:
    """Name rows of a map."""
    figure.update_yaxes(tickvals=list(places), ticktext=list(texts))
    if title is not None:
        figure.update_yaxes(title={"text": title, "standoff": 12})


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
    mean = line(x, np.round(centre, 4), f"mean over the {of}", BLUE) | {"mode": "lines+markers"}
    figure.add_scatter(**mean, legendgroup="mean", **place)


def noise_band(figure: go.Figure, noise: float, **place: int) -> None:
    """Draw zero and, where the noise is known, the range of 95 % of it, in grey."""
    level_line(figure, **place)
    if np.isfinite(noise):
        grey = {"line_width": 0, "fillcolor": FAINT, "opacity": 0.3}
        figure.add_hrect(y0=-1.96 * noise, y1=1.96 * noise, **grey, **place)


def limit_of(values: np.ndarray) -> float:
    """Return a symmetric colour limit that a few extremes do not rule."""
    size = np.abs(values[np.isfinite(values)])
    return float(np.quantile(size, 0.995)) if size.size else 1.0
