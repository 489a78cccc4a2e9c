"""`tirelib identify` end to end: a few runs of the numerical rig, files, exit codes, messages."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from tests.chain.test_command_line import run
from tests.synthetic import synthetic_run, write
from tirelib.campaign import read_campaign
from tirelib.campaign.write import write_campaign
from tirelib.cli import main, program
from tirelib.core.arrays import FloatArray
from tirelib.core.parameters import read_tire
from tirelib.rig.campaign import run_plan
from tirelib.rig.plans import Plan
from tirelib.rig.solve import inflated
from tirelib.rig.tire import TIRES, Condition

TIRE = TIRES["reference"]
CONDITIONS = ((3000.0, 1.7e5), (6500.0, 1.7e5), (3000.0, 2.5e5), (6500.0, 2.5e5))


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("rig") / "four"
    runs = tuple(Condition(load, pressure, 18.0) for load, pressure in CONDITIONS)
    run_plan(Plan("four", "four straight runs", runs), TIRE, folder, seed=7, jobs=1)
    return folder


@pytest.fixture(scope="module")
def files(campaign: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("out")
    out = {name: folder / name for name in ("model", "json", "first", "report")}
    words = ["--out", str(out["model"]), "--json", str(out["json"]), "--first", str(out["first"])]
    words += ["--report", str(out["report"])]
    found = CliRunner().invoke(program, ["identify", str(campaign), *words])
    assert found.exit_code == 0, found.output
    assert "4 straight runs, 5 of 5 gages averaged" in found.output
    return out


def test_the_ring_before_its_intervals_is_compared_as_the_whole_model(
    campaign: Path, files: dict[str, Path], tmp_path: Path
) -> None:
    told = []
    for name in ("first", "model"):
        words = ["--model", str(files[name]), "--json", str(tmp_path / name)]
        found = CliRunner().invoke(program, ["compare", str(campaign), *words])
        assert found.exit_code == 0, found.output
        told.append((tmp_path / name).read_text())
    assert told[0] == told[1]
    first, whole = (read_tire(str(files[name])).numbers for name in ("first", "model"))
    assert {name: number.value for name, number in first.items()} == {
        name: number.value for name, number in whole.items()
    }
    assert "interval" not in files["first"].read_text()


def test_the_page_has_every_number_its_interval_and_the_next_step(
    campaign: Path, document: dict[str, Any], files: dict[str, Path]
) -> None:
    text = (files["report"] / "identification.md").read_text(encoding="utf-8")
    page = (files["report"] / "identification.html").read_text(encoding="utf-8")
    for entry in document["parameters"]:
        row = f"| {entry['name']} | {entry['meaning']} | {entry['unit']} | "
        assert row in text
        assert row.split(" | ")[1] in page
        if entry["flags"]:
            assert f"| {entry['name']} | {', '.join(entry['flags'])} | " in text
    assert f"- **Next**: tirelib compare {campaign} --model {files['model']}" in text
    assert '"ring-intervals"' in page
    assert '"ring-correlation"' in page


def test_a_gage_without_numbers_is_warned_of_before_the_results(
    campaign: Path, tmp_path: Path
) -> None:
    given = read_campaign(campaign)
    runs = [replace(run, strain=without(run.strain, 1)) for run in given.runs()]
    write_campaign(tmp_path / "broken", given.header, runs)
    found = CliRunner().invoke(
        program, ["identify", str(tmp_path / "broken"), "--out", str(tmp_path / "M.toml")]
    )
    assert found.exit_code == 0, found.output
    assert "Warning: gage 2 at" in found.stderr
    assert "no numbers (NaN) in 4 runs" in found.stderr
    assert "4 straight runs, 3 of 5 gages averaged" in found.output


def without(strain: FloatArray | None, gage: int) -> FloatArray:
    assert strain is not None
    out = strain.copy()
    out[gage] = np.nan
    return out


@pytest.fixture(scope="module")
def document(files: dict[str, Path]) -> dict[str, Any]:
    return dict(json.loads(files["json"].read_text()))


@pytest.fixture(scope="module")
def true() -> dict[str, float]:
    """The rig tire's constants at the mean pressure, in the units of the document."""
    mean = float(np.mean([pressure for _, pressure in CONDITIONS]))
    grown = inflated(TIRE, mean, 0.0)
    return {
        "bending_stiffness": TIRE.bending,
        "radial_stiffness": TIRE.radial_stiffness(mean),
        "tangential_stiffness": TIRE.tangential_stiffness(mean),
        "tread_stiffness": TIRE.tread_normal * TIRE.belt_width,
        "innerliner_offset": 1e3 * TIRE.innerliner_offset,
        "radial_pressure_slope": 1e5 * TIRE.sidewall_radial,
        "tangential_pressure_slope": 1e5 * TIRE.sidewall_tangential,
        "extension_stiffness": TIRE.extension,
        "shear_stiffness": TIRE.shear,
        "rotary_inertia": 0.0,
        "tread_shear_stiffness": TIRE.tread_shear_x * TIRE.belt_width,
        "tread_hardening": TIRE.tread_hardening,
        "section_pull": TIRE.radial_stiffness(mean) * grown / (mean * TIRE.belt_width),
        "liner_share": 0.0,
        "offset_pressure_slope": 0.0,
        "tread_poisson": 0.0,
        "contact_crown": 0.0,
        "creep": 0.0,
        "tread_spread": 0.0,
        "centrifugal_tension": 1.0,
    }


