"""Self-contained pages: tables, figures, and the templates that hold them."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from jinja2 import ChoiceLoader, Environment, FileSystemLoader, PackageLoader, StrictUndefined
from matplotlib.figure import Figure

from tirelib.core.errors import TirelibError
from tirelib.core.version import __version__
from tirelib.report.style import AXES_NAME, save

if TYPE_CHECKING:
    from tirelib.report.figures.compare_plot import Plot

DASH = "\N{EN DASH}"
MINUS = "\N{MINUS SIGN}"
T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Table:
    """A table of finished cells; the first `texts` columns are words, the rest numbers."""

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    texts: int = 1
    note: str = ""
    folded: bool = False

    @classmethod
    def of(
        cls,
        title: str,
        items: Iterable[T],
        columns: Mapping[str, Callable[[T], str]],
        *,
        texts: int = 1,
        note: str = "",
        folded: bool = False,
    ) -> "Table":
        """Return a table with a row for each item.

        Parameters
        ----------
        columns : mapping
            The heading of each column, and what its cell says of an item.
        """
        rows = [[cell(item) for cell in columns.values()] for item in items]
        return cls(title, list(columns), rows, texts, note, folded)

    @classmethod
    def listed(cls, title: str, values: Mapping[str, str], note: str = "") -> "Table":
        """Return a table of one value each, by what it is."""
        return cls(title, ["", "value"], [[*row] for row in values.items()], note=note)


@dataclass(frozen=True, slots=True)
class Drawing:
    """A figure still to be drawn: file name, title, what to see in it, and how to draw it."""

    name: str
    title: str
    caption: str
    draw: Callable[[], Figure]


@dataclass(frozen=True, slots=True)
class Picture:
    """A figure on disk; `reason` says why there is none."""

    name: str
    title: str
    caption: str
    file: str = ""
    vector: str = ""
    reason: str = ""


@dataclass(frozen=True, slots=True)
class Part:
    """A part of a page; a plot is interactive, a picture is a file."""

    title: str
    anchor: str
    text: str = ""
    tables: Sequence[Table] = ()
    plots: Sequence["Plot"] = ()
    sources: Sequence[str] = ()
    pictures: Sequence[Picture] = ()


def number(value: float | None, digits: int = 4) -> str:
    """Return a number with this many significant digits as text; a dash for NaN.

    Examples
    --------
    >>> number(1234.567), number(0.000012345, 3), number(float("nan")), number(-2.0)
    ('1235', '1.23e-05', '\N{EN DASH}', '\N{MINUS SIGN}2')
    """
    if value is None or not math.isfinite(value):
        return DASH
    size = abs(value)
    if value == 0.0:
        return "0"
    if size < 1e-4 or size >= 1e7:
        text = f"{value:.{digits - 1}e}"
        return text.replace("-", MINUS, 1) if value < 0 else text
    decimals = max(0, digits - 1 - math.floor(math.log10(size)))
    text = f"{value:.{decimals}f}"
    if "." in text:
        text = text.rstrip("0").rstrip(".")
    return text.replace("-", MINUS)


def numbers(values: Iterable[float], digits: int = 3) -> str:
    """Return numbers with this many significant digits, separated by commas."""
    return ", ".join(number(float(value), digits) for value in values)


def unit_name(unit: str) -> str:
    """Return the unit of a document as sentences and titles say it."""
    return {"ustrain": "microstrain"}.get(unit, unit)


def p_value(value: float) -> str:
    """Return a p-value in the form of statistics tables.

    Examples
    --------
    >>> p_value(0.0004), p_value(0.0123)
    ('< 0.001', '0.012')
    """
    return "< 0.001" if value < 0.001 else f"{value:.3f}"


def draw_all(folder: Path, drawings: Sequence[Drawing]) -> list[Picture]:
    """Draw figures into a folder; one that the data cannot inform is kept with the reason."""
    pictures = []
    for drawing in drawings:
        said = drawing.name, drawing.title, drawing.caption
        try:
            file = save(drawing.draw(), folder / "figures", drawing.name)
        except TirelibError as error:
            pictures.append(Picture(*said, reason=str(error)))
        else:
            pictures.append(Picture(*said, f"figures/{file}", f"figures/{drawing.name}.svg"))
    return pictures


def filled(template: str | Path, **content: Any) -> str:
    """Return the text of a template with its values filled in.

    Parameters
    ----------
    template : str or Path
        The name of a template of this package, or the path of a template that extends one of them.
    **content
        Values that the template names; those of base.html are title, summary and sections.
    """
    template = Path(template)
    environment = Environment(
        loader=ChoiceLoader(
            [FileSystemLoader(template.parent), PackageLoader("tirelib.report", "templates")]
        ),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    known = {"axes": AXES_NAME, "version": __version__, "summary": "", **content}
    return environment.get_template(template.name).render(known)


def write_page(folder: Path, template: str | Path, **content: Any) -> Path:
    """Fill a template and write it as ``index.html`` of the folder; values as of `filled`."""
    text = filled(template, **content)
    folder.mkdir(parents=True, exist_ok=True)
    page = folder / "index.html"
    page.write_text(text, encoding="utf-8")
    return page
