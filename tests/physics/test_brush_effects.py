"""Laws that every effect of the brush obeys, a user's own included, and what each of them means."""

import inspect
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from tirelib.core.errors import ParameterError
from tirelib.effects import CATALOGUE, Effect, effect
from tirelib.effects.brush_state import BrushConditions, BrushState
from tirelib.effects.load import all_effects
from tirelib.model.brush import brush_forces, brush_state
from tirelib.physics.brush.predict import PointConditions, PointParameters, predict_forces
from tirelib.physics.brush.shaped import predict_shaped

NAMES = [
    "ring_pressure",
    "stiffness_load",
    "stiffness_pressure",
    "stiffness_temperature",
    "friction_load",
    "friction_pressure",
    "friction_temperature",
    "friction_speed",
    "brush_camber",
    "carcass",
    "ply_steer",
    "conicity",
    "relaxation",
    "combined_slip",
]
DRIFTS = ["stiffness_drift", "friction_drift"]
"""Effects of two components; registration tries them."""
FORCES = ("Fx", "Fy", "Mz")
MINE = '''
from tirelib.effects import effect

@effect("wet_road", stage="brush", unit="1", low=0.0, high=0.9, varies_with=("speed",),
        needs=("speed",), source="example")
def wet_road(state, strength):
    """Friction falls with the square of the speed on a wet road."""
    share = (state.conditions.speed / 30.0) ** 2
    return state.but(mu=state.mu * (1.0 - strength * share / (1.0 + share)))
'''


def points() -> BrushConditions:
    """Every condition varied, each with every other by chance, in both directions of rolling."""
    rng = np.random.default_rng(3)
    n = 120
    return BrushConditions(
        load=rng.uniform(1e3, 6e3, n),
        pressure=rng.uniform(1.5e5, 2.7e5, n),
        slip_angle=rng.uniform(-0.15, 0.15, n),
        slip_ratio=rng.uniform(-0.1, 0.1, n),
        camber=rng.uniform(-0.07, 0.07, n),
        speed=rng.choice([-1.0, 1.0], n) * rng.uniform(5, 30, n),
        temperature=rng.uniform(300.0, 370.0, n),
        slip_rate=rng.uniform(-0.2, 0.2, n),
        order=np.linspace(0.0, 1.0, n),
    )


POINTS = points()
BRUSH = PointParameters(
    lateral_stiffness=8e6, longitudinal_stiffness=1.1e7, friction=0.95, half_length=0.06
)


def state(at: BrushConditions = POINTS, **values: Any) -> BrushState:
    found = brush_state(BRUSH, at, reference=(4e3, 2e5), ring_flatness=0.8)
    return found.but(**values)


def forces(*changes: Any, at: BrushConditions = POINTS, **values: Any) -> np.ndarray:
    found = brush_forces(state(at, **values), changes)
    return np.stack([getattr(found, name) for name in FORCES])


BASE = forces()


def test_a_changed_state_keeps_all_other_fields_and_an_unknown_one_is_named() -> None:
    before = state()
    after = before.but(mu=2.0 * before.mu)
    for field in fields(BrushState):
        same = getattr(after, field.name) is getattr(before, field.name)
        assert same == (field.name != "mu"), field.name
    assert after.mu == pytest.approx(2.0 * before.mu)
    with pytest.raises(TypeError, match="'grip'"):
        before.but(grip=1.0)


@pytest.fixture(scope="module")
def every(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Effect]:
    mine = tmp_path_factory.mktemp("mine") / "mine.py"
    mine.write_text(MINE)
    found = all_effects([mine])
    return {n: e for n, e in found.items() if e.hook == "brush" and n not in DRIFTS}


ALL = [*NAMES, "wet_road"]


def test_the_catalogue_holds_the_agreed_names(every: dict[str, Effect]) -> None:
    brush = [name for name, e in CATALOGUE.items() if e.hook == "brush"]
    assert [name for name in brush if name not in DRIFTS] == NAMES
    assert [name for name in brush if name in DRIFTS] == DRIFTS
    assert list(every) == ALL


@pytest.mark.parametrize("name", NAMES)
def test_an_effect_is_a_short_law_in_a_file_of_its_own(name: str) -> None:
    lines, _ = inspect.getsourcelines(CATALOGUE[name].law)
    assert len("".join(lines).split('"""')[2].strip().splitlines()) <= 15
    assert Path(inspect.getsourcefile(CATALOGUE[name].law) or "").stem == name
    assert CATALOGUE[name].source


