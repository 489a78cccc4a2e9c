"""Registration: what a user's effect must show, and what is said when it does not."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tirelib.effects import CATALOGUE, Effect, effect
from tirelib.effects.load import read_effects
from tirelib.errors import ParameterError
from tirelib.model.registration import Registration, register
from tirelib.model.state import State

DOCS = Path(__file__).parents[3] / "docs/effects.md"


def made(law: Any, **changes: Any) -> Effect:
    given: dict[str, Any] = {"stage": "stiffness", "unit": "1", "low": 0.0, "high": 0.5}
    return effect("mine", **{**given, **changes})(law)


def fault(law: Any, **changes: Any) -> str:
    found = register(made(law, **changes), {})
    assert not found.accepted
    text = " | ".join(found.faults)
    assert "effect 'mine'" in text
    assert "test_registration.py" in text
    return text


def test_the_documents_effect_is_accepted(tmp_path: Path) -> None:
    code = re.search(r"```python\n(.*?)```", DOCS.read_text(encoding="utf-8"), re.DOTALL)
    assert code is not None
    file = tmp_path / "mine.py"
    file.write_text(code[1], encoding="utf-8")
    (own,) = read_effects(file)
    found = register(own)
    assert found.accepted, found.faults
    assert found.recovered == pytest.approx(found.planted, rel=0.05)
    assert 0.0 < found.survives <= 1.0
    assert found.signature > 1e-6


def test_a_copy_of_an_effect_is_its_twin() -> None:
    copy = made(CATALOGUE["low_pass"].law, stage="strain", unit="ms", high=1.0)
    twins = register(copy).twins
    assert twins[0][0] == "low_pass"
    assert twins[0][1] < 0.1
    assert [angle for _, angle in twins] == sorted(angle for _, angle in twins)
    assert "sidewall_load" not in dict(twins)


def test_an_effect_is_no_twin_of_itself() -> None:
    found = register(CATALOGUE["gage_drift"])
    assert found.accepted
    assert "gage_drift" not in dict(found.twins)


@pytest.mark.parametrize("name", ["nonuniformity", "camber", "centrifugal"])
def test_a_planted_strength_is_found_again(name: str) -> None:
    found = register(CATALOGUE[name], {})
    assert found.accepted, found.faults
    assert found.planted == pytest.approx(CATALOGUE[name].toward / 3.0)
    assert found.recovered == pytest.approx(found.planted, rel=1e-2)


@pytest.mark.parametrize("name", ["gage_gain", "gage_offset"])
def test_what_no_campaign_can_show_is_not_tried(name: str) -> None:
    found: Registration = register(CATALOGUE[name])
    assert found.accepted
    assert np.isnan(found.planted)


def test_zero_must_be_the_base() -> None:
    text = fault(lambda s, x: s.but(k_u=s.k_u * (1.001 + x)))
    assert "strength zero is not the base model bit for bit" in text


def test_a_dead_law_is_refused() -> None:
    assert "no influence on the strain" in fault(lambda s, x: s.but(k_t=s.k_t * (1 + 1e-9 * x)))
    assert "no influence on the strain" in fault(lambda s, x: s.but(k_u=s.k_u * (1 + x**4)))


def test_a_strength_that_acts_as_a_root_has_no_derivative() -> None:
    assert "no derivative at zero" in fault(lambda s, x: s.but(k_u=s.k_u * (1 - 0.1 * x**0.5)))


def test_an_argument_that_is_changed_in_place_is_named() -> None:
    def alters(state: State, strength: float) -> State:
        state.tension[:] += 1e3 * strength
        return state.but(k_u=state.k_u * (1.0 + strength))

    assert "alters tension of its argument" in fault(alters)


def test_a_range_that_cannot_be_computed_is_refused() -> None:
    text = fault(lambda s, x: s.but(k_u=s.k_u * (1.0 - 3.0 * x)))
    assert "cannot be computed at 0.5 1" in text
    assert "radial_stiffness" in text


def test_an_exception_is_reported_and_not_raised() -> None:
    assert "raised AttributeError" in fault(lambda s, x: s.but(k_u=s.k_w))
    assert "not a number" in fault(lambda s, x: s.but(k_u=s.k_u * np.float64(np.nan)))


def test_what_the_base_model_imitates_is_not_found_again() -> None:
    text = fault(lambda s, x: s.but(offset=s.offset * (1.0 + x)))
    assert "planted" in text
    assert "imitate all but" in text


def test_an_effect_of_the_brush_is_not_of_the_strain() -> None:
    with pytest.raises(ParameterError, match="stage brush does not act on strain"):
        register(made(lambda s, x: s, stage="brush"))
