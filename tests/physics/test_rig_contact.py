"""Laws of the rolling tire on the rig: balance, contact, strain shape, damping."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.signal import find_peaks

from tirelib.rig.belt import FIELDS, LATERAL, U, V
from tirelib.rig.observe import contact, edges, forces, trace
from tirelib.rig.solve import RigState, solve
from tirelib.rig.system import fields_at_points
from tirelib.rig.tire import Condition, RigTire

TIRE = RigTire()
BASE = Condition(4800.0, 2.3e5, 65.0 / 3.6)
LOADS = (1200.0, 3000.0, 4800.0, 8400.0)


@cache
def state(tire: RigTire = TIRE, **change: float) -> RigState:
    cond = replace(BASE, **change)
    start = None if cond == BASE and tire == TIRE else state()
    return solve(tire, cond, start)


def sidewall(s: RigState) -> dict[str, float]:
    """Force and moment of the sidewalls on the rim, integrated on their own [N], [N m]."""
    tire, cond, phi = s.tire, s.condition, s.grid.phi
    z = fields_at_points(s.grid, s.control)
    share = np.array(tire.sidewall_share)

    def pull(k: float, value: np.ndarray, rate: np.ndarray) -> np.ndarray:
        damper = 2.0 * tire.sidewall_damping * np.sqrt(k * tire.mass)
        return k * value + damper * s.omega * rate

    radial = share * pull(tire.radial_stiffness(cond.pressure), z[:, U], z[:, FIELDS + U])
    along = share * pull(tire.tangential_stiffness(cond.pressure), z[:, V], z[:, FIELDS + V])
    arm = tire.roll_lever * tire.lateral / np.sum(tire.lateral**2)
    rolled = z[:, LATERAL] + z[:, U] @ arm
    rolled_rate = z[:, FIELDS + LATERAL] + z[:, FIELDS + U] @ arm
    side = pull(tire.lateral_stiffness(cond.pressure), rolled, rolled_rate)
    radial = radial + side[:, None] * arm
    ds = s.grid.weight * tire.ring_radius
    cos, sin = np.cos(phi)[:, None], np.sin(phi)[:, None]
    lever = tire.ring_radius + z[:, U]
    return {
        "up": float(np.sum(ds @ (along * sin - radial * cos))),
        "forward": float(np.sum(ds @ (-radial * sin - along * cos))),
        "left": float(ds @ side),
        "turn": float(np.sum(ds @ (z[:, V] * radial - lever * along))),
    }


@pytest.mark.parametrize(
    "change",
    [
        {},
        {"load": 8400.0, "speed": 40.0},
        {"slip_angle": 0.05},
        {"slip_ratio": -0.05},
        {"slip_angle": -0.07, "slip_ratio": 0.03},
    ],
)
def test_road_and_sidewalls_balance(change: dict[str, float]) -> None:
    # pressure on a closed belt and the inertia of steady rolling have no resultant
    s = state(**change)
    road, rim = forces(s), sidewall(s)
    allowed = 1e-5 * road.fz  # the splines hold a rigid motion to 1e-7
    assert abs(road.fz - rim["up"]) < allowed
    assert abs(road.fx - rim["forward"]) < allowed
    assert abs(road.fy - rim["left"]) < allowed
    assert abs(road.torque - rim["turn"]) < allowed * s.height
    assert road.fz == pytest.approx(s.condition.load, rel=1e-9)


def test_a_cambered_tire_balances_in_the_wheel_plane() -> None:
    s = state(camber=0.07)
    road, rim = forces(s), sidewall(s)
    up = road.fz * np.cos(0.07) - road.fy * np.sin(0.07)
    left = road.fy * np.cos(0.07) + road.fz * np.sin(0.07)
    assert abs(up - rim["up"]) < 1e-5 * road.fz
    assert abs(left - rim["left"]) < 1e-5 * road.fz


def test_free_rolling_takes_no_torque_and_drags_by_damping_only() -> None:
    lossy, ideal = forces(state()), forces(state(replace(TIRE, sidewall_damping=0.0)))
    assert abs(lossy.torque) < 1e-6
    assert lossy.fx < 0.0
    # what is left without damping is the bristles' sliding at the trailing edge
    assert abs(ideal.fx) < 0.2 * abs(lossy.fx)


def test_without_friction_there_is_no_shear() -> None:
    c = contact(state(replace(TIRE, friction=0.0), slip_angle=0.05))
    assert c.q.max() > 1e5
    assert np.abs(c.fx).max() == 0.0
    assert np.abs(c.fy).max() == 0.0


def test_strain_has_contact_tension_and_two_compressive_peaks() -> None:
    for load in LOADS:
        s = state(load=load)
        tr, (angle, _) = trace(s), edges(s)
        strain, lead, trail = tr.strain[:, 2], angle[2, 0], angle[2, 1]
        hoop = strain[0]
        inside = (tr.phi > lead) & (tr.phi < trail)
        assert strain.max() == strain[inside].max()
        assert strain.max() > 2.0 * hoop
        for before in (True, False):
            part = np.flatnonzero((tr.phi < lead) if before else (tr.phi > trail))
            low = part[np.argmin(strain[part])]
            edge = lead if before else trail
            assert strain[low] < hoop - 5e-4
            assert abs(tr.phi[low] - edge) < 0.25


def test_strain_rate_peaks_lie_near_the_true_edges() -> None:
    for load in LOADS[1:]:
        s = state(load=load)
        tr, (angle, _) = trace(s), edges(s)
        slope = tr.slope[:, 2]
        # the belt bends over about sqrt(EI / T) = 15 mm, 0.05 rad
        assert abs(tr.phi[np.argmax(slope)] - angle[2, 0]) < 0.05
        assert abs(tr.phi[np.argmin(slope)] - angle[2, 1]) < 0.05


def test_strain_rate_carries_no_mesh_noise() -> None:
    for change in ({}, {"load": 8400.0}, {"slip_angle": 0.05}, {"slip_ratio": -0.05}):
        tr = trace(state(**change))
        for slope in tr.slope.T:
            size = np.abs(slope).max()
            up, _ = find_peaks(slope, prominence=2e-3 * size)
            down, _ = find_peaks(-slope, prominence=2e-3 * size)
            # an up and a down at each edge and their recoil; one more where sliding begins
            assert len(up) + len(down) <= 8


def test_contact_grows_and_axle_sinks_with_load() -> None:
    length = np.array([edges(state(load=load))[1] for load in LOADS])
    height = np.array([state(load=load).height for load in LOADS])
    assert np.all(np.diff(length, axis=0) > 0.0)
    assert np.all(np.diff(height) < 0.0)
    assert 0.04 < length[0, 2] < 0.08
    assert 0.15 < length[-1, 2] < 0.20


def test_contact_shrinks_with_pressure() -> None:
    length = [edges(state(pressure=p))[1][2] for p in (1.7e5, 2.3e5, 2.9e5)]
    assert length[0] > length[1] > length[2]


def shift(s: RigState) -> float:
    """Centre of pressure before the axle [m]."""
    c = contact(s)
    return float(np.sum(c.area * c.q * c.kin.x) / forces(s).fz)


def test_damping_and_speed_shift_pressure_forward() -> None:
    none = replace(TIRE, sidewall_damping=0.0)
    twice = replace(TIRE, sidewall_damping=2.0 * TIRE.sidewall_damping)
    for speed in (10.0, 40.0):
        assert abs(shift(state(none, speed=speed))) < 1e-4
    slow, fast = shift(state(speed=10.0)), shift(state(speed=40.0))
    assert 0.0 < slow < fast
    assert shift(state(twice, speed=40.0)) == pytest.approx(2.0 * fast, rel=0.1)
    angle, _ = edges(state(twice, speed=40.0))
    still, _ = edges(state(none, speed=40.0))
    assert angle.mean(axis=1)[2] < still.mean(axis=1)[2]


def test_softening_sidewalls_let_the_axle_sink() -> None:
    soft = replace(TIRE, sidewall_softening=0.2)
    assert state(soft, load=8400.0).height < state(load=8400.0).height - 1e-3


def test_traces_do_not_depend_on_the_start() -> None:
    goal = replace(BASE, load=6000.0, slip_angle=0.04)
    near = solve(TIRE, goal, state(slip_angle=0.05))
    far = solve(TIRE, goal, state(load=1200.0))
    assert abs(near.height - far.height) < 1e-8
    np.testing.assert_allclose(trace(near).strain, trace(far).strain, atol=1e-8)


def test_load_sensitivity_is_the_derivative() -> None:
    low, high = state(load=4790.0), state(load=4810.0)
    difference = (trace(high).strain - trace(low).strain) / 20.0
    by_load = trace(state()).by_load
    # at constant rolling radius conditions; bristles that begin to touch make it uneven
    assert np.abs(difference - by_load).max() < 0.02 * np.abs(by_load).max()
    assert state().stiffness == pytest.approx(20.0 / (low.height - high.height), rel=0.01)
