"""``documentation/index.html`` of an FMU: one page that explains the file by itself."""

import html
from collections.abc import Mapping, Sequence

from tirelib.fmu.variables import Variable

_STYLE = """
body { font: 15px/1.5 sans-serif; color: #1c2530; max-width: 60rem; margin: 2rem auto;
       padding: 0 1rem; }
table { border-collapse: collapse; margin: 0.5rem 0 1.2rem; font-size: 13.5px; }
th, td { border-bottom: 1px solid #d5dbe1; padding: 0.25rem 0.6rem; text-align: left;
         vertical-align: top; }
dt { font-weight: 600; } dd { margin: 0 0 0.4rem 0; }
code { background: #f2f4f6; padding: 0 0.2rem; } svg { max-width: 100%; height: auto; }
"""
Rows = Sequence[Sequence[str]]


def page(
    title: str,
    lead: str,
    facts: Mapping[str, str],
    table: Sequence[Variable],
    sections: Mapping[str, str],
) -> str:
    """Return the page.

    Parameters
    ----------
    title, lead : str
    facts : mapping
        Name and text of what is particular to this file; plain text.
    table : sequence of Variable
        Numbered inputs (``strain_2_3``) are described once.
    sections : mapping
        Title and finished HTML of what follows the facts, before the variables.
    """
    given = "\n".join(
        f"<dt>{html.escape(name)}</dt><dd>{html.escape(text)}</dd>" for name, text in facts.items()
    )
    body = "\n".join(f"<h2>{html.escape(name)}</h2>\n{text}" for name, text in sections.items())
    return (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>{title}</title>'
        f"<style>{_STYLE}</style></head><body>\n<h1>{title}</h1>\n<p>{html.escape(lead)}</p>\n"
        f"<dl>\n{given}\n</dl>\n{body}\n<h2>Variables</h2>\n{_variables(table)}\n</body></html>\n"
    )


def html_table(head: Sequence[str], rows: Rows) -> str:
    """Return an HTML table of plain texts."""
    first = "".join(f"<th>{html.escape(text)}</th>" for text in head)
    rest = "\n".join(
        "<tr>" + "".join(f"<td>{html.escape(text)}</td>" for text in row) + "</tr>" for row in rows
    )
    return f"<table>\n<tr>{first}</tr>\n{rest}\n</table>"


def _variables(table: Sequence[Variable]) -> str:
    parts = []
    for causality in ("parameter", "input", "output"):
        rows = [
            (v.name, v.kind, v.unit or "", v.display or "", _limits(v), v.description)
            for v in table
            if v.causality == causality
        ]
        head = ("name", "type", "unit", "shown in", "from .. to", "meaning")
        parts.append(f"<h3>{causality.capitalize()}s</h3>\n{html_table(head, rows)}")
    return "\n".join(parts)


def _limits(variable: Variable) -> str:
    if variable.low is None and variable.high is None:
        return ""
    low = "" if variable.low is None else f"{variable.low:.4g}"
    high = "" if variable.high is None else f"{variable.high:.4g}"
    return f"{low} .. {high}"
