"""What several verbs share: progress bars, JSON files, tables."""

import json
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from errno import ENOTDIR
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

import click
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from tirelib.documents import plain as plain
from tirelib.documents import write_json as write_json


class NewPath(click.Path):
    """A file or folder that a verb writes, refused before any work where it cannot be written."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        """Return the path; nothing is left behind by the trial."""
        path = Path(os.fsdecode(super().convert(value, param, ctx)))
        place = path
        while not place.exists() and place != place.parent:
            place = place.parent
        try:
            if place.is_dir():
                TemporaryFile(dir=place).close()
            elif place != path:
                raise NotADirectoryError(ENOTDIR, f"{place} is a file")
            elif path.is_file():  # a device or a pipe is left alone until it is written
                path.open("ab").close()
        except OSError as error:
            self.fail(
                f"{path}: cannot be written ({error.strerror}); a file in a writable folder is "
                "needed; choose another one",
                param,
                ctx,
            )
        return path


class NewPlace(NewPath):
    """A folder as `NewPath`, or a URL, which is tried by what writes there."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the path, or the URL as text."""
        return value if "://" in str(value) else super().convert(value, param, ctx)


CAMPAIGN = click.Path(path_type=Path)
FILE = click.Path(path_type=Path, dir_okay=False)
NEW_FILE = NewPath(path_type=Path, dir_okay=False)
NEW_FOLDER = NewPath(path_type=Path, file_okay=False)
NEW_PLACE = NewPlace(path_type=Path, file_okay=False)
WIDTH = 120
PROGRESS = "TIRELIB_PROGRESS"
"""Environment variable that asks for progress as lines of JSON."""


def output() -> Console:
    """Return the console for results, wide enough for tables when it is no terminal."""
    console = Console(highlight=False, markup=False)
    if console.is_terminal:
        return console
    return Console(highlight=False, markup=False, width=WIDTH, soft_wrap=True)


@contextmanager
def progress_bar(what: str, total: int | None = None) -> Iterator[Callable[[str], None]]:
    """Yield a callback that advances a bar on stderr by one step and shows a label.

    With the environment variable `PROGRESS` set to "json", every step is a line of JSON on stderr
    instead: what is done, the number of steps so far, of all steps (or null), and the label.
    """
    if os.environ.get(PROGRESS) == "json":
        yield _lines(what, total)
        return
    console = Console(stderr=True)
    with Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("{task.fields[label]}", style="dim", markup=False),
        console=console,
        transient=True,
        disable=not console.is_terminal,
    ) as bar:
        task = bar.add_task(what, total=total, label="")

        def advance(label: str) -> None:
            bar.update(task, advance=1, label=label)

        yield advance


def _lines(what: str, total: int | None) -> Callable[[str], None]:
    count = 0

    def say(label: str) -> None:
        line = {"progress": what, "done": count, "total": total, "label": label}
        sys.stderr.write(json.dumps(line) + "\n")
        sys.stderr.flush()

    def advance(label: str) -> None:
        nonlocal count
        count += 1
        say(label)

    say("")
    return advance
