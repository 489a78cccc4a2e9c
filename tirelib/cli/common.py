"""What several verbs share: paths that they read and write, JSON files, tables."""

import os
import re
from collections.abc import Collection
from difflib import get_close_matches
from errno import ENOTDIR
from math import isfinite
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

import click
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from tirelib.core.documents import plain as plain
from tirelib.core.documents import write_json as write_json


def _range(limits: click.IntRange | click.FloatRange) -> str:
    """Return the numbers that are allowed, in words; empty where all are."""
    low, high = limits.min, limits.max
    if low is not None and high is not None:
        return f"{'above ' if limits.min_open else 'from '}{low:.6g} to {high:.6g}"
    if low is not None:
        return f"above {low:.6g}" if limits.min_open else f"{low:.6g} or more"
    return "" if high is None else f"{high:.6g} or less"


def _needed(value: Any, kind: str, limits: click.IntRange | click.FloatRange) -> str:
    """Return what is wrong with the text of a number, and what is needed."""
    text = str(value)
    hint = ""
    if "," in text:
        hint = "; write a decimal point"
    elif re.fullmatch(r"[+-]?\d[\d.]*\s*[^\d.\s].*", text):
        hint = "; write the number alone, without its unit"
    allowed = _range(limits)
    return f"{text!r} is given; {kind}{f', {allowed},' if allowed else ''} is needed{hint}"


class Real(click.FloatRange):
    """A finite number within limits, which its help and its messages say in words."""

    name = "number"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the number."""
        try:
            number = super().convert(value, param, ctx)
        except click.BadParameter:
            self.fail(_needed(value, "a number", self), param, ctx)
        if not isfinite(number):
            self.fail(_needed(value, "a finite number", self), param, ctx)
        return number

    def _describe_range(self) -> str:
        return _range(self)


class Whole(click.IntRange):
    """A whole number within limits, which its help and its messages say in words."""

    name = "whole number"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the number."""
        try:
            return super().convert(value, param, ctx)
        except click.BadParameter:
            self.fail(_needed(value, "a whole number", self), param, ctx)

    def _describe_range(self) -> str:
        return _range(self)


class NewPath(click.Path):
    """A file or folder that a verb writes, refused before any work where it cannot be written.

    Folders on the way to it that do not exist are made, which the verb says at its end: a name
    that is misspelt is seen.
    """

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
        if ctx is not None and place not in (path, path.parent):
            ctx.call_on_close(lambda: _say_new(path, place))
        return path


def _say_new(path: Path, place: Path) -> None:
    """Name the folder below `place` that was made on the way to `path`, and one named alike."""
    new = place / path.relative_to(place).parts[0]
    if not new.is_dir():
        return
    others = [each.name for each in place.iterdir() if each.is_dir() and each != new]
    near = get_close_matches(new.name, others, 1, 0.8)
    beside = f"; there is {place / near[0]} as well" if near else ""
    click.echo(f"note: the folder {new} is new{beside}", err=True)


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


def new_table(*headings: str, words: Collection[str], **look: Any) -> Table:
    """Return an empty table; columns of words stand on the left, of numbers on the right."""
    table = Table(box=SIMPLE_HEAD, **look)
    for heading in headings:
        table.add_column(heading, justify="left" if heading in words else "right")
    return table


def say_written(*paths: Path | str) -> None:
    """Say where files were written."""
    for path in paths:
        output().print(f"written: {path}")


def write_document(document: dict[str, Any], *files: Path | None) -> None:
    """Write a document into each file that is wanted, and say so."""
    for file in filter(None, files):
        write_json(file, document)
        say_written(file)


def output() -> Console:
    """Return the console for results, wide enough for tables when it is no terminal."""
    console = Console(highlight=False, markup=False)
    if console.is_terminal:
        return console
    return Console(highlight=False, markup=False, width=WIDTH, soft_wrap=True)
