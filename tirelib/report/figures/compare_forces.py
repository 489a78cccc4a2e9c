"""Figures of a comparison of forces: agreement, and differences over the conditions."""

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from tirelib.core.arrays import FloatArray, IntArray
from tirelib.core.quantities import QUANTITIES
from tirelib.inference.compare.force_curves import Curve, ranked, slip_of
from tirelib.inference.compare.forces import UNITS, ForceComparison
from tirelib.inference.compare.sentences import told
from tirelib.inference.identify.error_bands import levels
from tirelib.inference.identify.force_points import CELL_ANGLE
from tirelib.report.figures.compare_plot import (
    Plot,
    confidence,
    heat,
    level_means,
    limit_of,
    noise_band,
    stack_titles,
    stacked,
    styled_figure,
)
from tirelib.report.figures.compare_trends import SYMBOLS
from tirelib.report.style import BLUE, CATEGORIES, FAINT, INK, RED

_OVER = tuple(
    (name, QUANTITIES[name].label, float(QUANTITIES[name].told(1.0)))
    for name in ("slip_angle", "slip_ratio", "camber", "load", "pressure")
)

_LISTED = ("load", "pressure", "slip_angle", "camber", "slip_ratio")


def force_plots(found: ForceComparison) -> list[Plot]:
    """Return the map, the force over its slip, the agreement, and differences."""
    return [_map(found), _over_slip(found), _agreement(found), _differences(found)]


def _label(found: ForceComparison) -> str:
    return f"{found.quantity} [{UNITS[found.quantity]}] (ISO 8855)"


def _slip(found: ForceComparison) -> tuple[str, str, float]:
    return next(row for row in _OVER if row[0] == slip_of(found.quantity))


def _unit(found: ForceComparison) -> tuple[float, str]:
    """Return factor and name of the unit of differences: noise, or the force's own without."""
    if np.isfinite(found.noise):
        return 1.0 / found.noise, "noise"
    return 1.0, UNITS[found.quantity]


def _binned(values: FloatArray, name: str) -> tuple[FloatArray, IntArray]:
    """Return the middle of each bin and the bin of each value, -1 where unknown."""
    if name in ("load", "pressure"):
        level = levels(values)
        count = int(level.max()) + 1
        return np.array([values[level == k].mean() for k in range(count)]), level
    step = {"slip_angle": float(np.deg2rad(1.0)), "slip_ratio": 0.02, "camber": CELL_ANGLE}[name]
    found, level = np.unique(np.round(np.nan_to_num(values) / step), return_inverse=True)
    return found * step + 0.0, np.asarray(level, dtype=np.int64).ravel()


def _map(found: ForceComparison) -> Plot:
    """Return the difference over slip and load, in units of the noise."""
    name, label, scale = _slip(found)
    x, column = _binned(getattr(found.data, name), name)
    y, row = _binned(found.data.load, "load")
    factor, unit = _unit(found)
    z = np.full((y.size, x.size), np.nan)
    for i in range(y.size):
        for j in range(x.size):
            inside = (row == i) & (column == j)
            if inside.any():
                z[i, j] = factor * float(found.difference[inside].mean())
    limit = limit_of(z)
    labels = [told("load", 50.0 * round(float(v) / 50.0)) for v in y]
    figure = heat(
        np.round(z, 3),
        np.round(scale * x, 4),
        limit,
        unit,
        hoverongaps=False,
        hovertemplate="%{x:.3g}: %{z:.3g} " + unit + "<extra></extra>",
    )
    figure.update_xaxes(title=label)
    figure.update_yaxes(
        title={"text": "load", "standoff": 12},
        tickvals=list(range(y.size)),
        ticktext=labels,
        showgrid=False,
    )
    styled_figure(figure, 220 + 34 * y.size)
    rows = [[round(scale * float(x[j]), 5), *np.round(z[:, j], 4).tolist()] for j in range(x.size)]
    return Plot(
        "force-map",
        f"{found.quantity}: model less measured over {label.split(' [')[0]} and load",
        "Mean over the points of a bin. Red: the model is above the measurement with its sign; "
        "blue: below.",
        figure,
        [label, *(f"load {text}: [{unit}]" for text in labels)],
        rows,
    )


def curve_plots(found: ForceComparison, curves: tuple[Curve, ...]) -> list[Plot]:
    """Return measurement and model over the slip for the best, the median and the worst curve."""
    return [_curve(found, curve, name) for name, curve in ranked(curves).items()]


def _curve(found: ForceComparison, curve: Curve, place: str) -> Plot:
    name, label, scale = _slip(found)
    unit = UNITS[found.quantity]
    k = curve.member
    x = scale * getattr(found.data, name)[k]
    measured, model, rest = found.measured[k], found.predicted[k], found.difference[k]
    figure = stacked(
        x,
        [
            {"y": measured, "name": "measured", "marker": {"color": BLUE, "size": 6}},
            {"y": model, "name": "model", "marker": {"color": RED, "size": 6, "symbol": "x"}},
        ],
        [{"y": rest, "name": "model less measured", "marker": {"color": INK, "size": 5}}],
        mode="markers",
    )
    noise_band(figure, found.noise, row=2, col=1)
    stack_titles(figure, label, _label(found), unit)
    noise = f", {curve.rms / found.noise:.1f} noise" if np.isfinite(found.noise) else ""
    rows = np.round(np.stack([x, measured, model, rest], axis=1), 5).tolist()
    return Plot(
        f"force-{place}",
        f"{place.capitalize()} curve: {curve.words}",
        f"Difference {curve.rms:.3g} {unit} rms{noise}, {curve.points} points. The model is "
        "computed at the conditions of each point. Grey: 95 % of the noise.",
        figure,
        [label, f"measured [{unit}]", f"model [{unit}]", f"model less measured [{unit}]"],
        rows,
    )