def test_true_values_lie_in_the_intervals(document: dict[str, Any], true: dict[str, float]) -> None:
    assert {p["name"] for p in document["parameters"]} == set(true)
    for entry in document["parameters"]:
        # an interval of factors ends above zero: what the tire has not is less than a fifth
        least = entry["low"] if true[entry["name"]] or entry["low"] < 0.0 else 0.0
        assert least <= true[entry["name"]] <= entry["high"], entry
        assert least == entry["low"] or entry["low"] < 0.2 * entry["value"], entry


def test_what_strain_tells_is_near_the_truth(
    document: dict[str, Any], true: dict[str, float]
) -> None:
    """Intervals may be wide; the values themselves are much nearer than those."""
    entries = {entry["name"]: entry for entry in document["parameters"]}
    assert not entries["radial_stiffness"]["flags"]
    near = {
        "bending_stiffness": 0.05,
        "radial_stiffness": 0.02,
        "innerliner_offset": 0.02,
        "extension_stiffness": 0.15,
        "radial_pressure_slope": 0.1,
    }
    for name, share in near.items():
        assert entries[name]["value"] == pytest.approx(true[name], rel=share), name
        assert "at_boundary" not in entries[name]["flags"], name
        half = 0.5 * (entries[name]["high"] - entries[name]["low"])
        # the fit's part is what four runs can tell, and not a rounded-up guess
        assert 0.0 < entries[name]["fit_std"] < half / 1.96


def test_the_strain_is_explained(document: dict[str, Any]) -> None:
    # a ring whose belt does not shear leaves 2 % of this tire's strain, a linear one 7 %
    assert document["rms_ustrain"] < 0.012 * document["strain_rms_ustrain"]
    stiffness = document["vertical_stiffness"]
    assert stiffness["model"] == pytest.approx(stiffness["measured"], rel=0.05)


def test_the_document_says_what_was_done(document: dict[str, Any], campaign: Path) -> None:
    assert document["format"] == "tirelib-identification/1"
    assert document["campaign"] == "rig-four"
    assert document["axes"] == "iso"
    assert document["runs"] == [0, 1, 2, 3]
    assert document["gages"] == [1, 2, 3, 4, 5]
    assert document["noise_ustrain"] is None, "nothing was repeated"
    matrix = np.array(document["correlation"])
    assert matrix.shape == (20, 20)
    assert np.diag(matrix) == pytest.approx(1.0)
    assert document["provenance"]["data_sha256"] == read_campaign(campaign).content_hash()
    keys = {"name", "meaning", "value", "std", "low", "high", "fit_std", "unit", "flags", "helps"}
    for entry in document["parameters"]:
        assert set(entry) == keys
        assert entry["low"] < entry["value"] < entry["high"]
        assert bool(entry["helps"]) == ("not_identifiable" in entry["flags"])


def test_the_model_is_a_tire_with_provenance(
    files: dict[str, Path], document: dict[str, Any]
) -> None:
    read = read_tire(files["model"])
    assert read.extra["provenance"]["data_sha256"] == document["provenance"]["data_sha256"]
    by_name = {p["name"]: p for p in document["parameters"]}
    assert read.tire.bending_stiffness == pytest.approx(by_name["bending_stiffness"]["value"])
    assert 1e3 * read.tire.innerliner_offset == pytest.approx(by_name["innerliner_offset"]["value"])
    assert read.numbers["tread_stiffness"].kind == "fitted"
    assert read.extra["effects"] == []
    told = read.extra["identified_correlation"]
    assert told["names"] == list(by_name)
    assert np.array(told["values"]) == pytest.approx(np.array(document["correlation"]))


def test_the_held_tread_is_as_stiff_as_the_tire_in_the_file(
    files: dict[str, Path], document: dict[str, Any]
) -> None:
    """Corrected Eq. (112): S_v = pi R (k_u + k_v), S_theta = 2 pi R^3 k_v."""
    tire, rim = read_tire(files["model"]).tire, document["rim_stiffness"]
    R, k_u, k_v = tire.ring_radius, tire.radial_stiffness, tire.tangential_stiffness
    S_v, S_theta = np.pi * R * (k_u + k_v), 2.0 * np.pi * R**3 * k_v
    assert rim["shift_N_per_mm"] == pytest.approx(1e-3 * S_v)
    assert rim["turn_Nm_per_deg"] == pytest.approx(S_theta * np.pi / 180.0)
    assert rim["longitudinal_N_per_mm"] == pytest.approx(1e-3 / (1 / S_v + R**2 / S_theta))


