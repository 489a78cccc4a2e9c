"""Common parts of interactive figures: one look, and their data as a table."""

import base64
import csv
import io
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots
from scipy.special import stdtrit

from tirelib.core.arrays import FloatArray, IntArray
from tirelib.measured.waveforms import GRID
from tirelib.report.style import BLUE, FAINT, INK, RED, RULE

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
MOST_NAMED_ROWS = 12
"""Rows of a map up to which the pointer names the row."""
SYMBOLS = ("circle", "square", "triangle-up", "diamond", "cross", "x")
Trace = Mapping[str, Any]
"""Arguments of plotly's `add_scatter`."""
Said = tuple[str, str, str]
"""Name, title and caption of a plot."""


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


def curves(
    said: Said,
    draw: Callable[[FloatArray, str, str, int], Trace],
    measured: tuple[str, FloatArray],
    models: Sequence[tuple[FloatArray, FloatArray]],
    titles: tuple[str, str],
    unit: str,
    noise: float,
) -> Plot:
    """Return measurement and models above, and the differences between them below.

    Parameters
    ----------
    draw : callable
        Takes values, what they are, a colour, and 0 for the measurement, 1 and 2 for the models.
    measured : (text, values)
    models : sequence of (values, model less measured)
        One, or those before and after a change.
    titles : (x, y)
        Of the common axis, and of the upper panel.
    unit : str
    noise : float
        Its 95 % are a grey band behind the differences; NaN where it is unknown.
    """
    figure = make_subplots(
        rows=2, cols=1, shared_xaxes=True, row_heights=[0.65, 0.35], vertical_spacing=0.06
    )
    traces = [draw(measured[1], measured[0], INK, 0)]
    figure.add_scatter(**traces[0], row=1, col=1)
    words = ("",) if len(models) == 1 else (" before", " after")
    for k, (word, colour, pair) in enumerate(zip(words, (RED, BLUE), models, strict=False), 1):
        names = f"model{word}", f"model{word} less measured"
        both = [draw(y, name, colour, k) for y, name in zip(pair, names, strict=True)]
        figure.add_scatter(**both[0], row=1, col=1)
        figure.add_scatter(**both[1], showlegend=False, row=2, col=1)
        traces += both
    noise_band(figure, noise, row=2, col=1)
    figure.update_xaxes(title=titles[0], row=2, col=1)
    figure.update_yaxes(title=titles[1], row=1, col=1)
    figure.update_yaxes(title=f"difference<br>[{unit}]", row=2, col=1)
    styled_figure(figure, 520, legend=above(1.1))
    data = {f"{trace['name']} [{unit}]": trace["y"] for trace in traces}
    return Plot.of(*said, figure, {titles[0]: traces[0]["x"], **data}, 5)


def fall(rms: Sequence[float], unit: str, noise: float) -> str:
    """Say the rms difference of a model, or those of the models before and after a change."""
    said = [f"{value:.3g}" for value in rms]
    known = f", {rms[-1] / noise:.1f} noise" if np.isfinite(noise) else ""
    was = f"was {said[0]} and is now" if len(rms) > 1 else "is"
    return f"The difference {was} {said[-1]} {unit} rms{known}."


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


def turn_map(
    said: Said,
    z: FloatArray,
    labels: Sequence[str],
    marks: tuple[Sequence[float], Sequence[str], str],
    unit: str,
    height: int,
    limit: float | None = None,
) -> Plot:
    """Return a `heat` over the whole turn of the wheel, `GRID`.

    Parameters
    ----------
    labels : sequence of str
        Of the rows: in the data and, where they are few, under the pointer.
    marks : (places, texts, title)
        Ticks of the rows, and what they are.
    """
    hover: dict[str, Any] = {"hovertemplate": f"%{{x:.0f}} deg: %{{z:.3g}} {unit}<extra></extra>"}
    if len(labels) <= MOST_NAMED_ROWS:
        text = np.broadcast_to(np.array(labels, dtype=object)[:, None], z.shape)
        hover = {"text": text, "hovertemplate": f"%{{text}}<br>{hover['hovertemplate']}"}
    figure = heat(z, DEGREES, ANGLE_TITLE, unit, height, limit, digits=2, **hover)
    figure.update_xaxes(range=[-180, 180], dtick=30)
    ticks(figure, *marks)
    columns = zip((f"{label} [{unit}]" for label in labels), z, strict=True)
    return Plot.of(*said, figure, [("wheel angle [deg]", DEGREES), *columns], 4)


