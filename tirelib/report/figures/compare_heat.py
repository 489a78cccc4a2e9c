"""Figures of strain: model less measured over angle and condition, and waveforms of runs."""

from collections.abc import Iterator, Sequence

import numpy as np
import plotly.graph_objects as go

from tirelib.core.arrays import FloatArray, IntArray
from tirelib.core.quantities import QUANTITIES
from tirelib.inference.compare.sentences import millimetres, told
from tirelib.inference.compare.strain import Comparison
from tirelib.inference.identify.error_bands import levels
from tirelib.report.figures.compare_plot import (
    ANGLE_TITLE,
    DEGREES,
    Plot,
    Trace,
    above,
    line,
    stacked,
    ticks,
    turn_map,
)
from tirelib.report.style import BLUE, FAINT, INK, RED

NAMES = {name: quantity.title for name, quantity in QUANTITIES.items()} | {"gage": "gage"}
SIGN = "Red: the model shows too much tension (too little compression); blue: too much compression."
MOST_NAMED_ROWS = 12
"""Rows of a map up to which the pointer names the row."""
_SLIPS = {
    "slip_angle": (" deg slip angle", 0.25),
    "camber": (" deg camber", 0.25),
    "slip_ratio": (" slip ratio", 0.005),
}
"""How a run's slip is said, and from which size, in that unit."""
HALF = 100.0
"""Angles shown at first, [deg]; the rest by zooming out."""
_UNIT = "microstrain"


def heat_maps(found: Comparison) -> list[Plot]:
    """Return the map of every run, and one by each condition that varies."""
    plots = [_runs(found)]
    for factor in found.chosen.factors:
        members = [factor.level == k for k in range(factor.values.size)]
        data = np.stack([found.difference[m].mean(axis=0) for m in members])
        labels = [told(factor.name, value) for value in factor.values]
        count = [int(m.sum()) for m in members]
        unit = QUANTITIES[factor.name].words
        plots.append(_map(found, data, labels, count, factor.name, unit))
    return plots


def gage_plots(found: Comparison) -> list[Plot]:
    """Return the map by gage, from the right to the left; nothing for one gage."""
    straight = found.chosen.straight
    lateral = np.array([found.chosen.waves.header.gage_lateral[g] for g in found.chosen.gages])
    if lateral.size < 2:
        return []
    order = np.argsort(lateral)
    data = found.by_gage[straight].mean(axis=0)[order]
    labels = [f"y = {millimetres(y)}" for y in lateral[order]]
    return [_map(found, data, labels, [int(straight.sum())] * len(labels), "gage", "mm")]


def unit_of(found: Comparison) -> tuple[float, str]:
    """Return factor and name of the unit of differences: noise, or microstrain without repeats."""
    if found.noise.known:
        return 1.0 / found.noise.std, "noise"
    return 1e6, "microstrain"


def place_of(found: Comparison, i: int) -> str:
    """Say pressure and speed of a run."""
    c = found.chosen.waves.conditions
    return f"{c['pressure'][i] / 1e5:.2f} bar, {c['speed'][i] * 3.6:.0f} km/h"


def _runs(found: Comparison) -> Plot:
    c, straight = found.chosen.waves.conditions, found.chosen.straight
    slip_ratio, slip_angle = (np.nan_to_num(c[name]) for name in ("slip_ratio", "slip_angle"))
    keys = [np.round(key, 3) for key in (slip_ratio, c["speed"], c["pressure"], slip_angle)]
    order = np.lexsort((*keys, levels(c["Fz"]), ~straight))
    factor, unit = unit_of(found)
    data = factor * found.difference[order]
    labels = [
        f"run {found.run[i]}: {c['Fz'][i]:.0f} N, {place_of(found, i)}{_slip(found, i)}"
        for i in order
    ]
    figure = _turns(data, labels, unit, 620)
    ticks(figure, *_load_ticks(found, order), "runs by load [N], then pressure and speed")
    figure.update_yaxes(range=[-0.5, len(order) - 0.5])
    edges = np.rad2deg(found.prediction.edges[order])
    first = int(straight.sum())  # between the counted runs and the others the lines are open
    edges = np.insert(edges, first, np.nan, axis=0)
    rows = np.insert(np.arange(len(order)), first, first).tolist()
    for side, name, dash in ((0, "entry", "dot"), (1, "exit", "solid")):
        text = f"{name} of the contact (model)"
        trace = line(np.round(edges[:, side], 2), rows, text, INK, width=1.2, dash=dash)
        figure.add_scatter(**trace, hoverinfo="skip")
    figure.update_layout(showlegend=True, legend=above(1.08))
    return Plot.of(
        "heat-runs",
        "Every run: model less measured",
        f"In units of {'the noise of the repeats' if unit == 'noise' else 'microstrain'}; set "
        f"points taken out; colours end at the 99.5 % quantile. {SIGN} Lines: the model's contact.",
        figure,
        *_data(labels, "run", data, unit),
    )


