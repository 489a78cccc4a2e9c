"""Laws of sheared tread elements and of their contact, Eq. (79)-(81), (98)-(106)."""

from dataclasses import replace

import numpy as np
import pytest

from tests.physics.shear_case import (
    BELTS,
    DEFLECTIONS,
    H0,
    OMEGA,
    SHEAR,
    T61,
    TREAD,
    Array,
    R,
    contact,
    ring,
)
from tirelib.physics.contact import radial, shear
from tirelib.physics.contact.free_boundary import Constant
from tirelib.physics.contact.shear import Shear, ShearContact
from tirelib.physics.contact.shear_law import Rolling, elements, kinematics
from tirelib.physics.contact.shear_newton import start
from tirelib.physics.contact.shear_system import Mesh, Patch, ShearProblem, assemble
from tirelib.physics.contact.tread import Tread
from tirelib.physics.ring.ring import modal_damping_time


def states(n: int = 200) -> tuple[Array, Array, Rolling]:
    """Random belts: one point, n elements."""
    rng = np.random.default_rng(7)
    size = np.array([0.03, 0.02, 0.3])
    belt = size * rng.uniform(-1.0, 1.0, (1, n, 3))
    phi = rng.uniform(-0.5, 0.5, (1, n))
    return belt, phi, Rolling(np.array([0.306]), np.array([0.287]), np.array([2e-3]))


# kinematics and the law of an element


def test_kinematics_are_those_of_plain_vectors_and_not_the_printed_ones() -> None:
    belt, phi, rolling = states()
    height, offset, _, _ = kinematics(belt, phi, rolling, np.array([R]))
    printed = []
    for (u, v, beta), angle, h, g in zip(belt[0], phi[0], height[0], offset[0], strict=True):
        # one step along the deformed belt turns by beta: its tangent is P' / |P'|, v - u' = R beta
        out, along = (
            np.array([np.sin(angle), np.cos(angle)]),
            np.array([np.cos(angle), -np.sin(angle)]),
        )
        turn = np.array([[np.cos(beta), np.sin(beta)], [-np.sin(beta), np.cos(beta)]])
        n, t = turn @ out, turn @ along
        tip = np.array([0.306 * angle + 2e-3, 0.287])
        way = tip - (R + u) * out - v * along
        assert abs(way @ n - h) < 1e-15
        assert abs(way @ t - g) < 1e-15
        eta = angle + beta
        printed.append(
            -0.287 * np.sin(eta)
            + (0.306 * angle + 2e-3) * np.cos(eta)
            - (R + u) * np.sin(angle - eta)
            + v * np.sin(angle - eta)
            - g
        )
    assert np.abs(printed).max() > 1e-3


def test_the_element_stands_on_the_normal_of_the_deformed_belt() -> None:
    # so eta = phi + beta with beta = (v - u') / R: with the other sign the angle would be 2 beta
    n, size = 5, 1e-6
    phi = np.linspace(-3.0, 3.0, 4001)
    v = size * np.sin(n * phi + 0.3)
    u = -size * n * np.cos(n * phi + 0.3)  # inextensible: u = -v'
    beta = size * (1.0 - n**2) * np.sin(n * phi + 0.3) / R
    x = (R + u) * np.sin(phi) + v * np.cos(phi)
    z = (R + u) * np.cos(phi) - v * np.sin(phi)
    dx, dz = np.gradient(x, phi, edge_order=2), np.gradient(z, phi, edge_order=2)
    across = (dx * np.sin(phi + beta) + dz * np.cos(phi + beta)) / np.hypot(dx, dz)
    assert np.abs(across[2:-2]).max() < 1e-3 * np.abs(beta).max()  # finite differences


