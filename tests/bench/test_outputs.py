"""An output that cannot be written is refused before anything is started, by every verb."""

from importlib import import_module
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from tirebench.cli import VERBS, program

OUTPUTS = {"--json", "--out", "--record", "--truth", "--port-file", "--conditions"}
INPUTS = {("run", "--conditions"), ("record", "--conditions"), ("run", "--port-file")}
CASES = [
    (verb, option)
    for verb in VERBS
    for parameter in getattr(import_module(f"tirebench.cli.{verb}"), verb).params
    for option in OUTPUTS & set(parameter.opts)
    if (verb, option) not in INPUTS
]


def value_of(parameter: click.Parameter, folder: Path) -> str:
    """Return a value that a required parameter takes."""
    if isinstance(parameter.type, click.Choice):
        return str(parameter.type.choices[0])
    numeric = isinstance(parameter.type, click.FloatRange | click.IntRange)
    return "120" if numeric else str(folder / "x")


def test_every_verb_has_an_output() -> None:
    assert len(CASES) >= 12
    assert {verb for verb, _ in CASES} == set(VERBS)


@pytest.mark.parametrize(("verb", "option"), CASES)
def test_an_output_below_a_file_is_refused(verb: str, option: str, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    place = tmp_path / "file" / "out"
    command = getattr(import_module(f"tirebench.cli.{verb}"), verb)
    assert isinstance(command, click.Command)
    needed = [
        word
        for parameter in command.params
        if parameter.required and option not in parameter.opts
        for word in ([parameter.opts[0]] if parameter.param_type_name == "option" else [])
        + [value_of(parameter, tmp_path)]
    ]
    outcome = CliRunner().invoke(program, [verb, *needed, option, str(place)])
    assert outcome.exit_code == 2, outcome.output
    assert f"{place}: cannot be written" in " ".join(outcome.output.split())
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
