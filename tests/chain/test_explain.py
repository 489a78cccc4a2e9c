"""`tirelib explain`: the whole journey in one command, of strain and of forces."""

import json
import shlex
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from click.testing import CliRunner, Result

from tests.chain.test_diagnose import Folder
from tests.unit.inference.diagnose.planted import EFFECT, FEW, STRENGTH, model_file, waves
from tests.unit.inference.force_campaigns import brush_file, steady_runs, write_forces
from tirelib.cli import program
from tirelib.core.errors import TirelibError
from tirelib.core.parameters import read_tire, write_tire
from tirelib.measured import waveforms

pytestmark = pytest.mark.usefixtures("copies")
KEYS = {
    "format",
    "tirelib",
    "campaign",
    "quantity",
    "verdict",
    "named",
    "added",
    "error_unit",
    "noise",
    "error_before",
    "error_after",
    "floor",
    "heldout_error_before",
    "heldout_error_after",
    "held_out",
    "residual_rms_before",
    "residual_rms_after",
    "residual_rms_unit",
    "steps",
    "pages",
    "commands",
    "messages",
    "explanation",
}


def call(*words: object) -> Result:
    return CliRunner().invoke(program, list(map(str, words)))


def journey(out: Path, *words: object) -> Any:
    target = out / "E.json"
    found = call("explain", *words, "--out", out, "--json", target)
    assert found.exit_code == 0, found.output + repr(found.exception)
    told = json.loads(target.read_text())
    page = (out / "index.html").read_text()
    return SimpleNamespace(told=told, out=out, said=found.output, page=page)


@pytest.fixture(scope="module")
def strain(tmp_path_factory: pytest.TempPathFactory) -> Any:
    folder = tmp_path_factory.mktemp("strain")
    write_tire(model_file(), folder / "M.toml", "tirelib-model/1")
    measured = waves(EFFECT, STRENGTH)
    with pytest.MonkeyPatch.context() as patch:
        for verb in ("compare", "diagnose", "add", "explain"):
            patch.setattr(f"tirelib.cli.{verb}.read_campaign", lambda path: Folder(measured))
        patch.setattr("tirelib.model.registration.registered_effects", lambda files: FEW)
        patch.setattr(
            waveforms, "measure_waveforms", lambda campaign, progress=None: campaign.measured
        )
        return journey(folder / "out", "DIR", "--model", folder / "M.toml")


@pytest.fixture(scope="module")
def planted(strain: Any) -> Any:
    """What the journey's `tirelib diagnose` wrote."""
    told = json.loads((strain.out / "diagnosis.json").read_text())
    return SimpleNamespace(told=told, out=strain.out / "diagnosed")


@pytest.fixture(scope="module")
def forces(tmp_path_factory: pytest.TempPathFactory) -> Any:
    folder = tmp_path_factory.mktemp("forces")
    campaign = write_forces(folder / "steady", steady_runs(slope=0.25), "steady")
    write_tire(brush_file(campaign), folder / "M.toml", "tirelib-model/1")
    return journey(folder / "out", folder / "steady", "--model", folder / "M.toml")


def test_what_was_planted_is_named_added_and_the_error_falls(strain: Any) -> None:
    told = strain.told
    assert set(told) == KEYS
    assert told["added"] == told["named"] == [EFFECT]
    assert told["error_after"] < 0.2 * told["error_before"]
    assert told["heldout_error_after"] < told["heldout_error_before"]
    assert told["floor"] <= told["error_after"] * (1.0 + 1e-6)
    (effect,) = read_tire(told["steps"][-1]["model"]).extra["effects"]
    assert effect["effect"] == EFFECT
    assert effect["strength"] == pytest.approx(STRENGTH, abs=0.05)


