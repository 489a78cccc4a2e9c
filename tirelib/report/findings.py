"""Common parts of the diagnosis pages for strain and forces: scores, dead effects, advice."""

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np
import plotly.graph_objects as go

from tirelib.effects import Effect
from tirelib.report.figures.compare_plot import Plot, styled_figure
from tirelib.report.page import Table
from tirelib.report.style import BLUE, FAINT, RED

LEAST_SHOWN = 0.01
"""Left end of the logarithmic scale of scores."""
_LEVELS = {"alarm": RED, "hint": BLUE, "quiet": FAINT}


class ScoredEffect(Protocol):
    """A candidate effect with its final result."""

    @property
    def effect(self) -> Effect:
        """Return the effect."""

    @property
    def score(self) -> float:
        """Return the misfit that returns without it."""

    @property
    def threshold(self) -> float:
        """Return the largest score among variants that lack no effect."""

    @property
    def level(self) -> str:
        """Return alarm, hint or quiet."""


def score_bars(findings: Sequence[ScoredEffect], alarm: float | None = None) -> Plot:
    """Return the scores over their thresholds.

    Marks are the threshold and, where there is one, the ratio from which on an effect is an alarm.
    """
    names = [f.effect.name for f in findings]
    ratio = [f.score / f.threshold for f in findings]
    figure = go.Figure(
        go.Bar(
            x=np.maximum(np.round(ratio, 4), LEAST_SHOWN),
            y=names,
            orientation="h",
            marker={"color": [_LEVELS[f.level] for f in findings]},
            hovertemplate="%{y}: %{x:.3g}<extra></extra>",
        )
    )
    marks = [(1.0, "threshold")] if alarm is None else [(1.0, "hint"), (alarm, "alarm")]
    note = "Red: alarm; blue: hint; gray: quiet."
    if alarm is not None:
        note += (
            f" An effect beyond {alarm:g} that is not an alarm lies outside its plausible range, "
            "or an exact refit is as good without it."
        )
    else:
        note += " A gray effect beyond the threshold is not needed where what is named is fitted."
    for at, text in marks:
        figure.add_vline(x=at, line={"dash": "dot", "color": FAINT})
        # places of annotations on an axis of powers are powers
        figure.add_annotation(
            x=float(np.log10(at)),
            y=1.0,
            yref="paper",
            yanchor="bottom",
            text=text,
            showarrow=False,
            xanchor="left" if at > 1.0 else "right",
        )
    figure.update_yaxes(autorange="reversed")
    figure.update_xaxes(title="score / threshold", type="log")
    styled_figure(figure, 160 + 22 * len(names), showlegend=False)
    return Plot(
        "scores",
        "Score over threshold",
        note,
        figure,
        ["effect", "score / threshold", "level"],
        [[f.effect.name, r, f.level] for f, r in zip(findings, ratio, strict=True)],
    )


def dead_effects(dead: Mapping[str, str]) -> list[Table]:
    """Return the table of effects that the plan cannot show, if there are any."""
    rows = [[name, reason] for name, reason in dead.items()]
    return [Table("Dead effects", ["effect", "why"], rows, texts=2)] if rows else []


def advice(step: Mapping[str, Any]) -> str:
    """Return the next test of a document in words."""
    text = f"{step['what'][0].upper()}{step['what'][1:]}."
    revived = step["would_revive"]
    if revived:
        text += (
            f" Other runs would show {', '.join(revived)}: see the effects that this plan cannot "
            "show."
        )
    return text
