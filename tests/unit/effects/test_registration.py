"""Registration: what a user's effect must show, and what is said when it does not."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from tirelib.cli.effects import effects
from tirelib.core.errors import FormatError
from tirelib.effects import CATALOGUE, Effect, effect
from tirelib.effects.load import read_effects
from tirelib.effects.state import State
from tirelib.model.registration import Registration, register, registered_effects

DOCS = Path(__file__).parents[3] / "docs/howto/effects.md"


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


def documented() -> list[str]:
    """Effects in the documentation: one of the strain, one of the brush."""
    return re.findall(r"```python\n(.*?)```", DOCS.read_text(encoding="utf-8"), re.DOTALL)


@pytest.mark.parametrize("which", [0, 1])
def test_the_documents_effects_are_accepted_and_have_at_most_15_lines(
    tmp_path: Path, which: int
) -> None:
    code = documented()[which]
    assert len([line for line in code.splitlines() if line.strip()]) <= 15
    file = tmp_path / "mine.py"
    file.write_text(code, encoding="utf-8")
    (own,) = read_effects(file)
    found = register(own)
    assert found.accepted, found.faults
    assert found.recovered == pytest.approx(found.planted, rel=0.05)
    assert 0.0 < found.survives <= 1.0
    assert found.signature > 1e-6


def test_a_copy_of_an_effect_is_its_twin() -> None:
    copy = made(CATALOGUE["low_pass"].law, stage="gage", unit="ms", high=1.0, components=2)
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


@pytest.mark.parametrize("name", [n for n, e in CATALOGUE.items() if e.hook == "brush"])
def test_every_effect_of_the_brush_is_found_again_on_forces(name: str) -> None:
    found = register(CATALOGUE[name], {})
    assert found.accepted, found.faults
    assert found.recovered == pytest.approx(found.planted, rel=1e-2)
    assert 0.0 < found.survives < 1.0


def test_the_brush_has_its_own_twins() -> None:
    found = register(made(CATALOGUE["friction_pressure"].law, stage="brush"))
    ((name, angle),) = found.twins
    assert (name, angle < 0.1) == ("friction_pressure", True)
    assert register(CATALOGUE["friction_load"]).twins == ()


@pytest.mark.parametrize(
    ("law", "says"),
    [
        (lambda s, x: s.but(mu=s.mu * (1.001 + x)), "strength zero is not the base model"),
        (lambda s, x: s.but(mu=s.mu * (1.0 + 1e-9 * x)), "no influence on Fy, Fx and Mz"),
        (lambda s, x: s.but(mu=s.mu * (1.0 - 0.1 * x**0.5)), "no derivative at zero"),
        (lambda s, x: s.but(mu=s.mu * (1.0 - 3.0 * x)), "cannot be computed at 0.5 1: brush"),
        (lambda s, x: s.but(mu=s.mue), "raised AttributeError"),
        (lambda s, x: s.but(mu=s.mu * (1.0 + x)), "imitate all but 0.0% of it"),
    ],
)
def test_a_law_of_the_brush_that_is_broken_is_told(law: Any, says: str) -> None:
    assert says in fault(law, stage="brush")


def test_an_argument_of_the_brush_that_is_changed_in_place_is_named() -> None:
    def alters(state: Any, strength: float) -> Any:
        state.mu[:] *= 1.0 - strength * state.conditions.load / 1e4
        return state

    assert "alters mu of its argument" in fault(alters, stage="brush")


def test_users_effects_are_registered_before_they_take_part(tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    file.write_text(documented()[1], encoding="utf-8")
    assert "wet_road" in registered_effects([file], installed=False)
    file.write_text(documented()[1].replace("(1.0 - strength", "(1.1 - strength"))
    with pytest.raises(FormatError, match=r"mine.py, line 6: strength zero"):
        registered_effects([file], installed=False)


def test_the_verb_tells_what_was_planted_and_found(tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    file.write_text(documented()[1], encoding="utf-8")
    found = CliRunner().invoke(effects, ["--effects", str(file)])
    assert found.exit_code == 0, found.output
    assert "0.3 1 planted, 0.3 found" in found.output
    assert "effects with a similar trace: friction_speed (21 deg)" in found.output
    file.write_text(documented()[1].replace("strength):", "strength)"))
    refused = CliRunner().invoke(effects, ["--effects", str(file)])
    assert "line 10: not Python" in str(refused.exception)
    assert "friction_drift" in CliRunner().invoke(effects).output
