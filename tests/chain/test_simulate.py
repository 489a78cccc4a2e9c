"""`tirelib simulate` from the command line: contract, files, exit codes, messages."""

import json
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

from tests.chain.test_command_line import run
from tests.unit.inference.diagnose.planted import model_file, waves
from tirelib.cli import main, program
from tirelib.core.parameters import read_tire, write_tire
from tirelib.inference.compare.model import model_of, predict_runs
from tirelib.model.base import operating_points


def document(tmp_path: Path, *words: object) -> dict[str, Any]:
    target = tmp_path / "s.json"
    found = CliRunner().invoke(program, ["simulate", *map(str, words), "--json", str(target)])
    assert found.exit_code == 0, found.output
    read = json.loads(target.read_text())
    assert isinstance(read, dict)
    return read


ANCHOR = ("--model", "table-6-1", "--deflection", "25", "--omega", "59", "--damping", "0.04")


def test_the_contract_holds_as_other_programs_call_it(tmp_path: Path) -> None:
    done = run("simulate", *ANCHOR, "--json", tmp_path / "S.json")
    assert done.returncode == 0, done.stderr
    found = json.loads((tmp_path / "S.json").read_text())
    assert found["format"] == "tirelib-simulation/1"
    assert found["edges_rad"] == pytest.approx([-0.2413, 0.2347], abs=1e-4)
    assert found["Fz_N"] == pytest.approx(5128.7, abs=0.1)
    assert found["q_center_N_per_m"] == pytest.approx(40787.0, abs=5.0)
    assert found["q_max_N_per_m"] == pytest.approx(41812.0, abs=5.0)
    assert found["pressure_center_mm"] == pytest.approx(-1.44, abs=0.01)
    assert found["pressure_bar"] == pytest.approx(1.32)
    assert found["omega_rad_s"] == pytest.approx(59.0)
    assert found["deflection_mm"] == pytest.approx(25.0)
    assert found["model"] == "table-6-1"
    assert found["contact"] == "radial"
    assert "points" not in found


def test_defaults_are_standing_radial_and_the_tires_own(tmp_path: Path) -> None:
    found = document(tmp_path, "--model", "table-6-1", "--load", 4000)
    assert found["omega_rad_s"] == 0.0
    assert found["contact"] == "radial"
    assert found["pressure_bar"] == pytest.approx(1.32)
    assert found["damping"] == pytest.approx(0.04)
    assert found["Fz_N"] == pytest.approx(4000.0)


def test_several_loads_stand_under_points_and_the_first_at_the_top(tmp_path: Path) -> None:
    found = document(tmp_path, "--model", "table-6-1", "--load", "1500,3000,4500")
    assert [point["Fz_N"] for point in found["points"]] == pytest.approx([1500, 3000, 4500])
    for key, value in found["points"][0].items():
        assert found[key] == value
    lengths = [point["contact_length_mm"] for point in found["points"]]
    assert lengths == sorted(lengths)


def test_speed_is_turn_rate_times_ring_radius(tmp_path: Path) -> None:
    by_speed = document(tmp_path, "--model", "table-6-1", "--load", 4000, "--speed", "63.72")
    by_omega = document(tmp_path, "--model", "table-6-1", "--load", 4000, "--omega", "59")
    assert by_speed["omega_rad_s"] == pytest.approx(59.0)
    assert by_speed["edges_rad"] == pytest.approx(by_omega["edges_rad"], abs=1e-9)


def test_pressure_is_in_bar_and_damping_in_lambda(tmp_path: Path) -> None:
    hard = document(tmp_path, *ANCHOR, "--pressure", "2.3")
    assert hard["pressure_bar"] == pytest.approx(2.3)
    assert hard["Fz_N"] > 5500.0
    plain = document(tmp_path, *ANCHOR[:-1], "0")
    assert plain["pressure_center_mm"] == pytest.approx(0.0, abs=1e-6)


def test_shear_contact_points_outward_and_radial_inward(tmp_path: Path) -> None:
    for contact, sign in (("radial", -1.0), ("shear", 1.0)):
        folder = tmp_path / contact
        found = document(tmp_path, *ANCHOR, "--contact", contact, "--out", folder)
        assert found["contact"] == contact
        table = pd.read_csv(folder / "simulation.csv")
        exit_half = table[(table.phi_rad > 0.05) & (table.pressure_N_per_m > 0.0)]
        assert (sign * exit_half.shear_N_per_m > 0.0).all()
    assert found["effective_radius_mm"] == pytest.approx(305.0, abs=2.0)


