"""The main job through the command line: answers, files, exit codes, messages."""

import io
import json
import os
import shutil
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import pandas as pd
import pytest

from tests.synthetic import cornering_runs, synthetic_run, write
from tirelib.campaign import read_campaign
from tirelib.cli import main
from tirelib.core.threads import VARIABLES


def alone(*words: object) -> subprocess.CompletedProcess[str]:
    """Run the program as a process of its own."""
    program = "import sys; from tirelib.cli import main; sys.argv[0] = 'tirelib'; main()"
    return subprocess.run(
        [sys.executable, "-c", program, *map(str, words)],
        capture_output=True,
        text=True,
        check=False,
    )


def run(*words: object) -> subprocess.CompletedProcess[str]:
    """Run the program in this process, from its first line to its exit code."""
    out, err = io.StringIO(), io.StringIO()
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(out), redirect_stderr(err):
        patch.setattr(sys, "argv", ["tirelib", *map(str, words)])
        for name in VARIABLES:  # the program sets them
            patch.setenv(name, os.environ.get(name, ""))
        with pytest.raises(SystemExit) as end:
            main()
    return subprocess.CompletedProcess(
        words, int(end.value.code or 0), out.getvalue(), err.getvalue()
    )


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory, rough_figures: None) -> Path:
    folder = tmp_path_factory.mktemp("journey")
    write(folder / "set1", cornering_runs())
    write(folder / "day2", cornering_runs(seed=5))
    made = run(
        "calibrate", folder / "set1", "--out", folder / "cal.toml", "--json", folder / "cal.json"
    )
    assert made.returncode == 0, made.stderr
    return folder


def test_calibrate_prints_and_stores_statistics(place: Path) -> None:
    document = json.loads((place / "cal.json").read_text())
    assert document["format"] == "tirelib-calibrate/1"
    names = [regression["source"] for regression in document["regressions"]]
    assert names[:4] == ["Fig. 4-4", "Fig. 4-5", "Fig. 4-7", "Table 4-1"]
    for regression in document["regressions"]:
        for term in regression["terms"]:
            assert term["std_error"] >= 0.0
            assert 0.0 <= term["p_value"] <= 1.0
    for quantity in ("Fz", "alpha", "kappa", "Fy"):
        assert document["in_use"][quantity]["cross_validated_rmse"] > 0.0
    held = {(row["held_out"], row["level"]) for row in document["held_out"]}
    assert ("load", "4500 N") in held
    loads = [row for row in document["held_out"] if row["held_out"] == "load"]
    for row in loads:  # what is not flagged is no worse than the dissertation's
        if row["quantity"] in ("Fz", "Fy") and not row["inside"]:
            assert row["in_range"] == 0.0, row
        if row["in_use_in_range"] is not None and row["dissertation"] is not None:
            assert row["in_use_in_range"] < row["dissertation"], row
    assert document["data"][0]["sha256"] == read_campaign(place / "set1").content_hash()
    text = (place / "cal.toml").read_text()
    assert 'format = "tirelib-calibration/2"' in text
    assert "sha256" in text


def test_estimate_writes_the_contract(place: Path) -> None:
    done = run(
        "estimate", place / "day2", "--calibration", place / "cal.toml", "--json", place / "e.json"
    )
    assert done.returncode == 0, done.stderr
    document = json.loads((place / "e.json").read_text())
    assert document["format"] == "tirelib-estimate/1"
    assert document["axes"] == "iso"
    assert set(document["summary"]) == {"Fz", "alpha", "kappa", "Fy"}
    for quantity, unit in (("Fz", "N"), ("alpha", "deg"), ("kappa", "1"), ("Fy", "N")):
        entry = document["summary"][quantity]
        assert set(entry) >= {"rmse", "unit", "r2", "n", "rmse_percent_of_range"}
        assert entry["unit"] == unit
        assert entry["n"] == 35
    assert document["not_given"] == []
    assert "was not given" not in done.stdout
    turn = next(turn for turn in document["turns"] if turn["valid"])
    assert set(turn) >= {
        "run",
        "t",
        "Fz",
        "Fz_std",
        "alpha",
        "alpha_std",
        "kappa",
        "kappa_std",
        "Fy",
        "Fy_std",
        "valid",
        "flags",
    }
    assert turn["flags"] == []
    first = document["turns"][0]
    assert first["flags"] == ["first_turn", *first["flags"][1:]]
    assert first["Fz"] is None
    assert not first["valid"]
    plans = {plan.run: plan for plan in read_campaign(place / "day2").plans}
    for turn in document["turns"]:
        if turn["valid"]:
            assert turn["Fz"] == pytest.approx(plans[turn["run"]].load, abs=6 * turn["Fz_std"])