def test_the_diagnosis_has_the_contracts_keys(planted: Any) -> None:
    told = planted.told
    assert told["format"] == "tirelib-diagnosis/1"
    assert told["quantity"] == "strain"
    assert {
        "noise",
        "floor",
        "error_before",
        "verdict",
        "named",
        "sets",
        "false_alarm",
        "candidates",
        "dead",
        "unexplained",
        "next_test",
    } <= set(told)
    assert set(told["unexplained"]) >= {"where", "scaling"}
    for entry in told["candidates"]:
        assert set(entry) >= {
            "effect",
            "rank",
            "score",
            "threshold",
            "level",
            "strength",
            "std",
            "in_range",
            "error_after",
            "heldout_error_after",
            "twins",
            "power",
            "p",
            "p_std",
            "gain",
        }
    assert [entry["rank"] for entry in told["candidates"]] == list(
        range(1, len(told["candidates"]) + 1)
    )


def test_the_planted_effect_is_named_with_errors_that_fall(planted: Any) -> None:
    told = planted.told
    assert told["verdict"] in ("named", "form_inadequate")
    assert told["named"] == [EFFECT]
    first = told["candidates"][0]
    assert first["effect"] == EFFECT
    assert first["level"] == "alarm"
    assert first["score"] > first["threshold"]
    gains = [entry["gain"] for entry in told["candidates"]]
    assert first["gain"] > 20.0 + max(gains[1:])
    assert told["p_without"] <= told["false_alarm"] == 0.05
    assert told["sets"] == [[EFFECT]]
    assert first["error_after"] == told["error_after"] < 0.5 * told["error_before"]
    assert told["error_after"] < told["error_refitted"] < told["error_before"]
    assert first["heldout_error_after"] < told["heldout_error_before"]
    assert all(entry["heldout_error_after"] is None for entry in told["candidates"][1:])


def test_dead_effects_are_names_with_reasons(planted: Any) -> None:
    told = planted.told
    assert told["dead_reasons"]["camber"] == "no run has a camber"
    assert told["dead"] == list(told["dead_reasons"])
    assert not set(told["dead"]) & {entry["effect"] for entry in told["candidates"]}


def test_the_diagnosis_is_one_page_and_the_same_in_words(planted: Any) -> None:
    page = (planted.out / "diagnosis.html").read_text()
    words = (planted.out / "diagnosis.md").read_text()
    assert json.loads((planted.out / "diagnosis.json").read_text()) == planted.told
    assert 'src="http' not in page
    for plot in ("scores", "residual-before", "residual-after"):
        assert f'id="plot-{plot}"' in page
    for text in (EFFECT, "Dead effects", "no run has a camber"):
        assert text in page
        assert text in words
    assert not (planted.out / "index.html").exists()


def test_forces_make_the_same_journey(forces: Any) -> None:
    told = forces.told
    assert set(told) == KEYS
    assert told["quantity"] == "Fy"
    assert "friction_load" in told["added"]
    assert told["error_after"] < told["error_before"]
    assert told["residual_rms_unit"] == "N"
    assert forces.page.count("<h3>Before: ") == forces.page.count("<h3>After: ") == 2
    for plot in ("part-errors", "curve-worst", "curve-best", "history-Fy"):
        assert f'id="plot-{plot}"' in forces.page, plot


@pytest.mark.parametrize("kind", ["strain", "forces"])
def test_console_page_and_file_say_the_same_four_lines(
    kind: str, request: pytest.FixtureRequest
) -> None:
    found = request.getfixturevalue(kind)
    lines = found.told["explanation"]
    assert list(lines) == ["missing", "sure", "error", "next"]
    words = (found.out / "index.md").read_text()
    for line in lines.values():
        assert line in words
        assert line in found.said.replace("\n", " ")
    for title in ("What is missing", "How sure", "The error", "What to do next"):
        assert f"<dt>{title}</dt>" in found.page
    assert f"{found.told['error_before']:.1f}" in lines["error"]