def test_out_writes_figure_curves_and_document(tmp_path: Path) -> None:
    folder = tmp_path / "new" / "folder"
    done = run("simulate", *ANCHOR, "--load", "4000", "--out", folder)
    assert done.returncode == 2  # both load and deflection
    assert not folder.exists()
    words = ("--model", "table-6-1", "--load", "2000,4000", "--omega", "59", "--out", folder)
    done = run("simulate", *words)
    assert done.returncode == 0, done.stderr
    assert sorted(file.name for file in folder.iterdir()) == [
        "simulation.csv",
        "simulation.json",
        "simulation.png",
        "simulation.svg",
    ]
    for name in ("png", "svg", "csv", "json"):
        assert f"simulation.{name}" in done.stdout
    found = json.loads((folder / "simulation.json").read_text())
    table = pd.read_csv(folder / "simulation.csv")
    second = table[table.point == 1]
    peak = found["points"][1]["strain_peaks"]["tp"]
    assert second.strain_ustrain.max() == pytest.approx(peak["ustrain"], rel=1e-4)
    place = second.phi_rad[second.strain_ustrain.idxmax()]
    assert place == pytest.approx(peak["angle_rad"], abs=0.005)
    carried = 0.3 * np.trapezoid(second.normal_N_per_m, second.phi_rad)
    assert carried == pytest.approx(4000.0, rel=1e-3)


