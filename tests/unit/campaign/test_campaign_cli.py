"""``tirelib campaign check`` and ``show``: exit codes, what is listed, JSON, the picture."""

import json
import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from tests.unit.campaign.campaign_synthetic import HEADER, Write, changed, with_rig
from tirelib.campaign import CampaignHeader, Run, RunPlan, read, write_campaign
from tirelib.cli.campaign import campaign
from tirelib.core.errors import FormatError


def call(*arguments: str | Path) -> Result:
    return CliRunner().invoke(campaign, [str(argument) for argument in arguments])


def test_a_sound_campaign_exits_0_and_says_so(write: Write) -> None:
    folder = write()
    result = call("check", folder)
    assert result.exit_code == 0, result.output
    assert result.stdout.strip().endswith("0 errors, 0 warnings: sound")
    assert result.stderr.splitlines() == ["checking ..."]
    assert call("check", folder, "--quiet").stderr == ""


def test_errors_exit_1_and_all_are_listed_and_counted(
    write: Write, sound_runs: tuple[Run, ...], tmp_path: Path
) -> None:
    runs = changed(sound_runs, 1, with_rig(Fz=lambda x: x / 1e3))
    folder = write(changed(runs, 2, with_rig(Fz=lambda x: 1.2 * x)))
    (folder / "runs" / "007.mf4").unlink()
    result = call("check", folder, "--json", tmp_path / "out" / "check.json")
    assert result.exit_code == 1
    lines = result.stdout.splitlines()
    assert [line.split()[0] for line in lines[:-1]] == ["error", "warning", "error"]
    assert "a factor of 0.001 is suspected (N and kN mixed up)" in lines[0]
    assert "2 errors, 1 warning: not usable until the errors are corrected" in lines[-1]

    document = json.loads((tmp_path / "out" / "check.json").read_text())
    assert document["format"] == "tirelib-campaign-check/1"
    assert (document["errors"], document["warnings"]) == (2, 1)
    assert document["problems"][2] == {
        "severity": "error",
        "where": "runs/007.mf4",
        "given": "the run file cannot be read (No such file or directory)",
        "allowed": "every file of runs.csv must be there",
        "remedy": "restore it or take its row out of runs.csv",
    }


def test_warnings_alone_exit_0(write: Write, sound_runs: tuple[Run, ...]) -> None:
    result = call("check", write(sound_runs[:10]))
    assert result.exit_code == 0
    assert "0 errors, 1 warning: usable, but read the warnings" in result.stdout


def test_swapped_gages_that_nothing_can_show_are_not_called_sound(
    write: Write, sound_runs: tuple[Run, ...]
) -> None:
    straight = [
        replace(run, strain=run.strain[[1, 0, 2, 3, 4]])
        for run in sound_runs
        if run.plan.slip_angle == 0.0
    ]
    result = call("check", write(straight))
    assert result.exit_code == 0
    assert "the order of the gages was not checked" in result.stdout
    assert "sound" not in result.stdout


def test_what_is_no_folder_exits_2_without_traceback(tmp_path: Path) -> None:
    result = call("check", tmp_path / "nothing")
    assert result.exit_code == 2
    assert "not a readable folder (No such file or directory)" in result.stderr
    assert isinstance(result.exception, SystemExit)


def test_an_empty_folder_exits_1(tmp_path: Path) -> None:
    result = call("check", tmp_path)
    assert result.exit_code == 1
    assert "campaign.toml: it cannot be read" in result.stdout
    assert "runs.csv: it cannot be read" in result.stdout


@pytest.mark.parametrize("verb", ["check", "show"])
def test_help_shows_an_example(verb: str) -> None:
    assert f"tirelib campaign {verb} straight" in call(verb, "--help").output


def png_size(file: Path) -> tuple[int, int]:
    content = file.read_bytes()
    assert content.startswith(b"\x89PNG")
    width, height = struct.unpack_from(">2I", content, 16)
    return width, height


