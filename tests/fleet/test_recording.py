"""Continuous recordings: turns of a batch, whatever gaps and blocks; every fault has its words."""

import json
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from click.testing import CliRunner

from tests.fleet.recordings import describe, write_drive
from tirelib.campaign import blocks as module
from tirelib.campaign.blocks import blocks
from tirelib.campaign.recording import read_recording
from tirelib.cli import program
from tirelib.core.errors import FormatError
from tirelib.estimators.calibration_file import read_calibration
from tirelib.estimators.continuous import estimate_recording
from tirelib.measured.features.extract import extract_features
from tirelib.measured.signal import LowPass, cut_turns


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two wheels, 24 s, 10 lost samples at 6 s, nothing for 4 s at 12 s."""
    folder = describe(tmp_path_factory.mktemp("drive"), ("FL", "FR"))
    write_drive(
        folder / "a.mf4",
        seconds=24.0,
        wheels=("FL", "FR"),
        loads=(4000.0, 5000.0),
        gaps=[(6.0, 6.005), (12.0, 16.0)],
        part=10.0,
    )
    return folder


def test_blocks_fill_short_gaps_and_begin_again_after_long_ones(
    drive: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = read_recording(drive)
    whole = list(blocks(found, found.wheels[0]))
    assert [block.fresh for block in whole] == [True, True]
    assert [round(float(block.time[-1]), 4) for block in whole] == [11.9995, 23.9995]
    assert np.isnan(whole[0].strain[0]).sum() == 10
    np.testing.assert_allclose(np.diff(whole[0].time), 1 / 2000.0, rtol=1e-6)
    monkeypatch.setattr(module, "BLOCK", 1009)
    small = list(blocks(found, found.wheels[0]))
    assert len(small) > 20
    for name in ("time", "strain"):
        joined = np.concatenate([getattr(block, name) for block in small], axis=-1)
        one = np.concatenate([getattr(block, name) for block in whole], axis=-1)
        np.testing.assert_allclose(joined, one, atol=1e-9)
    held = np.concatenate([block.held["speed"] for block in small])
    np.testing.assert_array_equal(held, np.concatenate([b.held["speed"] for b in whole]))


def test_turns_are_those_of_a_batch(
    drive: Path, calibration: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    known = read_calibration(calibration)
    found = read_recording(drive)
    second = list(blocks(found, found.wheels[0]))[1]
    monkeypatch.setattr(module, "BLOCK", 4001)
    parts = [part for part in estimate_recording(found, known) if part.wheel.name == "FL"]
    low_pass = LowPass(known.order, known.cut_off)
    turns = cut_turns(second.strain, second.rate, known.lateral, low_pass=low_pass, **second.held)
    batch = extract_features(turns)
    time = np.concatenate([part.features.time for part in parts])
    load = np.concatenate([part.estimates.value["Fz"] for part in parts])[time > 14.0]
    assert load.size == len(batch) > 50
    np.testing.assert_allclose(load, known.estimate(batch).value["Fz"], rtol=1e-9)
    np.testing.assert_allclose(time[time > 14.0], batch.time + 16.0, atol=1e-6)


def test_estimate_writes_table_and_document(drive: Path, calibration: Path, tmp_path: Path) -> None:
    table, document = tmp_path / "turns.parquet", tmp_path / "e.json"
    command = ["estimate", str(drive), "--calibration", str(calibration)]
    done = CliRunner().invoke(
        program, [*command, "--out", str(table), "--json", str(document)], catch_exceptions=False
    )
    assert done.exit_code == 0, done.output
    rows = pq.read_table(table)
    said = json.loads(document.read_text())
    assert said["format"] == "tirelib-estimate/1"
    assert said["turns"] == []  # they are in the table
    assert said["turn_count"] == rows.num_rows > 300
    assert set(rows["wheel"].to_pylist()) == {"FL", "FR"} == set(said["wheels"])
    assert said["wheels"]["FL"]["gaps"] == 1
    assert set(rows["tirelib"].to_pylist())
    assert len(set(rows["calibration"].to_pylist())) == 1
    done = CliRunner().invoke(program, [*command, "--json", str(document)], catch_exceptions=False)
    turns = json.loads(document.read_text())["turns"]
    assert done.exit_code == 0
    assert len(turns) == rows.num_rows
    assert turns[5]["Fz"] == pytest.approx(rows["Fz"][5].as_py())


def _read(folder: Path) -> None:
    found = read_recording(folder)
    list(blocks(found, found.wheels[0]))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (('axes = "iso"', 'axes = "left"'), "iso, sae, adapted_sae"),
        (("FL_strain_{}", "FL_strain"), "{} in the place of its number"),
        (("FL_strain_{}", "other_{}"), "'other_1' is there 0 times"),
        (("vehicle_speed", "FL_pressure"), "unit 'bar' is a unit of pressure"),
        (("tirelib-recording/1", "tirelib-recording/2"), "'tirelib-recording/1' is read"),
        (('format = "tirelib-recording/1"', ""), "format: the key is missing"),
        (("[wheels.FL.conditions]", "[wheels.FL.condition]"), "the key is unknown"),
    ],
)
def test_faults_say_where(drive: Path, tmp_path: Path, change: tuple[str, str], said: str) -> None:
    text = (drive / "recording.toml").read_text()
    assert change[0] in text
    (tmp_path / "recording.toml").write_text(text.replace(*change))
    (tmp_path / "a.mf4").symlink_to(drive / "a.mf4")
    with pytest.raises(FormatError) as caught:
        _read(tmp_path)
    assert said in str(caught.value)
    assert str(tmp_path) in str(caught.value)


def test_a_file_that_ends_early_is_refused(drive: Path, tmp_path: Path) -> None:
    (tmp_path / "recording.toml").write_text((drive / "recording.toml").read_text())
    content = (drive / "a.mf4").read_bytes()
    (tmp_path / "a.mf4").write_bytes(content[: len(content) // 2])
    found = read_recording(tmp_path)
    with pytest.raises(FormatError, match="truncated or damaged"):
        list(blocks(found, found.wheels[0]))
