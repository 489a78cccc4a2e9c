"""Waveforms of the best, the median and the worst run, measured and by the model."""

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from tirelib.compare.strain import Comparison
from tirelib.report.figures.compare_heat import DEGREES
from tirelib.report.figures.compare_plot import ANGLE_TITLE, Plot, styled_figure
from tirelib.report.style import BLUE, FAINT, RED

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


def _one(found: Comparison, i: int, name: str) -> Plot:
    c = found.chosen.waves.conditions
    measured = 1e6 * (found.chosen.strain[i] - found.points.shift[i])
    model = 1e6 * found.prediction.strain[i]
    difference = 1e6 * found.difference[i]
    figure = make_subplots(
        rows=2, cols=1, shared_xaxes=True, row_heights=[0.68, 0.32], vertical_spacing=0.06
    )
    figure.add_scatter(
        x=DEGREES,
        y=measured,
        name="measured, set points taken out",
        line={"color": BLUE, "width": 2},
        row=1,
        col=1,
    )
    figure.add_scatter(
        x=DEGREES,
        y=model,
        name="model",
        line={"color": RED, "width": 2, "dash": "dash"},
        row=1,
        col=1,
    )
    if found.noise.known:
        band = 1.96e6 * found.noise.std
        figure.add_trace(
            go.Scatter(
                x=[DEGREES[0], DEGREES[-1], DEGREES[-1], DEGREES[0]],
                y=[band, band, -band, -band],
                fill="toself",
                mode="lines",
                fillcolor="rgba(93,107,122,0.35)",
                line={"width": 0},
                name="95 % of the noise",
                hoverinfo="skip",
            ),
            row=2,
            col=1,
        )
    figure.add_scatter(
        x=DEGREES,
        y=difference,
        name="model less measured",
        line={"color": "#1c2530", "width": 1.5},
        row=2,
        col=1,
    )
    for edge in np.rad2deg(found.prediction.edges[i]):
        figure.add_vline(x=float(edge), line={"color": FAINT, "width": 1, "dash": "dot"})
    figure.update_xaxes(range=[-HALF, HALF], dtick=20)
    figure.update_xaxes(title=ANGLE_TITLE, row=2, col=1)
    figure.update_yaxes(title="strain [microstrain]", tickformat=",", row=1, col=1)
    figure.update_yaxes(title="difference<br>[microstrain]", row=2, col=1)
    styled_figure(figure, 520, legend={"orientation": "h", "y": 1.1, "x": 0.0})
    rms = 1e6 * found.run_rms[i]
    noise = f", {found.run_rms[i] / found.noise.std:.1f} noise" if found.noise.known else ""
    rows = np.round(np.stack([DEGREES, measured, model, difference], axis=1), 3).tolist()
    return Plot(
        f"waveform-{name}",
        f"{name.capitalize()} run: {found.run[i]} ({c['Fz'][i]:,.0f} N, "
        f"{c['pressure'][i] / 1e5:.2f} bar, {c['speed'][i] * 3.6:.0f} km/h)",
        f"Difference {rms:.0f} microstrain rms{noise}; strain without its mean over the turn, mean "
        "over the gages, tension positive. Dotted: edges of the model's contact.",
        figure,
        [
            "wheel angle [deg]",
            "measured, set points taken out [microstrain]",
            "model [microstrain]",
            "model less measured [microstrain]",
        ],
        rows,
    )