def _slip(found: Comparison, i: int) -> str:
    out = ""
    for name, (unit, least) in _SLIPS.items():
        value = QUANTITIES[name].told(np.nan_to_num(found.chosen.waves.conditions[name][i]))
        out += f", {value:+.3g}{unit}" if abs(value) > least else ""
    return out


def _load_ticks(found: Comparison, order: IntArray) -> tuple[list[float], list[str]]:
    """Return a tick in the middle of the runs of each load, where there is room for it."""
    load, straight = found.chosen.waves.conditions["Fz"], found.chosen.straight[order]
    level = levels(load)[order]
    places: list[float] = []
    texts: list[str] = []
    for counted in (True, False):
        for k in range(int(level.max()) + 1):
            where = np.flatnonzero((level == k) & (straight == counted))
            if where.size and (not places or where.mean() - places[-1] > 0.03 * order.size):
                places.append(float(where.mean()))
                mean = 50.0 * round(float(load[order][where].mean()) / 50.0)
                texts.append(told("load", mean) + ("" if counted else ", slip"))
    return places, texts


def _map(
    found: Comparison,
    data: FloatArray,
    labels: Sequence[str],
    count: Sequence[int],
    name: str,
    unit: str,
) -> Plot:
    factor, noise = unit_of(found)
    said = [f"{text} ({n} runs)" for text, n in zip(labels, count, strict=True)]
    figure = _turns(factor * data, said, noise, 200 + 34 * len(labels))
    title = f"{NAMES[name]}{f' [{unit}]' if unit else ''}"
    ticks(figure, range(len(labels)), labels, title)
    axes = " (ISO 8855)" if name == "gage" or QUANTITIES[name].signed else ""
    return Plot.of(
        f"heat-{name.replace('_', '-')}",
        f"By {NAMES[name]}{axes}",
        f"Mean over the runs of each level. {SIGN}",
        figure,
        *_data(labels, title, factor * data, noise),
    )


def _turns(data: FloatArray, labels: Sequence[str], unit: str, height: int) -> go.Figure:
    """Return a map whose rows the pointer names, where they are few."""
    if len(labels) > MOST_NAMED_ROWS:
        return turn_map(data, unit, height)
    said = np.broadcast_to(np.array(labels, dtype=object)[:, None], data.shape)
    hover = "%{text}<br>%{x:.0f} deg: %{z:.3g} " + unit + "<extra></extra>"
    return turn_map(data, unit, height, text=said, hovertemplate=hover)


def _data(
    labels: Sequence[str], first: str, data: FloatArray, unit: str
) -> tuple[list[tuple[str, FloatArray]], int]:
    """Return the data, a row per angle and a column per level, and their decimals."""
    named = [f"{first} {text}: [{unit}]" for text in labels]
    return [("wheel angle [deg]", DEGREES), *zip(named, data, strict=True)], 4


def waveform_plots(found: Comparison) -> list[Plot]:
    """Return a figure for the best, the median and the worst run (one run: a single figure)."""
    return [_one(found, i, name) for name, i in _ranked(found)]


def waveforms(before: Comparison, after: Comparison) -> list[Plot]:
    """Return both models' waveforms of the worst, the median and the best run of before."""
    return [_two(before, after, i, name) for name, i in _ranked(before, worst_first=True)]


