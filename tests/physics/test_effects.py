"""Laws that every effect obeys, user effects included."""

import inspect
import re
from dataclasses import fields, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tirelib.core.parameters import read_tire
from tirelib.effects import CATALOGUE, Effect
from tirelib.effects.load import all_effects
from tirelib.effects.state import Operating, State
from tirelib.measured.waveforms import GRID
from tirelib.model.base import predict, values_of
from tirelib.model.strain_bench import reference_plan

TIRE = read_tire("table-6-1").tire.changed(damping=0.0)
VALUES = values_of(TIRE)
PLAN = reference_plan(TIRE)
FREE_ROLLING = slice(0, 60)
SIDES = slice(60, 72)
DOCS = Path(__file__).parents[2] / "docs/howto/effects.md"

IN_ORDER = [
    "sidewall_load",
    "sidewall_pressure",
    "sidewall_damping",
    "temperature",
    "centrifugal",
    "rotary_inertia",
    "belt_extension",
    "belt_shear",
    "dynamic_stiffening",
    "tread_friction",
    "tread_load",
    "tread_wear",
    "trailing_sliding",
    "hydroplaning",
    "roughness",
    "camber",
    "belt_bending",
    "load_transfer",
    "traction",
    "nonuniformity",
    "gage_length",
    "low_pass",
    "gage_gain",
    "gage_saturation",
    "gage_offset",
    "gage_drift",
    "gain_load",
    "gain_pressure",
    "gain_speed",
    "angle_zero",
]
ONE_SIDED = {"sidewall_damping", "trailing_sliding", "hydroplaning", "low_pass", "angle_zero"}
ACROSS = {"camber", "belt_bending", "load_transfer"}
EXACT = ("speed", "order", "temperature", "camber", "slip_angle", "slip_ratio")
"""Conditions on which the undamped base model does not depend at all."""


def example() -> str:
    """The user's effect of the documentation."""
    found = re.search(r"```python\n(.*?)```", DOCS.read_text(encoding="utf-8"), re.DOTALL)
    assert found is not None
    return found[1]


def catalogue_and_users(folder: Path) -> dict[str, Effect]:
    mine = folder / "mine.py"
    mine.write_text(example(), encoding="utf-8")
    return dict(all_effects([mine]))


EVERY = [*IN_ORDER, "wet_tread"]


@pytest.fixture(scope="module")
def effects(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Effect]:
    return catalogue_and_users(tmp_path_factory.mktemp("effects"))


def run(
    *changes: tuple[str, Any],
    points: Operating = PLAN.points,
    lateral: np.ndarray | float = PLAN.lateral,
    values: dict[str, Any] = VALUES,
) -> State:
    place = ("constants", lambda s: s.but(lateral=np.resize(lateral, len(s.conditions))))
    return predict(values, points, [place, *changes])


def wave(*changes: tuple[str, Any], **given: Any) -> np.ndarray:
    state = run(*changes, **given)
    assert state.waveform is not None
    return state.waveform


BASE = wave()


def tangents(effect: Effect, share: float = 1.0, **given: Any) -> list[np.ndarray]:
    """Derivatives at zero times the end of the range, per component."""
    base = wave(**given) if given else BASE
    return [
        (wave(effect.at(effect.along(k, share * effect.step)), **given) - base)
        * (effect.toward / (share * effect.step))
        for k in range(effect.components)
    ]


def rms(x: np.ndarray) -> float:
    return float(np.sqrt(np.mean(x**2)))


def test_the_catalogue_holds_the_agreed_names_in_order() -> None:
    assert [name for name, effect in CATALOGUE.items() if effect.hook != "brush"] == IN_ORDER
    assert all(name == effect.name for name, effect in CATALOGUE.items())


@pytest.mark.parametrize("name", IN_ORDER)
def test_an_effect_is_a_short_law_in_a_file_of_its_own(name: str) -> None:
    effect = CATALOGUE[name]
    lines, _ = inspect.getsourcelines(effect.law)
    code = "".join(lines).split('"""')
    assert len(code[2].strip().splitlines()) <= 15
    assert Path(inspect.getsourcefile(effect.law) or "").stem == name
    assert effect.source
    assert effect.title[0].isupper()
    assert len(effect.title) < 90


def test_the_documentation_lists_every_effect_as_it_is() -> None:
    text = DOCS.read_text(encoding="utf-8")
    for e in CATALOGUE.values():
        row = f"| {e.stage} | `{e.name}` | {e.unit} | {e.low:g} .. {e.high:g} |"
        assert row in text, row
    assert len(example().strip().splitlines()) <= 15


@pytest.mark.parametrize("name", EVERY)
def test_strength_zero_is_the_base_bit_for_bit(effects: dict[str, Effect], name: str) -> None:
    effect = effects[name]
    state = run(effect.at(effect.along(0, 0.0)))
    base = run()
    assert state.waveform is not None
    np.testing.assert_array_equal(state.waveform, BASE)
    np.testing.assert_array_equal(state.deflection, base.deflection)


@pytest.mark.parametrize("name", EVERY)
def test_the_derivative_at_zero_is_alive_and_half_a_step_does_half(
    effects: dict[str, Effect], name: str
) -> None:
    effect = effects[name]
    for whole, half in zip(tangents(effect), tangents(effect, 0.5), strict=True):
        assert np.isfinite(whole).all()
        if name == "gage_offset":
            assert rms(whole) == 0.0
            continue
        # 5 ustrain at the end of the range: the noise of a good campaign
        assert rms(whole) > 5e-6
        # the second order of a step of a thousandth of the range
        assert rms(half - whole) < 0.005 * rms(whole)


