"""From a plan to a folder and back."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from tirelib.campaign import read_campaign
from tirelib.cli.rig import rig
from tirelib.core.errors import ParameterError
from tirelib.effects import CATALOGUE
from tirelib.rig.campaign import run_plan
from tirelib.rig.hidden import HIDDEN
from tirelib.rig.plans import Plan, on_one_road
from tirelib.rig.tire import Condition, RigTire

PLAN = Plan(
    "tiny",
    "three runs",
    (
        Condition(3000.0, 2.3e5, 18.0),
        Condition(3000.0, 2.3e5, 18.0, slip_angle=0.035),
        Condition(3000.0, 2.3e5, 18.0, slip_ratio=-0.02),
    ),
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("rig") / "tiny"
    run_plan(PLAN, RigTire(), out, seed=1, repeats=1, jobs=1, axes="adapted_sae")
    return out


def truth(folder: Path) -> list[dict[str, float]]:
    with (folder / "truth.csv").open(encoding="utf-8") as file:
        return [{k: float(v) for k, v in row.items()} for row in csv.DictReader(file)]


def test_campaign_reads_back_with_its_set_points(folder: Path) -> None:
    campaign = read_campaign(folder)
    assert campaign.header.axes == "adapted_sae"
    assert campaign.header.gage_lateral == pytest.approx((-0.06, -0.03, 0.0, 0.03, 0.06))
    assert [p.kind for p in campaign.plans] == ["free", "corner", "brake", "corner"]
    assert campaign.plans[1].slip_angle == pytest.approx(0.035)
    assert [p.start for p in campaign.plans] == pytest.approx([0.0, 12.0, 24.0, 36.0])


def test_truth_is_near_what_the_rig_measured(folder: Path) -> None:
    rows = truth(folder)
    for run, row in zip(read_campaign(folder).runs(), rows, strict=True):
        n = len(run.rig["Fz"])
        for name, unit, noise in (("Fx", "N", 30.0), ("Fy", "N", 30.0), ("Fz", "N", 30.0)):
            mean = run.mean(name)
            assert mean is not None
            # five sigma of the mean; part of a turn of run-out stays in the mean of Fz
            assert abs(mean - row[f"{name}_{unit}"]) < 5.0 * noise / np.sqrt(n) + 5.0
        assert run.mean("slip_ratio") == pytest.approx(row["slip_ratio_1"], abs=3e-4)
        assert run.strain is not None
        assert run.strain.shape[0] == 5
        assert 7e-3 < run.strain.max() < 15e-3


def test_a_repeat_has_its_own_noise_and_set_point_error(folder: Path) -> None:
    rows = truth(folder)
    assert rows[3]["Fz_N"] != rows[1]["Fz_N"]
    assert rows[3]["Fz_N"] == pytest.approx(rows[1]["Fz_N"], rel=0.03)
    assert rows[3]["slip_angle_rad"] == pytest.approx(0.035, abs=0.002)


def test_processes_do_not_change_the_data(folder: Path, tmp_path: Path) -> None:
    again = tmp_path / "again"
    run_plan(PLAN, RigTire(), again, seed=1, repeats=1, jobs=2, axes="adapted_sae")
    for one, two in zip(read_campaign(folder).runs(), read_campaign(again).runs(), strict=True):
        assert one.strain is not None
        assert two.strain is not None
        np.testing.assert_array_equal(one.strain, two.strain)


def test_a_plan_runs_on_a_slippery_road_with_a_worn_tread(folder: Path, tmp_path: Path) -> None:
    out = tmp_path / "wet"
    run_plan(on_one_road(PLAN, 0.3, 0.006), RigTire(), out, seed=1, repeats=0, jobs=1)
    here, there = read_campaign(folder), read_campaign(out)
    assert {(p.friction, p.tread_depth) for p in here.plans} == {(0.95, 0.008)}
    assert {(p.friction, p.tread_depth) for p in there.plans} == {(0.3, 0.006)}
    row = truth(out)[1]
    assert abs(row["Fy_N"]) < 0.3 * row["Fz_N"]
    assert row["R_e_m"] < truth(folder)[1]["R_e_m"] - 3e-4


def test_a_folder_that_is_not_empty_is_refused(folder: Path) -> None:
    with pytest.raises(ParameterError, match="not empty"):
        run_plan(PLAN, RigTire(), folder)
    result = CliRunner().invoke(rig, ["--plan", "set1", "--out", str(folder)])
    assert isinstance(result.exception, ParameterError)


def test_command_lists_plans_and_asks_for_what_it_needs(tmp_path: Path) -> None:
    file = tmp_path / "list.json"
    result = CliRunner().invoke(rig, ["--list", "--json", str(file)])
    assert result.exit_code == 0
    assert "set3_cornering" in result.output
    document = json.loads(file.read_text(encoding="utf-8"))
    assert document["format"] == "tirelib-rig/1"
    assert "reference" in document["tires"]
    assert CliRunner().invoke(rig, []).exit_code == 2
    assert "Example" in CliRunner().invoke(rig, ["--help"]).output


def test_strengths_to_hide_are_stated_in_the_units_of_the_catalogue(tmp_path: Path) -> None:
    file = tmp_path / "list.json"
    assert CliRunner().invoke(rig, ["--list", "--json", str(file)]).exit_code == 0
    listed = json.loads(file.read_text(encoding="utf-8"))["effects"]
    assert [each["effect"] for each in listed] == list(HIDDEN)
    for each in listed:
        one = HIDDEN[each["effect"]]
        if one.known:
            assert each["unit"] == CATALOGUE[one.name].unit
        for strength in (0.0, one.visible, one.largest, -one.visible * one.signed):
            assert one.from_stated(one.as_stated(strength)) == pytest.approx(strength, rel=1e-9)
    assert HIDDEN["gage_length"].as_stated(0.02) == 400.0  # mm^2
    assert HIDDEN["low_pass"].as_stated(2.5e-4) == 0.25  # ms


@pytest.mark.parametrize("given", ["belt_shear=2e-5", "gage_length=-400", "tread_load=-2"])
def test_a_strength_in_another_unit_is_refused_before_the_rig_starts(
    given: str, tmp_path: Path
) -> None:
    call = ["--plan", "short", "--hide", given, "--out", str(tmp_path / "out")]
    refused = CliRunner().invoke(rig, call).exception
    assert isinstance(refused, ParameterError)
    assert "shows clearly" in str(refused)
    assert not (tmp_path / "out").exists()
