"""Laws of the rolling continuum: balance, symmetry, energy, derivative, speed, convergence."""

from dataclasses import replace

import numpy as np
import pytest
from continuum.balance import balance
from continuum.elements import fields
from continuum.grid import FINE
from continuum.observe import hoop_strain, trace
from continuum.polar import radial, tangential
from continuum.road import columns, rows, scalars
from continuum.sidewall import at
from continuum.solve import model, solve
from continuum.tire import SHARE, Condition, draw

from tests.continuum.rolling import COARSE, COND, TIRE, hanging, plain, rim_force, state

LOSSES = {"friction": 0.6, "damping": 3e-4}


@pytest.mark.parametrize("change", [{}, {"load": 6500.0, "speed": 36.0}, LOSSES])
def test_road_and_sidewalls_balance(change: dict[str, float]) -> None:
    # pressure on a closed face and the inertia of steady rolling have no resultant, and rigid
    # translations are in the finite elements' space: only rounding and Newton's end are left
    s = state(**change)
    force, turning = rim_force(s)
    road = s.balance.road
    assert road.load == pytest.approx(s.balance.cond.load, abs=1e-4)
    assert abs(force[1] + road.load) < 1e-4
    assert abs(force[0] + road.forward) < 1e-4
    # a turn is in the space only to the third power of the coarse elements
    assert abs(turning - (-road.torque)) < 1e-5 * road.load * TIRE.ring_radius


def test_without_losses_the_contact_is_symmetric() -> None:
    strain = trace(state()).strain
    np.testing.assert_allclose(strain, np.roll(strain[::-1], 1, axis=0), atol=1e-9)
    assert abs(state().balance.road.torque) < 1e-6


def sidewall_loss(s: object) -> float:
    """Work per radian that the dampers take, from the displacements alone [J]."""
    b = s.balance
    line = b.mesh.carcass
    own, slope = fields(line, b.u)
    out, along = radial(line.phi), tangential(line.phi)
    w_phi = np.sum(slope * out, axis=-1) + np.sum(own * along, axis=-1)
    v_phi = np.sum(slope * along, axis=-1) - np.sum(own * out, axis=-1)
    p = b.cond.pressure
    rate = at(b.law.radial, p) * w_phi**2 + at(b.law.tangential, p) * v_phi**2
    weight = line.weight * b.tire.ring_radius * b.mesh.of_strip(b.tire.sidewall_share, line)
    return float(b.tire.damping * b.omega * np.sum(rate * weight))


def test_what_is_put_in_is_what_is_lost() -> None:
    # the test function x_phi is not in the finite elements' space: closed to the mesh's accuracy
    for mesh, allowed in ((0.023, 0.01), (0.0115, 0.002)):
        s = state(mesh, damping=3e-4)
        assert s.balance.road.forward == 0.0
        # the hub drives the wheel against the moment of the contact
        assert -s.balance.road.torque == pytest.approx(sidewall_loss(s), rel=allowed)
    s = state(0.0115, **LOSSES)
    road = s.balance.road
    assert road.dissipated > 0.0
    put_in = -road.forward * s.balance.rolling
    assert put_in == pytest.approx(road.dissipated + sidewall_loss(s), rel=0.02)


def test_friction_stays_inside_coulombs_cone_and_grips() -> None:
    road = state(**LOSSES).balance.road
    assert np.all(np.abs(road.tau) <= LOSSES["friction"] * road.q + 1e-9)
    # most of a freely rolling contact sticks
    pressed = road.q > 0.1 * road.q.max()
    sticks = np.abs(road.tau) < 0.7 * LOSSES["friction"] * road.q
    assert np.mean(sticks[pressed]) > 0.5


