"""Laws of the contact with sheared tread elements, Eq. (79)-(81), (98)-(106)."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import root

from tirelib.contact import radial, shear
from tirelib.contact.free_boundary import Constant
from tirelib.contact.shear import Shear, ShearContact
from tirelib.contact.shear_law import Elements, Rolling, elements, kinematics
from tirelib.contact.shear_newton import start
from tirelib.contact.shear_system import Mesh, Patch, ShearProblem, assemble
from tirelib.contact.tread import Tread
from tirelib.errors import ConvergenceError, ParameterError
from tirelib.ring.compliance import Compliance, compliance
from tirelib.ring.ring import Ring, modal_damping_time

Array = NDArray[np.float64]

OMEGA, R, H0 = 59.0, 0.30, 0.0125
T61 = Ring(
    radius=R,
    bending_stiffness=1.144,
    mass=3.16,
    inflation=1.32e5 * 0.165,
    radial_stiffness=6.24e5,
    tangential_stiffness=2.18e5,
)
BELTS = {
    "inextensible": T61,
    "extensible": replace(T61, extension_stiffness=5e6),
    "timoshenko": replace(T61, extension_stiffness=5e6, shear_stiffness=5e4),
}
TREAD = Tread(R + H0, 7.5e7, H0)
SHEAR = Shear(2.5e7, 0.65)
DEFLECTIONS = (0.025, 0.035, 0.045)


@cache
def ring(damping: float = 0.0, belt: str = "inextensible", omega: float = OMEGA) -> Compliance:
    return compliance(replace(BELTS[belt], damping=damping), omega, 60)


@cache
def contact(d0: float, damping: float = 0.0, mu: float = 0.65, **option: float) -> ShearContact:
    law = Shear(option.pop("stiffness", 2.5e7), mu)
    n_nodes = int(option.pop("n_nodes", 40))
    return shear.press(ring(damping), TREAD, law, d0, n_nodes=n_nodes, **option)  # type: ignore[arg-type]


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
            -0.287 * np.sin(eta) + (0.306 * angle + 2e-3) * np.cos(eta)
            - (R + u) * np.sin(angle - eta) + v * np.sin(angle - eta) - g
        )  # fmt: skip
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
    q_u = ke * ((-H0 + r_l + r_e * eta * phi) * c - (R + u) * c**2 - (R * eta - v / 2) * s2
                + (r_l - H0) * eta * s)  # fmt: skip
    q_u -= kg * ((r_l * eta - r_e * phi) * s + (R + u) * s**2 - (R * eta - v / 2) * s2
                 + r_e * eta * phi * c)  # fmt: skip
    q_v = ke * ((H0 - r_l - r_e * eta * phi) * s + (R + u) / 2 * s2 + (R * eta - v) * s**2
                + (r_l - H0) * eta * c - R * eta * c**2)  # fmt: skip
    bracket = ((r_e * phi - r_l * eta) * c - (R + u) / 2 * s2 + (R * eta - v) * c**2
               + r_e * eta * phi * s - R * eta * s**2)  # fmt: skip
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
        Constant(ring(0.09)), tread, Shear(2.5e7, mu).spread(1), None, np.array([6000.0]), None,
        np.array([20.0]), 1e3 * np.exp(-np.arange(61.0))[None, :, None] * np.array([1.0, 1j, 0.01]),
    )  # fmt: skip
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
        c = contact(d0, 0.04, torque=torque)  # type: ignore[arg-type]
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
    c = contact(0.035, 0.09, np.inf, torque=torque)  # type: ignore[arg-type]
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


# friction


@pytest.mark.parametrize("mu", [0.0, 0.02, 0.05, 0.2, 0.65])
@pytest.mark.parametrize("d0", [0.01, 0.045])
def test_friction_is_a_limit_that_sliding_reaches(mu: float, d0: float) -> None:
    c = contact(d0, 0.09, mu)
    limit, stick = mu * c.pressure, 2.5e7 * c.shear
    assert (np.abs(c.shear_traction) <= limit * (1.0 + 1e-12)).all()
    assert np.abs(c.shear_traction)[c.sliding] == pytest.approx(limit[c.sliding], rel=1e-12)
    assert c.shear_traction[~c.sliding] == pytest.approx(stick[~c.sliding], rel=1e-12)
    assert (np.abs(stick)[c.sliding] > limit[c.sliding]).all()
    assert (c.shear_traction * stick >= 0.0).all()  # direction kept
    assert c.sliding.any()


def test_a_hardening_tread_presses_by_its_own_law() -> None:
    hard = Tread(R + H0, 7.5e7, H0, hardening=2.0)
    c = shear.press(ring(0.04), hard, SHEAR, 0.035)
    assert c.pressure == pytest.approx(7.5e7 * c.compression * (1 + 2.0 * c.compression / H0))
    assert c.load[0] > contact(0.035, 0.04).load[0]
    assert c.iterations < 10  # with a wrong tangent Newton is linear


def test_brakes_slide_the_wheel_at_last() -> None:
    torque = np.array([0.0, 300.0, 600.0, 900.0, 1100.0])
    c = shear.load(ring(0.04), TREAD, SHEAR, 6000.0 + 0 * torque, torque=torque)
    assert c.torque == pytest.approx(torque, abs=1e-7)
    assert (np.diff(c.effective_radius) > 0.0).all()  # the wheel turns slower than the road
    assert (np.diff(c.sliding.sum(axis=1)) > 0).all()
    assert (np.diff(c.longitudinal_force) < 0.0).all()
    assert (np.abs(c.longitudinal_force) < 0.66 * c.load).all()
    with pytest.raises(ConvergenceError):
        shear.load(ring(0.04), TREAD, SHEAR, 6000.0, torque=0.66 * 6000.0 * 0.31)


def test_much_friction_is_no_sliding() -> None:
    free = contact(0.045, 0.09, np.inf)
    assert not free.sliding.any()
    assert np.isnan(free.sliding_onset[0])
    loads = [abs(contact(0.045, 0.09, mu).load[0] - free.load[0]) for mu in (0.65, 6.0, 600.0)]
    assert loads[2] < 1e-3 < loads[0]
    assert loads[2] <= loads[1] <= loads[0]


def test_damping_lets_the_rear_slide() -> None:
    for d0 in DEFLECTIONS:
        c = contact(d0, 0.04)
        assert c.sliding[0, -1]
        assert not c.sliding[0, :20].any()
        assert 0.9 * c.edges[0, 1] < c.sliding_onset[0] < c.edges[0, 1]
        # the straight line between two nodes misses by less than a tenth of their distance
        at = c.elements_at(c.sliding_onset[0] + np.array([-1e-3, 1e-3]))
        assert list(at.sliding[0]) == [False, True]


def test_no_friction_leaves_the_pressure_normal_to_the_belt() -> None:
    c = contact(0.035, 0.04, 0.0)
    assert c.sliding_onset[0] == c.edges[0, 0]
    assert np.abs(c.shear_traction).max() == 0.0
    assert np.abs(c.belt_loads[..., 2]).max() == 0.0
    assert np.abs(np.hypot(c.belt_loads[..., 0], c.belt_loads[..., 1]) - c.pressure).max() < 1e-9


def test_without_shear_stiffness_a_light_load_is_the_radial_contact() -> None:
    # what remains is the direction of pressing, the belt's normal instead of the radius: second
    # order in the patch's angle
    gap, half = [], []
    for d0 in (1e-3, 1e-4):
        c, r = contact(d0, stiffness=0.0), radial.press(ring(), TREAD, d0)
        gap.append(abs(c.load[0] / r.load[0] - 1.0))
        half.append(r.edges[0, 1])
    assert gap[0] < 1e-3
    order = np.log(gap[0] / gap[1]) / np.log(half[0] / half[1])
    assert order == pytest.approx(2.0, abs=0.2)


def test_outside_the_patch_the_tread_is_off_the_road() -> None:
    for damping in (0.0, 0.09):
        for d0 in (0.005, *DEFLECTIONS):
            c = contact(d0, damping)
            away = np.array([1e-3, 1e-2, 0.03, 0.1, 0.3])
            phi = np.concatenate([c.edges[0, 0] - away, c.edges[0, 1] + away])
            assert c.compression_at(phi).max() < 0.0
            assert c.pressure.min() > 0.0


# solution


def test_load_and_deflection_are_inverse() -> None:
    given = np.array([300.0, 1000.0, 4000.0, 8000.0, 12000.0])
    for damping in (0.0, 0.09):
        c = shear.load(ring(damping), TREAD, SHEAR, given)
        assert c.load == pytest.approx(given, rel=1e-10)
        back = shear.press(ring(damping), TREAD, SHEAR, c.deflection)
        assert back.edges == pytest.approx(c.edges, abs=1e-10)


def test_edges_of_a_contact_give_that_contact() -> None:
    c = contact(0.035, 0.04)
    fitted = shear.fit_edges(ring(0.04), TREAD, SHEAR, c.edges)
    assert fitted.deflection == pytest.approx(c.deflection, abs=1e-10)
    assert fitted.load == pytest.approx(c.load, rel=1e-8)
    assert abs(fitted.edge_mismatch[0]) < 1e-10
    other = shear.fit_edges(ring(0.04), TREAD, SHEAR, c.edges - np.array([[5e-3, 0.0]]))
    assert abs(other.edge_mismatch[0]) > 1e-6


def test_a_softening_sidewall_is_solved_with_the_load() -> None:
    def at(deflection: Array) -> Compliance:
        soft = replace(T61, damping=0.04, radial_stiffness=6.24e5 * np.exp(-12.0 * deflection))
        return compliance(soft, OMEGA, 60)

    given = np.array([2000.0, 6000.0])
    c = shear.load(at, TREAD, SHEAR, given)
    assert c.load == pytest.approx(given, rel=1e-10)
    direct = shear.press(at(c.deflection), TREAD, SHEAR, c.deflection)
    assert direct.load == pytest.approx(given, rel=1e-8)
    assert c.iterations < 10  # Newton knows the softening: without it 14


def test_an_extra_load_on_the_belt_is_answered() -> None:
    # a hand that pulls the belt off the road under the contact unloads it
    n = np.arange(61.0)
    extra = np.zeros((1, 61, 3), dtype=complex)
    extra[0, :, 0] = -1e3 * np.exp(-((n / 8.0) ** 2))
    pulled = shear.press(ring(), TREAD, SHEAR, 0.03, extra=extra)
    assert pulled.load[0] < contact(0.03).load[0] - 10.0
    assert pulled.residual.max() < 1e-12
    undone = shear.press(ring(), TREAD, SHEAR, 0.03, extra=0.0 * extra)
    assert undone.load[0] == pytest.approx(contact(0.03).load[0], rel=1e-12)


def test_points_together_are_points_alone() -> None:
    d0 = np.linspace(0.004, 0.045, 11)
    law = Shear(np.geomspace(1e5, 1e8, 11), np.linspace(0.0, 1.0, 11))
    together = shear.press(ring(0.04), TREAD, law, d0)
    assert together.residual.max() < 1e-12
    for i in (0, 4, 10):
        alone = shear.press(ring(0.04), TREAD, law.take(np.array([i])), d0[i])
        assert alone.load[0] == pytest.approx(together.load[i], rel=1e-9)
        assert alone.edges[0] == pytest.approx(together.edges[i], abs=1e-10)


@pytest.mark.parametrize("belt", BELTS)
@pytest.mark.parametrize("stiffness", [0.0, 1e4, 1e6, 2.5e7, 1e8])
def test_newton_settles_from_slippery_to_sticky_and_soft_to_stiff(
    belt: str, stiffness: float
) -> None:
    mu = np.array([0.0, 1e-3, 0.05, 0.3, 0.65, 2.0, 100.0, 1e6, np.inf])
    loads = np.array([300.0, 2000.0, 6000.0, 12000.0])
    law = Shear(stiffness, np.repeat(mu, loads.size))
    for damping in (0.0, 0.09):
        c = shear.load(ring(damping, belt), TREAD, law, np.tile(loads, mu.size))
        assert c.residual.max() < 1e-12
        assert c.load == pytest.approx(np.tile(loads, mu.size), rel=1e-9)


def test_with_sliding_the_error_falls_with_the_square_of_the_nodes() -> None:
    # at mu = 0.05 the kink at the edge of sliding lies in the middle of the patch
    exact = {mu: contact(0.035, 0.09, mu, n_nodes=160).load[0] for mu in (0.05, np.inf)}
    error = {
        mu: [abs(contact(0.035, 0.09, mu, n_nodes=n).load[0] - exact[mu]) for n in (20, 40, 80)]
        for mu in exact
    }
    assert error[np.inf][1] < 1e-6  # [N]: smooth, spectral
    assert error[0.05][1] < 1.0  # [N] of 7758
    assert error[0.05][2] < error[0.05][0] / 8.0  # second order would be 16


# an independent solution


class UniformGrid:
    """T61 without tirelib's equations: sums (88)-(90), vectors for the elements, a uniform grid."""

    def __init__(self, d0: float, damping: float, mu: float, n: int) -> None:
        self.phi = np.linspace(-0.34, 0.34, n)
        self.d0, self.mu = d0, mu
        k = np.arange(61.0)
        static = (1.144 / R**4 * k**2 + 1.32e5 * 0.165 / R) * (1 - k**2) ** 2
        static += -1.32e5 * 0.165 / R * (1 - k**2) + 2.18e5 + 6.24e5 * k**2
        c = 2.0 * damping * np.sqrt(3.16 * (1 + k**2) * static)
        size = np.where(k == 0, 0.5, 1.0) / np.pi / np.hypot(static, c * k * OMEGA)
        lag = np.arctan2(c * k * OMEGA, static)
        angle = self.phi[:, None, None] - self.phi[None, :, None]
        cos = size * np.cos(k * angle - lag)
        sin = size * np.sin(k * angle - lag)
        bend = (1 - k**2) / R
        answer = [
            [k**2 * cos, k * sin, k * bend * sin],
            [-k * sin, cos, bend * cos],
            [-k * bend * sin, bend * cos, bend**2 * cos],
        ]
        weight = np.full(n, self.phi[1] - self.phi[0])
        self.kernel = np.block([[a.sum(axis=-1) * weight for a in row] for row in answer])
        self.weight = weight

    def forces(self, x: Array) -> tuple[Array, Array, Array, Array]:
        u, v, beta = x[:-1].reshape(3, -1)
        s, c = np.sin(self.phi), np.cos(self.phi)
        n = np.array([np.sin(self.phi + beta), np.cos(self.phi + beta)])
        t = np.array([n[1], -n[0]])
        way = np.array([x[-1] * self.phi, 0 * s + R + H0 - self.d0])
        way = way - np.array([(R + u) * s + v * c, (R + u) * c - v * s])
        press, lean = H0 - (way * n).sum(axis=0), (way * t).sum(axis=0)
        force = 7.5e7 * np.maximum(press, 0.0)
        pull = np.clip(2.5e7 * lean, -self.mu * force, self.mu * force)
        vector = -force * n + pull * t
        q_u, q_v = vector[0] * s + vector[1] * c, vector[0] * c - vector[1] * s
        loads = np.concatenate([q_u, q_v, (H0 - press) * pull])
        return loads, press, lean, vector

    def residual(self, x: Array) -> Array:
        loads, press, lean, _ = self.forces(x)
        i = int(np.argmax(press > 0.0))  # the leading edge lies before this point
        share = press[i] / (press[i] - press[i - 1])
        entry = lean[i] + share * (lean[i - 1] - lean[i])
        return np.append(x[:-1] - self.kernel @ loads, entry)

    def solve(self, guess: Array) -> tuple[float, float, float, float]:
        """Return Fz, Fx (forward), R_e and the leading edge."""
        found = root(self.residual, guess, method="hybr", tol=1e-11)
        assert np.abs(self.residual(found.x)).max() < 1e-9, found.message
        _, press, _, vector = self.forces(found.x)
        up, forward = -R * np.sum(self.weight * vector[1]), -R * np.sum(self.weight * vector[0])
        i = int(np.argmax(press > 0.0))
        step = self.phi[1] - self.phi[0]
        edge = self.phi[i] - step * press[i] / (press[i] - press[i - 1])
        return float(up), float(forward), float(found.x[-1]), float(edge)


