"""The documentation: it builds, its links lead somewhere, its commands exist, its tutorials run."""

import json
import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import click
import pytest
from click.testing import CliRunner

from tests.chain.test_command_line import run
from tests.schema_check import SCHEMAS, wrong_documents
from tirebench.cli import program as bench
from tirelib.cli import program
from tirelib.core.flags import TurnFlag
from tirelib.effects.brush_state import BrushConditions, BrushState
from tirelib.effects.state import Operating, State

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
BUILT = ("_build", "_generated", "_tutorials")
PAGES = [
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    *(p for p in sorted(DOCS.rglob("*.md")) if not {*p.parts} & {*BUILT}),
]
SPHINX = pytest.importorskip("sphinx", reason="Sphinx comes with the extra tirelib[docs]")


def test_the_readme_is_short() -> None:
    assert len((ROOT / "README.md").read_text(encoding="utf-8").splitlines()) <= 120


@pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_links_lead_to_files(page: Path) -> None:
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    targets = re.findall(r"\]\(\s*([^)\s#]+)(?:#[^)]*)?\)", text)
    inside = [t for t in targets if "://" not in t and "_tutorials/" not in t]
    assert [t for t in inside if not (page.parent / t).exists()] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_commands_have_the_options_that_pages_show(page: Path) -> None:
    for line in commands(page.read_text(encoding="utf-8")):
        words = shlex.split(line, comments=True)
        command: click.Command = {"tirelib": program, "tirebench": bench}[words.pop(0)]
        while isinstance(command, click.Group) and words and not words[0].startswith("-"):
            found = command.get_command(click.Context(command), words.pop(0))
            assert found is not None, line
            command = found
        known = {
            name for option in command.params for name in (*option.opts, *option.secondary_opts)
        }
        known |= {"--help", "--version"}
        shown = {word.partition("=")[0] for word in words if re.match(r"--?[a-z]", word)}
        assert shown <= known, line


def commands(text: str) -> list[str]:
    """Command lines of indented and fenced blocks, one each, with their continuations."""
    joined = re.sub(r"\\\n\s*", " ", text)
    lines = re.findall(r"^(?: {4}|)(?:\.venv/bin/)?((?:tirelib|tirebench) [a-z-].*)$", joined, re.M)
    return [re.split(r" [|&>] | &$| > |  #", line)[0] for line in lines if "..." not in line]


def test_every_flag_has_a_remedy() -> None:
    tables = imported("tables", DOCS)
    assert set(tables.REMEDIES) == {flag.name for flag in TurnFlag}


@pytest.mark.parametrize("state", [State, Operating, BrushState, BrushConditions])
def test_what_a_law_finds_in_its_state_is_on_the_page(state: Any) -> None:
    page = (DOCS / "howto" / "effects.md").read_text(encoding="utf-8")
    said = set(re.findall(r"`(?:state\.)?(\w+)", page))
    assert {f.name for f in fields(state)} <= said


def test_diagnosis_is_explained_in_800_words() -> None:
    assert len((DOCS / "howto" / "diagnose.md").read_text(encoding="utf-8").split()) <= 800


def imported(name: str, folder: Path) -> Any:
    sys.path.insert(0, str(folder))
    try:
        return __import__(name)
    finally:
        sys.path.remove(str(folder))


