"""Self-contained pages of tables, pictures and plots, and the same in Markdown."""

import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

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


def write_parts_page(
    folder: Path,
    name: str,
    parts: Sequence[Part],
    *,
    title: str,
    summary: str,
    messages: Sequence[str] = (),
    answer: str = "",
    words: str | None = None,
    sentences: Sequence[str] = (),
    sentence_note: str = "",
    lines: Sequence[tuple[str, str]] = (),
    links: Sequence[tuple[str, str]] = (),
    commands: Sequence[str] = (),
) -> tuple[Path, Path]:
    """Write ``<name>.html`` and a Markdown file into a folder; return their paths.

    Parameters
    ----------
    messages : sequence of str
        What a reader has to know of the data.
    answer : str
        The result as a sentence.
    words : str, optional
        Name of the Markdown file; by default that of the page.
    sentences : sequence of str
        Where the model fails, below the answer.
    sentence_note : str
        What holds for the sentences.
    lines : sequence of (title, sentence)
        The result in a few lines at the head of the page, in the place of `answer`.
    links : sequence of (title, address)
        Titles and addresses of other pages, relative to the folder.
    commands : sequence of str
        Command lines that made it.

    Raises
    ------
    OSError
        If the folder cannot be written.
    """
    from plotly.offline import get_plotlyjs  # slow to import

    figures = {plot.name: plot.figure.to_json() for part in parts for plot in part.plots}
    listed = ",".join(f"{json.dumps(name)}:{figure}" for name, figure in figures.items())
    folder.mkdir(parents=True, exist_ok=True)
    page, text = folder / f"{name}.html", folder / f"{words or name}.md"
    page.write_text(
        filled(
            "page.html",
            title=title,
            sections=parts,
            summary=summary,
            answer=answer,
            messages=messages,
            sentences=sentences,
            sentence_note=sentence_note,
            lines=lines,
            links=links,
            commands=commands,
            plotly=Markup(get_plotlyjs()),
            figures=Markup("{" + listed.replace("</", "<\\/") + "}"),
        ),
        encoding="utf-8",
    )
    head = [f"- **{what}**: {said}" for what, said in lines] or [f"**{answer}**"]
    out = [f"# {title}", "", summary, "", *head, ""]
    out += [f"> {message}\n" for message in messages]
    if sentences:
        out += ["## Lack of fit", "", *(f"- {said}" for said in sentences), "", sentence_note, ""]
    out += [*(f"- [{what}]({address})" for what, address in links), ""] if links else []
    out += ["```", *commands, "```", ""] if commands else []
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
