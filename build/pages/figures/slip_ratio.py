"""Braking and driving: balance of the compressive peaks, and slip ratio (Fig. 4-17, 4-18)."""

import numpy as np
from matplotlib.figure import Figure

from pages.figures.strain import figure_4_17_turns
from pages.turns import TypicalTurns
from tirelib.estimators.estimate import Estimates
from tirelib.estimators.gage_chains import Rolling
from tirelib.estimators.regressors import compute_regressors
from tirelib.measured.observations import Observations
from tirelib.report.accuracy import WIDTH, accuracy, compare
from tirelib.report.figures.regression import RESIDUAL
from tirelib.report.style import (
    BLUE,
    FAINT,
    GREEN,
    ORANGE,
    RED,
    diagonal,
    label,
    legend_below,
    new_figure,
    styled,
    zero_line,
)

SLIP = label("slip ratio", "%", signed=True)
TICKS = (-100, -50, -20, -10, -5, -2, -1, 0, 1, 2, 5, 10, 20, 50, 100)
ROLLING = {"braking": (RED, "v"), "free": (GREEN, "o"), "driving": (BLUE, "^")}


@styled
def figure_4_17(turns: TypicalTurns, observations: Observations, rolling: Rolling) -> Figure:
    """Strain under braking, driving and free rolling with CP1, CP2; their balance over slip ratio.

    Source: dissertation, Fig. 4-17.
    """
    figure = new_figure(12.0, 8.2)
    halves = figure.subfigures(2, 1, squeeze=False, height_ratios=(1, 1.05))
    upper, lower = halves[0, 0], halves[1, 0]
    row = list(upper.subplots(1, len(turns.labels), sharey=True, squeeze=False)[0])
    figure_4_17_turns(turns, row)
    axes = lower.subplots()
    features = observations.features
    traction = compute_regressors(features, range(features.lateral.size))["traction"]
    kappa = 100.0 * observations.truth["slip_ratio"]
    good = observations.usable & np.isfinite(traction) & np.isfinite(kappa)
    words = np.array(rolling.classify(traction))
    for word, (colour, marker) in ROLLING.items():
        rows = good & (words == word)
        if rows.any():
            axes.scatter(
                kappa[rows],
                traction[rows],
                s=24,
                color=colour,
                marker=marker,
                linewidths=0.3,
                edgecolors="white",
                zorder=3,
                label=f"turn read as {word}",
            )
    low, high = rolling.centre - rolling.threshold, rolling.centre + rolling.threshold
    axes.axhspan(low, high, color=ORANGE, alpha=0.18, linewidth=0, label="read as free rolling")
    axes.axvline(0.0, color=FAINT, linewidth=0.9, zorder=1.5)
    axes.set_xscale("symlog", linthresh=2.0, linscale=0.8)
    ticks = [tick for tick in TICKS if kappa[good].min() <= tick <= kappa[good].max()]
    axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.minorticks_off()
    axes.set_xlabel("measured " + SLIP + ", braking negative")
    axes.set_ylabel(label("(CP1 \N{MINUS SIGN} CP2) / TP", "-"))
    axes.set_title("Balance of the two compressive peaks, a point is a turn")
    handles, texts = row[0].get_legend_handles_labels()
    more, others = axes.get_legend_handles_labels()
    known = dict(zip(texts + others, handles + more, strict=True))
    figure.legend(list(known.values()), list(known), loc="outside lower center", ncols=4)
    return figure


@styled
def figure_4_18(observations: Observations, estimates: Estimates) -> Figure:
    """Estimated against measured slip ratio with residuals and 95 % intervals, turn by turn.

    Source: dissertation, Fig. 4-18.
    """
    compared = compare(observations, estimates, "kappa")
    row = accuracy(compared)
    figure = new_figure(11.0, 4.8)
    left, right = figure.subplots(1, 2)
    words = np.array(estimates.rolling)[_rows(observations, estimates)]
    error = compared.measured - compared.estimated
    for word, (colour, marker) in ROLLING.items():
        here = words == word
        if not here.any():
            continue
        left.scatter(
            compared.measured[here],
            compared.estimated[here],
            s=24,
            color=colour,
            marker=marker,
            edgecolors="white",
            linewidths=0.3,
            zorder=3,
            label=f"turn read as {word}",
        )
        right.errorbar(
            compared.measured[here],
            error[here],
            WIDTH * compared.std[here],
            fmt=marker,
            color=colour,
            markersize=4.0,
            elinewidth=0.8,
            alpha=0.8,
        )
    diagonal(left, compared.measured, compared.estimated)
    left.set_title(f"Slip ratio from strain and speed: rms {row.rmse:.3f} % over {row.runs} runs")
    left.set_xlabel("measured " + SLIP)
    left.set_ylabel("estimated " + SLIP)
    right.set_title(
        f"Residuals with 95 % intervals, which hold {100 * row.coverage:.0f} % of the turns"
    )
    right.set_xlabel("measured " + SLIP)
    right.set_ylabel(label(RESIDUAL, "% slip"))
    zero_line(right)
    legend_below(figure, [left])
    return figure


def _rows(
    observations: Observations, estimates: Estimates
) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Rows that `compare` keeps."""
    truth = observations.truth["slip_ratio"]
    return np.asarray(
        estimates.valid["kappa"] & np.isfinite(truth) & np.isfinite(estimates.value["kappa"])
    )
