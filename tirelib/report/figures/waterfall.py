"""The error's fall, step by step: fitted and held out, with the floor."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import plotly.graph_objects as go

from tirelib.inference.extend.document import waterfall as fall_of
from tirelib.report.figures.compare_plot import Plot, styled_figure
from tirelib.report.page import unit_name
from tirelib.report.style import BLUE, FAINT, RED


class Step(NamedTuple):
    """A model on the way: label, error of its fit, error on held-out points (NaN if unknown)."""

    label: str
    error: float
    held_out: float


def waterfall(
    steps: Sequence[Step],
    unit: str,
    floor: float,
    name: str = "waterfall",
    title: str = "The model's history",
) -> Plot:
    """Return bars of the error after each step.

    Parameters
    ----------
    unit : str
        Unit of the errors.
    floor : float
        Error that structure leaves without a missing effect; NaN if unknown.
    """
    labels = [f"{k}: {step.label}" if k else step.label for k, step in enumerate(steps)]
    figure = go.Figure()
    errors, held = [step.error for step in steps], [step.held_out for step in steps]
    for values, what, colour in ((errors, "fitted", BLUE), (held, "held out", RED)):
        if np.isfinite(values).any():
            figure.add_bar(
                x=labels,
                y=[float(value) if np.isfinite(value) else None for value in values],
                name=what,
                marker={"color": colour},
                text=[f"{value:.3g}" if np.isfinite(value) else "" for value in values],
                textposition="outside",
                cliponaxis=False,
            )
    if np.isfinite(floor):
        figure.add_hline(
            y=floor,
            line={"dash": "dot", "color": FAINT},
            annotation_text="floor",
            annotation_position="top left",
        )
    figure.update_yaxes(title=f"error [{unit}]", rangemode="tozero")
    figure.update_xaxes(title="effect added (-: removed)")
    styled_figure(figure, 380, barmode="group")
    return Plot.of(
        name,
        title,
        "Rms error after each step, fitted anew each time; held out: on points that took no part "
        "in the fit.",
        figure,
        {"step": labels, f"error [{unit}]": errors, f"held-out error [{unit}]": held},
    )


def waterfall_of(history: Sequence[Mapping[str, Any]], quantity: str) -> Plot | None:
    """Return the fall across a model's history for one quantity, or None without entries."""
    rows = fall_of(history, quantity)
    if not rows:
        return None
    unit = rows[0]["unit"]
    last = [e for e in history if e.get("quantity", "strain") == quantity][-1]
    floor = last.get("floor" if unit == "noise" else f"floor_{unit}")
    steps = [
        Step(_label(row["action"], row["effect"]), _size(row["error"]), _size(row["heldout_error"]))
        for row in rows
    ]
    name, title = f"history-{quantity}", f"The model's history, {quantity}"
    return waterfall(steps, unit_name(unit), _size(floor), name, title)


def _label(action: str, effect: str | None) -> str:
    return "before" if effect is None else f"{'-' if action == 'remove' else ''}{effect}"


def _size(value: float | None) -> float:
    return float("nan") if value is None else float(value)
