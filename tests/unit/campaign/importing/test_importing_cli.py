"""``tirelib import``: exit codes, what is printed, JSON, and that its campaign passes the check."""

import json
import subprocess
import sys
from pathlib import Path

from click.testing import CliRunner, Result

from tests.unit.campaign.importing.importing_synthetic import (
    sae_columns,
    sae_map,
    write_csv,
    write_map,
    write_parquet,
)
from tirelib.cli import program
from tirelib.cli.campaign import campaign
from tirelib.core.errors import FormatError


def call(*arguments: str | Path) -> Result:
    return CliRunner().invoke(program, ["import", *map(str, arguments)])


def test_an_import_exits_0_and_its_campaign_passes_check_and_show(tmp_path: Path) -> None:
    file = write_csv(tmp_path / "a.csv", sae_columns(), separator=";", decimal=",")
    out, summary = tmp_path / "new" / "campaign", tmp_path / "s.json"
    result = call(file, "--map", write_map(tmp_path, sae_map()), "--out", out, "--json", summary)
    assert result.exit_code == 0, result.output
    assert "1 run(s), 400 rows, files in axes sae" in result.stdout
    assert "note: " in result.stderr
    assert "separator ';', decimal ','" in result.stderr

    document = json.loads(summary.read_text())
    assert document["format"] == "tirelib-import/1"
    assert (document["axes_of_files"], document["gages"]) == ("sae", None)
    (run,) = document["runs"]
    assert (run["run"], run["kind"], run["rows"]) == (0, "sweep", 400)
    assert run["source"] == str(file)
    assert "Fz" in run["channels"]

    check = CliRunner().invoke(campaign, ["check", str(out)])
    assert check.exit_code == 0
    assert "0 errors, 0 warnings: sound" in check.stdout
    show = CliRunner().invoke(campaign, ["show", str(out), "--out", str(tmp_path / "show")])
    assert show.exit_code == 0, show.output


def test_a_folder_is_answered_with_what_to_type(tmp_path: Path) -> None:
    result = call(tmp_path, "--list")
    assert result.exit_code == 2
    assert f"{tmp_path} is a folder; name its files, for example {tmp_path}/*.csv" in result.output


