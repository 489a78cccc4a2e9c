"""`tirelib diagnose` and `tirelib add`: files, exit codes, messages.

`test_explain` holds what the diagnosis of a planted effect says, in its document and on its page.
"""

import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from tests.unit.inference.diagnose.planted import EFFECT, FEW, STRENGTH, added, model_file, waves
from tirelib.cli import program
from tirelib.core.errors import TirelibError
from tirelib.core.parameters import read_tire, write_tire
from tirelib.measured.waveforms import Waveforms

MINE = """
from tirelib.effects import effect

@effect("mine", stage="tread", unit="{unit}", low=0.0, high=1.0, varies_with=("load",),
        source="test")
def law(state, strength):
    "Stiffer tread with load."
    return state.but(k_t=state.k_t * (1.0 + strength * state.conditions.load / 4e3)){end}
"""


class Folder:
    """Stands in for a campaign's files; the waveforms are the model's own."""

    def __init__(self, measured: Waveforms) -> None:
        self.measured, self.header = measured, measured.header

    def content_hash(self) -> str:
        return "hash"


def use(patch: pytest.MonkeyPatch, measured: Waveforms) -> None:
    for verb in ("diagnose", "add"):
        patch.setattr(f"tirelib.cli.{verb}.read_campaign", lambda path: Folder(measured))
    for module in ("measured.waveforms", "inference.extend.additions"):
        patch.setattr(f"tirelib.{module}.measure_waveforms", lambda c, progress: c.measured)


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


def test_the_named_effect_is_added_and_no_longer_a_candidate(
    model: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    use(monkeypatch, waves(EFFECT, STRENGTH))
    monkeypatch.setattr("tirelib.model.registration.registered_effects", lambda files: FEW)
    monkeypatch.setattr("tirelib.inference.extend.additions.extended", lambda *_: added()[0])
    monkeypatch.setattr("tirelib.inference.extend.additions.models_of", lambda *_: None)
    second, target = tmp_path / "M2.toml", tmp_path / "A.json"
    found = call(
        "add", EFFECT, "--model", model, "--data", "anywhere", "--out", second, "--json", target
    )
    assert found.exit_code == 0, found.output
    told = json.loads(target.read_text())
    assert told["format"] == "tirelib-extension/1"
    assert told["error_after"] < 0.5 * told["error_before"]
    assert told["heldout_error_after"] < told["heldout_error_before"]
    assert read_tire(second).extra["effects"][0]["strength"] == told["strength"]
    again = call("diagnose", "x", "--model", second, "--json", tmp_path / "D.json")
    assert again.exit_code == 0, again.output
    after = json.loads((tmp_path / "D.json").read_text())
    assert after["has"] == [EFFECT]
    assert EFFECT not in {entry["effect"] for entry in after["candidates"]}
    # wide priors about another start move the minimum by a hundredth of a whitened sample's scatter
    factor = told["error_after"] / added()[0].after.error
    assert after["error_before"] == pytest.approx(told["error_after"], abs=0.01 * factor)
    assert after["named"] == []


def test_without_repeats_nothing_is_named_and_the_noise_is_null(
    model: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    use(monkeypatch, waves(EFFECT, STRENGTH, 0))
    monkeypatch.setattr("tirelib.model.registration.registered_effects", lambda files: FEW)
    target = tmp_path / "D.json"
    found = call("diagnose", "anywhere", "--model", model, "--json", target)
    assert found.exit_code == 0, found.output
    told = json.loads(target.read_text())
    assert told["noise"] is None
    assert told["error_unit"] == "ustrain"
    assert (told["verdict"], told["named"]) == ("none", [])
    assert {entry["level"] for entry in told["candidates"]} <= {"hint", "quiet"}
    assert "no runs were repeated" in found.output
    names = [entry["effect"] for entry in told["candidates"]]
    assert max(map(len, names)) > 12
    assert all(name in found.output for name in names), "names are printed in full"


def test_bad_input_is_told(model: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    use(monkeypatch, waves())
    diagnose = ("diagnose", "x", "--model", model)
    add = ("--model", model, "--out", tmp_path / "M2.toml")
    assert "allowed are strain, Fy" in refused(*diagnose, "--quantity", "Fw")
    assert "allowed are strain, Fy" in refused("add", EFFECT, *add, "--quantity", "Mw")
    assert "did you mean sidewall_load" in refused("add", "sidewal_load", *add, "--data", "x")
    assert "--data is missing" in refused("add", EFFECT, *add)
    assert "EFFECT is missing" in refused("add", *add, "--data", "x")
    assert "nothing to undo" in refused("add", "--undo", *add)
    assert "neither" in refused("add", EFFECT, "--undo", *add)
    assert "has no effect" in refused("add", EFFECT, "--remove", *add, "--data", "x")
    assert not (tmp_path / "M2.toml").exists()


@pytest.mark.parametrize(
    ("unit", "end", "says"), [("1", "\n  oops(", "not Python"), ("furlong", "", "furlong")]
)
def test_a_faulty_file_of_effects_is_told(
    model: Path, tmp_path: Path, unit: str, end: str, says: str
) -> None:
    file = tmp_path / "mine.py"
    file.write_text(MINE.format(unit=unit, end=end))
    assert says in refused("diagnose", "x", "--model", model, "--effects", file)


def test_a_campaign_with_too_few_runs_gets_no_verdict(
    model: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    use(monkeypatch, waves().take(waves().run < 3))
    target = tmp_path / "D.json"
    assert "at least 4" in refused("diagnose", "x", "--model", model, "--json", target)
    assert not target.exists()


def test_a_seed_below_zero_is_refused(model: Path) -> None:
    found = call("selftest", "anywhere", "--model", model, "--seed", -1)
    assert found.exit_code == 2
    assert "'-1' is given; a whole number, 0 or more, is needed" in found.output
