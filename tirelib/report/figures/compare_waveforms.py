"""Waveforms of the best, the median and the worst run: measured, and by one model or two."""

from collections.abc import Iterator, Sequence

import numpy as np
import plotly.graph_objects as go

from tirelib.core.arrays import FloatArray
from tirelib.inference.compare.strain import Comparison
from tirelib.report.figures.compare_heat import place_of
from tirelib.report.figures.compare_plot import ANGLE_TITLE, DEGREES, Plot, Trace, line, stacked
from tirelib.report.style import BLUE, FAINT, INK, RED

HALF = 100.0
"""Angles shown at first, [deg]; the rest by zooming out."""
_UNIT = "microstrain"


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