def test_loads_are_the_forces_turned_into_the_ring_directions() -> None:
    belt, phi, rolling = states()
    e = elements(belt, phi, rolling, np.array([R]), TREAD.spread(1), Shear(2.5e7, 0.65).spread(1))
    eta = phi + belt[..., 2]
    x = e.normal * np.sin(eta) + e.tangential * np.cos(eta)
    z = e.normal * np.cos(eta) - e.tangential * np.sin(eta)
    scale = np.abs(e.loads).max()
    assert np.abs(x * np.sin(phi) + z * np.cos(phi) - e.loads[..., 0]).max() < 1e-14 * scale
    assert np.abs(x * np.cos(phi) - z * np.sin(phi) - e.loads[..., 1]).max() < 1e-14 * scale
    assert np.abs(e.height * e.tangential - e.loads[..., 2]).max() < 1e-14 * scale


def linearized(state: Array, phi: Array, r_e: float, r_l: float, sign: float) -> Array:
    """Eq. (100)-(102); the print has sign = -1 before the shear bracket of (101)."""
    u, v, eta = state[..., 0], state[..., 1], state[..., 2] + phi
    ke, kg, s, c = 7.5e7, 2.5e7, np.sin(phi), np.cos(phi)
    s2 = np.sin(2.0 * phi)
    q_u = ke * (
        (-H0 + r_l + r_e * eta * phi) * c
        - (R + u) * c**2
        - (R * eta - v / 2) * s2
        + (r_l - H0) * eta * s
    )
    q_u -= kg * (
        (r_l * eta - r_e * phi) * s + (R + u) * s**2 - (R * eta - v / 2) * s2 + r_e * eta * phi * c
    )
    q_v = ke * (
        (H0 - r_l - r_e * eta * phi) * s
        + (R + u) / 2 * s2
        + (R * eta - v) * s**2
        + (r_l - H0) * eta * c
        - R * eta * c**2
    )
    bracket = (
        (r_e * phi - r_l * eta) * c
        - (R + u) / 2 * s2
        + (R * eta - v) * c**2
        + r_e * eta * phi * s
        - R * eta * s**2
    )
    q_b = kg * H0 * (-r_l * eta + r_e * phi - (R + u) * s + (R * eta - v) * c)
    return np.stack([q_u, q_v + sign * kg * bracket, q_b], axis=-1)


def test_small_deflections_give_the_linear_loads_with_the_corrected_sign() -> None:
    # products of what (100)-(102) call small (u, v, eta, and h - h_0 in the moment) are left out
    rng = np.random.default_rng(3)
    phi = rng.uniform(-0.4, 0.4, (1, 50))
    direction = rng.uniform(-1.0, 1.0, (1, 50, 3)) * [0.03, 0.03, 1.0]

    def error(size: float, sign: float) -> Array:
        state = size * direction
        state[..., 2] -= phi  # eta is small, not beta
        rolling = Rolling(np.array([0.306]), np.array([0.29]), np.zeros(1))
        no_limit = Shear(2.5e7).spread(1)
        e = elements(state, phi, rolling, np.array([R]), TREAD.spread(1), no_limit)
        exact = e.loads.copy()
        exact[..., 2] = H0 * e.tangential
        return np.asarray(
            np.abs(exact - linearized(state, phi, 0.306, 0.29, sign)).max(axis=(0, 1))
        )

    ratio = error(1e-3, 1.0) / error(5e-4, 1.0)
    assert ratio == pytest.approx([4.0, 4.0, 4.0], rel=0.02)  # second order
    assert error(5e-4, -1.0)[1] > 100.0 * error(5e-4, 1.0)[1]


@pytest.mark.parametrize("mu", [np.inf, 0.65, 0.05, 0.0])
def test_derivatives_of_all_equations_are_those_of_differences(mu: float) -> None:
    tread = Tread(R + H0, 7.5e7, H0, hardening=0.8).spread(1)
    problem = ShearProblem(
        Constant(ring(0.09)),
        tread,
        Shear(2.5e7, mu).spread(1),
        None,
        np.array([6000.0]),
        None,
        np.array([20.0]),
        1e3 * np.exp(-np.arange(61.0))[None, :, None] * np.array([1.0, 1j, 0.01]),
    )
    mesh = Mesh.of(6)
    x = start(radial.press(ring(0.09), tread, 0.03), mesh)
    rng = np.random.default_rng(1)
    x += rng.uniform(-1e-3, 1e-3, x.shape)

    def residual(at: Array) -> Array:
        return assemble(Patch.of(problem, ring(0.09), mesh, at), None).residual[0]

    jacobian = assemble(Patch.of(problem, ring(0.09), mesh, x), None).jacobian[0]
    step = 1e-7
    for i in range(x.size):
        moved = step * (np.arange(x.size) == i)
        slope = (residual(x + moved) - residual(x - moved)) / (2.0 * step)
        # rounding of residuals of 1 m over the step
        assert np.abs(slope - jacobian[:, i]).max() < 1e-6 * (1.0 + np.abs(slope).max())


