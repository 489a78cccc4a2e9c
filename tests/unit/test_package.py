"""What the package needs is what it declares, and it installs no name that others may bear."""

import ast
import sys
import tomllib
from functools import cache
from pathlib import Path

import pytest
import release

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
NAMES = {"can": "python-can", "serial": "pyserial", "tomli_w": "tomli-w"}
"""Packages whose module has another name."""


def declared(*extras: str) -> set[str]:
    project = PROJECT["project"]
    lists = [project["dependencies"], *(project["optional-dependencies"][name] for name in extras)]
    return {line.split(">")[0].split("=")[0].split("[")[0] for each in lists for line in each}


@cache
def nodes(file: Path) -> list[ast.AST]:
    """Return the imports of a file and its texts."""
    wanted = (ast.Import, ast.ImportFrom, ast.Constant)
    return [node for node in ast.walk(ast.parse(file.read_text())) if isinstance(node, wanted)]


def imported(folder: Path) -> set[str]:
    found: set[str] = set()
    for file in folder.rglob("*.py"):
        for node in nodes(file):
            if isinstance(node, ast.Import):
                found |= {name.name.partition(".")[0] for name in node.names}
            elif isinstance(node, ast.ImportFrom) and not node.level:
                found.add(str(node.module).partition(".")[0])
    return {NAMES.get(name, name) for name in found - set(sys.stdlib_module_names)}


@pytest.mark.parametrize(
    ("folder", "extras", "own"),
    [
        ("tirelib", ("fmu", "fleet", "delta", "studio"), {"tirelib"}),
        ("bench/tirebench", ("bench",), {"tirelib", "tirebench"}),
    ],
)
def test_everything_that_is_imported_is_declared(
    folder: str, extras: tuple[str, ...], own: set[str]
) -> None:
    assert imported(ROOT / folder) - own <= declared(*extras)


def modules(root: Path) -> dict[str, Path]:
    return {
        ".".join(file.relative_to(root.parent).with_suffix("").parts): file
        for file in root.rglob("*.py")
        if not file.name.startswith("__")
    }


def named(file: Path) -> set[str]:
    """Return the modules that a file imports or names in a text, as what imports late does."""
    found: set[str] = set()
    for node in nodes(file):
        if isinstance(node, ast.Import):
            found |= {name.name for name in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module, *(f"{node.module}.{name.name}" for name in node.names)}
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            found.add(node.value)
    return found


def test_every_module_is_used_or_documented_for_users() -> None:
    """A verb, an FMU or the bench uses it; else it is on the page of the Python interface."""
    roots = [ROOT / "tirelib", ROOT / "bench" / "tirebench"]
    ours = {name: file for root in roots for name, file in modules(root).items()}
    files = [file for root in (*roots, ROOT / "fmu_src") for file in root.rglob("*.py")]
    used = set().union(*(named(file) for file in files))
    page = (ROOT / "docs" / "reference" / "api.md").read_text()
    documented = {line.split()[-1] for line in page.splitlines() if "automodule" in line}
    commands = {name for name in ours if name.split(".")[1] == "cli"}
    assert sorted(set(ours) - used - documented - commands) == []


def test_the_core_declares_nothing_that_the_library_does_not_import() -> None:
    assert declared() <= imported(ROOT / "tirelib") | {"pyarrow"}  # pandas writes Parquet with it


def test_the_wheel_installs_two_packages_with_their_types() -> None:
    packages = PROJECT["tool"]["hatch"]["build"]["targets"]["wheel"]["packages"]
    assert packages == ["tirelib", "bench/tirebench"]
    assert all((ROOT / package / "py.typed").is_file() for package in packages)


def test_a_release_is_refused_while_versions_differ_or_have_no_date() -> None:
    project = '[project]\nversion = "1.2.0"\n'
    good = (
        project,
        "version: 1.2.0\n",
        "# Changelog\n\n## 1.2.0 - 2027-01-31\n\n## 1.1.0 - 2026-12-01\n",
    )
    assert list(release.findings(*good)) == []
    (other,) = release.findings(project, "version: 1.1.0\n", good[2])
    assert "CITATION.cff names version 1.1.0, pyproject.toml 1.2.0" in other
    (undated,) = release.findings(project, good[1], "## Unreleased\n\n## 1.2.0 - 2027-01-31\n")
    assert "'## 1.2.0 - YEAR-MONTH-DAY'" in undated


def test_the_citation_names_the_version_of_the_package() -> None:
    files = [
        (ROOT / name).read_text() for name in ("pyproject.toml", "CITATION.cff", "CHANGELOG.md")
    ]
    assert not [finding for finding in release.findings(*files) if "CITATION" in finding]
