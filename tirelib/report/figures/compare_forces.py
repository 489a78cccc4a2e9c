"""Figures of forces, measured and by one model or two: curves, and differences over conditions."""

from collections.abc import Iterator, Sequence

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from tirelib.core.arrays import FloatArray, IntArray, rms
from tirelib.core.quantities import QUANTITIES
from tirelib.inference.compare.force_curves import Curve, curves_of, ranked
from tirelib.inference.compare.force_model import slip_of
from tirelib.inference.compare.forces import ForceComparison
from tirelib.inference.compare.sentences import set_point
from tirelib.inference.identify.error_bands import levels
from tirelib.inference.identify.force_points import CELL_ANGLE
from tirelib.report.figures.compare_plot import (
    SYMBOLS,
    Plot,
    cell_means,
    curves,
    dots,
    fall,
    heat,
    line,
    noise_band,
    styled_figure,
    ticks,
    trend,
)
from tirelib.report.style import BLUE, CATEGORIES, FAINT

_OVER = ("slip_angle", "slip_ratio", "camber", "load", "pressure")
_LISTED = ("load", "pressure", "slip_angle", "camber", "slip_ratio")
_BINS = {"slip_angle": float(np.deg2rad(1.0)), "slip_ratio": 0.02, "camber": CELL_ANGLE}
"""Width of the bins of a condition that is not set to levels."""
LESS = "model less measured"


def force_plots(found: ForceComparison) -> list[Plot]:
    """Return the map, the force over its slip, the agreement, and differences."""
    return [_map(found), _over_slip(found), _agreement(found), _differences(found)]


def _told(found: ForceComparison, name: str) -> FloatArray:
    """Return a condition of the points in its unit."""
    return np.asarray(QUANTITIES[name].told(getattr(found.data, name)))


def _binned(found: ForceComparison, name: str) -> tuple[FloatArray, IntArray]:
    """Return the middle of each bin, in its unit, and the bin of each value, -1 where unknown."""
    values = getattr(found.data, name)
    if name in _BINS:
        cells, level = np.unique(np.round(np.nan_to_num(values) / _BINS[name]), return_inverse=True)
        middle, level = cells * _BINS[name] + 0.0, np.asarray(level, dtype=np.int64).ravel()
    else:
        level = levels(values)
        middle = np.array([values[level == k].mean() for k in range(int(level.max()) + 1)])
    return np.asarray(QUANTITIES[name].told(middle)), level


def _map(found: ForceComparison) -> Plot:
    """Return the difference over slip and load, in units of the noise where it is known."""
    slip = QUANTITIES[slip_of(found.quantity)]
    x, column = _binned(found, slip_of(found.quantity))
    y, row = _binned(found, "load")
    unit, factor = found.unit, 1.0
    if np.isfinite(found.noise):
        unit, factor = "noise", 1.0 / found.noise
    z = factor * cell_means(found.difference, row, column, (y.size, x.size))
    labels = [set_point("load", float(v)) for v in y]
    figure = heat(z, x, slip.label, unit, 220 + 34 * y.size, hoverongaps=False)
    ticks(figure, range(y.size), labels, "load [N]")
    names = [f"load {text}: [{unit}]" for text in labels]
    return Plot.of(
        "force-map",
        f"{found.quantity}: {LESS} over {slip.title} and load",
        "Mean over the points of a bin. Red: the model is above the measurement with its sign; "
        "blue: below.",
        figure,
        [(slip.label, x), *zip(names, z, strict=True)],
        4,
    )


def curve_plots(*found: ForceComparison) -> list[Plot]:
    """Return measurement and model over the slip for the best, the median and the worst curve.

    Of two models, before and after a change, each figure shows both, the worst curve first.
    """
    named = ranked(curves_of(found[0]))
    order = reversed(named) if len(found) > 1 else named
    return [_curve(found, named[name], name) for name in order]


def _curve(found: Sequence[ForceComparison], curve: Curve, name: str) -> Plot:
    first, k, (start, of) = found[0], curve.member, ("force", "curve")
    if len(found) > 1:
        start, of = "curve", "curve of before"
    x, slip = _told(first, slip_of(first.quantity))[k], QUANTITIES[slip_of(first.quantity)]
    sizes = [rms(each.difference[k]) for each in found]
    return curves(
        (
            f"{start}-{name}",
            f"{name.capitalize()} {of}: {curve.words}",
            f"{fall(sizes, first.unit, first.noise)} The models are computed at "
            f"the conditions of each of the {curve.points} points. Grey: 95 % of the noise.",
        ),
        lambda values, what, colour, which: dots(
            x, values, what, colour, 6, symbol=("circle-open", "x", "circle")[which]
        ),
        ("measured", first.measured[k]),
        [(each.predicted[k], each.difference[k]) for each in found],
        (slip.label, QUANTITIES[first.quantity].label),
        first.unit,
        first.noise,
    )


