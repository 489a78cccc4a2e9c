"""Self-contained pages of tables, pictures and plots, and the same in Markdown."""

import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Required, TypedDict, TypeVar, Unpack

from jinja2 import ChoiceLoader, Environment, FileSystemLoader, PackageLoader, StrictUndefined
from markupsafe import Markup
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
class Picture:
    """A figure: file name, title, what to see in it, and how to draw it.

    Once it is drawn it has files, the PNG and the SVG that it leads to; or `reason` says why not.
    """

    name: str
    title: str
    caption: str
    draw: Callable[[], Figure] | None = None
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


Columns = Mapping[str, Callable[[Mapping[str, Any]], str]]
"""Headings of a table of a document's entries, and what each cell says of an entry."""
INTERVAL: Columns = {
    "95 % from": lambda entry: number(entry.get("low")),
    "to": lambda entry: number(entry.get("high")),
}
"""The ends of a 95 % interval."""
TWINS: Columns = {
    "twins (angle)": lambda entry: ", ".join(
        f"{twin['effect']} {twin['angle_deg']:.0f}\u00b0" for twin in entry["twins"]
    )
}
"""The effects whose signatures are like that of an effect."""


def p_value(value: float) -> str:
    """Return a p-value in the form of statistics tables.

    Examples
    --------
    >>> p_value(0.0004), p_value(0.0123)
    ('< 0.001', '0.012')
    """
    return "< 0.001" if value < 0.001 else f"{value:.3f}"


def draw_all(folder: Path, pictures: Iterable[Picture]) -> list[Picture]:
    """Draw figures into a folder; one that the data cannot inform is kept with the reason."""
    drawn = []
    for each in pictures:
        try:
            file = "" if each.draw is None else save(each.draw(), folder / "figures", each.name)
        except TirelibError as error:
            drawn.append(replace(each, reason=str(error)))
        else:
            vector = f"figures/{each.name}.svg"
            drawn.append(replace(each, file=f"figures/{file}", vector=vector) if file else each)
    return drawn


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


def write_page(
    folder: Path, template: str | Path, name: str = "index.html", **content: Any
) -> Path:
    """Fill a template and write it into the folder, made if needed; values as of `filled`."""
    text = filled(template, **content)
    folder.mkdir(parents=True, exist_ok=True)
    page = folder / name
    page.write_text(text, encoding="utf-8")
    return page


class Head(TypedDict, total=False):
    """What stands above the parts of a page.

    `messages` are what a reader has to know of the data; the result is the sentence `answer` or,
    instead, a few `lines` (title, sentence); `sentences` say where the model fails, and
    `sentence_note` what holds for them; `links` are other pages (title, address), and `commands`
    the command lines that made it.
    """

    title: Required[str]
    summary: str
    messages: Sequence[str]
    answer: str
    lines: Sequence[tuple[str, str]]
    sentences: Sequence[str]
    sentence_note: str
    links: Sequence[tuple[str, str]]
    commands: Sequence[str]


def write_parts_page(
    folder: Path,
    name: str,
    parts: Sequence[Part],
    *,
    words: str | None = None,
    **head: Unpack[Head],
) -> tuple[Path, Path]:
    """Write ``<name>.html`` and a Markdown file into a folder; return their paths.

    Parameters
    ----------
    words : str, optional
        Name of the Markdown file; by default that of the page.
    **head
        What of `Head` there is.

    Raises
    ------
    OSError
        If the folder cannot be written.
    """
    from plotly.offline import get_plotlyjs  # slow to import

    told: dict[str, Any] = dict.fromkeys(Head.__annotations__, "") | head  # "" lists nothing
    figures = {plot.name: plot.figure.to_json() for part in parts for plot in part.plots}
    listed = ",".join(f"{json.dumps(name)}:{figure}" for name, figure in figures.items())
    scripts = {
        "plotly": Markup(get_plotlyjs()),
        "figures": Markup("{" + listed.replace("</", "<\\/") + "}"),
    }
    page = write_page(folder, "page.html", f"{name}.html", sections=parts, **scripts, **told)
    lines = [f"- **{what}**: {said}" for what, said in told["lines"]] or [f"**{told['answer']}**"]
    out = [f"# {told['title']}", "", told["summary"], "", *lines, ""]
    out += [f"> {message}\n" for message in told["messages"]]
    if told["sentences"]:
        out += ["## Lack of fit", "", *(f"- {said}" for said in told["sentences"])]
        out += ["", told["sentence_note"], ""]
    if told["links"]:
        out += [*(f"- [{what}]({address})" for what, address in told["links"]), ""]
    if told["commands"]:
        out += ["```", *told["commands"], "```", ""]
    text = folder / f"{words or name}.md"
    text.write_text("\n".join([*out, *markdown_parts(parts)]).rstrip() + "\n", encoding="utf-8")
    return page, text


def markdown_parts(parts: Sequence[Part]) -> list[str]:
    """Return words, tables and sources of a page's parts as lines of Markdown."""
    lines: list[str] = []
    for part in parts:
        if not (part.text or part.tables or part.sources):
            continue
        lines += [f"## {part.title}", ""]
        if part.text:
            lines += [part.text, ""]
        for table in part.tables:
            lines += markdown_table(table)
        lines += [f"- {source}" for source in part.sources]
        lines.append("")
    return lines


def markdown_table(table: Table) -> list[str]:
    """Return a table as lines of Markdown."""
    head = "| " + " | ".join(table.columns) + " |"
    rule = "|" + "|".join("---" if k < table.texts else "---:" for k in range(len(table.columns)))
    rows = [
        "| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in table.rows
    ]
    note = [table.note, ""] if table.note else []
    return [f"**{table.title}**", "", head, rule + "|", *rows, "", *note]
