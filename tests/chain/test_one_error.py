"""One campaign gives one error in one unit, also where the next runs are planned.

`test_identify` and `test_explain` hold it for the other verbs.
"""

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

VERBS = ("compare", "selftest", "next_test")


@pytest.fixture(scope="module")
def told(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, Any]]:
    folder = tmp_path_factory.mktemp("journey")
    model, measured = folder / "M.toml", waves(EFFECT, STRENGTH)
    write_tire(model_file(), model, "tirelib-model/1")
    out: dict[str, dict[str, Any]] = {}

    def call(verb: str, *words: object) -> None:
        target = folder / f"{verb}.json"
        given = [verb, "x", "--model", str(model), *map(str, words), "--json", str(target)]
        found = CliRunner().invoke(program, given, catch_exceptions=False)
        assert found.exit_code == 0, found.output
        out[verb] = json.loads(target.read_text())

    with pytest.MonkeyPatch.context() as patch:
        for verb in VERBS:
            patch.setattr(f"tirelib.cli.{verb}.read_campaign", lambda path: Folder(measured))
        for module in (waveforms, sys.modules["tirelib.compare.compare"]):
            patch.setattr(module, "measure_waveforms", lambda c, progress: c.measured)
        call("compare")
        call(
            "selftest",
            "--repeats",
            1,
            "--effects-of",
            "hydroplaning",
            "--ratio",
            1.5,
        )
        call("next-test", "--suspects", "hydroplaning,sidewall_damping")
    return out


@pytest.mark.parametrize("verb", ["selftest", "next-test"])
def test_planning_tells_the_error_that_compare_tells(
    told: dict[str, dict[str, Any]], verb: str
) -> None:
    compared = told["compare"]
    assert compared["error"] > 5.0
    for key in ("error", "noise", "residual_rms_raw"):
        # contacts solved from another start differ by rounding
        assert told[verb][key] == pytest.approx(compared[key], rel=1e-6), key
    assert told[verb]["error_unit"] == compared["error_unit"] == "noise"
