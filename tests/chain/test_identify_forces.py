"""`tirelib identify` on forces: brush alone, with a given ring, sweeps, exit codes, messages."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result

from tirelib.campaign import (
    CampaignHeader,
    Run,
    RunPlan,
    TireGeometry,
    read_campaign,
    write_campaign,
)
from tirelib.cli import program
from tirelib.core.parameters import read_tire, write_tire
from tirelib.inference.identify.brush_law import brush_of
from tirelib.inference.identify.force_data import force_data
from tirelib.inference.identify.ring_patch import half_lengths
from tirelib.physics.brush.predict import PointConditions, PointParameters, predict_forces

pytestmark = pytest.mark.usefixtures("copies")
TIRE = read_tire("table-6-1").tire
C_PY, MU = 9e6, 0.92
ANGLES = np.radians([-8.0, -4.0, -2.0, -1.0, 0.0, 1.0, 2.0, 4.0, 8.0])
LOADS = (2000.0, 3000.0, 4000.0)
PRESSURE = 1.32e5


def half(load: np.ndarray) -> np.ndarray:
    return half_lengths(TIRE, load, np.full(load.size, PRESSURE))


def forces(load: np.ndarray, angle: np.ndarray, seed: int) -> dict[str, np.ndarray]:
    found = predict_forces(PointParameters(C_PY, MU, half(load)), PointConditions(load, angle))
    rng = np.random.default_rng(seed)
    noise = 30.0 * rng.standard_normal((2, load.size))
    return {
        "Fz": load,
        "slip_angle": angle,
        "Fy": found.Fy + noise[0],
        "Mz": found.Mz + noise[1] / 50,
    }


def steady(folder: Path, angles: np.ndarray = ANGLES, drop: tuple[str, ...] = ()) -> Path:
    runs = []
    for i, (load, angle) in enumerate((f, a) for f in LOADS for a in angles):
        point = forces(np.array([load]), np.array([angle]), i)
        rig = {name: np.repeat(value, 10) for name, value in point.items() if name not in drop}
        plan = RunPlan(i, f"runs/{i}.mf4", "corner", load, PRESSURE, 18.0, angle, 0.0, 0.0)
        runs.append(Run(plan, rig=rig, rig_time=np.arange(10) / 10.0))
    return written(folder, runs)


def written(folder: Path, runs: list[Run]) -> Path:
    header = CampaignHeader("rig", "iso", TireGeometry("bench tire", 0.3125))
    write_campaign(folder, header, iter(runs), axes="iso")
    return folder


def call(folder: Path, out: Path, *options: str) -> Result:
    out.mkdir(exist_ok=True)
    return CliRunner().invoke(
        program,
        [
            "identify",
            str(folder),
            "--out",
            str(out / "M.toml"),
            "--json",
            str(out / "I.json"),
            *options,
        ],
    )


def document(out: Path) -> dict[str, Any]:
    return dict(json.loads((out / "I.json").read_text()))


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return steady(tmp_path_factory.mktemp("forces") / "c")


@pytest.fixture(scope="module")
def alone(campaign: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    out = tmp_path_factory.mktemp("alone")
    found = call(campaign, out, "--report", str(out / "report"))
    assert found.exit_code == 0, found.output
    return out, found.output


def test_the_page_of_a_brush_has_no_ring(alone: tuple[Path, str]) -> None:
    out, said = alone
    text = (out / "report" / "identification.md").read_text(encoding="utf-8")
    assert "## Brush" in text
    assert "## Ring" not in text
    for each in document(out)["brush"]["parameters"]:
        assert f"| {each['name']} | {each['meaning']} |" in text
    assert "| Fy | " in text  # what the brush leaves of it
    assert f"written: {out / 'report' / 'identification.html'}" in said
    assert "next: tirelib compare" in said


def test_the_brush_comes_back_with_units_and_intervals(alone: tuple[Path, str]) -> None:
    found = document(alone[0])
    by_name = {each["name"]: each for each in found["brush"]["parameters"]}
    size = float(1e3 * half(np.array([3000.0]))[0])
    for name, true, unit in (
        ("bristle_lateral", C_PY, "N/m^2"),
        ("friction", MU, "1"),
        ("half_length", size, "mm"),
        ("slip_angle_offset", 0.0, "deg"),
        ("Fy_offset", 0.0, "N"),
        ("Mz_offset", 0.0, "Nm"),
    ):
        each = by_name[name]
        assert each["unit"] == unit
        low, high = each["interval"]
        assert low <= true <= high, name
        assert each["std"] > 0.0
        assert bool(each["helps"]) == ("not_identifiable" in each["flags"])
    assert by_name["half_length"]["value"] == pytest.approx(size, rel=0.03)
    for each in found["brush"]["stiffness"]:
        true = 2.0 * C_PY * float(half(np.array([each["load_N"]]))[0]) ** 2 * np.pi / 180.0
        assert each["unit"] == "N/deg"
        assert each["value"] == pytest.approx(true, rel=0.03)
        assert each["low"] < each["value"] < each["high"]
        assert 0.8 * true < each["low"] < 1.02 * true
        assert 0.98 * true < each["high"] < 1.2 * true
    assert found["forces"]["Fy"]["rmse"] < 50.0
    assert found["forces"]["Fy"]["r2"] > 0.998
    assert found["brush"]["half_length_from"] == "Mz"


def test_what_is_not_there_is_null_and_said(alone: tuple[Path, str], campaign: Path) -> None:
    found = document(alone[0])
    assert found["format"] == "tirelib-identification/1"
    assert found["parameters"] == []
    assert found["rms_ustrain"] is None
    assert found["ring_pressure"] is None
    assert any("holds no strain" in reason for reason in found["reasons"])
    assert "holds no strain" in alone[1]
    assert "N/deg" in alone[1]
    assert found["provenance"]["data_sha256"] == read_campaign(campaign).content_hash()


def test_the_model_predicts_what_the_fit_says(alone: tuple[Path, str], campaign: Path) -> None:
    """The file is all that other verbs have: its forces leave the error that the fit reports."""
    file = read_tire(alone[0] / "M.toml")
    assert file.name == "bench tire"
    assert file.numbers["free_radius"].kind == "measured"
    assert file.numbers["friction"].kind == "fitted"
    assert file.numbers["camber_thrust"].kind == "assumed"
    data = force_data(read_campaign(campaign))
    left = brush_of(file).predict(data).Fy - data.Fy
    rmse = document(alone[0])["forces"]["Fy"]["rmse"]
    assert np.sqrt(np.mean(left**2)) == pytest.approx(rmse, rel=1e-6)


def test_a_given_ring_gives_the_contact_length(campaign: Path, tmp_path: Path) -> None:
    found = call(campaign, tmp_path / "o", "--tire", "table-6-1")
    assert found.exit_code == 0, found.output
    told = document(tmp_path / "o")
    assert told["brush"]["half_length_from"] == "ring"
    by_name = {each["name"]: each for each in told["brush"]["parameters"]}
    assert "half_length" not in by_name
    assert by_name["bristle_lateral"]["value"] == pytest.approx(C_PY, rel=0.02)
    assert by_name["bristle_lateral"]["flags"] == []
    rows = told["ring_pressure"]["table"]
    assert {row["by"] for row in rows} == {"all", "load", "pressure", "slip_angle"}
    # made with the parabola: the parabola has to win
    assert rows[0]["parabola_rmse"] < 0.8 * rows[0]["ring_rmse"]
    assert rows[0]["better"] == "parabola"
    assert "parabola" in found.output
    file = read_tire(tmp_path / "o" / "M.toml")
    assert "half_length" not in file.numbers
    assert file.numbers["friction"].kind == "fitted"
    assert file.numbers["friction"].value == pytest.approx(MU, rel=0.02)
    assert brush_of(file).tire is not None
    assert file.tire.bending_stiffness == TIRE.bending_stiffness


def test_a_given_tire_that_does_not_fit_is_said(
    campaign: Path, alone: tuple[Path, str], tmp_path: Path
) -> None:
    found = call(campaign, tmp_path / "o", "--tire", str(alone[0] / "M.toml"))
    assert "bench tire: the given tire states no complete ring" in found.output
    ring = read_tire("table-6-1")
    wide = replace(ring.numbers["free_radius"], value=0.33)
    write_tire(replace(ring, numbers={**ring.numbers, "free_radius": wide}), tmp_path / "t.toml")
    found = call(campaign, tmp_path / "o", "--tire", str(tmp_path / "t.toml"))
    assert "free_radius is 330.0 mm in" in found.output
    belt = replace(ring.numbers["ring_radius"], value=0.32)
    both = {**ring.numbers, "free_radius": wide, "ring_radius": belt}
    write_tire(replace(ring, numbers=both), tmp_path / "t.toml")
    found = call(campaign, tmp_path / "no", "--tire", str(tmp_path / "t.toml"))
    assert "ring_radius = 320 mm is not below free_radius = 312.5 mm" in str(found.exception)
    assert not (tmp_path / "no" / "M.toml").exists()


def test_an_earlier_brush_does_not_outlive_the_new_one(
    campaign: Path, alone: tuple[Path, str], tmp_path: Path
) -> None:
    """A start with ring and half length: the new brush takes the ring's, so the old one goes."""
    ring, brush = read_tire("table-6-1"), read_tire(alone[0] / "M.toml")
    write_tire(replace(ring, numbers={**brush.numbers, **ring.numbers}), tmp_path / "both.toml")
    found = call(campaign, tmp_path / "o", "--tire", str(tmp_path / "both.toml"))
    assert found.exit_code == 0, found.output
    assert brush_of(read_tire(tmp_path / "o" / "M.toml")).tire is not None