@pytest.mark.parametrize("kind", ["strain", "forces"])
def test_every_step_is_linked_and_every_error_is_one_number(
    kind: str, request: pytest.FixtureRequest
) -> None:
    found = request.getfixturevalue(kind)
    told = found.told
    for page in told["pages"]:
        assert (found.out / page["path"]).is_file(), page
        assert f'href="{page["path"]}"' in found.page
    before, after, diagnosis = (
        json.loads((found.out / name).read_text())
        for name in ("compared-before.json", "compared-after.json", "diagnosis.json")
    )
    assert before["error"] == told["error_before"]
    assert after["error"] == told["error_after"]
    steps = [json.loads((found.out / f"added-{name}.json").read_text()) for name in told["added"]]
    # contacts solved from another start, and points that were thinned, differ by rounding
    assert diagnosis["error_before"] == pytest.approx(before["error"], rel=1e-6)
    assert diagnosis["error_after"] == pytest.approx(after["error"], rel=1e-6)
    assert diagnosis["floor"] == pytest.approx(told["floor"])
    for key in ("heldout_error_before", "heldout_error_after"):
        assert diagnosis[key] == told[key], key
    assert steps[0]["error_before"] == pytest.approx(before["error"], rel=1e-6)
    assert steps[-1]["error_after"] == pytest.approx(after["error"], rel=1e-6)
    every = [before, after, diagnosis, *steps]
    assert {document["error_unit"] for document in every} == {"noise"}
    # no model changes the unit
    assert len({document["noise"] for document in every}) == 1
    raw = (before["residual_rms_raw"], after["residual_rms_raw"])
    assert diagnosis["residual_rms_before"] == pytest.approx(raw[0], rel=1e-6)
    assert steps[-1]["residual_rms_after"] == pytest.approx(raw[1], rel=1e-6)
    for document in (diagnosis, *steps):
        assert 0.0 < document["floor"] <= document["error_after"]
    assert after["floor"] == pytest.approx(steps[-1]["floor"])


@pytest.mark.parametrize("kind", ["strain", "forces"])
def test_its_commands_are_those_of_the_verbs(kind: str, request: pytest.FixtureRequest) -> None:
    told = request.getfixturevalue(kind).told
    verbs = [shlex.split(line)[:2] for line in told["commands"]]
    adds = [["tirelib", "add"]] * len(told["added"])
    assert verbs == [
        ["tirelib", "compare"],
        ["tirelib", "diagnose"],
        *adds,
        ["tirelib", "compare"],
    ]
    for line in told["commands"]:
        for word in shlex.split(line):
            assert word in request.getfixturevalue(kind).page.replace("&#39;", "'")


def test_the_page_shows_each_run_and_before_beside_after(strain: Any) -> None:
    for plot in (
        "run-errors",
        "waveform-worst",
        "heat-runs-before",
        "heat-runs-after",
        "history-strain",
    ):
        assert f'id="plot-{plot}"' in strain.page, plot
    assert 'src="http' not in strain.page
    added = json.loads((strain.out / f"added-{EFFECT}.json").read_text())
    rows = added["runs"]
    mean = sum(row["error_after"] ** 2 for row in rows) / len(rows)
    assert mean**0.5 == pytest.approx(added["error_after"])
    assert any(row["held_out"] for row in rows)
    assert not all(row["held_out"] for row in rows)


def test_add_writes_its_waterfall_as_page_and_numbers(strain: Any) -> None:
    added = json.loads((strain.out / f"added-{EFFECT}.json").read_text())
    first, last = added["waterfall"]
    assert (first["effect"], last["effect"], last["action"]) == (None, EFFECT, "add")
    assert (first["error"], last["error"]) == (added["error_before"], added["error_after"])
    assert last["heldout_error"] == added["heldout_error_after"]
    page = (strain.out / f"added-{EFFECT}" / "extension.html").read_text()
    assert 'id="plot-history-strain"' in page
    assert 'id="plot-run-errors"' in page


def test_bad_input_is_refused_before_anything_is_written(tmp_path: Path) -> None:
    out = tmp_path / "out"
    missing = call("explain", tmp_path / "nowhere", "--out", out)
    assert isinstance(missing.exception, TirelibError)
    assert not out.exists()
    wrong = call("explain", tmp_path, "--out", out, "--quantity", "Fz")
    assert "allowed are strain, Fy, Fx, Mz" in str(wrong.exception)
    assert call("explain", tmp_path).exit_code == 2