def test_show_prints_header_runs_and_the_path_of_the_picture(write: Write, tmp_path: Path) -> None:
    result = call("show", write(), "--out", tmp_path / "o", "--json", tmp_path / "show.json")
    assert result.exit_code == 0, result.output
    picture = tmp_path / "o" / "overview.png"
    assert result.stdout.splitlines()[-1] == f"overview plot: {picture}"
    assert png_size(picture) == (1430, 946)
    assert "files adapted_sae, shown here iso" in result.stdout
    assert "y = +60 mm, +30 mm, 0 mm, -30 mm, -60 mm" in result.stdout
    row = next(line for line in result.stdout.splitlines() if line.split()[:2] == ["9", "corner"])
    assert "5000 / 49" in row
    assert "4.0 / 4.0" in row
    assert "…" not in result.stdout


def test_show_writes_what_was_measured_as_arrays(write: Write, tmp_path: Path) -> None:
    file = tmp_path / "measured.npz"
    result = call("show", write(), "--out", tmp_path / "o", "--data", file)
    assert result.exit_code == 0, result.output
    with np.load(file) as data:
        assert data["measured"].shape == (data["run"].size, data["angle"].size)
        assert 100.0 < np.ptp(data["measured"], axis=1).min() < 1e5  # in microstrain


def test_show_without_a_plot_reads_each_run_once(
    write: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    loaded, load = [], read.load_run

    def counted(folder: Path, plan: RunPlan, header: CampaignHeader) -> Run:
        loaded.append(plan.run)
        return load(folder, plan, header)

    monkeypatch.setattr(read, "load_run", counted)
    monkeypatch.chdir(tmp_path)
    files = ["--data", tmp_path / "measured.npz", "--json", tmp_path / "show.json"]
    result = call("show", write(), "--no-plot", *files)
    assert result.exit_code == 0, result.output
    document = json.loads((tmp_path / "show.json").read_text())
    assert document["plot"] is None
    assert loaded == [run["run"] for run in document["runs"]]
    assert not list(tmp_path.rglob("*.png"))


def test_show_says_why_there_is_nothing_to_draw(
    write: Write, sound_runs: tuple[Run, ...], tmp_path: Path
) -> None:
    file = tmp_path / "measured.npz"
    bare = [replace(run, strain=None, trigger=None) for run in sound_runs]
    result = call("show", write(bare), "--out", tmp_path / "o", "--data", file)
    assert result.exit_code == 0, result.output
    assert f"{file} is not written: " in result.stderr
    assert "holds no strain" in result.stderr
    assert not file.exists()


def test_show_writes_set_points_and_means_in_field_units(write: Write, tmp_path: Path) -> None:
    call("show", write(), "--out", tmp_path / "o", "--json", tmp_path / "show.json")
    document = json.loads((tmp_path / "show.json").read_text())
    assert document["format"] == "tirelib-campaign-show/1"
    assert document["axes"] == "iso"
    assert document["header"]["gage_lateral_mm"] == [60.0, 30.0, 0.0, -30.0, -60.0]
    assert len(document["content_hash"]) == 64
    run = document["runs"][9]
    assert run["set_point"]["slip_angle_deg"] == pytest.approx(4.0)
    assert run["set_point"]["pressure_bar"] == pytest.approx(2.3)
    # 36 samples of 20 N noise: a standard error of 3 N
    assert run["mean"]["Fy_N"] == pytest.approx(-6e4 * np.deg2rad(4.0), abs=15.0)
    assert run["mean"]["speed_kmh"] == pytest.approx(65.0, rel=1e-2)


def test_show_draws_a_sweep_without_strain(tmp_path: Path) -> None:
    nan = float("nan")
    times = np.arange(0.0, 20.0, 0.01)
    angle = 0.15 * np.sin(times)
    rig = {"Fy": -4e4 * angle, "Fz": np.full_like(times, 4e3), "slip_angle": angle}
    run = Run(RunPlan(0, "", "sweep", nan, nan, nan, nan, nan, nan), rig=rig, rig_time=times)
    header = replace(HEADER, gage_lateral=(), rate=nan)
    write_campaign(tmp_path / "c", header, [run])
    result = call("show", tmp_path / "c", "--out", tmp_path / "o")
    assert result.exit_code == 0, result.output
    assert "none: forces and moments only" in result.stdout
    assert png_size(tmp_path / "o" / "overview.png") == (1430, 528)


def test_show_leaves_a_bad_campaign_to_the_shared_wrapper(tmp_path: Path) -> None:
    assert isinstance(call("show", tmp_path).exception, FormatError)