def test_identify_tells_the_error_that_compare_tells(
    files: dict[str, Path], campaign: Path, document: dict[str, Any], tmp_path: Path
) -> None:
    words = ["compare", str(campaign), "--model", str(files["model"])]
    found = CliRunner().invoke(program, [*words, "--json", str(tmp_path / "C.json")])
    assert found.exit_code == 0, found.output
    told = json.loads((tmp_path / "C.json").read_text())
    # the model file's numbers come back to a rounding
    assert document["error"] == pytest.approx(told["error"], rel=1e-6)
    assert (document["error_unit"], document["noise"]) == (told["error_unit"], told["noise"])
    assert document["error_unit"] == "ustrain", "four runs, none repeated"
    assert document["error"] == pytest.approx(document["residual_rms_raw"])


def test_simulate_takes_the_model(files: dict[str, Path], tmp_path: Path) -> None:
    target = tmp_path / "S.json"
    found = CliRunner().invoke(
        program,
        ["simulate", "--model", str(files["model"]), "--load", "4000", "--json", str(target)],
    )
    assert found.exit_code == 0, found.output
    simulated = json.loads(target.read_text())
    assert simulated["Fz_N"] == pytest.approx(4000.0)
    assert 10.0 < simulated["deflection_mm"] < 40.0


def test_no_strain_is_an_error_of_two(tmp_path: Path) -> None:
    runs = [replace(synthetic_run(i), strain=None, trigger=None) for i in range(4)]
    folder = write(tmp_path / "c", runs)
    done = run("identify", folder, "--out", tmp_path / "M.toml")
    assert done.returncode == 2
    assert "holds no strain" in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "M.toml").exists()


def test_straight_runs_without_a_ring_are_an_error_of_one_beside_a_brush(tmp_path: Path) -> None:
    """The plan asked for a ring: a brush alone is no success, and the gage is named."""
    loads = (2500.0, 3500.0, 4500.0, 5500.0)
    straight = [synthetic_run(i, load=load, kind="free") for i, load in enumerate(loads)]
    dead = [replace(each, strain=np.array(each.strain)) for each in straight]
    for each in dead:
        assert each.strain is not None
        each.strain[2] = 2.7e-3
    turned = [
        synthetic_run(10 + i, load=load, slip_angle=np.deg2rad(angle))
        for i, (load, angle) in enumerate((f, a) for f in loads[::2] for a in (-6, -3, -1, 1, 3, 6))
    ]
    folder = write(tmp_path / "c", [*dead, *turned])
    found = CliRunner().invoke(
        program, ["identify", str(folder), "--out", str(tmp_path / "M.toml")]
    )
    assert found.exit_code == 1, found.output
    first, *lines = found.stderr.splitlines()
    assert first == "identifying ..."
    assert lines[0].startswith("Warning: the straight runs gave no ring")
    assert "gage 3 at +0 mm hardly shows strain in 4 runs (0, 1, 2, 3)" in found.stderr
    assert "bristle_lateral" in found.output
    assert read_tire(tmp_path / "M.toml").numbers["friction"].kind == "fitted"


def refused(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], *words: object
) -> str:
    """Return what a call in this process says when it ends with 2."""
    monkeypatch.setattr("sys.argv", ["tirelib", *map(str, words)])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    return capsys.readouterr().err


def test_a_sweep_alone_is_an_error_of_two(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = write(tmp_path / "c", [synthetic_run(0, kind="sweep")])
    assert "is a sweep" in refused(
        monkeypatch, capsys, "identify", folder, "--out", tmp_path / "M.toml"
    )


def test_a_tire_that_is_not_there_is_an_error_of_two(
    campaign: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert "none-such" in refused(
        monkeypatch,
        capsys,
        "identify",
        campaign,
        "--tire",
        "none-such",
        "--out",
        tmp_path / "M.toml",
    )


def test_a_tire_may_be_given_as_start_and_nothing_identified_is_one(
    campaign: Path, document: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tirelib.inference.identify.identify.WIDEST", 1e-6)
    out = tmp_path / "M.toml"
    found = CliRunner().invoke(
        program, ["identify", str(campaign), "--tire", "table-6-1", "--out", str(out)]
    )
    assert found.exit_code == 1, found.output
    assert "would help" in found.output
    numbers = read_tire(out).numbers  # written with their flags
    plain = {entry["name"]: entry for entry in document["parameters"]}
    assert numbers["radial_stiffness"].value == pytest.approx(
        plain["radial_stiffness"]["value"], rel=0.02
    )
    assert all("not_identifiable" in numbers[name].notes["flags"] for name in plain)
