"""Effects added one after the other by one set of fits: one number in every verb."""

from dataclasses import replace
from itertools import pairwise
from typing import Any

import pytest

from tests.unit.inference.diagnose.planted import EFFECT, STRENGTH, model_file, runs
from tests.unit.inference.force_campaigns import brush_file, write_sweep
from tirelib.campaign import Campaign, read_campaign
from tirelib.core.errors import ParameterError
from tirelib.core.parameters import TireFile
from tirelib.effects import CATALOGUE
from tirelib.inference.compare.model import model_of
from tirelib.inference.diagnose.assess import ForceAssessment
from tirelib.inference.diagnose.diagnose import Diagnosis, diagnose
from tirelib.inference.extend.additions import additions
from tirelib.inference.extend.extension import StrainCase, extended
from tirelib.inference.statistics import hypotheses
from tirelib.journey import add
from tirelib.journey import diagnose as diagnose_model

PLANTED = {"friction_pressure": 0.3, "brush_camber": 0.08}
FEW = {name: CATALOGUE[name] for name in (*PLANTED, "friction_load", "stiffness_pressure")}
"""The catalogue of these tests: what is planted, and two look-alikes."""


@pytest.fixture(scope="module")
def sweep(tmp_path_factory: pytest.TempPathFactory) -> tuple[Campaign, TireFile]:
    folder = tmp_path_factory.mktemp("sweep")
    made = write_sweep(folder / "sweep", 71, PLANTED)
    return read_campaign(folder / "sweep"), brush_file(made)


@pytest.fixture(scope="module")
def told(sweep: tuple[Campaign, TireFile]) -> ForceAssessment:
    found = diagnose_model(*sweep, "Fy", effects=FEW)
    assert isinstance(found, ForceAssessment)
    assert len(found.named) == 2
    return found


def steps(
    sweep: tuple[Campaign, TireFile], names: tuple[str, ...], told: ForceAssessment | None
) -> list[dict[str, Any]]:
    campaign, file = sweep
    effects = [CATALOGUE[name] for name in names]
    made = additions(effects, file, campaign, "Fy", FEW, diagnosis=told)
    return [document for _, document in made]


def test_the_errors_of_the_steps_are_those_of_the_diagnosis(
    sweep: tuple[Campaign, TireFile], told: ForceAssessment
) -> None:
    made = steps(sweep, told.named, told)
    assert [step["effect"] for step in made] == list(told.named)
    assert made[0]["error_before"] == told.before
    for one, following in pairwise(made):
        assert following["error_before"] == one["error_after"]
        assert following["heldout_error_before"] == one["heldout_error_after"]
    assert made[-1]["error_after"] == told.after
    assert made[-1]["floor"] == pytest.approx(told.floor)
    assert [entry["effect"] for entry in made[-1]["effects"]] == list(told.named)
    assert len(made[-1]["waterfall"]) == 3


def test_several_effects_are_the_same_with_the_diagnosis_and_without(
    sweep: tuple[Campaign, TireFile], told: ForceAssessment
) -> None:
    alone, taken = (steps(sweep, told.named, known)[-1] for known in (None, told))
    for key in ("error_before", "error_after", "floor", "heldout_error_after"):
        assert alone[key] == pytest.approx(taken[key], rel=1e-6), key
    assert alone["strength"] == pytest.approx(taken["strength"], rel=1e-4)


def test_a_diagnosis_of_another_model_or_campaign_is_refused(
    sweep: tuple[Campaign, TireFile], told: ForceAssessment
) -> None:
    campaign, file = sweep
    slack = replace(file.numbers["friction"], value=0.8)
    other = replace(file, numbers={**file.numbers, "friction": slack})
    with pytest.raises(ParameterError, match="diagnose that model"):
        add(list(told.named), other, campaign, diagnosis=told)
    stranger = replace(campaign, header=replace(campaign.header, name="another"))
    with pytest.raises(ParameterError, match="another"):
        add(list(told.named), file, stranger, diagnosis=told)


def test_an_effect_that_is_named_twice_is_refused(sweep: tuple[Campaign, TireFile]) -> None:
    with pytest.raises(ParameterError, match="twice"):
        steps(sweep, ("friction_load", "friction_load"), None)


@pytest.fixture(scope="module")
def pair() -> Diagnosis:
    """Return a diagnosis that has fitted two effects at once."""
    some = [CATALOGUE[name] for name in (EFFECT, "gage_length")]
    found = diagnose(runs(EFFECT, STRENGTH), model_of(model_file()).values, some)
    assert found.verdict.hypotheses.at((EFFECT, "gage_length")) is not None
    return found


def test_strain_takes_over_the_fits_of_the_diagnosis(
    pair: Diagnosis, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(hypotheses, "posterior", None)  # no hypothesis is fitted again
    case = StrainCase(pair.models.runs, model_of(model_file()))
    first = extended(pair.models, case, CATALOGUE[EFFECT])
    both = extended(pair.models, case, CATALOGUE["gage_length"], first.after)
    assert first.before is pair.base
    assert both.before is first.after
    assert both.given.value == pytest.approx(first.reached.value, rel=1e-6)
    assert both.held_before == first.held_after
    assert [effect.name for effect in both.after.effects] == [EFFECT, "gage_length"]
    assert both.after is pair.models.at((EFFECT, "gage_length"))
