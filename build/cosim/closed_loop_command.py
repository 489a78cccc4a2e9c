"""The command line of a closed-loop study: two FMUs in, a page and its figures as JSON out."""

import argparse
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeVar

import click

from tirelib.report.page import write_parts_page

Found = TypeVar("Found")


def run_study(
    about: str | None,
    name: str,
    find: Callable[[Path, Path, Callable[[str], None]], Found],
    document: Callable[[Found], dict[str, Any]],
    page: Callable[[Found], dict[str, Any]],
    arguments: Sequence[str] | None = None,
) -> int:
    """Run a study by the command line.

    Parameters
    ----------
    about : str, optional
        Shown by ``--help``.
    name : str
        Name of the JSON file, and of the folder below ``build/out``.
    find : callable
        Takes the virtual tire's FMU, the strain tire's, and what shows the progress.
    document, page : callables
        What was found as JSON knows it, and as `write_parts_page` takes it.
    arguments : sequence of str, optional
        Those of the process otherwise.
    """
    parser = argparse.ArgumentParser(description=about)
    parser.add_argument("--virtual", type=Path, required=True)
    parser.add_argument("--strain", type=Path, required=True)
    parser.add_argument("--out", type=Path, default=Path("build/out") / name)
    told = parser.parse_args(arguments)
    found = find(told.virtual, told.strain, lambda text: click.echo(text, err=True))
    told.out.mkdir(parents=True, exist_ok=True)
    text = json.dumps(document(found), indent=1, allow_nan=False)
    (told.out / f"{name}.json").write_text(text + "\n", encoding="utf-8")
    summary = "Four virtual tires and four strain tires under FMPy"
    write_parts_page(told.out, "index", summary=summary, messages=[], **page(found))
    return 0
