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
from tirelib.report.figures.compare_plot import Plot, confidence, level_means, styled_figure
from tirelib.report.style import BLACK, BLUE, CATEGORIES, FAINT, RED

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
SYMBOLS = ("circle", "square", "triangle-up", "diamond", "cross", "x")
_LEGEND = {"orientation": "h", "y": 1.16, "x": 0.0}
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
    rows: list[list[object]] = []
    for number, name in enumerate(SECTORS):
        centre, half, _ = level_means(means[:, number], factor.level, factor.values.size)
        where = {"row": number // 3 + 1, "col": number % 3 + 1}
        confidence(figure, x, centre, half, "runs", showlegend=number == 0, **where)
        rows += [
            [name, float(x[k]), round(float(centre[k]), 3), round(float(half[k]), 3)]
            for k in range(x.size)
        ]
        figure.add_hline(y=0.0, line={"color": FAINT, "width": 1}, **where)
    label = f"{CONDITIONS[factor.name]}{f' [{unit}]' if unit else ''}"
    for column in (1, 2, 3):
        figure.update_xaxes(title=label, row=2, col=column)
    figure.update_xaxes(tickvals=x)
    for row in (1, 2):
        figure.update_yaxes(title="model less measured<br>[microstrain]", row=row, col=1)
    styled_figure(figure, 560, legend=_LEGEND)
    figure.update_layout(margin={"t": 75})
    return Plot(
        f"trend-{factor.name.replace('_', '-')}",
        f"Mean difference by {CONDITIONS[factor.name]}",
        "Each panel is a sector of the wheel turn. The band is the 95 % confidence interval of the "
        "level's mean, from the scatter of its runs over the other conditions; levels of one run "
        "have none. Above zero the model shows too much tension.",
        figure,
        ["sector", label, "model less measured [microstrain]", "95 % half-width [microstrain]"],
        rows,
    )


def track_plots(found: Comparison) -> list[Plot]:
    """Return every track, measured and by the model, over the load."""
    return [_track(found, track) for track in found.tracks if track.known.any()]


def _track(found: Comparison, track: Track) -> Plot:
    shown = track.known & found.chosen.straight
    if not shown.any():
        shown = track.known
    load = found.chosen.waves.conditions["Fz"]
    figure = make_subplots(rows=1, cols=2, horizontal_spacing=0.1)
    parts = _pressures(found, shown)
    for k, (text, member) in enumerate(parts):
        color, symbol = CATEGORIES[k % len(CATEGORIES)], SYMBOLS[k % len(SYMBOLS)]
        x = load[member]
        order = np.argsort(x)
        model, half = (
            track.scale * track.model[member],
            1.96 * track.scale * track.model_std[member],
        )
        noise = 1.96 * track.scale * np.nan_to_num(track.noise)
        figure.add_scatter(
            x=x,
            y=track.scale * track.measured[member],
            mode="markers",
            name=f"measured, {text}",
            marker={"color": color, "symbol": symbol, "size": 7},
            error_y={"type": "constant", "value": noise, **_BAR, "color": color},
            row=1,
            col=1,
            customdata=found.run[member],
            hovertemplate=_HOVER,
        )
        figure.add_scatter(
            x=x[order],
            y=model[order],
            mode="lines",
            name=f"model, {text}",
            line={"color": color, "dash": "dash"},
            hoverinfo="skip",
            row=1,
            col=1,
        )
        figure.add_scatter(
            x=x,
            y=track.scale * (track.model - track.measured)[member],
            mode="markers",
            showlegend=False,
            marker={"color": color, "symbol": symbol, "size": 7},
            error_y={"type": "data", "array": np.hypot(half, noise), **_BAR, "color": color},
            customdata=found.run[member],
            hovertemplate=_HOVER,
            row=1,
            col=2,
        )
    figure.add_hline(y=0.0, line={"color": FAINT, "width": 1}, row=1, col=2)
    figure.update_xaxes(title="measured load [N]")
    figure.update_yaxes(title=f"{track.name} [{track.unit}]", row=1, col=1)
    figure.update_yaxes(title=f"model less measured [{track.unit}]", row=1, col=2)
    styled_figure(figure, 430, legend={"orientation": "h", "y": 1.22, "x": 0.0})
    figure.update_layout(margin={"t": 85})
    noise_text = (
        f"Noise of the repeats {track.scale * track.noise:.2g} {track.unit}. "
        if np.isfinite(track.noise)
        else ""
    )
    how = _HOW[track.name]
    rows = [
        [int(found.run[i]), round(float(load[i]), 1)]
        + [
            round(track.scale * float(v[i]), 4)
            for v in (track.measured, track.model, track.model_std)
        ]
        for i in np.flatnonzero(shown)
    ]
    return Plot(
        track.name.replace(" ", "-"),
        f"{track.name.capitalize()} of every run",
        f"{how}. {noise_text}Bars: 95 % by noise (left), by noise and set-point tolerance (right).",
        figure,
        [
            "run",
            "load [N]",
            f"measured [{track.unit}]",
            f"model [{track.unit}]",
            f"model, std by set points [{track.unit}]",
        ],
        rows,
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
    scaled = found.points.scaled
    order = np.argsort(found.chosen.waves.start, kind="stable")
    figure = go.Figure()
    place = np.arange(1, len(order) + 1)
    for k, name in enumerate(NAMES):
        figure.add_scatter(
            x=place,
            y=np.round(scaled[order, k], 3),
            mode="markers",
            name="angle zero" if name == "angle" else name,
            customdata=found.run[order],
            marker={"color": (BLUE, RED, BLACK, CATEGORIES[2])[k], "symbol": SYMBOLS[k], "size": 7},
            hovertemplate=_HOVER,
        )
    for y in (-1.96, 1.96):
        figure.add_hline(y=y, line={"color": FAINT, "width": 1, "dash": "dot"})
    figure.update_xaxes(title="place of the run in the campaign")
    figure.update_yaxes(title="beside the recorded value [tolerance]")
    styled_figure(figure, 380, legend={"orientation": "h", "y": 1.12, "x": 0.0})
    rows = [
        [
            int(found.run[i]),
            *np.round(scaled[i], 4).tolist(),
            *np.round(found.points.value[i] * (100, 100, 100, 1000), 5).tolist(),
        ]
        for i in order
    ]
    return Plot(
        "set-points",
        "What was taken out as set-point error",
        "Best linear prediction per run; 95 % should lie between the dotted lines. Many beyond "
        "them, or a trend, is misfit that looks like a set-point error.",
        figure,
        [
            "run",
            *(f"{name} [tolerance]" for name in NAMES),
            "load [%]",
            "pressure [%]",
            "gain [%]",
            "angle zero [mrad]",
        ],
        rows,
    )