@pytest.mark.parametrize("name", ALL)
def test_strength_zero_is_the_base_bit_for_bit(every: dict[str, Effect], name: str) -> None:
    np.testing.assert_array_equal(forces(every[name].at(0.0)), BASE)


@pytest.mark.parametrize("name", ALL)
def test_the_derivative_at_zero_exists_and_is_alive(every: dict[str, Effect], name: str) -> None:
    e = every[name]
    whole = forces(e.at(e.step)) - BASE
    half = forces(e.at(0.5 * e.step)) - BASE
    size = np.sqrt(np.mean(whole**2, axis=1)) * e.toward / e.step
    # at the end of its range any effect moves some force by more than a load cell's error
    assert (size > [5.0, 5.0, 0.5]).any()
    # differences of a smooth law halve with the step, but for a thousandth of the range
    assert np.abs(2.0 * half - whole).max() <= 0.02 * np.abs(whole).max()


@pytest.mark.parametrize("name", ALL)
def test_the_whole_range_can_be_computed_and_the_argument_stays(
    every: dict[str, Effect], name: str
) -> None:
    e = every[name]
    for end in (e.low, e.high):
        assert np.isfinite(forces(e.at(end))).all()
    before = state()
    copies = {
        f.name: np.copy(getattr(before, f.name))
        for f in fields(before)
        if isinstance(getattr(before, f.name), np.ndarray)
    }
    e.at(e.step)[1](before)
    for field, copy in copies.items():
        np.testing.assert_array_equal(getattr(before, field), copy)


def mirrored(at: BrushConditions) -> BrushConditions:
    """The same wheel seen in a mirror: slip angle and camber change sign, and so does Fy."""
    return replace(at, slip_angle=-at.slip_angle, camber=-at.camber, slip_rate=-at.slip_rate)


@pytest.mark.parametrize("name", ALL)
def test_only_ply_steer_and_conicity_know_left_from_right(
    every: dict[str, Effect], name: str
) -> None:
    e = every[name]
    seen = forces(e.at(0.3 * e.toward), at=mirrored(POINTS))
    same = np.abs(seen - forces(e.at(0.3 * e.toward)) * np.array([[1.0], [-1.0], [-1.0]])).max()
    assert (same > 1.0) if name in ("ply_steer", "conicity") else (same < 1e-6)


def test_ply_steer_changes_side_with_the_direction_of_rolling_and_conicity_does_not() -> None:
    straight = replace(
        POINTS, slip_angle=0.0 * POINTS.load, slip_ratio=0.0 * POINTS.load, camber=0.0 * POINTS.load
    )
    back = replace(straight, speed=-straight.speed)
    ply, cone = CATALOGUE["ply_steer"].at(0.2), CATALOGUE["conicity"].at(10.0)
    np.testing.assert_allclose(forces(ply, at=back)[1], -forces(ply, at=straight)[1], rtol=1e-12)
    np.testing.assert_array_equal(forces(cone, at=back), forces(cone, at=straight))
    np.testing.assert_allclose(forces(cone, at=straight)[1], 0.01 * straight.load, rtol=1e-12)
    # ISO: a positive shift of the slip angle pushes to the right
    forward = straight.speed > 0.0
    assert (forces(ply, at=straight)[1][forward] < 0.0).all()


@pytest.mark.parametrize(
    ("name", "field", "factor"),
    [
        ("stiffness_load", "load", np.exp(-0.3 * (1.5 - 1.0))),
        ("stiffness_pressure", "pressure", 1.5**0.3),
        ("friction_load", "load", 1.5**-0.3),
        ("friction_pressure", "pressure", 1.5**-0.3),
    ],
)
def test_laws_of_load_and_pressure_change_nothing_at_the_reference(
    name: str, field: str, factor: float
) -> None:
    law = CATALOGUE[name].at(0.3)[1]
    reference = {"load": 4e3, "pressure": 2e5}[field]
    constant = "mu" if name.startswith("friction") else "c_py"
    for ratio, wanted in ((1.0, 1.0), (1.5, factor)):
        at = replace(POINTS, **{field: np.full(len(POINTS), ratio * reference)})
        found = getattr(law(state(at)), constant) / getattr(state(at), constant)
        np.testing.assert_allclose(found, wanted, rtol=1e-12)