@pytest.mark.parametrize("mu", [0.65, 0.05])
def test_a_uniform_grid_with_powells_method_finds_the_same(mu: float) -> None:
    c = contact(0.03, 0.04, mu, n_nodes=80)
    first = radial.press(ring(0.04), TREAD, 0.03)
    errors = []
    for n in (69, 137):
        grid = UniformGrid(0.03, 0.04, mu, n)
        k = np.arange(61.0)
        belt = (np.exp(1j * grid.phi[:, None] * k) @ first.displacement[0]).real
        up, forward, r_e, edge = grid.solve(np.append(belt.T.ravel(), 0.305))
        errors.append(abs(up / c.load[0] - 1.0))
        assert edge == pytest.approx(c.edges[0, 0], abs=0.01 * (68 / (n - 1)) ** 2 + 2e-4)
    assert errors[1] < 1e-3
    assert forward == pytest.approx(c.longitudinal_force[0], abs=2.0)
    assert r_e == pytest.approx(c.effective_radius[0], abs=2e-5)


# use by others


def test_belt_traction_is_the_tangential_load_and_nothing_outside() -> None:
    c = contact(0.035, 0.09)
    assert shear.belt_traction(c, c.phi) == pytest.approx(c.belt_loads[..., 1], rel=1e-7, abs=1e-3)
    assert (shear.belt_traction(c, np.array([-0.5, 0.5, 3.0])) == 0.0).all()


