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
) -> tuple[Path, Path]:
    """Write ``<name>.html`` and ``<name>.md`` into a folder; return their paths.

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
            "title": part.title, "anchor": part.anchor, "text": part.text, "tables": part.tables,
            "plots": [by_name[plot.name] for plot in part.plots], "sources": part.sources,
        }
        for part in parts
    ]  # fmt: skip
    folder.mkdir(parents=True, exist_ok=True)
    page, words = folder / f"{name}.html", folder / f"{name}.md"
    # pages are written as index.html, which may be another report's in this folder
    with tempfile.TemporaryDirectory() as aside:
        made = write_page(
            Path(aside), "comparison.html", title=title, sections=(), parts=views,
            summary=summary, answer=answer, messages=messages, sentences=(), sentence_note="",
            plotly=Markup(get_plotlyjs()), figures=Markup(figures.replace("</", "<\\/")),
        )  # fmt: skip
        page.write_text(made.read_text(encoding="utf-8"), encoding="utf-8")
    lines = [f"# {title}", "", summary, "", f"**{answer}**", ""]
    lines += [f"> {message}\n" for message in messages]
    text = "\n".join([*lines, *markdown_parts(parts)]).rstrip() + "\n"
    words.write_text(text, encoding="utf-8")
    return page, words
