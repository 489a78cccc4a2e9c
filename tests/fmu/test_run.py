"""A campaign played to the FMU gives the document of `tirelib estimate`."""

import json
import shutil
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from tests.fmu import live
from tirelib.campaign import Run, read_campaign, write_campaign
from tirelib.cli.estimate import estimate
from tirelib.cli.fmu import fmu
from tirelib.core.errors import CalibrationError, FormatError
from tirelib.fmu.build import build_fmu
from tirelib.fmu.run import LoadedFmu, play_campaign


def assert_equal(given: Any, wanted: Any, where: str = "") -> None:
    """All keys alike, all numbers within 1e-9."""
    if isinstance(wanted, dict):
        assert given.keys() == wanted.keys(), where
        for key in wanted:
            assert_equal(given[key], wanted[key], f"{where}/{key}")
    elif isinstance(wanted, list):
        assert len(given) == len(wanted), where
        for number, (a, b) in enumerate(zip(given, wanted, strict=True)):
            assert_equal(a, b, f"{where}/{number}")
    elif isinstance(wanted, float):
        np.testing.assert_allclose(given, wanted, rtol=1e-9, atol=1e-9, err_msg=where)
    else:
        assert given == wanted, where


def told(command: Any, *arguments: str) -> Any:
    result = CliRunner().invoke(command, list(arguments), catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.output


@pytest.fixture(scope="module")
def wanted(tmp_path_factory: pytest.TempPathFactory) -> Any:
    path = tmp_path_factory.mktemp("estimate") / "e.json"
    told(
        estimate,
        str(live.campaign_folder()),
        "--calibration",
        str(live.calibration_file()),
        "--json",
        str(path),
    )
    return json.loads(path.read_text())


@pytest.mark.parametrize("samples", [1, 10])
def test_the_document_is_that_of_estimate(tmp_path: Path, wanted: Any, samples: int) -> None:
    file, result = tmp_path / "X.fmu", tmp_path / "f.json"
    output = told(
        fmu,
        "build",
        "--calibration",
        str(live.calibration_file()),
        "--out",
        str(file),
        "--samples-per-step",
        str(samples),
        "--sample-rate",
        "4000",
    )
    assert "live tire" in output
    output = told(fmu, "run", str(file), str(live.campaign_folder()), "--json", str(result))
    given = json.loads(result.read_text())
    assert given["format"] == "tirelib-estimate/1"
    assert len(given["turns"]) >= 3 * 15
    assert_equal(given, wanted)
    assert "Fz" in output


def lacking(run: Run, channel: str) -> Run:
    """Return the run without a rig channel, or with one that ends halfway; Fz keeps its times."""
    rig = {name: values for name, values in run.rig.items() if name != channel}
    if channel == "end":
        half = len(run.rig["Fz"]) // 2
        return replace(run, rig={n: v[:half] for n, v in rig.items()}, rig_time=run.rig_time[:half])
    return replace(run, rig=rig)


@pytest.mark.parametrize("channel", ["speed", "pressure", "camber", "omega", "end"])
def test_a_campaign_that_lacks_a_channel_gives_the_document_of_estimate(
    channel: str, tmp_path: Path
) -> None:
    """Where the rig did not measure, the set point holds; after its end, nothing does."""
    runs = [lacking(run, channel) for run in live.make_runs()[3:6]]
    write_campaign(tmp_path / "c", live.HEADER, runs)
    told(
        estimate,
        str(tmp_path / "c"),
        "--calibration",
        str(live.calibration_file()),
        "--json",
        str(tmp_path / "e"),
    )
    told(fmu, "run", str(live.fmu_file(10)), str(tmp_path / "c"), "--json", str(tmp_path / "f"))
    given, wanted = (json.loads((tmp_path / name).read_text()) for name in "fe")
    assert_equal(given, wanted)
    without_speed = {"no_speed" in turn["flags"] for turn in wanted["turns"][1:]}
    assert without_speed == ({True, False} if channel == "end" else {False})


def test_another_tire_is_refused(tmp_path: Path) -> None:
    header = replace(live.HEADER, tire=replace(live.HEADER.tire, name="another"))
    write_campaign(tmp_path / "c", header, live.make_runs()[:1])
    with (
        LoadedFmu(live.fmu_file(10)) as loaded,
        pytest.raises(CalibrationError, match="the tire is 'another'"),
    ):
        play_campaign(loaded, read_campaign(tmp_path / "c"))


def test_frames_longer_than_a_turn_are_an_error_not_a_lost_turn(tmp_path: Path) -> None:
    fast = [live.make_run(1, 4e3, 0.0, speed=300.0, turns=20.0)]
    write_campaign(tmp_path / "c", live.HEADER, fast)
    file = build_fmu(live.calibration_file(), tmp_path / "x.fmu", samples_per_step=256)
    with (
        LoadedFmu(file) as loaded,
        pytest.raises(FormatError, match="turns end within one frame of 256"),
    ):
        play_campaign(loaded, read_campaign(tmp_path / "c"))


def test_a_file_that_is_no_fmu_is_refused(tmp_path: Path) -> None:
    (tmp_path / "no.fmu").write_text("nothing")
    with pytest.raises(FormatError, match="is not an FMU"):
        LoadedFmu(tmp_path / "no.fmu")
    with pytest.raises(FormatError, match=r"lost\.fmu: cannot be read \(No such file"):
        LoadedFmu(tmp_path / "lost.fmu")


def test_the_example_of_the_documentation_runs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    page = Path(__file__).parents[2] / "docs" / "howto" / "fmu.md"
    code = page.read_text().split("```python\n")[2].split("```")[0]
    code = code.replace('"StrainTire.fmu", 1e4', f'"{live.fmu_file(10)}", {live.RATE}')
    assert len(code.splitlines()) <= 22
    write_campaign(tmp_path / "day2", live.HEADER, [live.make_run(1, 4e3, 0.0)])
    monkeypatch.chdir(tmp_path)
    exec(code, {})
    valid, numbers = capsys.readouterr().out.splitlines()[-1].split(" ", 1)
    load, std, age = json.loads(numbers)
    assert json.loads(valid) == [1]
    assert load == pytest.approx(4e3, abs=6 * std)
    assert age > 0.0


def test_the_checking_script_of_the_documentation_runs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    page = Path(__file__).parents[2] / "docs" / "howto" / "fmu.md"
    code = page.read_text().split("```python\n")[1].split("```")[0]
    assert len([line for line in code.splitlines() if line.strip()]) <= 27
    monkeypatch.chdir(tmp_path)
    altered = tmp_path / "altered.fmu"
    with zipfile.ZipFile(live.fmu_file(10)) as old, zipfile.ZipFile(altered, "w") as new:
        for name in old.namelist():
            data = old.read(name)
            new.writestr(
                name, data.replace(b",131072,", b",131073,") if "_ref.csv" in name else data
            )
    for file, wanted in ((live.fmu_file(10), "[]"), (altered, "['flags']")):
        exec(code.replace("sys.argv[1]", repr(str(file))), {})
        assert capsys.readouterr().out.endswith(f"problems: [] differ: {wanted}\n")


def thinned(folder: Path, out: Path) -> Path:
    """Return a campaign of every fourth run of another one."""
    out.mkdir()
    shutil.copy(folder / "campaign.toml", out)
    (out / "runs").symlink_to(folder / "runs")
    head, *runs = (folder / "runs.csv").read_text().splitlines()
    (out / "runs.csv").write_text("\n".join([head, *runs[::4], ""]))
    return out


@pytest.mark.shared
def test_lab_data_give_the_numbers_of_estimate(
    tmp_path: Path, shared: Callable[[str], Path]
) -> None:
    """The calibration is that of all runs."""
    from tirelib.cli.calibrate import calibrate

    folder = shared("lab-set1")
    few = thinned(folder, tmp_path / "few")
    calibration, file = tmp_path / "cal.toml", tmp_path / "x.fmu"
    told(calibrate, str(folder), "--out", str(calibration))
    told(estimate, str(few), "--calibration", str(calibration), "--json", str(tmp_path / "e"))
    told(
        fmu,
        "build",
        "--calibration",
        str(calibration),
        "--out",
        str(file),
        "--samples-per-step",
        "10",
    )
    told(fmu, "run", str(file), str(few), "--json", str(tmp_path / "f"))
    assert_equal(json.loads((tmp_path / "f").read_text()), json.loads((tmp_path / "e").read_text()))


def test_a_damaged_archive_is_refused_with_its_cause(tmp_path: Path) -> None:
    path = build_fmu(live.calibration_file(), tmp_path / "damaged.fmu")
    data = bytearray(path.read_bytes())
    with zipfile.ZipFile(path) as archive:
        library = archive.getinfo("binaries/linux64/StrainTire.so")
    data[library.header_offset + library.compress_size // 2] ^= 8
    path.write_bytes(data)
    with pytest.raises(FormatError, match=r"damaged\.fmu: cannot be unpacked .*StrainTire\.so"):
        LoadedFmu(path)
