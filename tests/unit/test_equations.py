"""The list of equations (`docs/theory/equations.toml`) and the docstrings cite the same numbers."""

import ast
import re
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = {
    "tirelib": ROOT / "tirelib",
    "tirebench": ROOT / "bench/tirebench",
    "routes": ROOT / "build/routes",
}
ONE = r"(?:\(\d+\)|\d+)"
CITED = re.compile(rf"\bEq\.\s+({ONE}(?:(?:,? and |,\s+|\s+to\s+|-){ONE})*)")
LISTED: list[dict[str, Any]] = [
    equation
    for part in tomllib.loads((ROOT / "docs/theory/equations.toml").read_text("utf-8"))["part"]
    for equation in part["equation"]
]


def expanded(numbers: str) -> set[int]:
    """ "(36) to (40), 53" as a set."""
    plain = re.sub(r"\s*(?:to|-)\s*", "-", re.sub(r"[()]", " ", numbers))
    return {
        n
        for low, high in re.findall(r"(\d+)(?:-(\d+))?", plain)
        for n in range(int(low), int(high or low) + 1)
    }


def file_of(module: str) -> Path:
    package, *rest = module.split(".")
    return PACKAGES[package].joinpath(*rest).with_suffix(".py")


def docstrings(path: Path) -> Iterator[str]:
    """Docstrings of modules, classes, functions and attributes, and the sources of effects."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        value = node.value if isinstance(node, ast.Expr) else None
        if isinstance(node, ast.keyword) and node.arg == "source":
            value = node.value
        if isinstance(value, ast.Constant) and isinstance(value.value, str):
            yield " ".join(value.value.split())


@cache
def cited(path: Path) -> set[int]:
    found = [m.group(1) for text in docstrings(path) for m in CITED.finditer(text)]
    return set().union(*(expanded(numbers) for numbers in found))


@cache
def names(path: Path) -> set[str]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    kinds = (ast.FunctionDef, ast.ClassDef)
    defined = {node.name for node in ast.walk(tree) if isinstance(node, kinds)}
    stored = {
        node.id
        for node in ast.walk(tree)
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
    }
    return defined | stored | {"<module>"}


def modules_of(equation: dict[str, Any]) -> set[str]:
    return {name.partition(":")[0] for name in equation["code"]} | {*equation.get("mentions", ())}


@pytest.mark.parametrize("equation", LISTED, ids=lambda e: e["numbers"])
def test_a_listed_equation_is_cited_by_its_code_and_has_a_test(equation: dict[str, Any]) -> None:
    numbers = expanded(equation["numbers"])
    silent = [m for m in sorted(modules_of(equation)) if not numbers & cited(file_of(m))]
    assert silent == []
    for name in equation["code"]:
        module, _, thing = name.partition(":")
        assert thing in names(file_of(module)), name
    assert equation["tests"]
    for name in equation["tests"]:
        file, _, test = name.partition("::")
        assert test in names(ROOT / file), name


def test_every_equation_that_a_docstring_cites_is_listed() -> None:
    missing = []
    for package, folder in PACKAGES.items():
        for path in sorted(folder.rglob("*.py")):
            module = ".".join((package, *path.relative_to(folder).with_suffix("").parts))
            here = [expanded(e["numbers"]) for e in LISTED if module in modules_of(e)]
            unlisted = cited(path) - set().union(*here)
            if unlisted:
                missing.append((module, sorted(unlisted)))
    assert missing == []


def test_an_equation_is_listed_once() -> None:
    every = [n for equation in LISTED for n in expanded(equation["numbers"])]
    assert sorted(every) == sorted({*every})


def test_every_equation_has_its_law_symbols_range_test_and_plot() -> None:
    needed = {"numbers", "name", "law", "symbols", "valid", "code", "tests", "plot"}
    lacking = {each["numbers"]: needed - each.keys() for each in LISTED if needed - each.keys()}
    assert lacking == {}
