"""A place that cannot be written is refused before any work, by every verb."""

from collections.abc import Iterator
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from tirelib.cli import program
from tirelib.cli.common import NEW_FILE, NewPath

WRITING = ("--out", "--json", "--report")


def writing_options(group: click.Group, path: str = "") -> Iterator[tuple[str, click.Parameter]]:
    context = click.Context(group)
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        assert command is not None
        if isinstance(command, click.Group):
            yield from writing_options(command, f"{path}{name} ")
        else:
            yield from (
                (f"{path}{name} {option.opts[0]}", option)
                for option in command.params
                if option.opts[0] in WRITING
            )


def test_every_option_that_names_something_to_write_is_tried_at_once() -> None:
    options = dict(writing_options(program))
    assert len(options) > 25
    assert [name for name, option in options.items() if not isinstance(option.type, NewPath)] == []


def test_a_place_below_a_file_is_refused_before_the_campaign_is_read(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    target = tmp_path / "file" / "M.toml"
    done = CliRunner().invoke(program, ["identify", "no-campaign", "--out", str(target)])
    assert done.exit_code == 2
    assert "cannot be written" in done.output
    assert "choose another one" in done.output
    assert "no-campaign" not in done.output


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="this system has no folder that refuses")
def test_a_folder_that_takes_no_files_is_refused() -> None:
    with pytest.raises(click.BadParameter, match="cannot be written"):
        NEW_FILE.convert("/proc/none/E.json", None, None)


def test_nothing_is_left_behind_and_what_stands_there_is_kept(tmp_path: Path) -> None:
    old = tmp_path / "E.json"
    old.write_text("old")
    assert NEW_FILE.convert(str(old), None, None) == old
    new = tmp_path / "a" / "b" / "E.json"
    assert NEW_FILE.convert(str(new), None, None) == new
    assert old.read_text() == "old"
    assert list(tmp_path.iterdir()) == [old]


@pytest.mark.parametrize(
    ("target", "said"),
    [
        ("projects/rig.json", ""),
        ("new.json", ""),
        ("progects/rig.json", "progects is new; there is {0}/projects as well"),
        ("results/today/rig.json", "results is new\n"),
    ],
)
def test_folders_that_are_made_on_the_way_are_said(target: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "projects").mkdir()
    done = CliRunner().invoke(program, ["rig", "--list", "--json", str(tmp_path / target)])
    assert done.exit_code == 0
    assert (tmp_path / target).is_file()
    wanted = f"note: the folder {tmp_path}/{said.format(tmp_path)}" if said else ""
    assert done.stderr.rstrip() == wanted.rstrip()


def test_a_folder_that_was_not_made_is_not_said(tmp_path: Path) -> None:
    call = ["features", str(tmp_path / "none"), "--out", str(tmp_path / "new" / "F.parquet")]
    done = CliRunner().invoke(program, call)
    assert done.exit_code != 0
    assert "is new" not in done.stderr
