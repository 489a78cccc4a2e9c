"""Trends with confidence bands, contact length and deflection, and the set points."""

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.core.quantities import QUANTITIES
from tirelib.inference.compare.document import edge_value
from tirelib.inference.compare.runs import Factor
from tirelib.inference.compare.sectors import SECTORS
from tirelib.inference.compare.sentences import told
from tirelib.inference.compare.set_points import NAMES
from tirelib.inference.compare.strain import Comparison
from tirelib.inference.compare.tracks import Track
from tirelib.report.figures.compare_heat import NAMES as CONDITIONS
from tirelib.report.figures.compare_plot import (
    SYMBOLS,
    Plot,
    above,
    confidence,
    dots,
    level_line,
    level_means,
    line,
    styled_figure,
)
from tirelib.report.style import BLACK, BLUE, CATEGORIES, GREEN, RED

_HOW = {
    "contact length": "From the steepest rise of strain at the entry to the steepest fall at the "
    "exit, read from measurement and model in the same way",
    "deflection": "Free radius less loaded radius; the measured one includes the rig's zero, which "
    "is not corrected",
    "contact entry": "Wheel angle of the steepest rise of strain, read from measurement and model "
    "in the same way; above zero on the right, the model's contact begins too late",
    "contact exit": "Wheel angle of the steepest fall of strain, read from measurement and model "
    "in the same way; above zero on the right, the model's contact ends too late",
}
_BAR = {"width": 0, "thickness": 1}
_HOVER = "run %{customdata}: %{y:.2f}<extra></extra>"


def trend_plots(found: Comparison) -> list[Plot]:
    """Return the difference in each sector over each condition that varies."""
    return [_trend(found, factor) for factor in found.chosen.factors]


def run_means(found: Comparison) -> FloatArray:
    """Return the mean difference of each run in each sector, (n_runs, n_sectors), [-]."""
    out = []
    for number in range(len(SECTORS)):
        inside = found.sector == number
        count = np.maximum(inside.sum(axis=1), 1)
        mean = np.sum(np.where(inside, found.difference, 0.0), axis=1) / count
        out.append(np.where(inside.any(axis=1), mean, np.nan))
    return np.stack(out, axis=1)


