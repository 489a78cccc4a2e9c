"""Figures of a comparison of forces: agreement, and differences over the conditions."""

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from tirelib.arrays import FloatArray
from tirelib.compare.forces import UNITS, ForceComparison
from tirelib.identify.error_bands import levels
from tirelib.report.figures.compare_plot import Plot, styled_figure
from tirelib.report.figures.compare_trends import SYMBOLS
from tirelib.report.style import BLUE, CATEGORIES, FAINT

_OVER = (("slip_angle", "slip angle [deg] (ISO 8855)", np.rad2deg(1.0)),
         ("slip_ratio", "slip ratio [-] (ISO 8855)", 1.0), ("load", "load [N]", 1.0),
         ("pressure", "inflation pressure [bar]", 1e-5))  # fmt: skip


def force_plots(found: ForceComparison) -> list[Plot]:
    """Return the force over its slip, the agreement, and the difference over each condition."""
    return [_over_slip(found), _agreement(found), _differences(found)]


def _label(found: ForceComparison) -> str:
    return f"{found.quantity} [{UNITS[found.quantity]}] (ISO 8855)"


def _slip(found: ForceComparison) -> tuple[str, str, float]:
    return _OVER[1 if found.quantity == "Fx" else 0]


def _over_slip(found: ForceComparison) -> Plot:
    name, label, factor = _slip(found)
    x = factor * getattr(found.data, name)
    level = levels(found.data.load)
    figure = go.Figure()
    for k in range(int(level.max()) + 1):
        member = np.flatnonzero(level == k)
        member = member[np.argsort(x[member])]
        color = CATEGORIES[k % len(CATEGORIES)]
        load = f"{found.data.load[member].mean():,.0f} N"
        figure.add_scatter(x=x[member], y=found.measured[member], mode="markers",
                           name=f"measured, {load}", marker={"color": color, "size": 7,
                           "symbol": SYMBOLS[k % len(SYMBOLS)]})  # fmt: skip
        figure.add_scatter(x=x[member], y=found.predicted[member], mode="lines",
                           name=f"model, {load}",
                           line={"color": color, "dash": "dash"})  # fmt: skip
    figure.update_xaxes(title=label)
    figure.update_yaxes(title=_label(found))
    styled_figure(figure, 480, legend={"x": 1.02, "y": 1.0})
    rows = _rows(found)
    return Plot("force-slip", f"{found.quantity} over {label.split(' [')[0]}",
                "Points are means over a cell of conditions; lines join the model's points at the "
                "same load.", figure, *rows)  # fmt: skip


def _rows(found: ForceComparison) -> tuple[list[str], list[list[float]]]:
    d, unit = found.data, UNITS[found.quantity]
    table = np.stack(
        [d.load, d.pressure / 1e5, np.rad2deg(d.slip_angle), np.rad2deg(d.camber), d.slip_ratio,
         found.measured, found.predicted, found.difference], axis=1,
    )  # fmt: skip
    names = ["load [N]", "pressure [bar]", "slip angle [deg]", "camber [deg]", "slip ratio [-]"]
    names += [f"{what} [{unit}]" for what in ("measured", "model", "model less measured")]
    return names, np.round(table, 5).tolist()


def _agreement(found: ForceComparison) -> Plot:
    figure = go.Figure()
    ends = [float(min(found.measured.min(), found.predicted.min())),
            float(max(found.measured.max(), found.predicted.max()))]  # fmt: skip
    figure.add_scatter(x=ends, y=ends, mode="lines", name="model = measured",
                       line={"color": FAINT, "width": 1})  # fmt: skip
    figure.add_scatter(x=found.measured, y=found.predicted, mode="markers", name="points",
                       marker={"color": BLUE, "size": 6})  # fmt: skip
    figure.update_xaxes(title=f"measured {_label(found)}")
    figure.update_yaxes(title=f"model {_label(found)}")
    styled_figure(figure, 480, legend={"orientation": "h", "y": 1.1})
    return Plot("force-agreement", "Agreement", "Model against measurement.", figure, *_rows(found))


def _varies(values: FloatArray, name: str) -> bool:
    if name in ("load", "pressure"):
        return int(levels(values).max()) > 0
    return float(np.ptp(values)) > (0.01 if name == "slip_angle" else 0.005)


def _differences(found: ForceComparison) -> Plot:
    used = [row for row in _OVER if _varies(getattr(found.data, row[0]), row[0])]
    used = used or [_slip(found)]
    figure = make_subplots(rows=1, cols=len(used), shared_yaxes=True, horizontal_spacing=0.04)
    for k, (name, label, factor) in enumerate(used, start=1):
        figure.add_scatter(x=factor * getattr(found.data, name), y=found.difference,
                           mode="markers", marker={"color": BLUE, "size": 5}, showlegend=False,
                           row=1, col=k)  # fmt: skip
        figure.update_xaxes(title=label, row=1, col=k)
        figure.add_hline(y=0.0, line={"color": FAINT, "width": 1}, row=1, col=k)
        if np.isfinite(found.noise):
            figure.add_hrect(y0=-1.96 * found.noise, y1=1.96 * found.noise, line_width=0,
                             fillcolor=FAINT, opacity=0.3, row=1, col=k)  # fmt: skip
    figure.update_yaxes(
        title=f"model less measured {found.quantity} [{UNITS[found.quantity]}]", row=1, col=1
    )
    styled_figure(figure, 420)
    return Plot("force-differences", "Difference over the conditions",
                "Grey: 95 % of the noise from repeats, where there are any.", figure,
                *_rows(found))  # fmt: skip