@pytest.mark.parametrize("name", [n for n in CATALOGUE if n.startswith("stiffness_")])
def test_what_stiffens_the_bristles_stiffens_them_along_as_across(name: str) -> None:
    effect = CATALOGUE[name]
    strength = 0.3 if effect.components == 1 else (0.3, 0.2)
    changed = effect.at(strength)[1](state())
    assert np.ptp(changed.c_py) > 0.0
    np.testing.assert_allclose(changed.c_px / state().c_px, changed.c_py / state().c_py)


@pytest.mark.parametrize("name", DRIFTS)
def test_a_drift_is_a_rise_over_the_campaign_and_a_bow_that_takes_nothing_on_the_mean(
    name: str,
) -> None:
    law, constant = CATALOGUE[name].at, "mu" if name.startswith("friction") else "c_py"
    rise, bow = (
        np.log(getattr(law(strength)[1](state()), constant) / getattr(state(), constant))
        for strength in ((0.2, 0.0), (0.0, 0.2))
    )
    np.testing.assert_allclose(rise, 0.2 * (POINTS.order - 0.5), atol=1e-12)
    assert np.trapezoid(bow, POINTS.order) == pytest.approx(0.0, abs=2e-4)
    assert bow[[0, -1]] - bow.min() == pytest.approx(0.2, abs=1e-3)


@pytest.mark.parametrize("degrees", [0.4, -0.7])
def test_ply_steer_is_so_many_degrees_of_slip_angle(degrees: float) -> None:
    forward = replace(POINTS, speed=np.abs(POINTS.speed))
    turned = replace(forward, slip_angle=forward.slip_angle + np.deg2rad(degrees))
    steered = forces(CATALOGUE["ply_steer"].at(degrees), at=forward)
    np.testing.assert_allclose(steered, forces(at=turned), rtol=1e-12, atol=1e-9)


def test_warmth_and_sliding_speed_lower_what_they_should() -> None:
    warm = replace(POINTS, temperature=np.full(len(POINTS), 373.15))
    for name, constant in (("stiffness_temperature", "c_px"), ("friction_temperature", "mu")):
        changed = CATALOGUE[name].at(0.3)[1](state(warm))
        np.testing.assert_allclose(
            getattr(changed, constant) / getattr(state(warm), constant), np.exp(-0.3), rtol=1e-12
        )
    fast = replace(POINTS, speed=2.0 * POINTS.speed)
    law = CATALOGUE["friction_speed"].at(0.5)[1]
    slow_mu, fast_mu = law(state()).mu, law(state(fast)).mu
    np.testing.assert_allclose(fast_mu / 0.95, (slow_mu / 0.95) ** 2, rtol=1e-12)


def test_friction_falls_alike_whether_the_tread_slides_along_or_across() -> None:
    slip, none = np.abs(POINTS.slip_ratio), 0.0 * POINTS.load
    law = CATALOGUE["friction_speed"].at(0.5)[1]
    along = law(state(replace(POINTS, slip_ratio=slip, slip_angle=none))).mu
    across = law(state(replace(POINTS, slip_ratio=none, slip_angle=np.arctan(slip)))).mu
    np.testing.assert_allclose(along, across, rtol=1e-12)
    np.testing.assert_allclose(along, 0.95 * np.exp(-0.05 * np.abs(POINTS.speed) * slip))


def test_camber_is_worth_its_share_of_slip_angle() -> None:
    small = replace(POINTS, slip_angle=0.0 * POINTS.load, slip_ratio=0.0 * POINTS.load)
    turned = replace(small, slip_angle=0.2 * small.camber, camber=0.0 * small.camber)
    cambered = forces(CATALOGUE["brush_camber"].at(0.2), at=small)
    np.testing.assert_allclose(cambered, forces(at=turned), rtol=1e-12, atol=1e-9)


def test_relaxation_does_nothing_in_steady_runs_and_lags_in_sweeps() -> None:
    e = CATALOGUE["relaxation"].at(0.5)
    steady = replace(POINTS, slip_rate=0.0 * POINTS.load)
    np.testing.assert_array_equal(forces(e, at=steady), forces(at=steady))
    late = replace(
        POINTS, slip_angle=POINTS.slip_angle - 0.5 / np.abs(POINTS.speed) * POINTS.slip_rate
    )
    np.testing.assert_allclose(forces(e), forces(at=late), rtol=1e-9, atol=1e-6)


def test_combined_slip_leaves_pure_cornering_and_scales_pure_braking() -> None:
    e = CATALOGUE["combined_slip"].at(0.2)
    corner = replace(POINTS, slip_ratio=0.0 * POINTS.load)
    np.testing.assert_array_equal(forces(e, at=corner), forces(at=corner))
    brake = replace(POINTS, slip_angle=0.0 * POINTS.load)
    np.testing.assert_allclose(
        forces(e, at=brake),
        forces(at=brake, mu=np.full(len(POINTS), 1.2 * 0.95)),
        rtol=1e-12,
        atol=1e-9,
    )


