"""One look for all figures: colours for colour-blind readers too, labels, legends, files.

Categories use the palette of Okabe and Ito and a marker of their own; ordered quantities (loads)
use viridis without its palest end. Legends stand outside the axes, so they never cover data.
"""

from collections.abc import Callable, Iterable, Sequence
from functools import wraps
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from tirelib.core.version import WRITER

AXES_NAME = "ISO 8855"
"""Axis system of every plot and page."""
INK, FAINT, RULE = "#1c2530", "#5d6b7a", "#d5dbe1"
BLUE, ORANGE, GREEN, RED = "#0072b2", "#e69f00", "#009e73", "#d55e00"
PURPLE, SKY, BLACK = "#cc79a7", "#56b4e9", "#000000"
CATEGORIES = (BLUE, ORANGE, GREEN, PURPLE, RED, SKY, BLACK)
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<", ">", "h")
STYLE: dict[Any, Any] = {
    "figure.facecolor": "white",
    "axes.facecolor": "white",
    "font.family": "DejaVu Sans",
    "font.size": 10.0,
    "text.color": INK,
    "axes.labelcolor": INK,
    "axes.edgecolor": FAINT,
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 10.5,
    "axes.titlelocation": "left",
    "axes.titlepad": 8.0,
    "axes.axisbelow": True,
    "axes.grid": True,
    "grid.color": RULE,
    "grid.linewidth": 0.7,
    "xtick.color": FAINT,
    "ytick.color": FAINT,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "legend.frameon": False,
    "legend.fontsize": 9.5,
    "lines.linewidth": 1.7,
    "lines.markersize": 5.5,
    "svg.hashsalt": "tirelib",
    "svg.fonttype": "path",
}
AGREEMENT = "estimated = measured"
RESOLUTION = 110
"""Dots per inch of PNG files."""

P = ParamSpec("P")
T = TypeVar("T")


def styled(draw: Callable[P, T]) -> Callable[P, T]:
    """Draw in the common style without touching the caller's settings."""

    @wraps(draw)
    def inner(*args: P.args, **kwargs: P.kwargs) -> T:
        with mpl.rc_context(STYLE):
            return draw(*args, **kwargs)

    return inner


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure of a size in inches, with an Agg canvas and no pyplot state."""
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def label(name: str, unit: str, *, signed: bool = False) -> str:
    """Return an axis label: quantity, unit and, where a sign matters, the axis system.

    Examples
    --------
    >>> label("slip angle", "deg", signed=True)
    'slip angle [deg] (ISO 8855)'
    """
    return f"{name} [{unit}]" + (f" ({AXES_NAME})" if signed else "")


def sequence(n: int) -> list[str]:
    """Return n colours for an ordered quantity, from dark to light."""
    return [to_hex(mpl.colormaps["viridis"](x)) for x in np.linspace(0.0, 0.86, max(n, 1))]


def zero_line(axes: Axes) -> None:
    """Draw the line y = 0 behind the data."""
    axes.axhline(0.0, color=FAINT, linewidth=0.9, zorder=1.5)


def signed_degrees(value: float) -> str:
    """Return an angle in whole degrees with its sign; zero has none.

    Examples
    --------
    >>> signed_degrees(3.98), signed_degrees(-0.02)
    ('+4 deg', '0 deg')
    """
    whole = round(value)
    return f"{whole:+d} deg" if whole else "0 deg"


def diagonal(axes: Axes, *values: Iterable[float]) -> None:
    """Draw the line of perfect agreement over the range of the values, labelled."""
    every = np.concatenate([np.asarray(list(v), dtype=np.float64).ravel() for v in values])
    every = every[np.isfinite(every)]
    ends = (float(every.min()), float(every.max())) if every.size else (0.0, 1.0)
    axes.plot(ends, ends, color=FAINT, linewidth=1.0, zorder=1.5, label=AGREEMENT)


def legend_below(figure: Figure, panels: Sequence[Axes], *, columns: int = 6) -> None:
    """Gather the legend entries of some axes, each once, under the figure."""
    found: dict[str, Artist] = {}
    for axes in panels:
        for handle, text in zip(*axes.get_legend_handles_labels(), strict=True):
            found.setdefault(text, handle)
    if AGREEMENT in found:
        found[AGREEMENT] = found.pop(AGREEMENT)
    for ncols in range(min(columns, max(len(found), 1)), 0, -1):
        legend = figure.legend(
            list(found.values()), list(found), loc="outside lower center", ncols=ncols
        )
        if ncols == 1 or legend.get_window_extent().width < 0.98 * figure.bbox.width:
            return
        legend.remove()


def save(figure: Figure, folder: Path, name: str) -> str:
    """Write PNG and SVG files, make the folder if needed, and return the PNG's name.

    Each file is drawn once; `Figure.savefig` would go through all artists twice for each.
    """
    folder.mkdir(parents=True, exist_ok=True)
    canvas, engine, dots = figure.canvas, figure.get_layout_engine(), figure.dpi
    with mpl.rc_context(STYLE):
        figure.dpi = RESOLUTION
        FigureCanvasAgg(figure).print_png(folder / f"{name}.png", metadata={"Software": WRITER})
        figure.dpi = dots  # of what an SVG file holds as pixels
        figure.set_layout_engine("none")  # the places are found; do not look for them twice
        FigureCanvasSVG(figure).print_svg(
            folder / f"{name}.svg", metadata={"Date": None, "Creator": WRITER}
        )
        figure.set_layout_engine(engine)
    figure.dpi = dots
    figure.set_canvas(canvas)
    return f"{name}.png"
