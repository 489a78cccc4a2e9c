"""`tirelib next-test` and `tirelib selftest`: keys, files, exit codes, messages.

The error that they report is that of `tirelib compare`; `test_identify` and `test_explain` hold the
same for the other verbs.
"""

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from click.testing import CliRunner, Result

from tests.chain.test_diagnose import Folder
from tests.unit.inference.diagnose.planted import EFFECT, STRENGTH, model_file, waves
from tirelib.cli import program
from tirelib.core.errors import TirelibError
from tirelib.core.parameters import write_tire
from tirelib.effects import CATALOGUE
from tirelib.measured import waveforms
from tirelib.measured.waveforms import Waveforms


@pytest.fixture(autouse=True)
def campaign(monkeypatch: pytest.MonkeyPatch) -> None:
    use(monkeypatch, waves(EFFECT, STRENGTH))


def use(patch: pytest.MonkeyPatch, measured: Waveforms) -> None:
    for verb in ("compare", "next_test", "selftest"):
        patch.setattr(f"tirelib.cli.{verb}.read_campaign", lambda path: Folder(measured))
    patch.setattr(waveforms, "measure_waveforms", lambda c, progress: c.measured)


def call(*words: object) -> Result:
    return CliRunner().invoke(program, list(map(str, words)))


def refused(*words: object) -> str:
    found = call(*words)
    assert isinstance(found.exception, TirelibError), found.output
    return str(found.exception)


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("models") / "M.toml"
    write_tire(model_file(), path, "tirelib-model/1")
    return path


FEW = {
    name: CATALOGUE[name]
    for name in (EFFECT, "temperature", "sidewall_damping", "low_pass", "camber")
}
"""Effects enough for a plan; its time goes with their number."""


def few_effects(patch: pytest.MonkeyPatch) -> None:
    patch.setattr("tirelib.model.registration.registered_effects", lambda files: FEW)


@pytest.fixture(scope="module")
def planned(model: Path) -> Any:
    with pytest.MonkeyPatch.context() as patch:
        use(patch, waves(EFFECT, STRENGTH))
        few_effects(patch)
        out, target = model.parent / "next", model.parent / "N.json"
        found = call(
            "next-test",
            "anywhere",
            "--model",
            model,
            "--suspects",
            f"{EFFECT}, temperature",
            "--load-range",
            2000,
            6500,
            "--speed-range",
            54,
            54,
            "--out",
            out,
            "--json",
            target,
        )
    assert found.exit_code == 0, found.output
    return SimpleNamespace(told=json.loads(target.read_text()), out=out, said=found.output)


def diagnosis(folder: Path, **changes: Any) -> Path:
    told = {
        "format": "tirelib-diagnosis/1",
        "made_by_hand": True,
        "quantity": "strain",
        "verdict": "none",
        "named": [],
        "candidates": [],
        "has": [],
    }
    file = folder / "D.json"
    file.write_text(json.dumps(told | changes))
    return file


def test_a_sweep_is_for_forces(model: Path) -> None:
    said = refused("next-test", "anywhere", "--model", model, "--suspects", EFFECT, "--sweep")
    assert "--sweep and --no-sweep are for forces" in said


def test_the_contracts_keys_are_there(planned: Any) -> None:
    told = planned.told
    assert told["format"] == "tirelib-next-test/1"
    assert told["quantity"] == "strain"
    for entry in told["candidates"]:
        assert set(entry) >= {
            "load_N",
            "pressure_bar",
            "speed_kmh",
            "separation",
            "resolves_probability",
            "pair",
        }
    assert told["best"] == told["candidates"][0]
    assert {e["effect"] for e in told["suspects"]} == {EFFECT, "temperature"}
    assert told["envelope"]["declared"] == ["load", "speed"]
    assert told["envelope"]["load_N"] == [2000.0, 6500.0]
    assert all(entry["speed_kmh"] == pytest.approx(54.0) for entry in told["candidates"])
    assert set(told["repeats"]) >= {"of_best", "limit", "separation", "wanted_separation"}


def test_the_planted_effect_is_preferred_and_that_is_said(planned: Any) -> None:
    (present,) = planned.told["present"]
    assert present["better"] == EFFECT
    assert present["resolved"]
    assert f"the present runs already distinguish {EFFECT} from temperature" in planned.said


def test_the_report_is_one_page_and_the_same_in_words(planned: Any) -> None:
    page = (planned.out / "next_test.html").read_text()
    words = (planned.out / "next_test.md").read_text()
    assert json.loads((planned.out / "next_test.json").read_text()) == planned.told
    assert 'src="http' not in page
    for plot in (f"separation-{EFFECT}-temperature", "repeats"):
        assert f'id="plot-{plot}"' in page
    for text in ("Runs by rank", "widened to both sides: pressure by 15 %", "W. J. Hill"):
        assert text in page
        assert text in words


