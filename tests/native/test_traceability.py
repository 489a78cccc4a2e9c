"""Each function of the core leads to its Python reference, its equation and its test."""

import re
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

import pytest

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs/reference/native_functions.md"
FUNCTION = re.compile(r"^(?:[a-zA-Z_]\w*[ *]+)+(\w+)\([^;{}]*?\)\s*\{", re.MULTILINE)
"""A definition: it begins its line, and braces follow."""
ROOTS = ("numpy", "scipy", "tirelib", "int", "min")


class Row(NamedTuple):
    """A function's line of the page."""

    file: str
    function: str
    reference: str
    rule: str
    test: str


def rows() -> Iterator[Row]:
    """Read the page; a name of Python gets the module of its heading."""
    for section in PAGE.read_text(encoding="utf-8").split("\n## ")[1:]:
        file, module = re.findall(r"`([^`]+)`", section.splitlines()[0])
        for line in section.splitlines()[1:]:
            if not line.startswith("| `"):
                continue
            function, name, rule, test = (cell.strip(" `") for cell in line.strip("|").split("|"))
            known = name.partition(".")[0] in ROOTS
            yield Row(file, function, name if known else f"{module}.{name}", rule, test)


ROWS = [*rows()]


def defined(text: str) -> list[str]:
    """Return the functions that a C text defines."""
    return FUNCTION.findall(re.sub(r"/\*.*?\*/|^#.*?$", "", text, flags=re.DOTALL | re.MULTILINE))


def found(name: str) -> Any:
    """Import as much of a dotted name as is a module, and take the rest from it."""
    parts = name.split(".")
    for size in range(len(parts), 0, -1):
        try:
            thing: Any = import_module(".".join(parts[:size]))
        except ModuleNotFoundError:
            continue
        for part in parts[size:]:
            thing = getattr(thing, part)
        return thing
    return getattr(import_module("builtins"), name)


@cache
def text(file: Path) -> str:
    return file.read_text(encoding="utf-8")


@cache
def headings(page: Path) -> set[str]:
    """Return the anchors of a page's headings."""
    titles = re.findall(r"^#+ (.*)$", text(page), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", title).strip().lower().replace(" ", "-") for title in titles}


def test_a_definition_is_told_from_a_call_and_from_a_declaration() -> None:
    source = "int f(int a);\nstatic int *g(A *a,\n    int b) {\n    h(b);\n    if (b) {\n    }\n}\n"
    assert defined(source) == ["g"]


@pytest.mark.parametrize("room", ["core", "tire"])
def test_every_function_of_the_core_has_its_line_and_no_other(room: str) -> None:
    sources = (ROOT / "fmu_src" / room).glob("*.[ch]")
    written = [(source.stem, name) for source in sources for name in defined(source.read_text())]
    listed = [
        (Path(row.file).stem, row.function) for row in ROWS if Path(row.file).parts[0] == room
    ]
    assert sorted(listed) == sorted(written)
    assert len(written) > 15


@pytest.mark.parametrize("file", dict.fromkeys(row.file for row in ROWS))
def test_the_lines_of_a_file_lead_to_code_rules_and_tests_that_exist(file: str) -> None:
    for row in ROWS:
        if row.file == file:
            assert found(row.reference) is not None, row
            assert row.rule, row
            for page, anchor in re.findall(r"\]\(([^)#]+)(?:#([^)]+))?\)", row.rule):
                assert (PAGE.parent / page).is_file(), row
                assert not anchor or anchor in headings(PAGE.parent / page), row
            module, _, test = row.test.partition("::")
            assert f"def {test}(" in text(Path(__file__).with_name(f"{module}.py")), row