def test_friction_loads_are_the_belt_loads_without_the_pressure() -> None:
    slippery = contact(0.035, 0.04, 0.0)
    assert np.abs(shear.friction_loads(slippery)).max() == 0.0
    c = contact(0.035, 0.04)
    beta = c.declination - c.phi
    pressed = replace(
        c,
        belt_loads=np.stack(
            [-c.pressure * np.cos(beta), -c.pressure * np.sin(beta), 0 * beta], axis=-1
        ),
    )
    rest = c.harmonics - pressed.harmonics
    assert np.abs(shear.friction_loads(c) - rest).max() < 1e-10 * np.abs(c.harmonics).max()


# bad input


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: shear.press(ring(), TREAD, SHEAR, -0.01), "deflection = -0.01"),
        (lambda: shear.press(ring(), TREAD, SHEAR, np.nan), "deflection = nan"),
        (lambda: shear.load(ring(), TREAD, SHEAR, 0.0), "vertical load = 0"),
        (lambda: shear.load(ring(), TREAD, SHEAR, 90000.0), "validity|ring holds"),
        (lambda: shear.press(ring(), TREAD, SHEAR, 0.02, torque=np.inf), "torque = inf"),
        (lambda: shear.press(ring(), TREAD, SHEAR, np.full((2, 2), 0.02)), "shape"),
        (lambda: shear.press(ring(), TREAD, Shear(np.ones(3)), np.full(2, 0.02)), "points"),
        (lambda: Shear(-1.0), "stiffness = -1"),
        (lambda: Shear(np.inf), "stiffness = inf"),
        (lambda: Shear(1.0, np.nan), "friction = nan"),
        (lambda: shear.press(ring(), Tread(0.29, 7.5e7), SHEAR, 0.02), "h_0"),
        (lambda: shear.fit_edges(ring(), TREAD, SHEAR, np.array([[0.1, -0.1]])), "order"),
    ],
)
def test_bad_input_is_refused_by_name(call: object, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        call()  # type: ignore[operator]


def test_a_belt_that_lifts_off_is_not_one_patch() -> None:
    # a hand pulls the belt up over the middle of the contact: both sides stay on the road
    n = np.arange(61.0)
    extra = np.zeros((1, 61, 3), dtype=complex)
    extra[0, :, 0] = -4e3 * np.exp(-((n / 30.0) ** 2))
    with pytest.raises(ConvergenceError, match="not one patch") as caught:
        shear.press(ring(), TREAD, SHEAR, 0.03, extra=extra)
    assert isinstance(caught.value.iterate, ShearContact)
    assert caught.value.iterate.pressure.min() < 0.0


def test_what_does_not_settle_is_handed_over() -> None:
    # without friction no torque can be asked for
    with pytest.raises(ConvergenceError, match="residual") as caught:
        shear.press(ring(0.04), TREAD, Shear(2.5e7, 0.0), 0.03, torque=100.0)
    assert isinstance(caught.value.iterate, ShearContact)
    assert caught.value.residual > 0.0


def test_elements_type_is_exported_with_its_shapes() -> None:
    e = contact(0.025).elements_at(np.linspace(-0.2, 0.2, 5))
    assert isinstance(e, Elements)
    assert e.loads.shape == (1, 5, 3)
    assert e.d_loads.shape == (1, 5, 3, 7)
