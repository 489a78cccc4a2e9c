"""Heat maps of a comparison: model less measured over wheel angle and condition."""

from collections.abc import Mapping

import numpy as np
import plotly.graph_objects as go

from tirelib.core.arrays import FloatArray, IntArray
from tirelib.core.quantities import QUANTITIES
from tirelib.inference.compare.document import edge_value
from tirelib.inference.compare.sentences import millimetres, told
from tirelib.inference.compare.strain import Comparison
from tirelib.inference.identify.error_bands import levels
from tirelib.measured.waveforms import GRID
from tirelib.report.figures.compare_plot import (
    ANGLE_TITLE,
    Plot,
    heat,
    limit_of,
    styled_figure,
)

DEGREES = np.rad2deg(GRID)
NAMES = {name: quantity.title for name, quantity in QUANTITIES.items()} | {"gage": "gage"}
SIGN = "Red: the model shows too much tension (too little compression); blue: too much compression."


def heat_maps(found: Comparison) -> list[Plot]:
    """Return the map of every run, and one by each condition that varies."""
    plots = [_runs(found)]
    for factor in found.chosen.factors:
        members = [factor.level == k for k in range(factor.values.size)]
        rows = [(told(factor.name, v), edge_value(factor.name, v)) for v in factor.values]
        data = np.stack([found.difference[m].mean(axis=0) for m in members])
        count = [int(m.sum()) for m in members]
        unit = QUANTITIES[factor.name].words
        plots.append(_map(found, data, rows, count, factor.name, unit))
    return plots


def gage_plots(found: Comparison) -> list[Plot]:
    """Return the map by gage, from the right to the left; nothing for one gage."""
    plots = []
    straight = found.chosen.straight
    lateral = [1e3 * found.chosen.waves.header.gage_lateral[g] for g in found.chosen.gages]
    if len(lateral) > 1:
        order = np.argsort(lateral)
        data = found.by_gage[straight].mean(axis=0)[order]
        rows = [(f"y = {millimetres(1e-3 * lateral[k])}", lateral[k]) for k in order]
        count = [int(straight.sum())] * len(rows)
        plots.append(_map(found, data, rows, count, "gage", "mm"))
    return plots


def unit_of(found: Comparison) -> tuple[float, str]:
    """Return factor and name of the unit of differences: noise, or microstrain without repeats."""
    if found.noise.known:
        return 1.0 / found.noise.std, "noise"
    return 1e6, "microstrain"


def _runs(found: Comparison) -> Plot:
    c = found.chosen.waves.conditions
    slip = np.nan_to_num(c["slip_angle"])
    keys = (np.nan_to_num(c["slip_ratio"]), c["speed"], c["pressure"], slip)
    load = levels(c["Fz"])
    straight = ~found.chosen.straight
    order = np.lexsort((*(np.round(key, 3) for key in keys), load, straight))
    factor, unit = unit_of(found)
    data = factor * found.difference[order]
    labels = [
        f"run {found.run[i]}: {c['Fz'][i]:.0f} N, {c['pressure'][i] / 1e5:.2f} bar, "
        f"{c['speed'][i] * 3.6:.0f} km/h" + _slip(c, i)
        for i in order
    ]
    figure = _heat(data, labels, unit)
    ticks, texts = _load_ticks(found, order)
    figure.update_yaxes(
        title={"text": "runs by load, pressure and speed", "standoff": 12},
        tickvals=ticks,
        ticktext=texts,
        showgrid=False,
        range=[-0.5, len(order) - 0.5],
    )
    edges = np.rad2deg(found.prediction.edges[order])
    first = int(found.chosen.straight.sum())
    _edges(
        figure,
        np.insert(edges, first, np.nan, axis=0),
        np.insert(np.arange(len(order)), first, first).tolist(),
    )
    styled_figure(figure, 620, showlegend=True, legend=_LEGEND)
    return Plot(
        "heat-runs",
        "Every run: model less measured",
        f"In units of {'the noise of the repeats' if unit == 'noise' else 'microstrain'}; set "
        f"points taken out; colours end at the 99.5 % quantile. {SIGN} Lines: the model's contact.",
        figure,
        *_table(labels, "run", data, unit),
    )


