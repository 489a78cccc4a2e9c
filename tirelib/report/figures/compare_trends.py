"""Trends with confidence bands, contact length and deflection, and the set points."""

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.core.quantities import QUANTITIES
from tirelib.inference.compare.runs import Factor
from tirelib.inference.compare.sectors import SECTORS
from tirelib.inference.compare.sentences import told
from tirelib.inference.compare.set_points import SAID
from tirelib.inference.compare.strain import Comparison
from tirelib.inference.compare.tracks import Track
from tirelib.report.figures.compare_plot import (
    SYMBOLS,
    Plot,
    above,
    dots,
    level_line,
    line,
    styled_figure,
    trend,
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
    inside = found.sector[:, None] == np.arange(len(SECTORS))[:, None]
    count = inside.sum(axis=2)
    total = np.sum(np.where(inside, found.difference[:, None], 0.0), axis=2)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _trend(found: Comparison, factor: Factor) -> Plot:
    quantity = QUANTITIES[factor.name]
    return trend(
        (
            f"trend-{factor.name.replace('_', '-')}",
            f"Mean difference by {quantity.title}",
            "Each panel is a sector of the wheel turn. The band is the 95 % confidence interval of "
            "the level's mean, from the scatter of its runs over the other conditions; levels of "
            "one run have none. Above zero the model shows too much tension.",
        ),
        quantity.heading,
        np.asarray(quantity.told(factor.values)),
        factor.level,
        dict(zip(SECTORS, 1e6 * run_means(found).T, strict=True)),
        ("model less measured", "microstrain"),
        "runs",
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
    data: dict[str, FloatArray] = {}
    for k, ((text, unit, factor), colour) in enumerate(
        zip(SAID.values(), (BLUE, RED, BLACK, GREEN), strict=True)
    ):
        data |= {f"{text} [tolerance]": scaled[:, k], f"{text} [{unit}]": factor * value[:, k]}
        trace = dots(place, np.round(scaled[:, k], 3), text, colour, symbol=SYMBOLS[k])
        figure.add_scatter(**trace, customdata=run, hovertemplate=_HOVER)
    for y in (-1.96, 1.96):
        level_line(figure, y, "dot")
    figure.update_xaxes(title="place of the run in the campaign")
    figure.update_yaxes(title="beside the recorded value [tolerance]")
    styled_figure(figure, 380, legend=above())
    return Plot.of(
        "set-points",
        "What was taken out as set-point error",
        "Best linear prediction per run; 95 % should lie between the dotted lines. Many beyond "
        "them, or a trend, is misfit that looks like a set-point error.",
        figure,
        {"run": run, **data},
        5,
    )