def test_without_out_and_json_it_only_prints(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    words = ("simulate", "--model", "table-6-1", "--load", "4000")
    done = run(*words)
    assert done.returncode == 0, done.stderr
    assert list(tmp_path.iterdir()) == []
    for text in ("vertical load", "4000.0", "entry", "CP1", "entry < 0 < exit"):
        assert text in done.stdout


def test_a_file_is_as_good_as_a_name(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    write_tire(read_tire("table-6-1"), path)
    mine = document(tmp_path, "--model", path, "--load", 4000)
    named = document(tmp_path, "--model", "table-6-1", "--load", 4000)
    assert mine["edges_rad"] == pytest.approx(named["edges_rad"], abs=1e-12)


def test_effects_of_a_model_are_named_as_left_out(tmp_path: Path) -> None:
    path = tmp_path / "model.toml"
    write_tire(read_tire("table-6-1"), path, "tirelib-model/1")
    with path.open("a") as file:
        file.write('\n[[effects]]\neffect = "tread_friction"\nstrength = 0.4\n')
    found = document(tmp_path, "--model", path, "--load", 4000, "--contact", "shear")
    assert found["effects_left_out"] == ["tread_friction"]
    words = ["simulate", "--model", str(path), "--load", "4000", "--contact", "shear"]
    shown = CliRunner().invoke(program, words)
    assert "left out of this simulation: tread_friction" in shown.output


def test_an_inflation_that_the_sidewall_does_not_know_is_noted(tmp_path: Path) -> None:
    words = ("--load", 4000, "--pressure", 2)
    assert "inflation acts" in document(tmp_path, "--model", "table-6-1", *words)["notes"][0]
    assert document(tmp_path, "--model", "table-6-2-195-65r15", *words)["notes"] == []
    assert document(tmp_path, "--model", "table-6-1", "--load", 4000)["notes"] == []


def test_a_load_that_no_tire_would_carry_is_noted_with_the_range(tmp_path: Path) -> None:
    """20 % of the free radius of 312.5 mm; the range's own load is no longer noted."""
    notes = document(tmp_path, "--model", "table-6-1", "--load", "4000,19000")["notes"]
    assert len(notes) == 1
    assert "19000 N press this tire by" in notes[0]
    found = re.search(r"free radius \(62 mm\).*model's range ends at (\d+) N", notes[0])
    assert found
    assert 4000.0 < float(found[1]) < 19000.0
    inside = document(tmp_path, "--model", "table-6-1", "--load", float(found[1]) - 1.0)
    assert inside["notes"] == []
    assert inside["deflection_mm"] == pytest.approx(62.5, abs=0.05)


def test_a_belt_too_soft_for_the_harmonics_is_noted(tmp_path: Path) -> None:
    path = tmp_path / "soft.toml"
    write_tire(read_tire("table-6-1"), path)
    place = r"(\[belt\.bending_stiffness\]\nvalue = )[\d.]+"
    text, count = re.subn(place, r"\g<1>0.035", path.read_text())
    assert count == 1
    path.write_text(text)
    notes = document(tmp_path, "--model", path, "--load", 4000)["notes"]
    assert "too little for 1000 harmonics" in notes[0]


def test_the_table_has_a_row_for_each_point_and_fits_a_terminal() -> None:
    loads = [f"{500 * (1 + n)}" for n in range(12)]
    words = ["simulate", "--model", "table-6-1", "--load", ",".join(loads), "--omega", "59"]
    shown = CliRunner().invoke(program, words, env={"COLUMNS": "80"})
    assert shown.exit_code == 0
    lines = shown.output.splitlines()[1:]
    assert max(map(len, lines)) <= 80
    for number, load in enumerate(loads):
        rows = [line.split() for line in lines if line.split()[:1] == [str(number)]]
        assert len(rows) == 4
        assert rows[0][1] == f"{load}.0"


def test_help_has_examples() -> None:
    shown = CliRunner().invoke(program, ["simulate", "--help"])
    assert shown.exit_code == 0
    assert "tirelib simulate --model table-6-1 --load 4000" in shown.output
    assert "simulate" in CliRunner().invoke(program, ["--help"]).output


WRONG = {
    "nothing": ([], "neither --load nor --deflection"),
    "both": (["--load", "4000", "--deflection", "20"], "both --load and --deflection"),
    "speeds": (["--load", "4000", "--speed", "50", "--omega", "50"], "both --speed and --omega"),
    "words": (["--load", "heavy"], "is neither a number"),
    "empty": (["--load", "1500,"], "is neither a number"),
    "zero": (["--load", "0"], "vertical load = 0 N"),
    "pull": (["--deflection", "-5"], "deflection = -0.005 m"),
    "heavy": (["--load", "90000"], "90000 N"),
    "vacuum": (["--load", "4000", "--pressure", "-1"], "-1 bar; the model holds from 0"),
    "kilopascal": (["--load", "4000", "--pressure", "230"], "230 bar; the model holds"),
    "fast": (["--load", "4000", "--speed", "550"], "0 to 540 km/h"),
    "spinning": (["--load", "4000", "--omega", "600"], "600 rad/s; the model holds from 0 to 500"),
    "no speed": (["--load", "4000", "--speed", "nan"], "nan km/h"),
    "backward": (
        ["--load", "4000", "--speed", "-50"],
        "--speed -50 km/h; the model holds for forward rolling from 0",
    ),
    "infinite": (["--load", "inf"], "inf N"),
    "damping": (["--load", "4000", "--damping", "-0.1"], "damping = -0.1"),
    "lists": (["--load", "1000,2000", "--speed", "1,2,3"], "2 values where the longest list has 3"),
    "contact": (["--load", "4000", "--contact", "magic"], "'radial', 'shear'"),
}


@pytest.mark.parametrize("case", WRONG)
def test_bad_input_is_a_message_and_exit_code_2(
    case: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    words, message = WRONG[case]
    monkeypatch.setattr(sys, "argv", ["tirelib", "simulate", "--model", "table-6-1", *words])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    shown = " ".join(capsys.readouterr().err.split())
    assert message in shown
    assert "Traceback" not in shown


def test_an_unknown_tire_is_told_its_neighbours() -> None:
    done = run("simulate", "--model", "table-6-3", "--load", "4000")
    assert done.returncode == 2
    assert "did you mean" in done.stderr
    assert "table-6-1" in done.stderr


def test_a_place_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    words = ("simulate", "--model", "table-6-1", "--load", "4000")
    for option in (["--json", tmp_path / "file/s.json"], ["--out", tmp_path / "file/out"]):
        done = run(*words, *option)
        assert done.returncode == 2, done.stdout
        assert "choose another" in done.stderr


def test_the_installed_program_is_the_same() -> None:
    program_file = Path(sys.executable).parent / "tirelib"
    assert program_file.exists(), "install the project (make) into the Python that runs the tests"
    words = [str(program_file), "simulate", *ANCHOR]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "5128.7" in done.stdout


EFFECTS = (("sidewall_damping", 0.08), ("sidewall_load", 0.2), ("gage_length", 400.0))


@pytest.fixture
def identified(tmp_path: Path) -> Path:
    """Return a model file as `identify` and `add` write them."""
    file = model_file(*EFFECTS)
    extra = {**file.extra, "model": {"ring": "large displacements", "contact": "radial"}}
    write_tire(replace(file, extra=extra), tmp_path / "M.toml", "tirelib-model/1")
    return tmp_path / "M.toml"


def test_a_model_file_gives_the_waveforms_that_compare_uses(
    identified: Path, tmp_path: Path
) -> None:
    measured = waves()
    at, model = operating_points(measured), model_of(read_tire(identified))
    predicted = predict_runs(model, at, [0.0], measured.low_pass)
    words = [
        name
        for option, unit, values in (
            ("--load", 1.0, at.load),
            ("--pressure", 1e5, at.pressure),
            ("--omega", 1.0, at.omega),
        )
        for name in (option, ",".join(repr(float(x / unit)) for x in values))
    ]
    found = document(tmp_path, "--model", identified, *words, "--out", tmp_path / "out")
    assert (found["ring"], found["effects_left_out"]) == ("large displacements", [])
    assert found["effects"] == [name for name, _ in EFFECTS]
    table = pd.read_csv(tmp_path / "out" / "simulation.csv")
    curves = table["gage_ustrain"].to_numpy().reshape(len(at), -1)[:, :-1:4]
    # the file has nine digits
    np.testing.assert_allclose(curves, 1e6 * predicted.strain, atol=1e-4)
    depth = [point["deflection_mm"] for point in found["points"]]
    np.testing.assert_allclose(depth, 1e3 * predicted.deflection, rtol=1e-9)
    edges = np.array([point["edges_rad"] for point in found["points"]])
    middle = 1e3 * predicted.edges.mean(axis=1)
    np.testing.assert_allclose(1e3 * edges.mean(axis=1), middle, atol=0.5)
    normal = table["normal_N_per_m"].to_numpy().reshape(len(at), -1)[:, :-1]
    step = 2.0 * np.pi * read_tire(identified).tire.ring_radius / normal.shape[1]
    carried = step * normal.sum(axis=1)
    # a quarter of a degree is coarse for the edges of the contact
    np.testing.assert_allclose(carried, at.load, rtol=3e-3)


def test_a_deflection_of_a_model_file_is_that_of_its_load(identified: Path, tmp_path: Path) -> None:
    by_load = document(tmp_path, "--model", identified, "--load", "2500,6000", "--speed", 80)
    depths = ",".join(repr(point["deflection_mm"]) for point in by_load["points"])
    back = document(tmp_path, "--model", identified, "--deflection", depths, "--speed", 80)
    assert [p["Fz_N"] for p in back["points"]] == pytest.approx([2500.0, 6000.0], rel=1e-5)


def test_another_ring_and_the_sheared_contact_are_told(identified: Path, tmp_path: Path) -> None:
    linear = document(tmp_path, "--model", identified, "--load", 6000, "--ring", "linear")
    large = document(tmp_path, "--model", identified, "--load", 6000)
    assert linear["ring"] == "linear"
    assert linear["deflection_mm"] < 0.97 * large["deflection_mm"]
    sheared = document(tmp_path, "--model", identified, "--load", 6000, "--contact", "shear")
    assert sheared["effects_left_out"] == [name for name, _ in EFFECTS]
    assert any("linear ring" in note for note in sheared["notes"])
    bare = document(tmp_path, "--model", "table-6-1", "--load", 4000)
    assert (bare["ring"], bare["effects"]) == ("linear", [])
    big = document(tmp_path, "--model", "table-6-1", "--load", 4000, "--ring", "large")
    assert big["deflection_mm"] > bare["deflection_mm"]


def test_conditions_without_an_effect_that_knows_them_are_refused() -> None:
    found = CliRunner().invoke(
        program, ["simulate", "--model", "table-6-1", "--load", "4000", "--camber", "2"]
    )
    assert "leave them out" in str(found.exception)