def _trend(found: Comparison, factor: Factor) -> Plot:
    means = 1e6 * run_means(found)
    unit = QUANTITIES[factor.name].words
    x = np.array([edge_value(factor.name, float(v)) for v in factor.values])
    figure = make_subplots(
        rows=2,
        cols=3,
        subplot_titles=[s.capitalize() for s in SECTORS],
        shared_xaxes=True,
        vertical_spacing=0.14,
        horizontal_spacing=0.07,
    )
    sector, levels = [], []
    for number, name in enumerate(SECTORS):
        centre, half, _ = level_means(means[:, number], factor.level, factor.values.size)
        where = {"row": number // 3 + 1, "col": number % 3 + 1}
        confidence(figure, x, centre, half, "runs", showlegend=number == 0, **where)
        level_line(figure, **where)
        sector += [name] * x.size
        levels.append(np.stack([x, np.round(centre, 3), np.round(half, 3)]))
    label = f"{CONDITIONS[factor.name]}{f' [{unit}]' if unit else ''}"
    for column in (1, 2, 3):
        figure.update_xaxes(title=label, row=2, col=column)
    figure.update_xaxes(tickvals=x)
    for row in (1, 2):
        figure.update_yaxes(title="model less measured<br>[microstrain]", row=row, col=1)
    styled_figure(figure, 560, legend=above(1.16))
    figure.update_layout(margin={"t": 75})
    names = [label, "model less measured [microstrain]", "95 % half-width [microstrain]"]
    return Plot.of(
        f"trend-{factor.name.replace('_', '-')}",
        f"Mean difference by {CONDITIONS[factor.name]}",
        "Each panel is a sector of the wheel turn. The band is the 95 % confidence interval of the "
        "level's mean, from the scatter of its runs over the other conditions; levels of one run "
        "have none. Above zero the model shows too much tension.",
        figure,
        {"sector": sector, **dict(zip(names, np.concatenate(levels, axis=1), strict=True))},
    )


def track_plots(found: Comparison) -> list[Plot]:
    """Return every track, measured and by the model, over the load."""
    return [_track(found, track) for track in found.tracks if track.known.any()]


def _track(found: Comparison, track: Track) -> Plot:
    shown = track.known & found.chosen.straight
    if not shown.any():
        shown = track.known
    load, unit = found.chosen.waves.conditions["Fz"], f"[{track.unit}]"
    measured, model, std = (
        track.scale * values for values in (track.measured, track.model, track.model_std)
    )
    noise = track.scale * track.noise
    bar = 1.96 * float(np.nan_to_num(noise))
    figure = make_subplots(rows=1, cols=2, horizontal_spacing=0.1)
    for k, (text, member) in enumerate(_pressures(found, shown)):
        colour, symbol = CATEGORIES[k % len(CATEGORIES)], SYMBOLS[k % len(SYMBOLS)]
        x, order = load[member], np.argsort(load[member])
        runs = {"customdata": found.run[member], "hovertemplate": _HOVER}
        left = dots(x, measured[member], f"measured, {text}", colour, symbol=symbol)
        error = {"type": "constant", "value": bar, **_BAR, "color": colour}
        figure.add_scatter(**left, error_y=error, **runs, row=1, col=1)
        along = line(x[order], model[member][order], f"model, {text}", colour, dash="dash")
        figure.add_scatter(**along, hoverinfo="skip", row=1, col=1)
        right = dots(x, (model - measured)[member], f"difference, {text}", colour, symbol=symbol)
        half = np.hypot(1.96 * std[member], bar)
        error = {"type": "data", "array": half, **_BAR, "color": colour}
        figure.add_scatter(**right, error_y=error, **runs, showlegend=False, row=1, col=2)
    level_line(figure, row=1, col=2)
    figure.update_xaxes(title="measured load [N]")
    figure.update_yaxes(title=f"{track.name} {unit}", row=1, col=1)
    figure.update_yaxes(title=f"model less measured {unit}", row=1, col=2)
    styled_figure(figure, 430, legend=above(1.22))
    figure.update_layout(margin={"t": 85})
    told_noise = f"Noise of the repeats {noise:.2g} {track.unit}. " if np.isfinite(noise) else ""
    return Plot.of(
        track.name.replace(" ", "-"),
        f"{track.name.capitalize()} of every run",
        f"{_HOW[track.name]}. {told_noise}Bars: 95 % by noise (left), by noise and set-point "
        "tolerance (right).",
        figure,
        {
            "run": found.run[shown],
            "load [N]": np.round(load[shown], 1),
            f"measured {unit}": np.round(measured[shown], 4),
            f"model {unit}": np.round(model[shown], 4),
            f"model, std by set points {unit}": np.round(std[shown], 4),
        },
    )


def _pressures(found: Comparison, shown: BoolArray) -> list[tuple[str, BoolArray]]:
    for factor in found.chosen.factors:
        if factor.name == "pressure":
            return [
                (told("pressure", float(v)), shown & (factor.level == k))
                for k, v in enumerate(factor.values)
                if (shown & (factor.level == k)).any()
            ]
    return [("all runs", shown)]


def set_point_plot(found: Comparison) -> Plot:
    """Return the set points' random part of every run in units of the tolerance."""
    order = np.argsort(found.chosen.waves.start, kind="stable")
    run, scaled, value = found.run[order], found.points.scaled[order], found.points.value[order]
    figure, place = go.Figure(), np.arange(1, len(order) + 1)
    for k, (name, colour) in enumerate(zip(NAMES, (BLUE, RED, BLACK, GREEN), strict=True)):
        text = "angle zero" if name == "angle" else name
        trace = dots(place, np.round(scaled[:, k], 3), text, colour, symbol=SYMBOLS[k])
        figure.add_scatter(**trace, customdata=run, hovertemplate=_HOVER)
    for y in (-1.96, 1.96):
        level_line(figure, y, "dot")
    figure.update_xaxes(title="place of the run in the campaign")
    figure.update_yaxes(title="beside the recorded value [tolerance]")
    styled_figure(figure, 380, legend=above())
    units = {"load [%]": 100, "pressure [%]": 100, "gain [%]": 100, "angle zero [mrad]": 1000}
    return Plot.of(
        "set-points",
        "What was taken out as set-point error",
        "Best linear prediction per run; 95 % should lie between the dotted lines. Many beyond "
        "them, or a trend, is misfit that looks like a set-point error.",
        figure,
        {
            "run": run,
            **{f"{name} [tolerance]": np.round(scaled[:, k], 4) for k, name in enumerate(NAMES)},
            **{name: np.round(f * value[:, k], 5) for k, (name, f) in enumerate(units.items())},
        },
    )
