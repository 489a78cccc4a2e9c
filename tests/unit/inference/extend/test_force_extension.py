"""Adding brush effects: which force they are fitted to, what is written, and the fall's figure."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.unit.inference.force_campaigns import brush_file, steady_runs, write_forces
from tirelib.core.errors import FormatError, ParameterError
from tirelib.core.parameters import TireFile, read_tire, write_tire
from tirelib.effects import CATALOGUE, Effect
from tirelib.inference.diagnose.forces.case import ForceCase, force_case, force_cases
from tirelib.inference.extend.document import extension_document
from tirelib.inference.extend.extension import (
    ForceExtension,
    case_for,
    extended,
    models_of,
    refuse,
    without_effect,
)
from tirelib.inference.extend.model_file import extended_file, undone_file
from tirelib.journey import add
from tirelib.report.figures.before_after import waterfall_of

EFFECT, SLOPE = CATALOGUE["friction_load"], 0.25


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> TireFile:
    folder = tmp_path_factory.mktemp("extend")
    return brush_file(write_forces(folder / "base", steady_runs(), "base"))


@pytest.fixture(scope="module")
def case(tmp_path_factory: pytest.TempPathFactory, model: TireFile) -> ForceCase:
    folder = tmp_path_factory.mktemp("extend")
    campaign = write_forces(folder / "steady", steady_runs(slope=SLOPE), "steady")
    return force_case(campaign, model, CATALOGUE, "Fy")


def add_brush_effect(case: ForceCase, effect: Effect) -> ForceExtension:
    refuse(case.model, effect)
    return extended(models_of(case, [effect]), case, effect)


@pytest.fixture(scope="module")
def added(case: ForceCase) -> ForceExtension:
    return add_brush_effect(case, EFFECT)


def test_the_planted_strength_comes_back_with_an_honest_interval(added: ForceExtension) -> None:
    assert added.strength[0] == pytest.approx(SLOPE, abs=4.0 * added.std[0])
    assert added.std[0] < 0.02
    assert added.flags == ()


def test_the_error_falls_to_the_noise_fitted_and_on_the_highest_load(
    added: ForceExtension,
) -> None:
    assert added.before.error > 5.0
    assert added.after.error < 1.1
    (fold,) = added.folds
    assert (fold.name, fold.main) == ("load", True)
    # the laws are carried on by half of the highest load that was fitted
    assert added.held_after[0] < 2.0 < 0.2 * added.held_before[0]


def test_a_step_tells_the_error_of_a_force_that_was_not_fitted(
    model: TireFile, tmp_path: Path
) -> None:
    runs = (
        replace(run, rig=run.rig | {"Mz": -0.03 * run.rig["Fy"]})
        for run in steady_runs(slope=SLOPE)
    )
    campaign = write_forces(tmp_path / "both", runs, "both")
    new, document = add(EFFECT.name, model, campaign, "Fy")
    before, after = (force_case(campaign, file, CATALOGUE, "Mz") for file in (model, new))
    told = {"error_before": before.given, "error_after": after.given, "error_unit": after.unit}
    assert document["others"] == {"Mz": told}
    assert before.given != after.given


def test_the_file_holds_what_was_fitted_and_comes_back(
    added: ForceExtension, model: TireFile, tmp_path: Path
) -> None:
    # a number that the file did not state is gone again after an undo
    stated = {name: number for name, number in model.numbers.items() if name != "Fy_offset"}
    bare = replace(model, numbers=stated)
    file = extended_file(bare, added, "hash")
    assert "Fy_offset" in file.numbers
    write_tire(file, tmp_path / "M2.toml", "tirelib-model/1")
    back = read_tire(tmp_path / "M2.toml")
    assert back.numbers["friction"].value == pytest.approx(added.after.values["friction"])
    assert back.numbers["friction"].kind == "fitted"
    (entry,) = back.extra["effects"]
    assert entry["effect"] == "friction_load"
    (step,) = back.extra["history"]
    assert (step["quantity"], step["data_sha256"]) == ("Fy", "hash")
    assert step["heldout_error_after"] < step["heldout_error_before"]
    old, entry = undone_file(back)
    once = read_back(bare, tmp_path)
    assert set(old.numbers) == set(once.numbers)
    for name, number in once.numbers.items():
        # written and read twice, a number in degrees may move by its last digit
        assert old.numbers[name].value == pytest.approx(number.value, rel=1e-15, abs=0.0)
        # repr: a standard deviation that nobody knows is not a number, which is not itself
        assert repr(replace(old.numbers[name], value=0.0)) == repr(replace(number, value=0.0))
    assert (old.extra["effects"], old.extra["history"]) == ([], [])


def read_back(file: TireFile, folder: Path) -> TireFile:
    write_tire(file, folder / "copy.toml", "tirelib-model/1")
    return read_tire(folder / "copy.toml")


def test_errors_are_told_in_the_noise_of_a_point(
    added: ForceExtension, case: ForceCase, model: TireFile
) -> None:
    document = extension_document(added, extended_file(model, added, "hash"))
    assert document["error_before"] == pytest.approx(case.given)
    assert document["error_refitted"] == pytest.approx(added.before.error)
    assert document["heldout_error_after"] == pytest.approx(added.held_after[0])
    assert (document["held_out"][0]["condition"], document["held_out"][0]["unit"]) == ("load", "N")
    assert document["held_out"][0]["value"] == pytest.approx(6000.0)


def test_a_needless_effect_is_flagged(model: TireFile, tmp_path: Path) -> None:
    campaign = write_forces(tmp_path / "own", steady_runs(), "own")
    found = add_brush_effect(force_case(campaign, model, CATALOGUE, "Fy"), EFFECT)
    assert "not_significant" in found.flags or abs(found.strength[0]) < 0.01


def test_an_effect_is_added_once_and_only_what_is_there_is_removed(case: ForceCase) -> None:
    with pytest.raises(ParameterError, match="no effect 'carcass' of the brush"):
        without_effect(case, CATALOGUE["carcass"])
    with pytest.raises(ParameterError, match="acts on strain"):
        add_brush_effect(case, CATALOGUE["camber"])


def test_an_effect_is_fitted_to_the_force_of_the_last_step(
    added: ForceExtension, model: TireFile, tmp_path: Path
) -> None:
    campaign = write_forces(tmp_path / "steady", steady_runs(slope=SLOPE), "steady")
    file = extended_file(model, added, "hash")
    cases = force_cases(campaign, file, CATALOGUE)
    assert case_for(cases, CATALOGUE["carcass"]).quantity == "Fy"
    with pytest.raises(ParameterError, match="has the effect 'friction_load' already"):
        add_brush_effect(cases[0], EFFECT)


def test_a_number_that_no_tire_has_is_not_written(added: ForceExtension, model: TireFile) -> None:
    wild = dict(added.after.values) | {"friction": 50.0}
    broken = replace(added, after=replace(added.after, values=wild))
    with pytest.raises(FormatError, match="friction after the fit"):
        extended_file(model, broken, "hash")


def test_the_fall_is_shown_by_quantity_in_one_unit() -> None:
    history = [
        {"effect": "sidewall_load", "action": "add", "error_before": 3.0, "error_after": 2.0},
        {
            "effect": "friction_load",
            "action": "add",
            "quantity": "Fy",
            "error_before_N": 90.0,
            "error_after_N": 60.0,
        },
        {
            "effect": "friction_load",
            "action": "add",
            "quantity": "Fy",
            "error_before": 9.0,
            "error_after": 6.0,
            "heldout_error_before": 10.0,
            "heldout_error_after": 7.0,
            "floor": 2.0,
        },
        {
            "effect": "friction_load",
            "action": "remove",
            "quantity": "Fy",
            "error_before": 6.0,
            "error_after": 9.0,
            "floor": 2.0,
        },
    ]
    (plot,) = waterfall_of(history, "Fy")
    assert [row[0] for row in plot.rows] == ["before", "1: friction_load", "2: -friction_load"]
    assert [row[1] for row in plot.rows] == [9.0, 6.0, 9.0]
    assert plot.rows[1][2] == 7.0
    assert np.isnan(plot.rows[2][2])
    (strain,) = waterfall_of(history, "strain")
    assert [row[1] for row in strain.rows] == [3.0, 2.0]
    assert waterfall_of(history, "Mz") == []
