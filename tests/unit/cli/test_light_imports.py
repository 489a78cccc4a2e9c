"""What is imported before a user asks for anything: as little as possible."""

import ast
import json
import subprocess
import sys
from pathlib import Path

import click
import pytest

import tirebench.cli
import tirelib.cli
from tirelib.cli import VERBS, Verbs

HEAVY = {
    "asammdf",
    "h5py",
    "jinja2",
    "matplotlib",
    "numpy",
    "pandas",
    "plotly",
    "pyarrow",
    "rich",
    "scipy",
    "sklearn",
    "statsmodels",
}
LIST = "import json, sys; sys.stderr.write(json.dumps(sorted(sys.modules)))"


def imported(code: str) -> set[str]:
    done = subprocess.run(
        [sys.executable, "-c", f"{code}\n{LIST}"], capture_output=True, text=True, check=True
    )
    return set(json.loads(done.stderr))


@pytest.mark.parametrize(
    "code",
    [
        "import tirelib",
        "from tirelib.cli import program\nprogram(['--help'], standalone_mode=False)",
        "from tirelib.cli import program\nprogram(['--version'], standalone_mode=False)",
        "from tirebench.cli import program\nprogram(['--help'], standalone_mode=False)",
    ],
    ids=["import tirelib", "tirelib --help", "tirelib --version", "tirebench --help"],
)
def test_nothing_heavy_is_imported(code: str) -> None:
    modules = imported(code)
    assert not modules & HEAVY
    assert not [name for name in modules if name.startswith(("tirelib.cli.", "tirebench.cli."))]


@pytest.mark.parametrize("program", [tirelib.cli.program, tirebench.cli.program])
def test_the_list_of_verbs_says_what_each_verb_says_of_itself(program: Verbs) -> None:
    context = click.Context(program)
    for verb, sentence in program.sentences.items():
        command = program.get_command(context, verb)
        assert command is not None
        assert " ".join((command.help or "").split()).startswith(sentence), verb


def test_every_name_is_typed_listed_documented_and_there() -> None:
    tree = ast.parse(Path(tirelib.__file__).read_text())
    (typed,) = [
        node
        for node in tree.body
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
    ]
    names = sorted(a.name for line in typed.body for a in line.names)  # type: ignore[attr-defined]
    assert names == sorted(tirelib.__all__)
    for name in names:
        assert f"`{name}`" in (tirelib.__doc__ or "")
        assert callable(getattr(tirelib, name))
        assert name in dir(tirelib)


def test_an_unknown_name_is_refused() -> None:
    with pytest.raises(AttributeError, match="no attribute 'tyre'"):
        _ = tirelib.tyre  # type: ignore[attr-defined]


def test_a_user_s_call_and_the_command_line_agree(tmp_path: Path) -> None:
    from click.testing import CliRunner

    from tirelib.cli import program

    words = [
        "simulate",
        "--model",
        "table-6-1",
        "--load",
        "4000",
        "--json",
        str(tmp_path / "s.json"),
    ]
    assert CliRunner().invoke(program, words).exit_code == 0
    point = json.loads((tmp_path / "s.json").read_text())
    done = tirelib.simulate(tirelib.read_tire("table-6-1"), load=4000.0)
    assert 1e3 * float(done.deflection[0]) == pytest.approx(point["deflection_mm"], rel=1e-9)


@pytest.mark.parametrize(
    ("typed", "offered"), [("ca", ["campaign", "calibrate"]), ("", list(VERBS)), ("x", [])]
)
def test_the_shell_completes_verbs_without_importing_any(typed: str, offered: list[str]) -> None:
    code = f"""
import click
from tirelib.cli import program
context = click.Context(program, info_name="tirelib")
assert [item.value for item in program.shell_complete(context, {typed!r})] == {offered!r}
"""
    assert not [name for name in imported(code) if name.startswith("tirelib.cli.")]


def test_the_citation_names_this_version() -> None:
    citation = (Path(__file__).parents[3] / "CITATION.cff").read_text()
    assert f"\nversion: {tirelib.__version__}\n" in citation
