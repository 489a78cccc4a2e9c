"""Maps of what a diagnosed model leaves of the strain: wheel angle over runs."""

import numpy as np

from tirelib.inference.diagnose.document import Assessment
from tirelib.inference.diagnose.left import Left, left_of
from tirelib.report.figures.compare_plot import DEGREES, Plot, limit_of, ticks, turn_map
from tirelib.report.page import unit_name


def strain_maps(found: Assessment) -> list[Plot]:
    """Return the map without the named effects and, where there are some, with them."""
    before = left_of(found.refitted, found.diagnosis.problem.data.points)
    maps = [_map(found, before, "before", "Without the named effects")]
    if found.named:
        maps.append(_map(found, found.left, "after", f"With {', '.join(found.named)}"))
    return maps


def _map(found: Assessment, left: Left, name: str, title: str) -> Plot:
    points, run = found.diagnosis.problem.data.points, found.diagnosis.runs.waves.run
    order = np.lexsort((points.speed, points.pressure, np.round(points.load, -2)))
    data, unit = left.white[order], unit_name(found.after.unit)
    labels = [f"run {run[k]}: {points.load[k]:.0f} N" for k in order]
    figure = turn_map(data, unit, 480, limit=limit_of(found.refitted.white_of(found.refitted.rest)))
    marks = range(0, len(order), max(1, len(order) // 10))
    ticks(figure, marks, [labels[k] for k in marks], "runs, by load [N]")
    columns = zip((f"{label} [{unit}]" for label in labels), data, strict=True)
    return Plot.of(
        f"residual-{name}",
        title,
        "Model minus measurement, with set-point errors weighted down as in the fit. One colour "
        "scale for both maps. Red: the model shows too much tension; blue: too much compression.",
        figure,
        [("wheel angle [deg]", DEGREES), *columns],
        3,
    )
