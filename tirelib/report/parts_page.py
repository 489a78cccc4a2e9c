"""Pages made of parts: one self-contained HTML file, and the same in Markdown."""

import json
from collections.abc import Sequence
from pathlib import Path

from markupsafe import Markup
from plotly.offline import get_plotlyjs

from tirelib.report.page import Part, Table, filled


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