# balance and symmetry


@pytest.mark.parametrize("damping", [0.0, 0.04, 0.09])
def test_the_sidewall_carries_what_the_road_gives(damping: float) -> None:
    for d0 in DEFLECTIONS:
        c = contact(d0, damping)
        lag = 1.0 + 1j * OMEGA * modal_damping_time(replace(T61, damping=damping), 1)[0, 1]
        up, forward = sidewall(c, lag)
        assert up == pytest.approx(c.load[0], rel=1e-9)
        assert abs(forward - c.longitudinal_force[0]) < 1e-9 * c.load[0]


@pytest.mark.parametrize("belt", BELTS)
def test_the_standing_sidewall_carries_the_load_of_every_belt(belt: str) -> None:
    c = shear.press(ring(0.0, belt, 0.0), TREAD, SHEAR, 0.035)
    up, forward = sidewall(c, 1.0 + 0j)
    assert up == pytest.approx(c.load[0], rel=1e-9)
    assert abs(forward) < 1e-9 * c.load[0]


def sidewall(c: ShearContact, lag: complex) -> tuple[float, float]:
    """Force on the belt's road, up and forward, from the first harmonic of u and v."""
    u, v = c.displacement[0, 1, 0] * 6.24e5 * lag, c.displacement[0, 1, 1] * 2.18e5 * lag
    up = -R * np.pi * (u.real + v.imag)
    return float(up), float(-R * np.pi * (v.real - u.imag))


@pytest.mark.parametrize("belt", BELTS)
def test_without_damping_pressure_is_even_and_shear_is_odd(belt: str) -> None:
    c = shear.press(ring(0.0, belt), TREAD, SHEAR, 0.035)
    scale = c.pressure.max()
    assert np.abs(c.pressure - c.pressure[:, ::-1]).max() < 1e-9 * scale
    assert np.abs(c.shear_traction + c.shear_traction[:, ::-1]).max() < 1e-9 * scale
    assert c.edges[0, 0] == pytest.approx(-c.edges[0, 1], abs=1e-12)
    assert abs(c.longitudinal_force[0]) < 1e-9 * c.load[0]
    assert abs(c.torque[0]) < 1e-9 * c.load[0]


def test_without_damping_the_rolling_tire_is_the_standing_one() -> None:
    for omega in (0.0, 150.0, 300.0):
        c = shear.press(ring(0.0, omega=omega), TREAD, SHEAR, 0.035)
        assert c.load[0] == pytest.approx(contact(0.035).load[0], rel=1e-10)
        assert c.edges == pytest.approx(contact(0.035).edges, abs=1e-11)


@pytest.mark.parametrize("d0", DEFLECTIONS)
def test_shear_is_directed_outward_with_shear_and_inward_with_the_radial_model(d0: float) -> None:
    c, r = contact(d0, 0.04), radial.press(ring(0.04), TREAD, d0)
    along = c.road_traction[0]
    # damping shifts the change of sign from the middle by some mm
    away = np.abs(c.phi) > 0.03
    assert (np.sign(c.phi) * along)[away].min() > 0.0
    assert (np.sign(r.phi) * (-r.pressure * np.sin(r.phi))).max() < 0.0


@pytest.mark.parametrize("d0", DEFLECTIONS)
def test_contact_angles_are_smaller_than_in_the_radial_model(d0: float) -> None:
    r = radial.press(ring(0.04), TREAD, d0)
    share = contact(d0, 0.04).edges / r.edges
    assert share.max() < 1.0
    # 6 % at 25 mm, 8 % at 35 mm, 10.5 % at 45 mm
    assert 1.0 - share.mean() == pytest.approx(
        np.interp(d0, DEFLECTIONS, [0.059, 0.081, 0.104]), abs=5e-3
    )