def test_where_nothing_is_in_doubt_the_list_is_empty_and_the_exit_code_zero(
    model: Path, tmp_path: Path
) -> None:
    file, target = diagnosis(tmp_path), tmp_path / "N.json"
    found = call(
        "next-test",
        "x",
        "--model",
        model,
        "--diagnosis",
        file,
        "--json",
        target,
        "--out",
        tmp_path / "page",
    )
    assert found.exit_code == 0, found.output
    told = json.loads(target.read_text())
    assert told["candidates"] == []
    assert told["verdict"] == "none"
    assert "nothing is in doubt" in found.output
    assert (tmp_path / "page" / "next_test.html").exists()


def test_bad_input_is_told(model: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run = ("next-test", "x", "--model", model)
    assert "both given" in refused(*run, "--suspects", "low_pass", "--diagnosis", "D.json")
    assert "'lowpass' is not known" in refused(*run, "--suspects", "lowpass")
    assert "load 7000 to 2000" in refused(
        *run, "--suspects", "low_pass", "--load-range", 7000, 2000
    )
    (tmp_path / "D.json").write_text("{oops")
    assert "cannot be read as JSON" in refused(*run, "--diagnosis", tmp_path / "D.json")
    (tmp_path / "D.json").write_text("[1]")
    assert "'tirelib-diagnosis/1' is needed" in refused(*run, "--diagnosis", tmp_path / "D.json")
    other = diagnosis(tmp_path, campaign="another day")
    assert "is of the campaign 'another day'" in refused(*run, "--diagnosis", other)
    other = diagnosis(tmp_path, has=["camber"])
    assert "diagnose this model" in refused(*run, "--diagnosis", other)
    force = diagnosis(tmp_path, quantity="Fy")
    assert "is a diagnosis of Fy, and strain is planned" in refused(*run, "--diagnosis", force)
    sideways = (*run, "--suspects", "low_pass", "--slip-angle-range", -5, 5)
    assert "slip angle is declared, which these runs cannot have" in refused(*sideways)
    test = ("selftest", "x", "--model", model)
    assert "'oops' is not known" in refused(*test, "--effects-of", "oops")
    assert call(*test, "--ratio", 0.9).exit_code == 2
    use(monkeypatch, waves().take(waves().run < 3))
    assert "at least 4" in refused(*test)
    assert "at least 4" in refused(*run, "--suspects", "low_pass")


@pytest.fixture(scope="module")
def judged(model: Path) -> Any:
    out, target = model.parent / "judged", model.parent / "S.json"
    with pytest.MonkeyPatch.context() as patch:
        use(patch, waves(EFFECT, STRENGTH))
        few_effects(patch)
        found = call(
            "selftest",
            "x",
            "--model",
            model,
            "--effects-of",
            "sidewall_load",
            "--ratio",
            1.1,
            "--repeats",
            2,
            "--out",
            out,
            "--json",
            target,
        )
    assert found.exit_code == 0, found.output
    return SimpleNamespace(told=json.loads(target.read_text()), out=out, said=found.output)


def test_a_selftest_tells_chances_on_page_and_screen(judged: Any) -> None:
    told = judged.told
    assert told["format"] == "tirelib-selftest/1"
    assert [entry["effect"] for entry in told["effects"]] == ["sidewall_load"]
    assert told["effects"][0]["results"][0]["n"] == 2
    page, words = (
        (judged.out / "selftest.html").read_text(),
        (judged.out / "selftest.md").read_text(),
    )
    assert 'id="plot-chance"' in page
    for text in ("optimistic", "Dead effects", "no run has a camber"):
        assert text in page
        assert text in words
        assert text in judged.said or text == "Dead effects"


@pytest.fixture(scope="module")
def compared(model: Path) -> dict[str, Any]:
    target = model.parent / "C.json"
    with pytest.MonkeyPatch.context() as patch:
        use(patch, waves(EFFECT, STRENGTH))
        found = call("compare", "x", "--model", model, "--json", target)
    assert found.exit_code == 0, found.output
    return dict(json.loads(target.read_text()))


@pytest.mark.parametrize("planning", ["planned", "judged"])
def test_planning_reports_the_error_that_compare_reports(
    compared: dict[str, Any], planning: str, request: pytest.FixtureRequest
) -> None:
    told = request.getfixturevalue(planning).told
    assert compared["error"] > 5.0
    for key in ("error", "noise", "residual_rms_raw"):
        # contacts solved from another start differ by rounding
        assert told[key] == pytest.approx(compared[key], rel=1e-6), key
    assert told["error_unit"] == compared["error_unit"] == "noise"