def test_the_site_builds_without_a_warning_and_is_searched_offline(tmp_path: Path) -> None:
    program = Path(__file__).with_name("few_pages.py")
    pages = ["index", "howto/effects", "reference/cli", "theory/ring_static"]
    command = [sys.executable, program, ",".join(pages), "-D", "plot_gallery=0"]
    # without functions in the contents beside every page the site builds a fourth faster
    command += ["-D", "toc_object_entries=0"]
    done = subprocess.run(
        [*command, "--fail-on-warning", "--quiet", "--keep-going", str(DOCS), str(tmp_path)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    index = (tmp_path / "searchindex.js").read_text(encoding="utf-8")
    assert "sidewall_damp" in index
    for page in pages:
        text = (tmp_path / f"{page}.html").read_text(encoding="utf-8")
        loaded = re.findall(r'<(?:script|link|img)[^>]+(?:src|href)="(https?://[^"]+)"', text)
        assert loaded == []  # nothing comes from a network


@pytest.mark.parametrize(
    "words",
    [
        "effects",
        "rig --list",
        "simulate --model table-6-1 --load 1500,3000 --speed 65",
        "bench load --bus fd --format RAW12 --wheels 4",
    ],
)
def test_a_document_is_as_its_schema_says_and_no_key_may_come_or_go(
    words: str, tmp_path: Path
) -> None:
    given = words.split()
    chosen = bench if given[0] == "bench" else program
    done = CliRunner().invoke(
        chosen, [*given[chosen is bench :], "--json", str(tmp_path / "d.json")]
    )
    assert done.exit_code in (0, 1), done.output
    assert list(wrong_documents(tmp_path)) == []
    whole = json.loads((tmp_path / "d.json").read_text())
    other = next(key for key, value in whole.items() if isinstance(value, list | float))
    less = {"format": whole["format"]}  # all that `rig` has in both of its documents
    for wrong in ({**whole, "new": 1}, {**whole, other: "of another type"}, less):
        (tmp_path / "d.json").write_text(json.dumps(wrong))
        found = list(wrong_documents(tmp_path))
        assert len(found) == (wrong is not less or given[0] != "rig"), wrong
    (tmp_path / "d.json").write_text(json.dumps(whole))


def test_every_document_has_a_schema_that_names_its_command() -> None:
    said = " ".join(json.loads(path.read_text())["description"] for path in SCHEMAS.glob("*.json"))
    for name, program_of_it in (("tirelib", program), ("tirebench", bench)):
        for command in with_json(name, program_of_it):
            assert f"`{command}`" in said, command


def with_json(name: str, command: click.Command) -> Iterator[str]:
    """Commands with the option --json."""
    if isinstance(command, click.Group):
        context = click.Context(command)
        for verb in command.list_commands(context):
            found = command.get_command(context, verb)
            assert found is not None
            yield from with_json(f"{name} {verb}", found)
    elif any("--json" in option.opts for option in command.params):
        yield name


NUMBERS = {
    "strain_to_load": lambda found: (found["rmse"], 0.0, 20.0),
    "missing_effect": lambda found: (found["errors"][-1], 0.5, 1.5),
    "own_measurements": lambda found: (found["strength"] + found["difference"], 0.24, 0.26),
    "vehicle_loop": lambda found: (found["share"].mean(), 0.19, 0.22),
    "bench_transmitter": lambda found: (found["mine"].mean(), 4100.0, 4250.0),
    "extend": lambda found: (found["samples"], 1000, 1000),
}
"""The number of each tutorial that is checked, and between what it must lie."""


def test_every_tutorial_has_a_number() -> None:
    scripts = {path.stem for path in (DOCS / "tutorials").glob("*.py")} - {"example_rig"}
    assert set(NUMBERS) == scripts == set(imported("tables", DOCS).ORDER)


IN_ITS_OWN = subprocess.run


def in_this_process(
    command: Any, *, env: Mapping[str, str] = os.environ, **options: Any
) -> subprocess.CompletedProcess[str]:
    """Run `python -m tirelib ...` without a process of its own, whose imports take a second."""
    if command[:3] != [sys.executable, "-m", "tirelib"]:
        return IN_ITS_OWN(command, env=env, **options)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(options["cwd"])
        patch.setenv("COLUMNS", env.get("COLUMNS", "80"))
        done = run(*command[3:])
    if options["check"]:
        done.check_returncode()
    return done


@pytest.mark.parametrize("name", NUMBERS)
def test_a_tutorial_runs_and_ends_with_its_number(name: str, monkeypatch: Any) -> None:
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("agg")
    monkeypatch.syspath_prepend(str(DOCS / "tutorials"))
    monkeypatch.setattr(subprocess, "run", in_this_process)
    path = DOCS / "tutorials" / f"{name}.py"
    found: dict[str, Any] = {"__name__": name, "__file__": str(path)}
    try:
        exec(compile(path.read_text(encoding="utf-8"), path, "exec"), found)
    finally:
        matplotlib.pyplot.close("all")
    value, low, high = NUMBERS[name](found)
    assert low <= value <= high
