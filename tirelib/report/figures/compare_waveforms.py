"""Waveforms of the best, the median and the worst run, measured and by the model."""

import numpy as np
import plotly.graph_objects as go

from tirelib.core.arrays import FloatArray
from tirelib.inference.compare.strain import Comparison
from tirelib.report.figures.compare_heat import DEGREES
from tirelib.report.figures.compare_plot import (
    ANGLE_TITLE,
    Plot,
    noise_band,
    stack_titles,
    stacked,
)
from tirelib.report.style import BLUE, FAINT, INK, RED

HALF = 100.0
"""Angles shown at first, [deg]; the rest by zooming out."""


def waveform_plots(found: Comparison) -> list[Plot]:
    """Return a figure for the best, the median and the worst run (one run: a single figure)."""
    plots: list[Plot] = []
    seen: set[int] = set()
    for name, i in zip(("best", "median", "worst"), found.ranked(), strict=True):
        if i not in seen:
            plots.append(_one(found, i, name))
        seen.add(i)
    return plots


def waveform_axes(figure: go.Figure, edges: FloatArray) -> go.Figure:
    """Return stacked waveforms with their axes, and with the contact's edges [rad] dotted."""
    for edge in np.rad2deg(edges):
        figure.add_vline(x=float(edge), line={"color": FAINT, "width": 1, "dash": "dot"})
    figure.update_xaxes(range=[-HALF, HALF], dtick=20)
    figure.update_yaxes(tickformat=",", row=1, col=1)
    return stack_titles(figure, ANGLE_TITLE, "strain [microstrain]", "microstrain")


def _one(found: Comparison, i: int, name: str) -> Plot:
    c = found.chosen.waves.conditions
    measured = 1e6 * (found.chosen.strain[i] - found.points.shift[i])
    model = 1e6 * found.prediction.strain[i]
    difference = 1e6 * found.difference[i]
    figure = stacked(
        DEGREES,
        [
            {
                "y": measured,
                "name": "measured, set points taken out",
                "line": {"color": BLUE, "width": 2},
            },
            {"y": model, "name": "model", "line": {"color": RED, "width": 2, "dash": "dash"}},
        ],
        [{"y": difference, "name": "model less measured", "line": {"color": INK, "width": 1.5}}],
    )
    noise_band(figure, 1e6 * found.noise.std, row=2, col=1)
    waveform_axes(figure, found.prediction.edges[i])
    rms = 1e6 * found.run_rms[i]
    noise = f", {found.run_rms[i] / found.noise.std:.1f} noise" if found.noise.known else ""
    rows = np.round(np.stack([DEGREES, measured, model, difference], axis=1), 3).tolist()
    return Plot(
        f"waveform-{name}",
        f"{name.capitalize()} run: {found.run[i]} ({c['Fz'][i]:,.0f} N, "
        f"{c['pressure'][i] / 1e5:.2f} bar, {c['speed'][i] * 3.6:.0f} km/h)",
        f"Difference {rms:.0f} microstrain rms{noise}; strain without its mean over the turn, mean "
        "over the gages, tension positive. Dotted: edges of the model's contact. Grey: 95 % of the "
        "noise.",
        figure,
        [
            "wheel angle [deg]",
            "measured, set points taken out [microstrain]",
            "model [microstrain]",
            "model less measured [microstrain]",
        ],
        rows,
    )
