"""What a verb says of its work while it goes on: a bar, lines of text, lines of JSON, or nothing.

On a terminal a bar moves. Without one (a log, a batch job), a line says what begins, and further
ones say how far it is, at most one every half minute. ``--verbose`` prints a line for each step,
``--quiet`` none. All of it goes to stderr.
"""

import json
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import monotonic
from typing import Any

import click
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

PROGRESS = "TIRELIB_PROGRESS"
"""Environment variable that asks for progress as lines of JSON."""
EVERY = 30.0
"""Least time between two lines without a terminal, s: a log that is followed shows that work goes
on, and a night of work is some hundred lines."""
_CHOSEN = "tirelib.progress"
_WORDS = {"quiet": "--quiet", "verbose": "--verbose"}


def progress_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """Add ``--quiet`` and ``--verbose`` to a verb that works for long."""

    def choose(context: click.Context, option: click.Parameter, given: bool) -> None:
        if given:
            context.meta[_CHOSEN] = option.name

    for letter, name, does in (
        ("-v", "verbose", "Print every step of the work, and the answer with every detail."),
        ("-q", "quiet", "Print no progress; warnings, errors and the answer stay."),
    ):
        function = click.option(
            letter,
            f"--{name}",
            name,
            is_flag=True,
            expose_value=False,
            callback=choose,
            help=does,
        )(function)
    return function


def is_verbose() -> bool:
    """Return whether the running verb was asked for every detail."""
    return _chosen() == "verbose"


def chosen_words() -> list[str]:
    """Return the option that the running verb was given, for a verb that it calls itself."""
    chosen = _chosen()
    return [_WORDS[chosen]] if chosen else []


def _chosen() -> str:
    context = click.get_current_context(silent=True)
    return "" if context is None else str(context.meta.get(_CHOSEN, ""))


@contextmanager
def progress_bar(what: str, total: int | None = None) -> Iterator[Callable[[str], None]]:
    """Yield a callback that says that one step is done, and what it was.

    If the environment variable `TIRELIB_PROGRESS` is "json", each step prints JSON on stderr:
    what is done, the number of steps so far, of all steps (or null), and the label.
    """
    chosen = _chosen()
    console = Console(stderr=True)
    if os.environ.get(PROGRESS) == "json":
        yield _json_lines(what, total)
    elif chosen == "quiet":
        yield lambda label: None
    elif chosen == "verbose" or not console.is_terminal:
        lines = _Lines(what, total, 0.0 if chosen == "verbose" else EVERY)
        yield lines.advance
        lines.end()
    else:
        with Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            TextColumn("{task.fields[label]}", style="dim", markup=False),
            console=console,
            transient=True,
        ) as bar:
            task = bar.add_task(what, total=total, label="")
            yield lambda label: bar.update(task, advance=1, label=label)


class _Lines:
    """Lines of text on stderr, at least `every` seconds apart."""

    def __init__(self, what: str, total: int | None, every: float) -> None:
        self.what, self.total, self.every = what, total, every
        self.count = 0
        self.begun = self.last = monotonic()
        self._say("...")

    def advance(self, label: str) -> None:
        """Count one step; print it if the last line is old enough."""
        self.count += 1
        now = monotonic()
        if now - self.last >= self.every:
            self.last = now
            done = f"step {self.count}" + (f" of {self.total}" if self.total else "")
            self._say(f": {done}, {now - self.begun:.0f} s{f', {label}' if label else ''}")

    def end(self) -> None:
        """Print how long it took, if any line between was printed."""
        if self.last > self.begun or self.every == 0.0:
            self._say(f": done in {monotonic() - self.begun:.0f} s")

    def _say(self, rest: str) -> None:
        click.echo(f"{self.what}{' ' if rest == '...' else ''}{rest}", err=True)


def _json_lines(what: str, total: int | None) -> Callable[[str], None]:
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