def force_trends(found: ForceComparison) -> list[Plot]:
    """Return the mean difference over each condition that varies, with confidence bands."""
    used = [row for row in _OVER if _varies(getattr(found.data, row[0]), row[0])]
    return [_trend(found, *row) for row in used]


def _trend(found: ForceComparison, name: str, label: str, scale: float) -> Plot:
    unit = UNITS[found.quantity]
    x, column = _binned(getattr(found.data, name), name)
    own = name == slip_of(found.quantity)
    size = np.abs(found.predicted) - np.abs(found.measured)
    difference = found.difference if own else size
    what = f"model less measured {found.quantity}" if own else f"size of {found.quantity} too large"
    centre, half, count = level_means(difference, column, x.size)
    x = scale * x
    figure = go.Figure()
    confidence(figure, x, centre, half, "points")
    figure.add_hline(y=0.0, line={"color": FAINT, "width": 1})
    figure.update_xaxes(title=label)
    figure.update_yaxes(title=f"{what} [{unit}]")
    styled_figure(figure, 380, legend={"orientation": "h", "y": 1.12, "x": 0.0})
    rows = np.round(np.stack([x, count, centre, half], axis=1), 5).tolist()
    return Plot(
        f"force-trend-{name.replace('_', '-')}",
        f"Mean difference by {label.split(' [')[0]}",
        (
            ""
            if own
            else "The differences are those of the magnitudes, because both signs of the "
            "slip occur. "
        )
        + "The band is the 95 % confidence interval of the bin's mean, from the scatter of its "
        "points over the other conditions; bins of one point have none.",
        figure,
        [label, "points", f"{what} [{unit}]", f"95 % half-width [{unit}]"],
        rows,
    )


def _over_slip(found: ForceComparison) -> Plot:
    name, label, factor = _slip(found)
    x = factor * getattr(found.data, name)
    level = levels(found.data.load)
    figure = go.Figure()
    for k in range(int(level.max()) + 1):
        member = np.flatnonzero(level == k)
        member = member[np.argsort(x[member])]
        color = CATEGORIES[k % len(CATEGORIES)]
        load = f"{found.data.load[member].mean():,.0f} N"
        figure.add_scatter(
            x=x[member],
            y=found.measured[member],
            mode="markers",
            name=f"measured, {load}",
            marker={"color": color, "size": 7, "symbol": SYMBOLS[k % len(SYMBOLS)]},
        )
        figure.add_scatter(
            x=x[member],
            y=found.predicted[member],
            mode="lines",
            name=f"model, {load}",
            line={"color": color, "dash": "dash"},
        )
    figure.update_xaxes(title=label)
    figure.update_yaxes(title=_label(found))
    styled_figure(figure, 480, legend={"x": 1.02, "y": 1.0})
    rows = _rows(found)
    return Plot(
        "force-slip",
        f"{found.quantity} over {label.split(' [')[0]}",
        "Points are means over a cell of conditions; lines join the model's points at the "
        "same load.",
        figure,
        *rows,
    )


def _rows(found: ForceComparison) -> tuple[list[str], list[list[float]]]:
    unit = UNITS[found.quantity]
    said = [QUANTITIES[name] for name in _LISTED]
    told = [QUANTITIES[name].told(getattr(found.data, name)) for name in _LISTED]
    table = np.stack([*told, found.measured, found.predicted, found.difference], axis=1)
    names = [f"{each.title} [{each.words or '-'}]" for each in said]
    names += [f"{what} [{unit}]" for what in ("measured", "model", "model less measured")]
    return names, np.round(table, 5).tolist()


def _agreement(found: ForceComparison) -> Plot:
    figure = go.Figure()
    ends = [
        float(min(found.measured.min(), found.predicted.min())),
        float(max(found.measured.max(), found.predicted.max())),
    ]
    figure.add_scatter(
        x=ends, y=ends, mode="lines", name="model = measured", line={"color": FAINT, "width": 1}
    )
    figure.add_scatter(
        x=found.measured,
        y=found.predicted,
        mode="markers",
        name="points",
        marker={"color": BLUE, "size": 6},
    )
    figure.update_xaxes(title=f"measured {_label(found)}")
    figure.update_yaxes(title=f"model {_label(found)}")
    styled_figure(figure, 480, legend={"orientation": "h", "y": 1.1})
    return Plot("force-agreement", "Agreement", "Model against measurement.", figure, *_rows(found))


def _varies(values: FloatArray, name: str) -> bool:
    if name in ("load", "pressure"):
        return int(levels(values).max()) > 0
    return float(np.ptp(values)) > (0.005 if name == "slip_ratio" else 0.01)


def _differences(found: ForceComparison) -> Plot:
    used = [row for row in _OVER if _varies(getattr(found.data, row[0]), row[0])]
    used = used or [_slip(found)]
    figure = make_subplots(rows=1, cols=len(used), shared_yaxes=True, horizontal_spacing=0.04)
    for k, (name, label, factor) in enumerate(used, start=1):
        figure.add_scatter(
            x=factor * getattr(found.data, name),
            y=found.difference,
            mode="markers",
            marker={"color": BLUE, "size": 5},
            showlegend=False,
            row=1,
            col=k,
        )
        figure.update_xaxes(title=label, row=1, col=k)
        noise_band(figure, found.noise, row=1, col=k)
    figure.update_yaxes(
        title=f"model less measured {found.quantity} [{UNITS[found.quantity]}]", row=1, col=1
    )
    styled_figure(figure, 420)
    return Plot(
        "force-differences",
        "Difference over the conditions",
        "Grey: 95 % of the noise from repeats, where there are any.",
        figure,
        *_rows(found),
    )
