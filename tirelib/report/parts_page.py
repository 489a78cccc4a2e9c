"""Pages made of parts: one self-contained HTML file, and the same in Markdown."""

import base64
import csv
import io
import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from markupsafe import Markup
from plotly.offline import get_plotlyjs

from tirelib.report.figures.compare_plot import Plot
from tirelib.report.page import Table, filled


@dataclass(frozen=True, slots=True)
class Part:
    """A part of the page."""

    title: str
    anchor: str
    text: str = ""
    tables: Sequence[Table] = ()
    plots: Sequence[Plot] = ()
    sources: Sequence[str] = field(default_factory=tuple)


@dataclass(frozen=True, slots=True)
class Shown:
    """A plot as the template takes it."""

    name: str
    title: str
    caption: str
    height: int
    json: str
    csv: str

    @classmethod
    def of(cls, plot: Plot) -> "Shown":
        """Return the plot with its data ready for the page."""
        text = io.StringIO()
        writer = csv.writer(text)
        writer.writerow(plot.columns)
        writer.writerows(plot.rows)
        data = base64.b64encode(text.getvalue().encode()).decode()
        height = int(plot.figure.layout.height)
        return cls(plot.name, plot.title, plot.caption, height, str(plot.figure.to_json()), data)


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
    shown = {plot.name: Shown.of(plot) for part in parts for plot in part.plots}
    figures = "{" + ",".join(f"{json.dumps(s.name)}:{s.json}" for s in shown.values()) + "}"
    views = [
        {
            "title": part.title,
            "anchor": part.anchor,
            "text": part.text,
            "tables": part.tables,
            "plots": [shown[plot.name] for plot in part.plots],
            "sources": part.sources,
        }
        for part in parts
    ]
    folder.mkdir(parents=True, exist_ok=True)
    page, text = folder / f"{name}.html", folder / f"{words or name}.md"
    page.write_text(
        filled(
            "comparison.html",
            title=title,
            sections=(),
            parts=views,
            summary=summary,
            answer=answer,
            messages=messages,
            sentences=sentences,
            sentence_note=sentence_note,
            lines=lines,
            links=links,
            commands=commands,
            plotly=Markup(get_plotlyjs()),
            figures=Markup(figures.replace("</", "<\\/")),
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
