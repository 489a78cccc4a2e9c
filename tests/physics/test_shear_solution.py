"""Friction, solution and refusals of the contact with shear, and an independent solution."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import root

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
from tirelib.core.errors import ConvergenceError, ParameterError
from tirelib.physics.contact import radial, shear
from tirelib.physics.contact.shear import Shear, ShearContact
from tirelib.physics.contact.shear_law import Elements
from tirelib.physics.contact.tread import Tread
from tirelib.physics.ring.compliance import Compliance, compliance

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
    # where the limit lies is Newton's to find; what is clearly beyond is refused before
    with pytest.raises(ConvergenceError):
        shear.load(ring(0.04), TREAD, SHEAR, 6000.0, torque=1215.0)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_torque_beyond_friction_is_refused_with_its_limit(sign: float) -> None:
    torque = sign * np.array([100.0, 1300.0])
    with pytest.raises(ParameterError, match=r"point 1: torque = .*1300 N m.*mu Fz R_l = 11\d\d N"):
        shear.load(ring(0.04), TREAD, SHEAR, 6000.0 + 0 * torque, torque=torque)
    with pytest.raises(ParameterError, match=r"mu Fz R_l = 0 N m"):
        shear.press(ring(0.04), TREAD, Shear(2.5e7, 0.0), 0.03, torque=sign * 100.0)


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


def test_edges_may_be_a_list() -> None:
    c = contact(0.035, 0.04)
    fitted = shear.fit_edges(ring(0.04), TREAD, SHEAR, c.edges.tolist())
    assert fitted.deflection == pytest.approx(c.deflection, abs=1e-10)


def test_a_callable_ring_of_one_row_serves_many_loads() -> None:
    given = np.array([2000.0, 4000.0, 6000.0])
    called = shear.load(lambda _: ring(0.04), TREAD, SHEAR, given)
    assert called.deflection == pytest.approx(
        shear.load(ring(0.04), TREAD, SHEAR, given).deflection, rel=1e-9
    )


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
        (lambda: shear.load(ring(), TREAD, SHEAR, 90000.0), r"carries 0 to about \d+"),
        (lambda: shear.load(ring(), TREAD, SHEAR, np.array([5e3, -1.0])), "at point 1"),
        (lambda: shear.load(ring(), TREAD, SHEAR, "4 kN"), "vertical load is '4 kN'.*number"),
        (lambda: Shear("soft"), "stiffness is 'soft'.*number"),
        (
            lambda: shear.load(ring(), Tread(R + H0, 7.5e7, 4e-4), SHEAR, np.array([500.0, 6e3])),
            r"point 1 at Fz = 6000 N.*pressed by 0\.\d+ mm.*thickness 0\.4 mm",
        ),
        (lambda: shear.press(ring(), TREAD, SHEAR, 0.02, torque=np.inf), "torque = inf"),
        (lambda: shear.press(ring(), TREAD, SHEAR, np.full((2, 2), 0.02)), "shape"),
        (lambda: shear.press(ring(), TREAD, Shear(np.ones(3)), np.full(2, 0.02)), "points"),
        (lambda: Shear(-1.0), "stiffness = -1"),
        (lambda: Shear(np.inf), "stiffness = inf"),
        (lambda: Shear(1.0, np.nan), "friction = nan"),
        (lambda: shear.press(ring(), Tread(0.29, 7.5e7), SHEAR, 0.02), "h_0"),
        (lambda: shear.fit_edges(ring(), TREAD, SHEAR, np.array([[0.1, -0.1]])), "order"),
        (lambda: shear.fit_edges(ring(), TREAD, SHEAR, [0.1, 0.2]), r"shape \(2,\)"),
    ],
)
def test_bad_input_is_refused_by_name(call: object, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        call()


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
    # a torque that friction just does not hold
    with pytest.raises(ConvergenceError, match="residual") as caught:
        shear.load(ring(0.04), TREAD, SHEAR, 6000.0, torque=1215.0)
    assert isinstance(caught.value.iterate, ShearContact)
    assert caught.value.residual > 0.0


def test_elements_type_is_exported_with_its_shapes() -> None:
    e = contact(0.025).elements_at(np.linspace(-0.2, 0.2, 5))
    assert isinstance(e, Elements)
    assert e.loads.shape == (1, 5, 3)
    assert e.d_loads.shape == (1, 5, 3, 7)