def test_the_stiffness_is_the_derivative_of_the_residual() -> None:
    every = {"softening": 0.5, "roughness": 2e-4, "water": 2e4} | LOSSES
    tire, base = replace(TIRE, **every), state().balance
    step = 1e-8 * np.random.default_rng(0).standard_normal(base.u.shape)

    def at_(du: np.ndarray | float, height: float = 0.0, rolling: float = 0.0):
        return balance(
            tire,
            base.law,
            COND,
            base.mesh,
            base.u + du,
            base.height + height,
            base.rolling + rolling,
            60.0,
        )

    now, up, down = at_(0.0), at_(step), at_(-step)
    told = now.mesh.add.matrix(list(now.stiffness)) @ step.ravel()
    seen = 0.5 * (up.residual - down.residual)
    np.testing.assert_allclose(told, seen, atol=1e-5 * np.abs(seen).max())
    for row, name in zip(rows(now.mesh, now.road), ("load", "torque"), strict=True):
        seen = 0.5 * (getattr(up.road, name) - getattr(down.road, name))
        assert now.surface_vector(row) @ step.ravel() == pytest.approx(seen, rel=1e-4)
    e = 1e-8
    up, down = at_(0.0, e), at_(0.0, -e)
    column = now.surface_vector(columns(now.mesh, now.road)[0])
    seen = (up.residual - down.residual) / (2.0 * e)
    np.testing.assert_allclose(column, seen, atol=1e-4 * np.abs(column).max())
    seen = [(getattr(up.road, n) - getattr(down.road, n)) / (2.0 * e) for n in ("load", "torque")]
    np.testing.assert_allclose(scalars(now.road)[:, 0], seen, rtol=1e-4)


def test_the_response_to_load_is_the_difference_of_two_states() -> None:
    less, more = state(load=3990.0), state(load=4010.0)
    assert 20.0 / (less.height - more.height) == pytest.approx(state().stiffness, rel=1e-3)
    slope = (more.balance.u - less.balance.u) / 20.0
    np.testing.assert_allclose(slope, state().by_load, atol=1e-2 * np.abs(slope).max())


def test_hoop_strain_grows_with_speed_squared() -> None:
    omega = np.array([0.0, 40.0, 80.0, 120.0])
    strain = [
        SHARE @ hoop_strain(s, b.u).mean(axis=1)
        for b in (hanging(plain(), 2.1e5, float(w)) for w in omega)
        for s in [replace(state(), balance=b)]
    ]
    growth = np.polyfit(omega**2, strain, 1)[0]
    # per length: (EA / R^2 + k_u) w = m Omega^2 R, at the innerliner w / (R + y)
    ring, radius = TIRE.section, TIRE.ring_radius
    stiff = ring["EA"] / radius**2 + at(plain().law.radial, 2.1e5)
    theory = ring["mass"] * radius / stiff / (radius + TIRE.innerliner_offset)
    assert growth == pytest.approx(theory, rel=0.02)


def test_a_zigzag_is_refused() -> None:
    s = state()
    u = s.balance.u.copy()
    nodes = s.model.mesh.nodes
    u[:, 0] += 1e-5 * np.cos(2.0 * np.pi * nodes[:, 0] / (2.0 * COARSE)) * (nodes[:, 1] < 0.3)
    with pytest.raises(ArithmeticError, match="the strain zigzags by"):
        trace(replace(s, balance=replace(s.balance, u=u)))


def test_strain_converges_with_the_mesh() -> None:
    best = trace(state(0.0115)).strain
    coarse, half = (np.sqrt(np.mean((trace(state(h)).strain - best) ** 2)) for h in (0.046, 0.023))
    assert np.log2(coarse / half) > 2.5
    # every harmonic of a strain of 12,000 microstrain; the default mesh is half of the finer one
    assert half < 40e-6
    assert abs(state(0.023).height - state(0.0115).height) < 2e-6


def test_the_default_mesh_is_fine_enough_beside_the_contact_as_well() -> None:
    """Elements of .08 rad beside the contact, twice as long, would change it by 14 microstrain."""
    tire, cond = draw(9332), Condition(3600.0, 2.2e5, 16.7)
    usual, half = (trace(solve(model(tire, fine), cond)).strain for fine in (FINE, 0.5 * FINE))
    assert np.sqrt(np.mean((usual - half) ** 2)) < 1e-6