@pytest.mark.parametrize("name", EVERY)
def test_a_law_leaves_its_argument_alone(effects: dict[str, Effect], name: str) -> None:
    effect = effects[name]
    seen: list[str] = []

    def watched(state: State) -> State:
        arrays = {
            f.name: v.copy()
            for f in fields(State)
            if isinstance(v := getattr(state, f.name), np.ndarray)
        }
        inside = {
            f: getattr(c, f).copy() for f in ("edges", "weights", "delta") if (c := state.contact)
        }
        pressure = None if state.contact is None else state.contact.pressure.copy()
        out: State = effect.at(effect.along(0, effect.toward / 2))[1](state)
        for field, value in arrays.items():
            np.testing.assert_array_equal(getattr(state, field), value, err_msg=field)
        for field, value in inside.items():
            np.testing.assert_array_equal(getattr(state.contact, field), value, err_msg=field)
        if state.contact is not None:
            np.testing.assert_array_equal(state.contact.pressure, pressure)
        seen.append(name)
        return out

    run((effect.hook, watched))
    assert seen


@pytest.mark.parametrize("name", sorted(set(EVERY) - {"nonuniformity", "traction"}))
def test_left_and_right_of_the_contact_are_alike_except_where_the_effect_has_a_direction(
    effects: dict[str, Effect], name: str
) -> None:
    if name == "gage_offset":
        return
    rows = SIDES if name in ACROSS else FREE_ROLLING
    change = tangents(effects[name])[0][rows]
    mirrored = change[:, (-np.arange(GRID.size)) % GRID.size]
    odd = rms(0.5 * (change - mirrored)) / rms(change)
    if name in ONE_SIDED:
        assert odd > 0.3
    else:
        # round-off of the contact solver over a small step
        assert odd < 1e-4


@pytest.mark.parametrize("name", sorted(ACROSS))
def test_an_effect_across_the_width_is_dead_in_the_middle_and_opposite_at_the_sides(
    name: str,
) -> None:
    left, right = (tangents(CATALOGUE[name], lateral=y)[0] for y in (0.06, -0.06))
    # second order of the step only
    assert rms(left + right) < 1e-3 * rms(left)
    assert rms(tangents(CATALOGUE[name], lateral=0.0)[0]) == 0.0


def line(condition: str) -> tuple[Operating, float]:
    """Points on which one condition varies alone, and the gage."""
    one = PLAN.points.take(np.full(4, 30))
    t = np.linspace(0.0, 1.0, 4)
    varied: dict[str, Any] = {
        "load": {"load": 1500.0 + 5000.0 * t},
        "pressure": {"pressure": 1.6e5 + 1e5 * t},
        "speed": {"speed": 5.0 + 30.0 * t, "omega": (5.0 + 30.0 * t) / TIRE.ring_radius},
        "order": {"order": t},
        "temperature": {"temperature": 293.0 + 40.0 * t},
        "camber": {"camber": 0.07 * t},
        "slip_angle": {"slip_angle": 0.05 * t, "side_force": -2000.0 * t},
        "slip_ratio": {"slip_ratio": 0.05 * t, "drive_force": 2000.0 * t},
    }
    return replace(one, **varied[condition]), -0.06


@cache
def line_waveform(condition: str) -> np.ndarray:
    points, lateral = line(condition)
    return wave(points=points, lateral=lateral)


def variation(effect: Effect, condition: str) -> float:
    """How much the tangent, relative to the waveform, changes along one condition."""
    points, lateral = line(condition)
    base = line_waveform(condition)
    change = wave(effect.at(effect.trials[0]), points=points, lateral=lateral) - base
    relative = change / np.sqrt(np.mean(base**2, axis=1))[:, None]
    spread = rms(relative - relative.mean(axis=0))
    return spread / rms(relative) if rms(relative) > 0 else 0.0


@pytest.mark.parametrize("name", EVERY)
def test_the_signature_varies_with_what_is_declared_and_with_nothing_else(
    effects: dict[str, Effect], name: str
) -> None:
    effect = effects[name]
    if name == "gage_offset":
        return
    for condition in set(effect.varies_with) - {"angle", "lateral"}:
        assert variation(effect, condition) > 0.1, condition
    for condition in set(EXACT) - set(effect.varies_with):
        # a stretching belt feels its inertia a little, a hundredth of the signature
        assert variation(effect, condition) < 0.02, condition


@pytest.mark.parametrize("name", EVERY)
def test_the_whole_plausible_range_can_be_computed(effects: dict[str, Effect], name: str) -> None:
    effect = effects[name]
    for k in range(effect.components):
        for end in (effect.low, effect.high):
            assert np.isfinite(wave(effect.at(effect.along(k, end)))).all()


@settings(max_examples=40)
@given(name=st.sampled_from(IN_ORDER), share=st.floats(0.0, 1.0))
def test_anywhere_in_the_range_is_finite_and_without_a_mean(name: str, share: float) -> None:
    effect = CATALOGUE[name]
    strength = effect.low + share * (effect.high - effect.low)
    found = wave(effect.at(effect.along(0, strength)))
    assert np.isfinite(found).all()
    # the mean over the turn is taken off of measured waveforms
    assert np.abs(found.mean(axis=1)).max() < 1e-12


@pytest.mark.parametrize("name", EVERY)
def test_a_strength_means_the_same_on_every_campaign(effects: dict[str, Effect], name: str) -> None:
    effect = effects[name]
    some = np.array([3, 17, 42, 61, 64, 70])
    change = effect.at(effect.along(0, effect.toward / 3))
    alone = wave(change, points=PLAN.points.take(some), lateral=PLAN.lateral[some])
    # the contact solver's tolerance
    np.testing.assert_allclose(alone, wave(change)[some], atol=1e-9)