def ticks(
    figure: go.Figure, places: Sequence[float], texts: Sequence[str], title: str | None = None
) -> None:
    """Name rows of a map."""
    figure.update_yaxes(tickvals=list(places), ticktext=list(texts))
    if title is not None:
        figure.update_yaxes(title={"text": title, "standoff": 12})


def cell_means(
    values: FloatArray, row: IntArray, column: IntArray, shape: tuple[int, int]
) -> FloatArray:
    """Return the mean of the values in each cell of a map; NaN where there are none.

    A value belongs to no cell where its row or its column is below zero.
    """
    inside = (row >= 0) & (column >= 0)
    place = np.ravel_multi_index((row[inside], column[inside]), shape)
    total, count = (
        np.bincount(place, weights, minlength=shape[0] * shape[1]).reshape(shape)
        for weights in (values[inside], None)
    )
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _level_means(values: FloatArray, level: IntArray, count: int) -> FloatArray:
    """Return number, mean and half of the 95 % confidence interval of each level, (3, count).

    NaN where there are no values; the half as well where there is one. A value that is NaN does
    not count.
    """
    number, mean, half = np.full((3, count), np.nan)
    for k in range(count):
        part = values[(level == k) & np.isfinite(values)]
        number[k] = part.size
        if part.size:
            mean[k] = part.mean()
        if part.size > 1:
            half[k] = part.std(ddof=1) / np.sqrt(part.size) * stdtrit(part.size - 1, 0.975)
    return np.stack([number, mean, half])


def trend(
    said: Said,
    label: str,
    x: FloatArray,
    level: IntArray,
    panels: Mapping[str, FloatArray],
    what: tuple[str, str],
    of: str,
) -> Plot:
    """Return means over the levels of a condition, with bands of 95 % confidence.

    Parameters
    ----------
    label : str
        Axis of the condition.
    x : shape (n_levels,)
        The condition at each level.
    level : shape (n,)
        Level of each value, from 0; others belong to none.
    panels : mapping of str to shape (n,)
        Values of each panel, three of which stand in a row; the only one needs no name.
    what : (text, unit)
        What the values are.
    of : str
        What the means are over.
    """
    named, unit = len(panels) > 1, f"[{what[1]}]"
    rows, columns = (-(-len(panels) // 3), 3) if named else (1, 1)
    figure = make_subplots(
        rows=rows,
        cols=columns,
        subplot_titles=[name.capitalize() for name in panels] if named else None,
        shared_xaxes=True,
        vertical_spacing=0.14,
        horizontal_spacing=0.07,
    )
    names = [label, of, f"{what[0]} {unit}", f"95 % half-width {unit}"]
    data: dict[str, Any] = {"panel": []} if named else {}
    parts = []
    for k, (name, values) in enumerate(panels.items()):
        where = {"row": k // columns + 1, "col": k % columns + 1}
        number, mean, half = _level_means(values, level, x.size)
        _band(figure, x, mean, half, of, showlegend=k == 0, **where)
        level_line(figure, **where)
        parts.append(np.round([x, number, mean, half], 5))
        if named:
            data["panel"] += [name] * x.size
    figure.update_xaxes(title=label, row=rows)
    figure.update_yaxes(title=f"{what[0]}{'<br>' if named else ' '}{unit}", col=1)
    styled_figure(figure, 560 if named else 380, legend=above(1.16 if named else 1.12))
    if named:
        figure.update_layout(margin={"t": 75})
        figure.update_xaxes(tickvals=x)
    data |= zip(names, np.concatenate(parts, axis=1), strict=True)
    return Plot.of(*said, figure, data)


def _band(
    figure: go.Figure, x: FloatArray, mean: FloatArray, half: FloatArray, of: str, **place: Any
) -> None:
    """Draw means with their band in a panel."""
    known = np.isfinite(half)
    at, low, high = x[known], (mean - half)[known], (mean + half)[known]
    figure.add_scatter(
        x=np.concatenate([at, at[::-1]]),
        y=np.concatenate([high, low[::-1]]),
        fill="toself",
        mode="lines",
        fillcolor="rgba(0,114,178,0.22)",
        line={"width": 0},
        hoverinfo="skip",
        name="95 % confidence",
        legendgroup="band",
        visible=bool(known.any()),
        **place,
    )
    means = line(x, np.round(mean, 4), f"mean over the {of}", BLUE) | {"mode": "lines+markers"}
    figure.add_scatter(**means, legendgroup="mean", **place)


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
