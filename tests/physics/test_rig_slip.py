"""Laws of the rig under slip angle, slip ratio and camber; ISO signs."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from tirelib.rig import solve as module
from tirelib.rig.measure import slip_ratio
from tirelib.rig.observe import Forces, contact, edges, forces, trace
from tirelib.rig.solve import RigState, SolverError, solve
from tirelib.rig.tire import Condition, RigTire

TIRE = RigTire()
BASE = Condition(4800.0, 2.3e5, 65.0 / 3.6)
ANGLES = (0.0, 0.01, 0.02, 0.05, 0.1, 0.2)
SLIPS = (0.005, 0.01, 0.03, 0.1, 0.6)


@cache
def state(**change: float) -> RigState:
    cond = replace(BASE, **change)
    return solve(TIRE, cond, None if cond == BASE else state())


def force(**change: float) -> Forces:
    return forces(state(**change))


def test_mirrored_slip_angle_mirrors_gages_and_lateral_force() -> None:
    left, right = state(slip_angle=-0.04), state(slip_angle=0.04)
    np.testing.assert_allclose(trace(left).strain, trace(right).strain[:, ::-1], atol=1e-8)
    np.testing.assert_allclose(edges(left)[1], edges(right)[1][::-1], atol=1e-7)
    one, two = forces(left), forces(right)
    assert one.fy == pytest.approx(-two.fy, rel=1e-6)
    assert one.aligning == pytest.approx(-two.aligning, rel=1e-5)
    assert one.fx == pytest.approx(two.fx, abs=1e-3)


def test_positive_slip_angle_pushes_right_and_aligns() -> None:
    f = force(slip_angle=0.03)
    assert f.fy < 0.0
    assert f.aligning > 0.0  # the force acts behind the axle


def test_lateral_force_rises_from_its_slope_at_zero_to_friction() -> None:
    fy = -np.array([force(slip_angle=a).fy for a in ANGLES])
    assert abs(fy[0]) < 1e-3
    assert np.all(np.diff(fy) > 0.0)
    secant = fy[1:] / np.array(ANGLES[1:])
    assert np.all(np.diff(secant) < 0.0)
    small = -force(slip_angle=1e-3).fy / 1e-3
    assert small == pytest.approx(secant[0], rel=0.1)
    assert 4e4 < small < 9e4  # cornering stiffness of a passenger tire at 4800 N [N/rad]
    assert fy[-1] == pytest.approx(TIRE.friction * 4800.0, rel=0.03)
    assert fy[-1] <= TIRE.friction * 4800.0


def test_slip_angle_makes_a_trapezoid_with_its_long_side_left() -> None:
    # positive slip angle, force to the right (negative): the left strips carry more
    lengths = np.array([edges(state(slip_angle=a))[1] for a in (0.0, 0.02, 0.05, 0.1)])
    assert np.all(np.diff(lengths[1:], axis=1) > 0.0)
    spread = lengths[:, 4] - lengths[:, 0]
    assert np.all(np.diff(spread) > 0.0)
    # the centre hardly notices (dissertation, Fig. 4-3)
    assert np.ptp(lengths[:, 2]) < 0.025 * lengths[0, 2]
    negative = edges(state(slip_angle=-0.05))[1]
    assert np.all(np.diff(negative) < 0.0)


def test_loaded_side_is_compressed_more_before_contact() -> None:
    tr = trace(state(slip_angle=0.05))
    first = tr.strain[tr.phi < 0.0].min(axis=0)
    assert np.all(np.diff(first) < 0.0)


def test_camber_loads_the_side_it_leans_to() -> None:
    # positive camber leans the top right (ISO 8855): the right strips go deeper, Fy to the right
    s = state(camber=0.07)
    assert np.all(np.diff(edges(s)[1]) < 0.0)
    assert forces(s).fy < -50.0
    mirrored = state(camber=-0.07)
    np.testing.assert_allclose(trace(mirrored).strain, trace(s).strain[:, ::-1], atol=1e-8)
    assert forces(mirrored).fy == pytest.approx(-forces(s).fy, rel=1e-5)


def test_longitudinal_force_follows_slip_ratio_to_friction() -> None:
    rolling = force().fx
    for sign in (1.0, -1.0):
        fx = np.array([sign * (force(slip_ratio=sign * k).fx - rolling) for k in SLIPS])
        assert np.all(np.diff(fx) > -1e-6 * fx.max())
        assert fx[0] > 0.0
        slope = fx[:2] / np.array(SLIPS[:2])
        assert slope[0] == pytest.approx(slope[1], rel=0.15)
    limit = TIRE.friction * 4800.0
    assert force(slip_ratio=0.6).fx == pytest.approx(limit, rel=1e-6)
    assert force(slip_ratio=-0.6).fx == pytest.approx(-limit, rel=1e-6)


def test_slip_ratio_is_what_was_set() -> None:
    for kappa in (0.03, -0.1):
        assert slip_ratio(state(slip_ratio=kappa)) == pytest.approx(kappa, abs=1e-9)
    # a wheel rolling freely at a slip angle turns at about v cos(alpha) / R_e
    assert slip_ratio(state(slip_angle=0.05)) == pytest.approx(np.cos(0.05) - 1.0, abs=1e-3)
    near_zero = state(slip_ratio=1e-9)
    assert near_zero.free_radius == pytest.approx(state().rolling_radius, rel=1e-6)


def test_braking_deepens_the_second_peak_and_driving_the_first() -> None:
    def depth(s: RigState) -> tuple[float, float]:
        tr = trace(s)
        strain = tr.strain[:, 2]
        return float(strain[tr.phi < 0.0].min()), float(strain[tr.phi > 0.0].min())

    free, brake, drive = (
        depth(state()),
        depth(state(slip_ratio=-0.03)),
        depth(state(slip_ratio=0.03)),
    )
    assert abs(free[0] - free[1]) < 2e-4
    assert brake[1] < brake[0] - 5e-4
    assert drive[0] < drive[1] - 5e-4
    assert brake[1] < free[1]
    assert drive[0] < free[0]


@pytest.mark.parametrize(
    "change",
    [
        {"slip_angle": 0.1},
        {"slip_ratio": -0.03},
        {"slip_angle": 0.07, "slip_ratio": -0.1},
        {"slip_angle": -0.07, "slip_ratio": 0.03, "camber": 0.07},
    ],
)
def test_no_bristle_and_no_tire_exceeds_friction(change: dict[str, float]) -> None:
    c, f = contact(state(**change)), force(**change)
    assert np.all(np.hypot(c.fx, c.fy) <= TIRE.friction * c.q * (1.0 + 1e-9) + 1e-6)
    assert np.hypot(f.fx, f.fy) <= TIRE.friction * f.fz * (1.0 + 1e-9)


def test_combined_slip_takes_from_both_forces() -> None:
    both = force(slip_angle=0.07, slip_ratio=-0.1)
    assert abs(both.fx) < abs(force(slip_ratio=-0.1).fx)
    assert abs(both.fy) < abs(force(slip_angle=0.07).fy)


def test_a_state_tells_its_derivative_with_the_load_whatever_way_it_was_found(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Directly, from another slip ratio, and by half of the way."""
    whole, asked = module._newton, []

    def too_far(tire: RigTire, cond: Condition, *rest: Any, **named: Any) -> RigState:
        asked.append(cond)
        if asked.count(cond) == 1 and cond in (turned, slowed):
            raise SolverError("too far")
        return whole(tire, cond, *rest, **named)

    turned, slowed = replace(BASE, slip_angle=0.05), replace(BASE, slip_ratio=-0.1)
    near = solve(TIRE, slowed, state(slip_ratio=-0.03))
    monkeypatch.setattr(module, "_newton", too_far)
    halved = solve(TIRE, turned, state())
    assert asked[1].slip_angle == pytest.approx(0.025)
    asked.clear()
    braked = solve(TIRE, slowed, replace(state(), straight=None))
    assert asked[asked.index(slowed) + 1].slip_ratio == pytest.approx(-0.05)
    pairs = (
        (near, {"slip_ratio": -0.1}),
        (braked, {"slip_ratio": -0.1}),
        (halved, {"slip_angle": 0.05}),
    )
    for found, change in pairs:
        direct = state(**change)
        assert found.stiffness == pytest.approx(direct.stiffness, rel=1e-5)
        most = np.abs(direct.by_load).max()
        np.testing.assert_allclose(found.by_load, direct.by_load, atol=1e-5 * most)
        assert found.straight is not None
        assert np.isnan(found.straight.stiffness)


@pytest.mark.parametrize("change", [{"slip_angle": 0.1}, {"slip_angle": 0.05}])
def test_the_free_radius_is_that_of_the_upright_wheel(change: dict[str, float]) -> None:
    found = state(**change)
    assert found.free_radius == pytest.approx(state().rolling_radius, rel=1e-9)
    assert abs(found.rolling_radius / found.free_radius - 1.0) > 1e-5