def test_the_condition_that_costs_most_is_named(place: Path, tmp_path: Path) -> None:
    shutil.copytree(place / "day2", tmp_path / "day2")
    plan = tmp_path / "day2" / "runs.csv"
    pd.read_csv(plan).drop(columns="tread_depth_mm").to_csv(plan, index=False)
    done = run(
        "estimate",
        tmp_path / "day2",
        "--calibration",
        place / "cal.toml",
        "--json",
        tmp_path / "e.json",
    )
    assert done.returncode == 0, done.stderr
    rows = json.loads((tmp_path / "e.json").read_text())["not_given"]
    (load,) = (row for row in rows if row["quantity"] == "Fz")
    assert (load["condition"], load["column"]) == ("tread_depth", "tread_depth_mm")
    assert load["std"] > 2.0 * load["std_if_given"]
    said = " ".join(done.stdout.split())
    assert "The tread depth was not given: the standard deviation of" in said
    assert f"of Fz is {load['std']:.3g} N instead of {load['std_if_given']:.3g} N" in said
    assert "(column tread_depth_mm of runs.csv" in said


def test_a_quantity_without_calibration_is_null(place: Path, tmp_path: Path) -> None:
    slips = (-0.1, -0.05, 0.0, 0.05, 0.1)
    runs = [synthetic_run(i, slip_ratio=k, kind="drive") for i, k in enumerate(slips)]
    write(tmp_path / "drive", runs)
    assert run("calibrate", tmp_path / "drive", "--out", tmp_path / "c.toml").returncode == 0
    done = run(
        "estimate",
        tmp_path / "drive",
        "--calibration",
        tmp_path / "c.toml",
        "--json",
        tmp_path / "e.json",
    )
    assert done.returncode == 0
    document = json.loads((tmp_path / "e.json").read_text())
    assert document["summary"]["Fz"] is None
    assert document["summary"]["kappa"]["rmse"] < 1e-3
    assert all(turn["Fz"] is None for turn in document["turns"])


@pytest.mark.parametrize("name", ["f.parquet", "f.csv"])
def test_features_writes_a_row_per_turn_and_gage(place: Path, tmp_path: Path, name: str) -> None:
    done = run("features", place / "set1", "--out", tmp_path / name, "--json", tmp_path / "f.json")
    assert done.returncode == 0, done.stderr
    read = pd.read_parquet if name.endswith("parquet") else pd.read_csv
    table = read(tmp_path / name)
    summary = json.loads((tmp_path / "f.json").read_text())
    assert len(table) == 5 * summary["turns"]
    assert summary["units"]["contact_angle"] == "rad"
    good = table[table["flags"].fillna("") == ""]
    assert good["contact_angle"].between(0.1, 0.7).all()


def test_several_campaigns_in_one_call(place: Path, tmp_path: Path) -> None:
    done = run("calibrate", place / "set1", place / "day2", "--out", tmp_path / "c.toml", "--quick")
    assert done.returncode == 0, done.stderr


