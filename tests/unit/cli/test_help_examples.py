"""Examples of ``--help``: what a line reads was written by a line before it, in the same help.

So they can be copied into an empty folder one after the other. `build/package.py --examples` does
that with an installed wheel.
"""

import re
import shlex
from collections.abc import Iterator
from pathlib import Path, PurePath
from typing import Any

import click
import pytest

from tirebench.cli import program as bench
from tirelib.cli import program
from tirelib.cli.common import NewPath

OWN = {
    *("mine.py", "cornering.mat", "commute", "Foreign.fmu"),
    *("cross-check/Foreign", "s3://bucket/campaigns"),
}
"""What only the reader can have: an effect, measurements, an FMU of another tool."""
SHIPPED = {"table-6-1", "table-6-2-195-65r15"}
"""Tires of the library that examples name."""
READ = {"model_name", "model", "source", "paths", "calibration"}
"""Parameters that name a file, a folder, or something else."""


def verbs(name: str, command: click.Command) -> Iterator[tuple[str, click.Command]]:
    yield name, command
    if isinstance(command, click.Group):
        context = click.Context(command)
        for verb in command.list_commands(context):
            found = command.get_command(context, verb)
            assert found is not None
            yield from verbs(f"{name} {verb}", found)


VERBS = dict(verbs("tirelib", program))


def examples(command: click.Command) -> list[str]:
    text = (command.epilog or "").partition("Example")[2].partition("\n\n")[0]
    joined = re.sub(r"\\\n\s*", " ", text)
    return [line.strip() for line in joined.splitlines() if line.startswith("  ")]


def reads_and_writes(line: str) -> tuple[set[str], set[str]]:
    """Return the files and folders that a command line reads, and those that it writes."""
    line, _, redirected = line.partition(">")
    words = shlex.split(line, comments=True)
    reads: set[str] = set()
    writes = {redirected.strip()} - {""}
    command = VERBS[words.pop(0)]
    while isinstance(command, click.Group):
        found = command.get_command(click.Context(command), words.pop(0))
        assert found is not None, line
        command = found
    given = command.make_context("verb", words, resilient_parsing=True).params
    for parameter in command.params:
        value: Any = given.get(parameter.name or "")
        values = {str(v) for v in (value if isinstance(value, tuple) else (value,)) if v}
        if isinstance(parameter.type, NewPath) or parameter.name == "target":
            writes |= values
        elif isinstance(parameter.type, click.Path) or parameter.name in READ:
            reads |= values
    return reads, writes


def within(path: str) -> set[str]:
    """Return the path and the folders that it lies in."""
    return {path, *map(str, PurePath(path).parents)} - {"."}


@pytest.mark.parametrize("name", [name for name, verb in VERBS.items() if examples(verb)])
def test_what_an_example_reads_was_made_before(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    made: set[str] = OWN | SHIPPED
    for line in examples(VERBS[name]):
        reads, writes = reads_and_writes(line)
        assert {path for path in reads if not made & within(path)} == set(), line
        made |= {place for path in writes for place in within(path)}


@pytest.mark.parametrize("name", [name for name in VERBS if name != "tirelib"])
def test_every_verb_has_an_example(name: str) -> None:
    assert isinstance(VERBS[name], click.Group) or examples(VERBS[name])


def test_no_help_names_a_folder_of_the_repository() -> None:
    for name, verb in (*VERBS.items(), *verbs("tirebench", bench)):
        text = verb.get_help(click.Context(verb, info_name=name))
        assert "build/" not in text, name
        assert "docs/" not in text, name
