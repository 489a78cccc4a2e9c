"""Maps of what a diagnosed model leaves: of strain over the turn, of a force over its slip."""

from dataclasses import replace

import numpy as np

from tirelib.core.arrays import FloatArray, IntArray
from tirelib.core.quantities import QUANTITIES
from tirelib.inference.compare.force_model import slip_of
from tirelib.inference.diagnose.assess import Assessment, ForceAssessment
from tirelib.inference.diagnose.forces.models import ForceFit
from tirelib.inference.diagnose.left import Left, left_of
from tirelib.inference.identify.error_bands import levels
from tirelib.inference.problems.force_plan import varies
from tirelib.report.figures.compare_plot import (
    Plot,
    cell_means,
    heat,
    limit_of,
    ticks,
    turn_map,
)
from tirelib.report.page import unit_name

DIGITS = {"load": ",.0f", "pressure": ".2f", "camber": ".1f", "speed": ".0f"}
"""How the set point of a condition is said."""
_BINS = 24


def maps(found: Assessment | ForceAssessment) -> list[Plot]:
    """Return the map without the named effects and, where there are some, with them."""
    titles = ["Without the named effects"]
    if found.named:
        titles.append(f"With {', '.join(found.named)}")
    if isinstance(found, ForceAssessment):
        fits = (found.diagnosis.base, found.final)
        drawn = [_slips(found, fit, title) for fit, title in zip(fits, titles, strict=False)]
    else:
        first = left_of(found.refitted, found.diagnosis.problem.data.points)
        pairs = zip((first, found.left), titles, strict=False)
        drawn = [_turns(found, left, title) for left, title in pairs]
    names = ("residual-before", "residual-after")
    return [replace(plot, name=name) for plot, name in zip(drawn, names, strict=False)]


def _turns(found: Assessment, left: Left, title: str) -> Plot:
    points, run = found.diagnosis.problem.data.points, found.diagnosis.runs.waves.run
    order = np.lexsort((points.speed, points.pressure, np.round(points.load, -2)))
    data, unit = left.white[order], unit_name(found.after.unit)
    labels = [f"run {run[k]}: {points.load[k]:.0f} N" for k in order]
    marks = range(0, len(order), max(1, len(order) // 10))
    return turn_map(
        (
            "residual",
            title,
            "Model minus measurement, with set-point errors weighted down as in the fit. One "
            "colour scale for both maps. Red: the model shows too much tension; blue: too much "
            "compression.",
        ),
        data,
        labels,
        (marks, [labels[k] for k in marks], "runs, by load [N]"),
        unit,
        480,
        limit_of(found.refitted.white_of(found.refitted.rest)),
    )


def _slips(assessment: ForceAssessment, model: ForceFit, title: str) -> Plot:
    """Return the mean of model less measured by slip and by set point of the other conditions."""
    case = assessment.case
    at, unit = case.bench.conditions, case.unit
    condition = slip_of(case.quantity)
    slip, words = QUANTITIES[condition].told(getattr(at, condition)), QUANTITIES[condition].heading
    edges = np.linspace(slip.min(), slip.max() + 1e-9, _BINS + 1)
    middle, column = 0.5 * (edges[1:] + edges[:-1]), np.digitize(slip, edges) - 1
    labels, group = _rows(assessment)
    column = np.clip(column, 0, _BINS - 1)
    cells, first = (
        cell_means(-case.factor * fit.rest, group, column, (len(labels), _BINS))
        for fit in (model, assessment.diagnosis.base)
    )
    figure = heat(
        cells,
        middle,
        words,
        unit,
        220 + 14 * min(len(labels), 30),
        limit_of(first),
        customdata=[[label] * _BINS for label in labels],
        hovertemplate="%{customdata}, slip %{x}: %{z:.3g} " + unit + "<extra></extra>",
    )
    marks = range(0, len(labels), max(1, len(labels) // 14))
    ticks(figure, marks, [labels[k] for k in marks])
    columns = zip((f"{x:.4g} {words}" for x in middle), np.round(cells, 4).T, strict=True)
    return Plot.of(
        "residual",
        title,
        "Mean of model less measured; one colour scale for both maps. White: none, or not "
        "measured.",
        figure,
        {"set point": labels, **dict(columns)},
    )


def _rows(assessment: ForceAssessment) -> tuple[list[str], IntArray]:
    """Return labels of set points and the set point of each point, by load first."""
    at = assessment.case.bench.conditions
    keys: list[IntArray] = []
    shown: list[tuple[FloatArray, str]] = []
    for name in DIGITS:
        if name != "load" and not varies(at, name):
            continue
        values = getattr(at, name)
        if name == "camber":
            keys.append(np.round(values / np.deg2rad(0.5)).astype(np.int64))
        else:
            values = np.abs(values)
            keys.append(levels(values))
        shown.append((np.asarray(QUANTITIES[name].told(values)), name))
    _, number = np.unique(np.stack(keys), axis=1, return_inverse=True)
    group = np.asarray(number, dtype=np.int64).ravel()
    said = [
        [f"{v[group == k].mean():{DIGITS[n]}} {QUANTITIES[n].unit}" for v, n in shown]
        for k in range(int(group.max()) + 1)
    ]
    return [", ".join(parts) for parts in said], group
