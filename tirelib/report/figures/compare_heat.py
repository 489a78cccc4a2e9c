"""Figures of strain: model less measured over angle and condition, and waveforms of runs."""

from collections.abc import Sequence

import numpy as np

from tirelib.core.arrays import FloatArray, IntArray
from tirelib.core.quantities import QUANTITIES
from tirelib.inference.compare.sentences import millimetres, set_point, told
from tirelib.inference.compare.strain import Comparison
from tirelib.inference.identify.error_bands import levels
from tirelib.report.figures.compare_plot import (
    ANGLE_TITLE,
    DEGREES,
    Plot,
    above,
    curves,
    fall,
    line,
    turn_map,
)
from tirelib.report.style import FAINT, INK

SIGN = "Red: the model shows too much tension (too little compression); blue: too much compression."
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
        quantity = QUANTITIES[factor.name]
        axes = f"{quantity.title} (ISO 8855)" if quantity.signed else quantity.title
        plots.append(_map(found, data, labels, count, (factor.name, axes, quantity.heading)))
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
    said = "gage", "gage (ISO 8855)", "gage [mm]"
    return [_map(found, data, labels, [int(straight.sum())] * len(labels), said)]


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
    plot = turn_map(
        (
            "heat-runs",
            "Every run: model less measured",
            f"In units of {'the noise of the repeats' if unit == 'noise' else 'microstrain'}; set "
            f"points taken out; colours end at the 99.5 % quantile. {SIGN} Lines: the model's "
            "contact.",
        ),
        data,
        labels,
        (*_load_ticks(found, order), "runs by load [N], then pressure and speed"),
        unit,
        620,
    )
    plot.figure.update_yaxes(range=[-0.5, len(order) - 0.5])
    edges = np.rad2deg(found.prediction.edges[order])
    first = int(straight.sum())  # between the counted runs and the others the lines are open
    edges = np.insert(edges, first, np.nan, axis=0)
    rows = np.insert(np.arange(len(order)), first, first).tolist()
    for side, name, dash in ((0, "entry", "dot"), (1, "exit", "solid")):
        text = f"{name} of the contact (model)"
        trace = line(np.round(edges[:, side], 2), rows, text, INK, width=1.2, dash=dash)
        plot.figure.add_scatter(**trace, hoverinfo="skip")
    plot.figure.update_layout(showlegend=True, legend=above(1.08))
    return plot


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
                mean = float(load[order][where].mean())
                texts.append(set_point("load", mean) + ("" if counted else ", slip"))
    return places, texts


def _map(
    found: Comparison,
    data: FloatArray,
    labels: Sequence[str],
    count: Sequence[int],
    names: tuple[str, str, str],
) -> Plot:
    """Return the map by a condition: its name, in the plot's title, and of the axis."""
    (factor, noise), (name, title, axis) = unit_of(found), names
    return turn_map(
        (
            f"heat-{name.replace('_', '-')}",
            f"By {title}",
            f"Mean over the runs of each level. {SIGN}",
        ),
        factor * data,
        [f"{text} ({n} runs)" for text, n in zip(labels, count, strict=True)],
        (range(len(labels)), labels, axis),
        noise,
        200 + 34 * len(labels),
    )


def waveform_plots(*found: Comparison) -> list[Plot]:
    """Return a figure for the best, the median and the worst run (one run: a single figure).

    Of two models, before and after a change, each figure shows both, the worst run first.
    """
    named = {i: name for name, i in reversed(found[0].ranked().items())}
    order = named.items() if len(found) > 1 else reversed(named.items())
    return [_waveforms(found, i, name) for i, name in order]


def _waveforms(found: Sequence[Comparison], i: int, name: str) -> Plot:
    first, text, title = found[0], "measured", f"{name.capitalize()} run of before"
    measured, noise = first.chosen.strain[i], first.noise.std
    if len(found) == 1:
        measured, text = measured - first.points.shift[i], "measured, set points taken out"
        title = f"{name.capitalize()} run"
    load = first.chosen.waves.conditions["Fz"][i]
    plot = curves(
        (
            f"waveform-{name}",
            f"{title}: {first.run[i]} ({load:,.0f} N, {place_of(first, i)})",
            f"{fall([1e6 * float(each.run_rms[i]) for each in found], _UNIT, 1e6 * noise)} It is "
            "corrected for set points. Strain without its mean over the turn, mean over the gages, "
            "tension positive. Dotted: edges of the model's contact. Grey: 95 % of the noise.",
        ),
        lambda values, what, colour, k: line(
            DEGREES, values, what, colour, width=2, dash=("solid", "dash", "solid")[k]
        ),
        (text, 1e6 * measured),
        [(1e6 * each.prediction.strain[i], 1e6 * each.difference[i]) for each in found],
        (ANGLE_TITLE, f"strain [{_UNIT}]"),
        _UNIT,
        1e6 * noise,
    )
    for edge in np.rad2deg(found[-1].prediction.edges[i]):
        plot.figure.add_vline(x=float(edge), line={"color": FAINT, "width": 1, "dash": "dot"})
    plot.figure.update_xaxes(range=[-HALF, HALF], dtick=20)
    plot.figure.update_yaxes(tickformat=",", row=1, col=1)
    return plot