def _ranked(found: Comparison, *, worst_first: bool = False) -> Iterator[tuple[str, int]]:
    """Return names and numbers of runs, each run once."""
    named = [*zip(("best", "median", "worst"), found.ranked(), strict=True)]
    seen: set[int] = set()
    for name, i in reversed(named) if worst_first else named:
        if i not in seen:
            yield name, i
        seen.add(i)


def _curves(
    values: Sequence[Trace], differences: Sequence[Trace], edges: FloatArray, noise: float | None
) -> go.Figure:
    """Return waveforms over their differences, the contact's edges [rad] dotted."""
    titles = ANGLE_TITLE, f"strain [{_UNIT}]"
    figure = stacked(values, differences, titles, _UNIT, noise)
    for edge in np.rad2deg(edges):
        figure.add_vline(x=float(edge), line={"color": FAINT, "width": 1, "dash": "dot"})
    figure.update_xaxes(range=[-HALF, HALF], dtick=20)
    return figure.update_yaxes(tickformat=",", row=1, col=1)


def _title(found: Comparison, i: int, what: str) -> str:
    load = found.chosen.waves.conditions["Fz"][i]
    return f"{what}: {found.run[i]} ({load:,.0f} N, {place_of(found, i)})"


def _one(found: Comparison, i: int, name: str) -> Plot:
    model, difference = 1e6 * found.prediction.strain[i], 1e6 * found.difference[i]
    measured = 1e6 * (found.chosen.strain[i] - found.points.shift[i])
    taken, less = "measured, set points taken out", "model less measured"
    values = [
        line(DEGREES, measured, taken, BLUE, width=2),
        line(DEGREES, model, "model", RED, width=2, dash="dash"),
    ]
    rest = line(DEGREES, difference, less, INK, width=1.5)
    edges, known = found.prediction.edges[i], found.noise.known
    figure = _curves(values, [rest], edges, 1e6 * found.noise.std)
    noise = f", {found.run_rms[i] / found.noise.std:.1f} noise" if known else ""
    return Plot.of(
        f"waveform-{name}",
        _title(found, i, f"{name.capitalize()} run"),
        f"Difference {1e6 * found.run_rms[i]:.0f} {_UNIT} rms{noise}; strain without its mean over "
        "the turn, mean over the gages, tension positive. Dotted: edges of the model's contact. "
        "Grey: 95 % of the noise.",
        figure,
        {
            "wheel angle [deg]": DEGREES,
            f"{taken} [{_UNIT}]": measured,
            f"model [{_UNIT}]": model,
            f"{less} [{_UNIT}]": difference,
        },
        3,
    )


def _two(before: Comparison, after: Comparison, i: int, name: str) -> Plot:
    measured = 1e6 * before.chosen.strain[i]
    values: list[Trace] = [line(DEGREES, measured, "measured", INK, width=2.5)]
    differences: list[Trace] = []
    models, rest = {}, {}
    for found, word, colour, dash in (
        (before, "before", RED, "dash"),
        (after, "after", BLUE, "solid"),
    ):
        model, left = 1e6 * found.prediction.strain[i], 1e6 * found.difference[i]
        models[f"model {word} [{_UNIT}]"], rest[f"{word} less measured [{_UNIT}]"] = model, left
        values.append(line(DEGREES, model, f"model {word}", colour, dash=dash))
        trace = line(DEGREES, left, f"model {word} minus measured", colour, width=1.5, dash=dash)
        differences.append(trace | {"showlegend": False})
    was, is_now = (1e6 * float(found.run_rms[i]) for found in (before, after))
    return Plot.of(
        f"waveform-{name}",
        _title(before, i, f"{name.capitalize()} run of before"),
        f"The difference, corrected for set points, was {was:.0f} {_UNIT} rms and is now "
        f"{is_now:.0f}. Shown is the strain minus its mean over the turn, averaged over the "
        "gages, tension positive. Dotted: edges of the contact of the model after.",
        _curves(values, differences, after.prediction.edges[i], None),
        {"wheel angle [deg]": DEGREES, f"measured [{_UNIT}]": measured, **models, **rest},
        3,
    )