def test_a_long_sweep_is_thinned_and_nothing_is_left_unsaid(tmp_path: Path) -> None:
    time = np.arange(120_000) / 100.0
    load = 3000.0 + 1000.0 * np.sin(time / 40.0)
    angle = 0.15 * np.sin(time)
    rig = forces(load, angle, 1)
    rig["Fz"] = np.where(time < 2.0, -4.0, load)
    plan = RunPlan(0, "runs/0.mf4", "sweep", *(np.nan,) * 6)
    folder = written(tmp_path / "c", [Run(plan, rig=rig, rig_time=time)])
    found = call(folder, tmp_path / "o", "--tire", "table-6-1")
    assert found.exit_code == 0, found.output
    told = document(tmp_path / "o")
    # a ring without a pressure is no ring
    assert told["brush"]["half_length_from"] == "Mz"
    assert "the ring cannot give the contact length" in " ".join(told["brush"]["notes"])
    assert not any("gives the contact length" in reason for reason in told["reasons"])
    notes = " ".join(told["brush"]["notes"])
    assert "200 samples of sweeps have no positive load" in notes
    assert "119800 samples: each 3. is used" in notes
    assert told["forces"]["points"] == 39934
    assert "inflation pressure is unknown" in notes
    by_name = {each["name"]: each for each in told["brush"]["parameters"]}
    assert by_name["friction"]["value"] == pytest.approx(MU, rel=0.01)
    assert "reference_pressure" not in read_tire(tmp_path / "o" / "M.toml").numbers


