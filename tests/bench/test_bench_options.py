"""What options promise: formats, triggers, faults, conditions of a replay, a whole JSON."""

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from tirebench.cli import program
from tirebench.errors import DeviceError
from tirebench.page.alarms import read_alarms
from tirebench.protocols.user_map import read_map
from tirebench.recording.document import empty_summary
from tirebench.wire.conditions import Conditions, RunMark, condition, parse_conditions
from tirebench.wire.device import Device
from tirelib.estimators.edge import EDGE_UNIT, FORMAT


def refused(*arguments: object) -> str:
    result = CliRunner().invoke(program, [str(argument) for argument in arguments])
    assert result.exit_code == 2
    return " ".join(result.output.split())


def test_a_recording_has_no_name_of_another_format(tmp_path: Path) -> None:
    said = refused("record", "--port", "nowhere", "--out", tmp_path / "a.mf4")
    assert "a recording is MCAP" in said
    assert "tirebench export" in said


def test_a_trigger_needs_a_recording(tmp_path: Path) -> None:
    fmu = tmp_path / "X.fmu"
    fmu.touch()
    said = refused("run", "--port", "nowhere", "--fmu", fmu, "--trigger", "10,20")
    assert "--trigger needs --record" in said


def test_a_bus_takes_no_faults_of_bytes(campaign: Path) -> None:
    bus = ("--bus", "can:virtual:x", "--format", "RAW16", "--fault", "flips")
    said = refused("emulate", "--campaign", campaign, *bus)
    assert "no other program hears them" in said
    assert "--fault flips with --bus" in said


def test_given_conditions_replace_only_what_they_name() -> None:
    marks = (RunMark(3, 5, 0.0),)
    recorded = Conditions((5, 9), (condition(18.0, 2e5), condition(19.0, 2e5)), marks)
    both = Conditions.constant(speed=20.0).over(recorded)
    assert both.runs == marks
    np.testing.assert_array_equal(both.at(6)[:2], (20.0, 2e5))
    np.testing.assert_array_equal(both.at(9)[:2], (20.0, 2e5))
    np.testing.assert_array_equal(both.at(0)[:2], (20.0, np.nan))


def test_a_whole_json_is_written_again(tmp_path: Path) -> None:
    file, out = tmp_path / "a.json", tmp_path / "b.json"
    document = {
        "format": FORMAT,
        "axes": "iso",
        "tire": None,
        "summary": {name: empty_summary(name) for name in EDGE_UNIT},
        "turns": [],
        "source": {"ended": "end"},
    }
    file.write_text(json.dumps(document, indent=1))
    result = CliRunner().invoke(program, ["repair", str(file), "--out", str(out)])
    assert result.exit_code == 0
    assert json.loads(out.read_text()) == document


def test_a_missing_dbc_is_named(tmp_path: Path) -> None:
    file = tmp_path / "wheel.toml"
    file.write_text('format = "tirebench-map/1"\ndbc = "wheel.dbc"\n')
    with pytest.raises(DeviceError, match=r"wheel\.dbc: cannot be read"):
        read_map(file)


def test_another_number_of_gages_names_both_numbers() -> None:
    with pytest.raises(DeviceError, match="has 3 gages, but this wheel sends 4"):
        Device().check_layout((0.03, 0.0, -0.03), "X.fmu", 4)


def test_the_documented_file_of_conditions_is_read() -> None:
    page = (Path(__file__).parents[2] / "docs/howto/bench.md").read_text(encoding="utf-8")
    block = page.split("```json\n")[1].split("```")[0]
    conditions = parse_conditions(json.loads(block), "the page")
    np.testing.assert_allclose(conditions.at(5e6)[:2], (80.0 / 3.6, 2.3e5))


def test_the_page_on_ones_own_transmitter_has_a_map_and_a_program_that_are_read() -> None:
    page = (Path(__file__).parents[2] / "docs/howto/own_calibration.md").read_text("utf-8")
    program_text = page.split("```python\n")[1].split("```")[0]
    compile(program_text, "the page", "exec")
    table = tomllib.loads(page.split("```toml\n")[1].split("```")[0])
    columns = {channel["column"] for channel in table["channels"].values()}
    header = page.split("```text\n")[1].splitlines()[0].split(",")
    assert columns == {"time", *(f"strain_{gage}" for gage in range(1, 6)), *header[1:]}
    assert "wheel_0_strain_segment" in program_text


def test_an_unknown_key_of_an_alarm_is_named(tmp_path: Path) -> None:
    file = tmp_path / "alarms.toml"
    file.write_text('format = "tirebench-alarms/1"\n[loss]\nhihg = 2.0\n')
    with pytest.raises(DeviceError, match=r"\[loss\] has an unknown key, hihg"):
        read_alarms(file)