def test_pressure_is_concave_at_large_deflection_where_the_radial_model_has_a_hump() -> None:
    c, r = contact(0.045, 0.04), radial.press(ring(0.04), TREAD, 0.045)
    middle = -c.elements_at(np.zeros(1)).normal[0, 0]
    sides = [c.pressure[c.phi < 0].max(), c.pressure[c.phi > 0].max()]
    assert middle < 0.98 * min(sides)
    assert r.pressure_at(np.zeros(1))[0, 0] > 0.999 * r.pressure.max()


def test_damping_moves_the_pressure_to_the_entry() -> None:
    centre = [contact(0.035, lam).pressure_centre[0] for lam in (0.0, 0.04, 0.09)]
    assert centre[0] == pytest.approx(0.0, abs=1e-12)
    assert centre[2] < centre[1] < -1e-3
    entry = [contact(0.035, lam).edges[0].sum() for lam in (0.0, 0.04, 0.09)]
    assert entry[2] < entry[1] < -5e-3


@pytest.mark.parametrize("torque", [None, 0.0])
def test_effective_radius_lies_between_loaded_and_free_radius(torque: float | None) -> None:
    for d0 in DEFLECTIONS:
        c = contact(d0, 0.04, torque=torque)
        assert c.loaded_radius[0] < c.effective_radius[0] < R + H0
        assert c.loaded_radius[0] == pytest.approx(R + H0 - d0, abs=1e-12)


def test_the_leading_element_is_undeformed() -> None:
    # (103) and (104) with the belt from the harmonics
    c = contact(0.035, 0.09)
    lead = c.edges[:, :1]
    assert abs(c.compression_at(lead)[0, 0]) < 1e-12
    assert abs(c.elements_at(lead).offset[0, 0]) < 1e-12
    assert abs(c.compression_at(c.edges[:, 1:])[0, 0]) < 1e-12


@pytest.mark.parametrize("torque", [None, 0.0, 40.0, -40.0])
def test_the_power_of_the_road_is_spent_in_belt_and_wheel(torque: float | None) -> None:
    """Per radian: R int f_x R_e dphi, tips stick, is what belt loads and torque take.

    The linear ring has its moment on the undeformed radius, and (81) has no moment of f_n on the
    sheared tip; both are added here. What the last element still holds is lost behind the patch.
    """
    c = contact(0.035, 0.09, np.inf, torque=torque)
    if torque is not None:
        assert c.torque[0] == pytest.approx(torque, abs=1e-8)
    w, n = c.weights[0], np.arange(61.0)
    waves = np.exp(1j * np.outer(n, c.phi[0]))
    belt, slope = (
        (c.displacement[0] * f).T @ waves for f in (1.0 + 0 * n[:, None], 1j * n[:, None])
    )
    q = c.belt_loads[0].T
    loss = R * np.sum(w * (q * slope.real))
    assert loss > 10.0
    moved = R * np.sum(w * (q[1] * belt.real[0] - q[0] * belt.real[1]))
    leaning = R * np.sum(w * c.shear[0] * c.pressure[0] * (1.0 + slope.real[2]))
    left = c.elements_at(c.edges[:, 1:]).offset[0, 0]
    spent = loss + c.torque[0] + moved + leaning + R * 0.5 * 2.5e7 * left**2
    given = -c.longitudinal_force[0] * c.effective_radius[0]
    assert spent == pytest.approx(given, abs=1e-6)  # [N m]; quadrature on 40 nodes


def test_rolling_freely_takes_no_torque_and_drags_less() -> None:
    # (103) leaves a braking moment of the road with damping
    edge, free = contact(0.035, 0.04), contact(0.035, 0.04, torque=0.0)
    assert edge.torque[0] > 5.0
    assert abs(free.torque[0]) < 1e-9
    assert edge.longitudinal_force[0] < free.longitudinal_force[0] < 0.0
    assert free.tip_offset[0] != 0.0
    assert edge.tip_offset[0] == 0.0