def test_not_one_valid_turn_is_a_negative_answer(place: Path, tmp_path: Path) -> None:
    write(tmp_path / "heavy", [synthetic_run(0, load=12000.0)])
    done = run("estimate", tmp_path / "heavy", "--calibration", place / "cal.toml")
    assert done.returncode == 1
    assert "out_of_range" in done.stdout


def broken(place: Path, tmp_path: Path) -> dict[str, tuple[list[object], str]]:
    cal, data = place / "cal.toml", place / "set1"
    write(tmp_path / "other", [synthetic_run(0)], tire="another tire")
    write(tmp_path / "few", [synthetic_run(i, load=2000.0 + 900.0 * i) for i in range(3)])
    (tmp_path / "old.toml").write_text('format = "tirelib-calibration/9"\n')
    (tmp_path / "cut.toml").write_text(cal.read_text()[:400] + '\nname = "cut')
    (tmp_path / "half.toml").write_text(cal.read_text().replace("[chain.laws]", "[chain.lows]"))
    estimate = ["estimate", data, "--calibration"]
    out = ["--out", tmp_path / "x.toml"]
    return {
        "no folder": (["estimate", tmp_path / "none", "--calibration", cal], "campaign.toml"),
        "no calibration": ([*estimate, tmp_path / "none.toml"], "cannot be read"),
        "unknown version": ([*estimate, tmp_path / "old.toml"], "this version reads"),
        "cut off": ([*estimate, tmp_path / "cut.toml"], "is not TOML"),
        "damaged": ([*estimate, tmp_path / "half.toml"], "chain[0].laws: is missing"),
        "another tire": (["estimate", tmp_path / "other", "--calibration", cal], "another tire"),
        "mixed tires": (["calibrate", data, tmp_path / "other", *out], "holds for one tire"),
        "too few": (["calibrate", tmp_path / "few", *out], "at least 5"),
        "twice": (["calibrate", data, data, *out], "is given twice"),
        "unknown table": (["features", data, "--out", tmp_path / "f.xlsx"], ".parquet and .csv"),
        "bad order": (["calibrate", data, *out, "--order", "3"], "8 .. 120"),
        "no option": (["calibrate", data], "Missing option '--out'"),
        "no verb": (["calibratte", data], "no such command 'calibratte'"),
    }


def test_bad_input_ends_with_exit_code_two_and_a_message(place: Path, tmp_path: Path) -> None:
    for name, (words, message) in broken(place, tmp_path).items():
        done = run(*words)
        assert done.returncode == 2, (name, done.stdout, done.stderr)
        assert message in done.stderr, (name, done.stderr)
        assert "Traceback" not in done.stderr, name


def test_a_process_ends_as_the_program_does(place: Path, tmp_path: Path) -> None:
    words, message = broken(place, tmp_path)["another tire"]
    done = alone(*words)
    assert (done.returncode, done.stdout) == (2, "")
    assert message in done.stderr
    assert "Traceback" not in done.stderr


def test_names_with_markup_stay_names(place: Path, tmp_path: Path) -> None:
    write(tmp_path / "day [b]", [synthetic_run(0)], name="x [/b] y [red]z")
    done = run(
        "estimate",
        tmp_path / "day [b]",
        "--calibration",
        place / "cal.toml",
        "--json",
        tmp_path / "a[/b].json",
    )
    assert done.returncode == 0, done.stderr
    assert "x [/b] y [red]z" in done.stdout
    assert "a[/b].json" in done.stdout


def test_an_output_that_cannot_be_written_is_bad_input(place: Path, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    done = run("calibrate", place / "set1", "--quick", "--out", tmp_path / "file" / "c.toml")
    assert done.returncode == 2
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize("verb", ["campaign", "features", "calibrate", "estimate", "rig"])
def test_every_verb_has_help_with_an_example(verb: str) -> None:
    done = run(verb, "--help")
    assert done.returncode == 0
    if verb == "campaign":
        done = run(verb, "check", "--help")
    assert "Example" in done.stdout
    assert "tirelib " in done.stdout
