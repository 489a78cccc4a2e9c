"""Map of a force's residual after the brush fit: slip over conditions."""

import numpy as np
import plotly.graph_objects as go

from tirelib.core.arrays import FloatArray, IntArray
from tirelib.core.units import from_si
from tirelib.inference.diagnose.forces.assess import ForceAssessment
from tirelib.inference.diagnose.forces.fit import ForceFit
from tirelib.inference.identify.error_bands import levels
from tirelib.inference.problems.force_plan import varies
from tirelib.report.figures.compare_plot import DIVERGING, Plot, limit_of, styled_figure

CONDITIONS = (
    ("load", "N", "force"),
    ("pressure", "bar", "pressure"),
    ("camber", "deg", "angle"),
    ("speed", "km/h", "speed"),
)
DIGITS = {"N": "z,.0f", "bar": "z.2f", "deg": "z.1f", "km/h": "z.0f"}
_BINS = 24


def force_maps(found: ForceAssessment) -> list[Plot]:
    """Return the map without the named effects and, where there are some, with them."""
    maps = [_map(found, found.diagnosis.base, "before", "Without the named effects")]
    if found.named:
        maps.append(_map(found, found.final, "after", f"With {', '.join(found.named)}"))
    return maps


def _map(assessment: ForceAssessment, model: ForceFit, name: str, title: str) -> Plot:
    """Return the mean of model less measured by slip and by set point of the other conditions."""
    case = assessment.case
    at, unit = case.problem.bench.conditions, case.unit
    slip = at.slip_ratio if case.quantity == "Fx" else np.rad2deg(at.slip_angle)
    edges = np.linspace(slip.min(), slip.max() + 1e-9, _BINS + 1)
    labels, group = _rows(assessment)
    data = case.factor * (model.predicted - case.problem.measured)
    first = case.factor * (assessment.diagnosis.base.predicted - case.problem.measured)
    cells = _means(data, np.digitize(slip, edges) - 1, group, len(labels))
    limit = limit_of(_means(first, np.digitize(slip, edges) - 1, group, len(labels)))
    middle = 0.5 * (edges[1:] + edges[:-1])
    figure = go.Figure(
        go.Heatmap(
            z=np.round(cells, 3),
            x=np.round(middle, 4),
            y=list(range(len(labels))),
            zmin=-limit,
            zmax=limit,
            colorscale=DIVERGING,
            customdata=[[label] * _BINS for label in labels],
            hovertemplate="%{customdata}, slip %{x}: %{z:.3g} " + unit + "<extra></extra>",
            colorbar={"title": {"text": f"model less<br>measured<br>[{unit}]"}},
        )
    )
    words = "slip ratio" if case.quantity == "Fx" else "slip angle [deg]"
    figure.update_xaxes(title=words)
    marks = list(range(0, len(labels), max(1, len(labels) // 14)))
    figure.update_yaxes(tickvals=marks, ticktext=[labels[k] for k in marks], showgrid=False)
    styled_figure(figure, 220 + 14 * min(len(labels), 30))
    rows = [[labels[k], *np.round(row, 4).tolist()] for k, row in enumerate(cells)]
    return Plot(
        f"residual-{name}",
        title,
        "Mean of model less measured; one colour scale for both maps. White: none, or not "
        "measured.",
        figure,
        ["set point", *[f"{x:.4g} {words}" for x in middle]],
        rows,
    )


def _rows(assessment: ForceAssessment) -> tuple[list[str], IntArray]:
    """Return labels of set points and the set point of each point, by load first."""
    at = assessment.case.problem.bench.conditions
    keys: list[IntArray] = []
    shown: list[tuple[FloatArray, str]] = []
    for name, unit, dimension in CONDITIONS:
        if name != "load" and not varies(at, name):
            continue
        values = np.abs(getattr(at, name))
        if name == "camber":
            values = getattr(at, name)
            keys.append(np.round(values / np.deg2rad(0.5)).astype(np.int64))
        else:
            keys.append(levels(values))
        shown.append((np.asarray(from_si(values, unit, dimension)), unit))
    _, number = np.unique(np.stack(keys), axis=1, return_inverse=True)
    group = np.asarray(number, dtype=np.int64).ravel()
    labels = []
    for k in range(int(group.max()) + 1):
        means = [(float(v[group == k].mean()), unit) for v, unit in shown]
        labels.append(", ".join(f"{mean:{DIGITS[unit]}} {unit}" for mean, unit in means))
    return labels, group


def _means(data: FloatArray, column: IntArray, group: IntArray, rows: int) -> FloatArray:
    place = group * _BINS + np.clip(column, 0, _BINS - 1)
    count = np.bincount(place, minlength=rows * _BINS)
    total = np.bincount(place, data, minlength=rows * _BINS)
    with np.errstate(invalid="ignore"):
        mean: FloatArray = (total / np.where(count > 0, count, np.nan)).reshape(rows, _BINS)
    return mean
