"""Maps of what a diagnosed model leaves of the strain: wheel angle over runs."""

import numpy as np

from tirelib.inference.diagnose.document import Assessment
from tirelib.inference.diagnose.left import Left, left_of
from tirelib.measured.waveforms import GRID
from tirelib.report.figures.compare_plot import ANGLE_TITLE, Plot, heat, limit_of, styled_figure
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
    data = left.white[order]
    unit = unit_name(found.after.unit)
    limit = limit_of(found.refitted.white_of(found.refitted.rest))
    degrees = np.rad2deg(GRID)
    figure = heat(
        np.round(data, 2),
        np.round(degrees, 2),
        limit,
        unit,
        hovertemplate="%{x:.0f} deg: %{z:.3g} " + unit + "<extra></extra>",
    )
    figure.update_xaxes(title=ANGLE_TITLE, range=[-180, 180], dtick=30)
    marks = list(range(0, len(order), max(1, len(order) // 10)))
    figure.update_yaxes(
        title="runs, by load",
        tickvals=marks,
        showgrid=False,
        ticktext=[f"run {run[order[k]]}: {points.load[order[k]]:.0f} N" for k in marks],
    )
    styled_figure(figure, 480)
    labels = [f"run {run[k]}: {points.load[k]:.0f} N [{unit}]" for k in order]
    rows = [[round(float(a), 3), *np.round(data[:, j], 3).tolist()] for j, a in enumerate(degrees)]
    return Plot(
        f"residual-{name}",
        title,
        "Model minus measurement, with set-point errors weighted down as in the fit. One colour "
        "scale for both maps. Red: the model shows too much tension; blue: too much compression.",
        figure,
        ["wheel angle [deg]", *labels],
        rows,
    )
