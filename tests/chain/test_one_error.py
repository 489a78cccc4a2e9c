"""One campaign through all verbs gives one error, in one unit."""

import json
import sys
from typing import Any

import pytest
from click.testing import CliRunner

from tests.chain.test_diagnose import Folder
from tests.unit.diagnose.planted import EFFECT, STRENGTH, model_file, waves
from tirelib import waveforms
from tirelib.cli import program
from tirelib.parameters import write_tire

VERBS = ("compare", "diagnose", "add", "selftest", "next_test")


@pytest.fixture(scope="module")
def told(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, Any]]:
    folder = tmp_path_factory.mktemp("journey")
    model, second, measured = folder / "M.toml", folder / "M2.toml", waves(EFFECT, STRENGTH)
    write_tire(model_file(), model, "tirelib-model/1")
    out: dict[str, dict[str, Any]] = {}

    def call(key: str, verb: str, *words: object) -> None:
        target = folder / f"{key}.json"
        given = [verb, *map(str, words), "--json", str(target)]
        found = CliRunner().invoke(program, given, catch_exceptions=False)
        assert found.exit_code == 0, found.output
        out[key] = json.loads(target.read_text())

    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("TIRELIB_CACHE", "off")
        for verb in VERBS:
            patch.setattr(f"tirelib.cli.{verb}.read_campaign", lambda path: Folder(measured))
        for module in (waveforms, sys.modules["tirelib.compare.compare"]):
            patch.setattr(module, "measure_waveforms", lambda c, progress: c.measured)
        few = ("--members", 4)
        call("compare", "compare", "x", "--model", model)
        call("diagnose", "diagnose", "x", "--model", model, *few)
        call("selftest", "selftest", "x", "--model", model, *few, "--repeats", 1, "--effects-of",
             "hydroplaning", "--ratio", 1.5)  # fmt: skip
        call("next-test", "next-test", "x", "--model", model, "--suspects",
             "hydroplaning,sidewall_damping")  # fmt: skip
        call("add", "add", EFFECT, "--model", model, "--data", "x", "--out", second)
        call("compare again", "compare", "x", "--model", second)
    return out


def test_every_verb_tells_the_same_error_of_a_model(told: dict[str, dict[str, Any]]) -> None:
    first = told["compare"]["error"]
    assert first > 5.0
    for verb in ("diagnose", "add"):
        # contacts solved from another start differ by rounding
        assert told[verb]["error_before"] == pytest.approx(first, rel=1e-6), verb
    for verb in ("selftest", "next-test"):
        assert told[verb]["error"] == pytest.approx(first, rel=1e-6), verb
    second = told["compare again"]["error"]
    assert second < 0.2 * first
    assert told["add"]["error_after"] == pytest.approx(second, rel=1e-6)


def test_no_model_changes_the_unit(told: dict[str, dict[str, Any]]) -> None:
    assert {document["error_unit"] for document in told.values()} == {"noise"}
    noise = told["compare"]["noise"]
    for verb, document in told.items():
        assert document["noise"] == pytest.approx(noise, rel=1e-12), verb


def test_the_raw_rms_stands_beside_it(told: dict[str, dict[str, Any]]) -> None:
    raw = told["compare"]["residual_rms_raw"]
    assert told["diagnose"]["residual_rms_before"] == pytest.approx(raw, rel=1e-6)
    assert told["add"]["residual_rms_before"] == pytest.approx(raw, rel=1e-6)
    after = told["compare again"]["residual_rms_raw"]
    assert told["add"]["residual_rms_after"] == pytest.approx(after, rel=1e-6)
    assert after < raw


def test_the_floor_is_never_above_the_error(told: dict[str, dict[str, Any]]) -> None:
    for verb in ("diagnose", "add"):
        assert 0.0 < told[verb]["floor"] <= told[verb]["error_after"], verb
    assert told["compare again"]["floor"] == pytest.approx(told["add"]["floor"])
