"""Pages made of parts: one self-contained HTML file, and the same in Markdown."""

import json
import tempfile
from collections.abc import Sequence
from pathlib import Path

from markupsafe import Markup
from plotly.offline import get_plotlyjs

from tirelib.report.comparison import Part, Shown, markdown_parts
from tirelib.report.page import write_page


def write_parts_page(
    folder: Path,
    name: str,
    parts: Sequence[Part],
    *,
    title: str,
    summary: str,
    answer: str,
    messages: Sequence[str],
    lines: Sequence[tuple[str, str]] = (),
    links: Sequence[tuple[str, str]] = (),
    commands: Sequence[str] = (),
) -> tuple[Path, Path]:
    """Write ``<name>.html`` and ``<name>.md`` into a folder; return their paths.

    Parameters
    ----------
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
    shown = [Shown.of(plot) for part in parts for plot in part.plots]
    figures = "{" + ",".join(f"{json.dumps(s.name)}:{s.json}" for s in shown) + "}"
    by_name = {s.name: s for s in shown}
    views = [
        {
            "title": part.title,
            "anchor": part.anchor,
            "text": part.text,
            "tables": part.tables,
            "plots": [by_name[plot.name] for plot in part.plots],
            "sources": part.sources,
        }
        for part in parts
    ]
    folder.mkdir(parents=True, exist_ok=True)
    page, words = folder / f"{name}.html", folder / f"{name}.md"
    # pages are written as index.html, which may be another report's in this folder
    with tempfile.TemporaryDirectory() as aside:
        made = write_page(
            Path(aside),
            "comparison.html",
            title=title,
            sections=(),
            parts=views,
            summary=summary,
            answer=answer,
            messages=messages,
            sentences=(),
            sentence_note="",
            lines=lines,
            links=links,
            commands=commands,
            plotly=Markup(get_plotlyjs()),
            figures=Markup(figures.replace("</", "<\\/")),
        )
        page.write_text(made.read_text(encoding="utf-8"), encoding="utf-8")
    head = [f"- **{what}**: {said}" for what, said in lines] or [f"**{answer}**"]
    out = [f"# {title}", "", summary, "", *head, ""]
    out += [f"> {message}\n" for message in messages]
    out += [*(f"- [{what}]({address})" for what, address in links), ""] if links else []
    out += ["```", *commands, "```", ""] if commands else []
    text = "\n".join([*out, *markdown_parts(parts)]).rstrip() + "\n"
    words.write_text(text, encoding="utf-8")
    return page, words