def force_trends(found: ForceComparison) -> list[Plot]:
    """Return the mean difference over each condition that varies, with confidence bands."""
    return [_trend(found, name) for name in _varied(found)]


def _varied(found: ForceComparison) -> Iterator[str]:
    """Return the conditions that vary."""
    for name in _OVER:
        values = getattr(found.data, name)
        if name in ("load", "pressure"):
            varies = int(levels(values).max()) > 0
        else:
            varies = float(np.ptp(values)) > (0.005 if name == "slip_ratio" else 0.01)
        if varies:
            yield name


def _trend(found: ForceComparison, name: str) -> Plot:
    x, column = _binned(found, name)
    if name in (slip_of(found.quantity), "camber"):  # which shifts both signs of a force alike
        what, text, values = f"{LESS} {found.quantity}", "", found.difference
    else:
        what, text = (
            f"size of {found.quantity} too large",
            ("The differences are those of the magnitudes, because both signs of the slip occur. "),
        )
        values = np.abs(found.predicted) - np.abs(found.measured)
    return trend(
        (
            f"force-trend-{name.replace('_', '-')}",
            f"Mean difference by {QUANTITIES[name].title}",
            f"{text}The band is the 95 % confidence interval of the bin's mean, from the scatter "
            "of its points over the other conditions; bins of one point have none.",
        ),
        QUANTITIES[name].label,
        x,
        column,
        {"": values},
        (what, found.unit),
        "points",
    )


def _over_slip(found: ForceComparison) -> Plot:
    slip = QUANTITIES[slip_of(found.quantity)]
    x, level, figure = _told(found, slip_of(found.quantity)), levels(found.data.load), go.Figure()
    for k in range(int(level.max()) + 1):
        member = np.flatnonzero(level == k)
        member = member[np.argsort(x[member])]
        colour, symbol = CATEGORIES[k % len(CATEGORIES)], SYMBOLS[k % len(SYMBOLS)]
        load, at = f"{found.data.load[member].mean():,.0f} N", x[member]
        measured, model = found.measured[member], found.predicted[member]
        figure.add_scatter(**dots(at, measured, f"measured, {load}", colour, symbol=symbol))
        figure.add_scatter(**line(at, model, f"model, {load}", colour, dash="dash"))
    figure.update_xaxes(title=slip.label)
    figure.update_yaxes(title=QUANTITIES[found.quantity].label)
    return _points(
        found,
        "force-slip",
        f"{found.quantity} over {slip.title}",
        "Points are means over a cell of conditions; lines join the model's points at the same "
        "load.",
        styled_figure(figure, 480, legend={"x": 1.02, "y": 1.0}),
    )


def _points(found: ForceComparison, name: str, title: str, caption: str, figure: go.Figure) -> Plot:
    """Return a plot whose data are all points."""
    unit, data = found.unit, {}
    for each in _LISTED:
        data[f"{QUANTITIES[each].title} [{QUANTITIES[each].words or '-'}]"] = _told(found, each)
    names = (f"{what} [{unit}]" for what in ("measured", "model", LESS))
    data |= zip(names, (found.measured, found.predicted, found.difference), strict=True)
    return Plot.of(name, title, caption, figure, data, 5)


def _agreement(found: ForceComparison) -> Plot:
    both = np.concatenate([found.measured, found.predicted])
    ends, figure = [float(both.min()), float(both.max())], go.Figure()
    figure.add_scatter(**line(ends, ends, "model = measured", FAINT, width=1))
    figure.add_scatter(**dots(found.measured, found.predicted, "points", BLUE, 6))
    figure.update_xaxes(title=f"measured {QUANTITIES[found.quantity].label}")
    figure.update_yaxes(title=f"model {QUANTITIES[found.quantity].label}")
    styled_figure(figure, 480, legend={"orientation": "h", "y": 1.1})
    return _points(found, "force-agreement", "Agreement", "Model against measurement.", figure)


def _differences(found: ForceComparison) -> Plot:
    used = [*_varied(found)] or [slip_of(found.quantity)]
    figure = make_subplots(rows=1, cols=len(used), shared_yaxes=True, horizontal_spacing=0.04)
    for k, name in enumerate(used, start=1):
        trace = dots(_told(found, name), found.difference, "points", BLUE, 5)
        figure.add_scatter(**trace, showlegend=False, row=1, col=k)
        figure.update_xaxes(title=QUANTITIES[name].label, row=1, col=k)
        noise_band(figure, found.noise, row=1, col=k)
    figure.update_yaxes(title=f"{LESS} {found.quantity} [{found.unit}]", row=1, col=1)
    return _points(
        found,
        "force-differences",
        "Difference over the conditions",
        "Grey: 95 % of the noise from repeats, where there are any.",
        styled_figure(figure, 420),
    )
