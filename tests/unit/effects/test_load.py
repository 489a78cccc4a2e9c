"""Effects of users: files and entry points, and every way in which they can be wrong."""

from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import pytest

from tirelib.core.errors import FormatError
from tirelib.effects import CATALOGUE
from tirelib.effects import load as module
from tirelib.effects.load import all_effects, read_effects

GOOD = """
from tirelib.effects import effect

@effect("{name}", stage="tread", unit="1", low=0.0, high=1.0)
def law(state, strength):
    "Stiffer tread."
    return state.but(k_t=state.k_t * (1.0 + strength))
"""


def write(folder: Path, text: str, name: str = "mine.py") -> Path:
    file = folder / name
    file.write_text(text, encoding="utf-8")
    return file


def test_a_files_effects_come_after_the_catalogue(tmp_path: Path) -> None:
    found = all_effects([write(tmp_path, GOOD.format(name="stiffer"))])
    assert list(found) == [*CATALOGUE, "stiffer"]
    assert found["stiffer"].title == "Stiffer tread."
    assert "mine.py, line 4" in found["stiffer"].origin
    assert list(all_effects()) == list(CATALOGUE)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("x = (1,\ny = 2\n", ("line 1", "not Python", "x = (1,")),
        ("import tirelib\n\nx = 1 / 0\n", ("line 3", "ZeroDivisionError")),
        ("import no_such_module\n", ("line 1", "ModuleNotFoundError")),
        ("x = 1\n", ("holds no effect", "@effect")),
        (
            "from tirelib.effects import CATALOGUE, effect\nx = CATALOGUE['camber']\n",
            ("no effect",),
        ),
        (GOOD.format(name="Big Name"), ("line 4", "'Big Name'", "lower_case")),
        (GOOD.format(name="a").replace('"tread"', '"tyre"'), ("line 4", "stage 'tyre'")),
        (GOOD.format(name="a").replace('unit="1"', 'unit="foo"'), ("line 4", "unit 'foo'")),
        (GOOD.format(name="a").replace("low=0.0", "low=2.0"), ("line 4", "range 2.0 .. 1.0")),
        (GOOD.format(name="a").replace("low=0.0, ", ""), ("line 4", "TypeError", "'low'")),
    ],
)
def test_a_bad_file_is_refused_with_its_line(
    tmp_path: Path, text: str, words: tuple[str, ...]
) -> None:
    with pytest.raises(FormatError) as caught:
        read_effects(write(tmp_path, text))
    for word in ("mine.py", *words):
        assert word in str(caught.value)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=r"none\.py: cannot be read"):
        all_effects([tmp_path / "none.py"])


def test_no_name_is_given_twice_and_all_faults_come_at_once(tmp_path: Path) -> None:
    files = [
        write(tmp_path, GOOD.format(name="camber"), "one.py"),
        write(tmp_path, GOOD.format(name="mine"), "two.py"),
        write(tmp_path, GOOD.format(name="mine"), "three.py"),
    ]
    with pytest.raises(FormatError) as caught:
        all_effects(files)
    first, second = caught.value.problems
    for word in ("one.py", "'camber'", "camber.py", "names must be unique"):
        assert word in first
    for word in ("three.py", "'mine'", "two.py"):
        assert word in second


def test_installed_packages_join_by_entry_points(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write(
        tmp_path, GOOD.format(name="stiffer") + "\nlisted = [law]\nwrong = 3\n", "plugin_of_test.py"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    entries: list[EntryPoint] = []

    def found(**given: Any) -> list[EntryPoint]:
        assert given == {"group": "tirelib.effects"}
        return entries

    monkeypatch.setattr(module, "entry_points", found)
    for value in ("plugin_of_test:law", "plugin_of_test:listed", "plugin_of_test"):
        entries[:] = [EntryPoint("one", value, "tirelib.effects")]
        if value == "plugin_of_test":
            with pytest.raises(
                FormatError, match="entry point one = plugin_of_test: holds no effect"
            ):
                all_effects()
        else:
            assert "stiffer" in all_effects()
        assert "stiffer" not in all_effects(installed=False)
    entries[:] = [EntryPoint("two", "plugin_of_test:absent", "tirelib.effects")]
    with pytest.raises(FormatError, match=r"entry point two .*AttributeError.*uninstall"):
        all_effects()