@pytest.mark.parametrize(
    ("angles", "drop", "words"),
    [
        (np.radians([4.0]), (), "slip angles span 0 deg"),
        (ANGLES, ("Fy", "Mz"), "Fy not measured"),
    ],
)
def test_what_tells_no_brush_is_an_error_that_says_why(
    tmp_path: Path, angles: np.ndarray, drop: tuple[str, ...], words: str
) -> None:
    folder = steady(tmp_path / "c", angles, drop)
    found = call(folder, tmp_path / "o")
    assert found.exit_code == 1
    assert words in str(found.exception)
    assert "no ring" in str(found.exception)
    assert not (tmp_path / "o" / "M.toml").exists()


def test_one_size_of_slip_angle_identifies_nothing(tmp_path: Path) -> None:
    found = call(steady(tmp_path / "c", np.radians([-4.0, 4.0])), tmp_path / "o")
    assert found.exit_code == 1, found.output
    assert found.exception is None or isinstance(found.exception, SystemExit)
    assert "one size of slip angle only" in found.output
    told = document(tmp_path / "o")
    assert all("not_identifiable" in each["flags"] for each in told["brush"]["parameters"][:3])


def test_a_header_without_free_radius_is_refused(campaign: Path, tmp_path: Path) -> None:
    copy = tmp_path / "c"
    copy.mkdir()
    text = (campaign / "campaign.toml").read_text()
    lines = [line for line in text.splitlines() if "free_radius_m" not in line]
    (copy / "campaign.toml").write_text("\n".join(lines))
    (copy / "runs.csv").write_text((campaign / "runs.csv").read_text())
    (copy / "runs").symlink_to(campaign / "runs")
    found = call(copy, tmp_path / "o")
    assert found.exit_code == 1
    assert "free_radius_m" in str(found.exception)


def test_ring_and_brush_of_a_laboratory_tire(shared: Callable[[str], Path], tmp_path: Path) -> None:
    """Strain and forces together: the ring's pressure, not the parabola, gives the forces."""
    source = shared("lab-set1")
    found = call(source, tmp_path / "o")
    assert found.exit_code == 0, found.output
    told = document(tmp_path / "o")
    assert told["parameters"]
    assert told["brush"]["half_length_from"] == "ring"
    assert told["ring_pressure"]["table"][0]["better"] == "ring"
    assert 0.7 < brush_of(read_tire(tmp_path / "o" / "M.toml")).values["friction"] < 1.1