def _slip(c: Mapping[str, FloatArray], i: int) -> str:
    out = ""
    for name, unit, factor in (
        ("slip_angle", " deg slip angle", np.rad2deg(1.0)),
        ("camber", " deg camber", np.rad2deg(1.0)),
        ("slip_ratio", " slip ratio", 1.0),
    ):
        value = np.nan_to_num(c[name][i]) * factor
        if abs(value) > (0.25 if factor > 1 else 0.005):
            out += f", {value:+.3g}{unit}"
    return out


def _load_ticks(found: Comparison, order: IntArray) -> tuple[list[float], list[str]]:
    """Return a tick in the middle of the runs of each load, where there is room for it."""
    load, straight = found.chosen.waves.conditions["Fz"], found.chosen.straight[order]
    level = levels(load)[order]
    ticks: list[float] = []
    texts: list[str] = []
    for counted in (True, False):
        for k in range(int(level.max()) + 1):
            where = np.flatnonzero((level == k) & (straight == counted))
            if where.size and (not ticks or where.mean() - ticks[-1] > 0.03 * order.size):
                ticks.append(float(where.mean()))
                mean = 50.0 * round(float(load[order][where].mean()) / 50.0)
                texts.append(told("load", mean) + ("" if counted else ", slip"))
    return ticks, texts


def _map(
    found: Comparison,
    data: FloatArray,
    rows: list[tuple[str, float]],
    count: list[int],
    name: str,
    unit: str,
) -> Plot:
    factor, noise = unit_of(found)
    values = factor * data
    labels = [text for text, _ in rows]
    figure = _heat(
        values,
        [f"{t} ({n} runs)" for t, n in zip(labels, count, strict=True)],
        noise,
    )
    figure.update_yaxes(
        title={"text": NAMES[name], "standoff": 12},
        tickvals=list(range(len(labels))),
        ticktext=labels,
        showgrid=False,
    )
    styled_figure(figure, 200 + 34 * len(labels))
    axes = " (ISO 8855)" if name == "gage" or QUANTITIES[name].signed else ""
    return Plot(
        f"heat-{name.replace('_', '-')}",
        f"By {NAMES[name]}{axes}",
        f"Mean over the runs of each level. {SIGN}",
        figure,
        *_table(labels, f"{NAMES[name]}{f' [{unit}]' if unit else ''}", values, noise),
    )


_LEGEND = {"orientation": "h", "y": 1.08, "x": 0.0}


def _heat(data: FloatArray, labels: list[str], unit: str) -> go.Figure:
    limit = limit_of(data)
    few = len(labels) <= 12
    figure = heat(
        np.round(data, 2),
        np.round(DEGREES, 3),
        limit,
        unit,
        text=np.broadcast_to(np.array(labels, dtype=object)[:, None], data.shape) if few else None,
        hovertemplate=("%{text}<br>" if few else "")
        + "%{x:.0f} deg: %{z:.3g} "
        + unit
        + "<extra></extra>",
    )
    figure.update_xaxes(title=ANGLE_TITLE, range=[-180, 180], dtick=30)
    return figure


def _edges(figure: go.Figure, edges: FloatArray, y: list[int]) -> None:
    for side, name in ((0, "entry of the contact (model)"), (1, "exit of the contact (model)")):
        figure.add_scatter(
            x=np.round(edges[:, side], 2),
            y=y,
            mode="lines",
            name=name,
            hoverinfo="skip",
            line={"color": "#1c2530", "width": 1.2, "dash": "solid" if side else "dot"},
        )


def _table(
    labels: list[str], first: str, data: FloatArray, unit: str
) -> tuple[list[str], list[list[object]]]:
    """Return the data: a row per angle and a column per level."""
    rows = [[round(float(a), 3), *np.round(data[:, j], 4).tolist()] for j, a in enumerate(DEGREES)]
    return ["wheel angle [deg]", *(f"{first} {text}: [{unit}]" for text in labels)], rows
