"""What a verb says while it works: lines without a terminal, more of them, or none."""

import json
from collections.abc import Iterator

import click
import pytest
from click.testing import CliRunner

from tirelib.cli import program, progress
from tirelib.cli.progress import EVERY, PROGRESS, chosen_words, progress_bar, progress_options


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The time that the verb sees; a step of `work` takes ten seconds."""
    now = [0.0]
    monkeypatch.setattr(progress, "monotonic", lambda: now[0])
    return now


@pytest.fixture
def work(clock: list[float]) -> click.Command:
    @click.command()
    @click.option("--steps", type=int, default=12)
    @progress_options
    def verb(steps: int) -> None:
        with progress_bar("fitting", steps) as advance:
            for number in range(steps):
                clock[0] += 10.0
                advance(f"part {number}")
        click.echo("answer " + " ".join(chosen_words()))

    return verb


def said(verb: click.Command, *words: str) -> tuple[list[str], str]:
    result = CliRunner().invoke(verb, words)
    assert result.exit_code == 0, result.output
    return result.stderr.splitlines(), result.stdout.strip()


def test_without_a_terminal_a_line_comes_at_once_and_then_every_half_minute(
    work: click.Command,
) -> None:
    lines, answer = said(work)
    assert lines == [
        "fitting ...",
        *(
            f"fitting: step {n} of 12, {10 * n} s, part {n - 1}"
            for n in range(1, 13)
            if n % (EVERY / 10) == 0
        ),
        "fitting: done in 120 s",
    ]
    assert answer == "answer"


def test_short_work_is_one_line(work: click.Command) -> None:
    assert said(work, "--steps", "2")[0] == ["fitting ..."]


def test_verbose_prints_every_step_and_quiet_none(work: click.Command) -> None:
    lines, answer = said(work, "-v")
    assert len(lines) == 1 + 12 + 1
    assert answer == "answer --verbose"
    assert said(work, "--quiet") == ([], "answer --quiet")


def test_a_program_that_asks_for_json_gets_every_step_whatever_the_options(
    work: click.Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(PROGRESS, "json")
    lines = [json.loads(line) for line in said(work, "--quiet", "--steps", "3")[0]]
    assert [line["done"] for line in lines] == [0, 1, 2, 3]
    assert lines[-1] == {"progress": "fitting", "done": 3, "total": 3, "label": "part 2"}


def verbs(group: click.Command, name: str = "") -> Iterator[tuple[str, click.Command]]:
    if isinstance(group, click.Group):
        context = click.Context(group)
        for verb in group.list_commands(context):
            found = group.get_command(context, verb)
            assert found is not None
            yield from verbs(found, f"{name} {verb}")
    else:
        yield name.strip(), group


SHORT = {"fmu table", "export", "simulate", "studio", "fleet"}
"""Verbs that take a second, or that have a display of their own."""


@pytest.mark.parametrize("names", [("-v", "--verbose"), ("-q", "--quiet")])
def test_every_verb_that_works_for_long_has_both_options(names: tuple[str, str]) -> None:
    def have(verb: click.Command) -> bool:
        return any(tuple(option.opts) == names for option in verb.params)

    assert {name for name, verb in verbs(program) if not have(verb)} == SHORT