def test_bad_input_exits_2_lists_all_faults_and_writes_nothing(tmp_path: Path) -> None:
    columns = sae_columns()
    columns["FZ"] = -columns["FZ"]
    columns["SA_"] = columns.pop("SA")
    file = write_parquet(tmp_path / "a.parquet", columns)
    arguments = [
        str(file),
        "--map",
        str(write_map(tmp_path, sae_map())),
        "--out",
        str(tmp_path / "out"),
    ]
    done = subprocess.run(
        [sys.executable, "-c", "from tirelib.cli import main; main()", "import", *arguments],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert "Traceback" not in done.stderr
    assert "did you mean 'SA_'" in done.stderr
    assert done.stdout == ""
    assert not (tmp_path / "out").exists()


def test_an_old_campaign_is_kept_unless_forced(tmp_path: Path) -> None:
    file = write_csv(tmp_path / "a.csv", sae_columns())
    arguments = (file, "--map", write_map(tmp_path, sae_map()), "--out", tmp_path / "out")
    assert call(*arguments).exit_code == 0
    refused = call(*arguments)
    assert "a campaign is already there" in str(refused.exception)
    assert call(*arguments, "--force").exit_code == 0


def test_map_and_out_are_asked_for(tmp_path: Path) -> None:
    result = call(write_csv(tmp_path / "a.csv", sae_columns()))
    assert result.exit_code == 2
    assert "--map and --out is missing" in result.stderr
    assert call().exit_code == 2


def test_a_condition_that_is_left_out_is_said_over_all_files(tmp_path: Path) -> None:
    document = sae_map()
    del document["channels"]["camber"]
    upright, leaning = sae_columns(), sae_columns(seed=2)
    upright["IA"], leaning["IA"] = 0.0 * upright["IA"], 0.0 * leaning["IA"] + 4.0
    files = [
        write_csv(tmp_path / f"{k}.csv", columns) for k, columns in enumerate((upright, leaning))
    ]
    known = "warning: column 'IA': it is known as camber, "
    a_map = write_map(tmp_path, document)
    result = call(*files, "--map", a_map, "--out", tmp_path / "both")
    assert f"{known}varies (0 .. 4) and is not mapped" in result.stderr
    assert "runs at different camber count as repeats" in result.stderr
    result = call(files[1], "--map", a_map, "--out", tmp_path / "leaning")
    assert f"{known}stands (at 4) and is not mapped" in result.stderr
    result = call(files[0], "--map", a_map, "--out", tmp_path / "upright")
    assert "is not mapped" not in result.stderr
    result = call(*files, "--map", write_map(tmp_path, sae_map()), "--out", tmp_path / "whole")
    assert "is not mapped" not in result.stderr


def test_list_and_suggest_need_no_map(tmp_path: Path) -> None:
    file = write_csv(tmp_path / "a.csv", sae_columns())
    listed = call(file, "--list", "--json", tmp_path / "l.json")
    assert listed.exit_code == 0
    assert "slip_angle" in listed.stdout
    document = json.loads((tmp_path / "l.json").read_text())
    assert document["format"] == "tirelib-import-list/1"
    columns = {item["name"]: item for item in document["files"][0]["columns"]}
    assert columns["SA"]["quantity"] == "slip_angle"
    assert abs(columns["SA"]["max"] - 6.0) < 1e-3

    draft = call(file, "--suggest")
    assert draft.exit_code == 0
    assert (
        'slip_angle = { column = "SA", unit = "" }  # state the unit of this angle' in draft.stdout
    )


def test_a_listing_goes_on_after_a_file_that_cannot_be_read(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("a tire\n")
    sound = write_csv(tmp_path / "b.csv", sae_columns())
    listed = call(tmp_path / "a.csv", sound, "--list", "--json", tmp_path / "l.json")
    assert listed.exit_code == 1
    assert "warning: " in listed.stderr
    document = json.loads((tmp_path / "l.json").read_text())
    assert [each["file"] for each in document["files"]] == [str(sound)]
    assert [each["file"] for each in document["unreadable"]] == [str(tmp_path / "a.csv")]
    load = next(one for one in document["files"][0]["columns"] if one["name"] == "FZ")
    assert load["min"] <= -load["middle"] <= load["max"] < 0.0
    assert call(tmp_path / "a.csv", sound, "--suggest").stdout == call(sound, "--suggest").stdout
    assert isinstance(call(tmp_path / "a.csv", "--list").exception, FormatError)


def test_a_listing_takes_the_layout_from_a_map(tmp_path: Path) -> None:
    file = tmp_path / "a.csv"
    file.write_text("a;b|c\n1;2|3\n4;5|6\n7;8|9\n")
    assert "it reads equally well" in str(call(file, "--list").exception)
    layout = write_map(tmp_path, '[csv]\nseparator = "|"\n')
    listed = call(file, "--list", "--map", layout)
    assert listed.exit_code == 0
    assert "separator '|'" in listed.stdout


def test_a_file_that_is_not_there_is_a_fault_like_others(tmp_path: Path) -> None:
    arguments = ("--map", write_map(tmp_path, sae_map()), "--out", tmp_path / "out")
    result = call(tmp_path / "no.csv", tmp_path / "no.mat", *arguments)
    assert isinstance(result.exception, FormatError)
    assert len(result.exception.problems) == 2


def test_help_shows_an_example() -> None:
    result = call("--help")
    assert "tirelib import cornering.mat --map cornering.map.toml --out" in result.stdout
    assert "import" in CliRunner().invoke(program, ["--help"]).stdout
