"""Adding an effect, removing it, and going back."""

from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from tests.unit.inference.diagnose.planted import (
    EFFECT,
    STRENGTH,
    add_effect,
    added,
    model_file,
    runs,
)
from tirelib.core.errors import CalibrationError, FormatError, ParameterError
from tirelib.core.parameters import read_tire, write_tire
from tirelib.effects import CATALOGUE
from tirelib.inference.compare.error import error_of
from tirelib.inference.compare.model import model_of
from tirelib.inference.extend.document import extension_document
from tirelib.inference.extend.extension import StrainCase, known_effect, without_effect
from tirelib.inference.extend.model_file import extended_file, undone_file


def test_adding_the_planted_effect_takes_the_error_away() -> None:
    done, _ = added()
    assert done.after.error < 0.05 * done.before.error
    assert done.strength[0] == pytest.approx(STRENGTH, abs=0.02)
    assert done.flags == ()


def test_an_effect_of_another_quantity_stays_in_the_file() -> None:
    """What was fitted to strain replaces what acts on strain, and leaves the brush alone."""
    file, done = model_file(("friction_load", 0.1), (EFFECT, 0.9)), added()[0]
    effects = extended_file(file, done, "hash").extra["effects"]
    assert [each["effect"] for each in effects] == ["friction_load", EFFECT]
    assert effects[0] == file.extra["effects"][0]
    assert effects[1]["strength"] == pytest.approx(STRENGTH, abs=0.02)


def test_the_error_falls_on_runs_that_were_left_out() -> None:
    done, _ = added()
    assert [fold.name for fold in done.folds] == ["load", "pressure"]
    assert np.all(np.array(done.held_after) < np.array(done.held_before))


def test_errors_are_those_of_the_model_files_before_and_after() -> None:
    done, file = added()
    told = extension_document(done, file)
    measured = runs(EFFECT, STRENGTH)
    assert told["error_unit"] == "noise"
    assert told["error_before"] == pytest.approx(error_of(measured, model_of(model_file())).value)
    assert told["error_after"] == pytest.approx(error_of(measured, model_of(file)).value)
    assert told["error_after"] < 0.1 * told["error_refitted"]
    # other numbers take a part of what the effect is needed for
    assert told["error_refitted"] < 0.9 * told["error_before"]
    assert told["error_refitted"] < done.before.error
    assert told["noise"] == pytest.approx(1e6 * done.runs.noise.std)
    assert told["floor"] <= told["error_after"]
    assert {"heldout_error_before", "heldout_error_after", "strength", "std"} <= set(told)
    assert told["format"] == "tirelib-extension/1"
    assert "before" not in told["history"][0]


def test_without_repeats_errors_are_in_microstrain_and_not_in_the_history_as_noise() -> None:
    alone = runs(EFFECT, STRENGTH, 0)
    given = error_of(alone, model_of(model_file()))
    done = replace(added()[0], runs=alone, given=given, reached=given)
    new = extended_file(model_file(), done, "hash")
    told = extension_document(done, new)
    assert told["error_unit"] == "ustrain"
    assert told["error_after"] == given.value
    assert np.isnan(told["noise"])
    assert "repeat" in told["messages"][0]
    assert "error_after" not in new.extra["history"][0]
    assert "error_after_ustrain" in new.extra["history"][0]


def test_the_model_file_holds_values_effect_and_history_and_comes_back_equal(
    tmp_path: Path,
) -> None:
    done, file = added()
    write_tire(file, tmp_path / "M2.toml", "tirelib-model/1")
    back = read_tire(tmp_path / "M2.toml")
    # a number in its usual unit comes back to one rounding
    assert asdict(back.tire) == pytest.approx(asdict(file.tire), rel=4e-16)
    assert back.tire.bending_stiffness == pytest.approx(done.after.values["bending_stiffness"])
    (entry,) = back.extra["effects"]
    assert entry == {
        "effect": EFFECT,
        "strength": done.strength[0],
        "std": done.std[0],
        "unit": CATALOGUE[EFFECT].unit,
    }
    (step,) = back.extra["history"]
    assert step["data_sha256"] == "hash"
    assert step["error_after"] < step["error_before"]
    assert model_of(back).used[0].strength == done.strength[0]
    assert back.numbers["mass"] == file.numbers["mass"]


def test_an_interval_goes_with_its_number_and_keeps_its_relative_width() -> None:
    _, file = added()
    old, new = model_file().numbers["bending_stiffness"], file.numbers["bending_stiffness"]
    low, high = new.notes["interval_SI"]
    assert low < new.value < high
    assert (high - low) / new.value == pytest.approx(1.0 / old.value)
    assert new.std / new.value >= old.std / old.value * (1.0 - 1e-12)


def test_undo_restores_every_digit(tmp_path: Path) -> None:
    write_tire(added()[1], tmp_path / "M2.toml", "tirelib-model/1")
    back, entry = undone_file(read_tire(tmp_path / "M2.toml"))
    before = model_file()
    assert entry["effect"] == EFFECT
    assert back.tire == before.tire
    assert back.numbers["bending_stiffness"] == before.numbers["bending_stiffness"]
    assert back.extra["effects"] == []
    assert back.extra["history"] == []
    with pytest.raises(FormatError, match="nothing to undo"):
        undone_file(back)


def test_removing_restores_the_fit_without_the_effect() -> None:
    done, file = added()
    out = without_effect(StrainCase(runs(EFFECT, STRENGTH), model_of(file)), CATALOGUE[EFFECT])
    assert out.after.effects == ()
    # both are the bottom of one cost; wide priors about different starts move it by little
    assert out.after.error == pytest.approx(done.before.error, rel=0.02)
    assert out.before.error == pytest.approx(done.after.error, abs=0.2)
    gone = extended_file(file, out, "hash")
    assert gone.extra["effects"] == []
    assert [step["action"] for step in gone.extra["history"]] == ["add", "remove"]


def test_an_effect_of_the_model_is_no_addition() -> None:
    _, file = added()
    with pytest.raises(ParameterError, match="already"):
        add_effect(runs(EFFECT, STRENGTH), model_of(file), CATALOGUE[EFFECT])


def test_what_strain_cannot_have_is_refused_with_the_reason() -> None:
    model = model_of(model_file())
    with pytest.raises(ParameterError, match="fitted number"):
        add_effect(runs(), model, CATALOGUE["belt_extension"])
    with pytest.raises(CalibrationError, match="no run has a camber"):
        add_effect(runs(), model, CATALOGUE["camber"])
    with pytest.raises(ParameterError, match="no effect 'camber'"):
        without_effect(StrainCase(runs(), model), CATALOGUE["camber"])


def test_a_misspelt_effect_is_answered_with_the_nearest() -> None:
    with pytest.raises(ParameterError, match="did you mean sidewall_damping"):
        known_effect("sidewal_damping", CATALOGUE)


def test_a_needless_effect_is_flagged_as_not_significant() -> None:
    file = model_file()
    done = add_effect(runs(), model_of(file), CATALOGUE["hydroplaning"])
    assert "not_significant" in done.flags
    # one more coordinate never makes the fit worse: what it leaves, and the priors, together
    assert done.after.hypothesis.fit.cost <= done.before.hypothesis.fit.cost
    # the error does not count the priors: measured are .7 % more
    assert done.after.error <= done.before.error * 1.01