def test_a_softer_carcass_lowers_the_side_force() -> None:
    at = replace(POINTS, slip_ratio=0.0 * POINTS.load)
    soft = forces(CATALOGUE["carcass"].at(0.01), at=at)[1]
    assert (np.abs(soft) <= np.abs(forces(at=at)[1]) + 1e-9).all()


def test_a_soft_carcass_turns_the_contact_by_so_many_degrees_for_each_newton_metre() -> None:
    at = replace(POINTS, slip_ratio=0.0 * POINTS.load)
    soft = forces(CATALOGUE["carcass"].at(0.01), at=at)
    turned = replace(at, slip_angle=at.slip_angle - np.deg2rad(0.01 * soft[2]))
    # the brush counts the turn in tan(alpha), which differs by alpha^2, 2 % of so small a turn
    np.testing.assert_allclose(soft[:2], forces(at=turned)[:2], rtol=1e-3, atol=1e-2)


def test_the_rings_pressure_is_as_strong_as_the_ring_says() -> None:
    flat = CATALOGUE["ring_pressure"].at(1.0)[1](state())
    np.testing.assert_array_equal(flat.flatness, 0.8)


@settings(max_examples=40, deadline=None)
@given(
    c=st.floats(-0.8, 2.8),
    angle=st.floats(-0.3, 0.3),
    ratio=st.floats(-0.3, 0.3),
    load=st.floats(500.0, 9e3),
)
@example(c=-0.5, angle=0.125, ratio=0.0, load=3497.0)  # sticks in the middle only
def test_a_shaped_pressure_carries_what_each_bristle_carries(
    c: float, angle: float, ratio: float, load: float
) -> None:
    found = predict_shaped(BRUSH, PointConditions(load, angle, ratio), np.array([c]))
    u = (np.arange(20000) + 0.5) / 20000.0
    x = 1.0 - 2.0 * u
    pressure = load / 0.12 * 6.0 * u * (1.0 - u) * (1.0 + c * x**2) / (1.0 + c / 5.0)
    demand = np.array([1.1e7 * ratio, -8e6 * np.tan(angle)])[:, None] * 0.12 * u / (1.0 + ratio)
    size = np.hypot(*demand)
    slip = np.array([ratio, -np.tan(angle)])
    slide = slip / max(np.hypot(*slip), 1e-300)
    held = size <= 0.95 * pressure
    force = np.where(held, demand, slide[:, None] * 0.95 * pressure)
    # a midpoint sum over 20,000 bristles; the end of sticking lies in one of them
    limit = 3e-4 * load
    assert found.Fx.item() == pytest.approx(0.12 * force[0].mean(), abs=limit)
    assert found.Fy.item() == pytest.approx(0.12 * force[1].mean(), abs=limit)
    moment = 0.12 * (force[1] * 0.06 * x).mean()
    assert found.Mz.item() == pytest.approx(moment, abs=0.06 * limit)


def test_a_vanishing_flatness_is_the_parabola_and_a_wild_one_is_refused() -> None:
    at = PointConditions(POINTS.load, POINTS.slip_angle, POINTS.slip_ratio)
    own = {"yaw_compliance": 4e-5, "lateral_compliance": 3e-6, "sliding_friction": 0.7}
    yielding = replace(BRUSH, **own, Fy_offset=20.0)
    plain, near = predict_forces(yielding, at), predict_shaped(yielding, at, 1e-11)
    for name in FORCES:
        np.testing.assert_allclose(getattr(near, name), getattr(plain, name), atol=1e-6)
    with pytest.raises(ParameterError, match="flatness = 3 of the pressure; allowed"):
        predict_shaped(BRUSH, at, 3.0)


def test_what_is_not_measured_is_asked_for() -> None:
    unknown = replace(POINTS, temperature=np.full(len(POINTS), np.nan))
    with pytest.raises(ParameterError, match="needs temperature, which is not measured"):
        forces(CATALOGUE["friction_temperature"].at(0.1), at=unknown)


def test_a_wrong_unit_is_refused_at_its_definition() -> None:
    with pytest.raises(ParameterError, match="unit 'furlong'"):
        effect("mine", stage="brush", unit="furlong", low=0, high=1)(lambda state, strength: state)
