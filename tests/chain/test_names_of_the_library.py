"""The journey by the names of the library, as by the command line: here with forces."""

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

import tirelib
from tests.unit.inference.force_campaigns import steady_runs, write_forces
from tirelib.cli import program
from tirelib.core.errors import ParameterError


def document(*words: object) -> dict[str, object]:
    found = CliRunner().invoke(program, list(map(str, words)))
    assert found.exit_code == 0, found.output
    read = json.loads(Path(str(words[-1])).read_text())
    assert isinstance(read, dict)
    return read


def test_identify_diagnose_and_add_give_what_the_verbs_give(tmp_path: Path) -> None:
    folder = tmp_path / "steady"
    write_forces(folder, steady_runs(slope=0.25), "steady")
    campaign = tirelib.read_campaign(folder)

    document("identify", folder, "--out", tmp_path / "M.toml", "--json", tmp_path / "i.json")
    model = tirelib.identify(campaign).file
    file = tirelib.read_tire(tmp_path / "M.toml")
    assert {name: number.value for name, number in model.numbers.items()} == pytest.approx(
        {name: number.value for name, number in file.numbers.items()}
    )

    told = document(
        "diagnose",
        folder,
        "--model",
        tmp_path / "M.toml",
        "--json",
        tmp_path / "d.json",
    )
    found = tirelib.diagnose(campaign, file)
    assert list(found.named) == told["named"]
    assert found.floor == pytest.approx(told["floor"])

    words = ("--model", tmp_path / "M.toml", "--data", folder, "--out", tmp_path / "M2.toml")
    added = document("add", "friction_load", *words, "--json", tmp_path / "a.json")
    new, step = tirelib.add("friction_load", file, campaign)
    assert step["error_after"] == pytest.approx(added["error_after"])
    (effect,) = new.extra["effects"]
    assert effect["effect"] == "friction_load"

    compared = tirelib.compare(campaign, new, "Fy")
    assert compared.error == pytest.approx(step["error_after"], rel=0.05)


def test_an_unknown_quantity_is_refused_by_name(tmp_path: Path) -> None:
    campaign = write_forces(tmp_path / "s", steady_runs(), "s")
    with pytest.raises(ParameterError, match="torque: allowed are strain, Fy, Fx, Mz"):
        tirelib.add("friction_load", tirelib.read_tire("table-6-1"), campaign, "torque")
