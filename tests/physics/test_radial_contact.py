"""Laws of the contact through radial tread springs: balance, complementarity, limits, anchors."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import fsolve, nnls

from tirelib.contact.fourier import evaluate
from tirelib.contact.radial import RadialContact, fit_edges, load, press
from tirelib.contact.tread import Tread
from tirelib.errors import ConvergenceError, ParameterError
from tirelib.parameters import Tire, read_tire
from tirelib.ring.compliance import Compliance, compliance
from tirelib.ring.ring import Ring, plain_stiffness

TIRE = read_tire("table-6-1").tire
TREAD = Tread.of(TIRE)


def ring(lam: float = 0.04, omega: float = 59.0, n_modes: int = 60) -> Compliance:
    return compliance(replace(Ring.of(TIRE, TIRE.pressure), damping=lam), omega, n_modes)


@st.composite
def tires(draw: st.DrawFn) -> Tire:
    """Tires around all those of the dissertation's tables."""
    tread = draw(st.floats(0.006, 0.02))
    radius = draw(st.floats(0.25, 0.4))
    return TIRE.changed(
        ring_radius=radius,
        free_radius=radius + tread,
        tread_thickness=tread,
        bending_stiffness=draw(st.floats(0.7, 6.0)),
        radial_stiffness=draw(st.floats(2e5, 1.5e6)),
        tangential_stiffness=draw(st.floats(0.0, 5e5)),
        tread_stiffness=draw(st.floats(3e7, 1.5e8)),
        tread_hardening=draw(st.sampled_from([0.0, 2.0])),
        damping=draw(st.floats(0.0, 0.12)),
    )


@st.composite
def contacts(draw: st.DrawFn) -> RadialContact:
    tire = draw(tires())
    pressure = draw(st.floats(1.0e5, 3.0e5))
    omega = draw(st.floats(0.0, 120.0))
    share = draw(st.floats(0.015, 0.13))
    return press(
        compliance(Ring.of(tire, pressure), omega, 60), Tread.of(tire), share * tire.free_radius
    )


ANCHORS = [  # d0 [mm], Omega, lambda, lead, trail [rad], Fz [N], q centre, q max [N/m], centre [mm]
    (25, 0, 0.0, 0.2380, 0.2380, 5127.5, 40777, 41331, 0.00),
    (25, 59, 0.0, 0.2380, 0.2380, 5127.5, 40777, 41331, 0.00),
    (25, 59, 0.04, 0.2413, 0.2347, 5128.7, 40787, 41812, -1.44),
    (25, 59, 0.09, 0.2454, 0.2305, 5133.7, 40828, 42489, -3.24),
    (35, 0, 0.0, 0.3107, 0.3107, 7944.4, 48524, 48524, 0.00),
    (35, 59, 0.0, 0.3107, 0.3107, 7944.4, 48524, 48524, 0.00),
    (35, 59, 0.04, 0.3144, 0.3070, 7946.1, 48534, 48549, -1.68),
    (45, 0, 0.0, 0.3788, 0.3788, 11174.6, 56922, 56922, 0.00),
    (45, 59, 0.0, 0.3788, 0.3788, 11174.6, 56922, 56922, 0.00),
    (45, 59, 0.04, 0.3827, 0.3748, 11176.6, 56932, 56940, -1.86),
]


@pytest.mark.parametrize("row", ANCHORS, ids=str)
def test_anchors_of_another_solver(row: tuple[float, ...]) -> None:
    """200 modes there. Its edges lie on 401 nodes and are rounded to 1e-4 rad."""
    d0, omega, lam, lead, trail, fz, centre, highest, moved = row
    contact = press(ring(lam, omega, 200), TREAD, d0 / 1e3, n_nodes=60)
    np.testing.assert_allclose(contact.edges[0], [-lead, trail], atol=1.5e-4)
    assert contact.load[0] == pytest.approx(fz, rel=1e-3)
    phi = np.linspace(*contact.edges[0], 4001)
    q = contact.pressure_at(phi)[0]
    assert q[2000] == pytest.approx(centre, rel=1e-3)
    assert q.max() == pytest.approx(highest, rel=1e-3)
    assert 1e3 * contact.pressure_centre[0] == pytest.approx(moved, abs=0.02)


@given(contacts())
def test_pressure_inside_clearance_outside(contact: RadialContact) -> None:
    """Complementarity on a fine grid round the whole wheel."""
    phi = np.linspace(-1.5, 1.5, 3001)
    delta, inside = contact.compression(phi)[0], contact.pressure_at(phi)[0] != 0
    peak = delta.max()
    assert (delta[inside] >= -1e-6 * peak).all()
    assert (delta[~inside] <= 1e-6 * peak).all()
    assert (contact.pressure > 0).all()
    at_edges = contact.compression(contact.edges)
    # 20 s^2 of angle are left at a last shift s = 5e-6; the slope there is some 10 peaks a radian
    assert np.abs(at_edges).max() < 1e-7 * peak


@given(contacts())
def test_tread_force_belongs_to_the_compression_that_the_ring_leaves(
    contact: RadialContact,
) -> None:
    """The integral equation holds at the nodes and, as a function, between them."""
    np.testing.assert_allclose(
        contact.compression(contact.phi), contact.delta, atol=1e-9 * contact.delta.max()
    )


@given(contacts())
def test_foundation_carries_the_load(contact: RadialContact) -> None:
    """Vertical balance from displacement alone: nothing but the sidewall holds the belt up."""
    tire_ring = contact.compliance
    u, v = (contact.displacement[0, 1, i] for i in range(2))
    k = (
        1.0 / tire_ring.radial[0, 1]
    )  # k_u + k_v with its damping; u = -v' gives both the same force
    radius = tire_ring.radius[0]
    np.testing.assert_allclose(u, -1j * v, rtol=1e-12)
    assert contact.load[0] == pytest.approx(-(np.pi * radius * k * u).real, rel=1e-9)
    drag = (np.pi * radius * k * u).imag
    assert contact.drag[0] == pytest.approx(-drag, abs=1e-9 * contact.load[0])


def test_resultant_of_the_sidewall_point_by_point() -> None:
    """Radial k_u u and tangential k_v v, projected and summed round the wheel, are Fz."""
    contact = press(ring(0.0), TREAD, 0.03)
    phi = np.arange(720) * np.pi / 360
    u = evaluate(contact.displacement[..., 0], phi)[0]
    v = evaluate(contact.displacement[..., 1], phi)[0]
    # phi = 0 points down: outward there is down, +phi there is sideways
    up = -TIRE.radial_stiffness * u * np.cos(phi) + TIRE.tangential_stiffness * v * np.sin(phi)
    assert up.sum() * TIRE.ring_radius * np.pi / 360 == pytest.approx(contact.load[0], rel=1e-9)


@given(contacts())
def test_load_and_deflection_are_inverse(contact: RadialContact) -> None:
    again = load(contact.compliance, contact.tread, contact.load)
    assert again.load[0] == pytest.approx(contact.load[0], rel=1e-9)
    assert again.deflection[0] == pytest.approx(contact.deflection[0], rel=1e-8)
    np.testing.assert_allclose(again.edges, contact.edges, atol=1e-7)


@given(contacts())
def test_edges_alone_give_the_deflection_back(contact: RadialContact) -> None:
    fitted = fit_edges(contact.compliance, contact.tread, contact.edges)
    assert fitted.deflection[0] == pytest.approx(contact.deflection[0], rel=1e-7)
    assert fitted.load[0] == pytest.approx(contact.load[0], rel=1e-7)
    assert abs(fitted.edge_mismatch[0]) < 1e-6 * contact.delta.max()


def test_angles_that_no_such_ring_can_have_leave_a_mismatch() -> None:
    contact = press(ring(), TREAD, 0.025)
    turned = fit_edges(ring(), TREAD, contact.edges + 0.01)
    assert turned.edge_mismatch[0] > 0.05 * contact.delta.max()  # pressed in front, pulled behind
    turned = fit_edges(ring(), TREAD, contact.edges - 0.01)
    assert turned.edge_mismatch[0] < -0.05 * contact.delta.max()


@pytest.mark.parametrize("lam", [0.0, 0.04])
def test_complementarity_solver_on_a_fixed_grid_agrees_at_second_order(lam: float) -> None:
    """No edges at all: q >= 0, gap >= 0, q gap = 0 on equidistant nodes."""
    exact = press(ring(lam), TREAD, 0.03)
    error = []
    for size in (301, 601):
        fz, edges = _on_a_grid(lam, 0.03, size)
        step = 1.0 / (size - 1)
        np.testing.assert_allclose(edges, exact.edges[0], atol=step)
        error.append(abs(fz / exact.load[0] - 1) / step**2)
    # the error's factor hangs on where the edges fall between nodes
    assert max(error) < 25.0


def _on_a_grid(lam: float, d0: float, size: int) -> tuple[float, np.ndarray]:
    phi = np.linspace(-0.5, 0.5, size)
    h = phi[1] - phi[0]
    amplitude, lag, n = _printed_response(lam, 60)
    apart = phi[:, None] - phi[None, :]
    give = sum(a * np.cos(k * apart - g) for a, g, k in zip(amplitude, lag, n, strict=True)) * h
    matrix = give + np.eye(size) / TIRE.tread_stiffness
    known = d0 - TIRE.free_radius * (1 - np.cos(phi))
    if lam == 0.0:  # least squares with q >= 0 has the same conditions
        factor = np.linalg.cholesky(matrix).T
        q = nnls(factor, np.linalg.solve(factor.T, known))[0]
    else:  # active sets, until none changes
        active, before = known > 0, None
        while before is None or (active != before).any():
            before = active
            q = np.zeros(size)
            q[active] = np.linalg.solve(matrix[np.ix_(active, active)], known[active])
            active = np.where(active, q > 0, known - matrix @ q > 0)
    pressed = phi[q > 0]
    fz = TIRE.ring_radius * h * (q * np.cos(phi)).sum()
    return fz, np.array([pressed[0] - h / 2, pressed[-1] + h / 2])


def _printed_response(lam: float, n_modes: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """n^2 A_n, n gamma_n and n of Eq. (89) at 59 rad/s, for an inward load (negative A'_n)."""
    n = np.arange(1.0, n_modes + 1)
    k = plain_stiffness(Ring.of(TIRE, TIRE.pressure), n_modes)[0, 1:]
    c = 59.0 * n * 2 * lam * np.sqrt(TIRE.mass * (1 + n**2) * k)
    return n**2 / (np.pi * np.hypot(k, c)), np.arctan2(c, k), n


@pytest.mark.parametrize("lam", [0.0, 0.04])
def test_the_dissertations_route_ends_at_the_same_contact(lam: float) -> None:
    """Matrices (93)-(96) with A'_n = -n^2 A_n, then two angles by a nonlinear solver, Eq. (97)."""
    exact = press(ring(lam, n_modes=30), TREAD, 0.03)
    angles, fz = dissertation_contact(TIRE, lam, 0.03, 30)
    np.testing.assert_allclose(angles, exact.edges[0], atol=1e-7)
    assert fz == pytest.approx(exact.load[0], rel=1e-7)


def dissertation_contact(
    tire: Tire, lam: float, d0: float, n_modes: int, sign: float = -1.0
) -> tuple[np.ndarray, float]:
    """Contact angles and load by Eq. (91)-(97)."""
    amplitude, lag, n = _printed_response(lam, n_modes)
    amplitude = sign * amplitude
    xi, weights = np.polynomial.legendre.leggauss(120)

    def solve(angles: np.ndarray) -> tuple[np.ndarray, float]:
        front, rear = angles
        phi = 0.5 * (front + rear) + 0.5 * (rear - front) * xi
        w = 0.5 * (rear - front) * weights
        cos, sin = np.cos(np.outer(n, phi)), np.sin(np.outer(n, phi))
        wave_cos = amplitude[:, None] * (
            np.cos(np.outer(n, phi) - lag[:, None]) - np.cos(n * rear - lag)[:, None]
        )
        wave_sin = amplitude[:, None] * (
            np.sin(np.outer(n, phi) - lag[:, None]) - np.sin(n * rear - lag)[:, None]
        )
        rows, waves = np.concatenate([cos, sin]) * w, np.concatenate([wave_cos, wave_sin])
        left = rows @ waves.T - np.eye(2 * n.size) / tire.tread_stiffness
        right = tire.free_radius * rows @ (np.cos(rear) - np.cos(phi))
        # the right side of (93) with q = k_t (u(phi) - u(rear) + R0 (cos phi - cos rear))
        ab = np.linalg.solve(left, right)

        def u(at: np.ndarray) -> np.ndarray:
            x = np.outer(at, n) - lag
            return np.cos(x) @ (amplitude * ab[: n.size]) + np.sin(x) @ (amplitude * ab[n.size :])

        ends = np.array([front, rear])
        rest = d0 - (tire.free_radius * (1 - np.cos(ends)) - u(ends))
        q = tire.tread_stiffness * (u(phi) + d0 - tire.free_radius * (1 - np.cos(phi)))
        return rest, tire.ring_radius * float((w * q * np.cos(phi)).sum())

    half = 0.6 * np.arccos(1 - d0 / tire.free_radius)
    angles = fsolve(lambda x: solve(x)[0], np.array([-half, half]), xtol=1e-12)
    return angles, solve(angles)[1]


def test_a_belt_that_stretches_gives_way_as_a_whole_too() -> None:
    """The mean: u (k_u - p b / R + EA / R^2) = -mean pressure; zero for the dissertation's ring."""
    stretching = replace(Ring.of(TIRE, TIRE.pressure), extension_stiffness=5e5)
    contact = press(compliance(stretching, 0.0, 60), TREAD, 0.025)
    np.testing.assert_allclose(contact.compression(contact.phi), contact.delta, atol=1e-12)
    mean = (contact.weights * contact.pressure).sum() / (2 * np.pi)
    r, line = TIRE.ring_radius, TIRE.pressure * TIRE.belt_width
    hold = TIRE.radial_stiffness - line / r + 5e5 / r**2
    assert contact.displacement[0, 0, 0].real == pytest.approx(-mean / hold, rel=1e-9)
    stiff = press(ring(0.0), TREAD, 0.025)
    assert stiff.displacement[0, 0, 0] == 0
    assert contact.load[0] < stiff.load[0]


def test_modes_and_nodes_converge() -> None:
    """Fz for 30, 60, 120 modes as in the errata; nodes converge faster than any power."""
    fz = [press(ring(n_modes=n), TREAD, 0.025).load[0] for n in (30, 60, 120)]
    np.testing.assert_allclose(fz, [5129.40, 5128.73, 5128.73], atol=0.02)
    for d0 in (0.01, 0.025, 0.045):
        best = press(ring(), TREAD, d0, n_nodes=120).load[0]
        error = [abs(press(ring(), TREAD, d0, n_nodes=n).load[0] / best - 1) for n in (12, 20, 40)]
        assert error[0] < 1e-4
        assert error[1] < 1e-6
        assert error[2] < 1e-9  # the stopping tolerance; a uniform grid of 200 is at 1e-4


def test_forty_gauss_nodes_beat_two_hundred_uniform_ones() -> None:
    best = press(ring(), TREAD, 0.03, n_nodes=120).load[0]
    gauss = abs(press(ring(), TREAD, 0.03).load[0] - best)
    uniform = abs(_on_a_grid(0.04, 0.03, 301)[0] - best)  # some 200 of the 301 are in contact
    assert gauss < 1e-4 * uniform


@given(st.floats(0.005, 0.045), st.floats(1.0, 150.0))
def test_without_damping_speed_changes_nothing(d0: float, omega: float) -> None:
    still, rolling = press(ring(0.0, 0.0), TREAD, d0), press(ring(0.0, omega), TREAD, d0)
    assert rolling.load[0] == pytest.approx(still.load[0], rel=1e-10)
    np.testing.assert_allclose(rolling.edges, still.edges, atol=1e-10)
    np.testing.assert_allclose(still.edges[0, 0], -still.edges[0, 1], rtol=1e-9)


def test_damping_moves_the_pressure_to_the_entry() -> None:
    lam = np.linspace(0.0, 0.12, 7)
    wheel = replace(Ring.of(TIRE, TIRE.pressure), damping=lam)
    contact = press(compliance(wheel, 59.0, 60), TREAD, 0.03)
    assert abs(contact.pressure_centre[0]) < 1e-9
    assert (np.diff(contact.pressure_centre) < -1e-4).all()
    assert (np.diff(contact.edges, axis=0) < 0).all()
    back = press(compliance(wheel, -59.0, 60), TREAD, 0.03)
    np.testing.assert_allclose(back.pressure_centre, -contact.pressure_centre, atol=1e-9)
    np.testing.assert_allclose(back.edges[:, ::-1], -contact.edges, atol=1e-9)


def test_more_load_makes_a_longer_patch_and_a_deeper_one() -> None:
    contact = load(ring(), TREAD, np.linspace(300, 11000, 30))
    assert (np.diff(contact.deflection) > 0).all()
    assert (np.diff(contact.edges[:, 1] - contact.edges[:, 0]) > 0).all()


def test_more_pressure_makes_a_shorter_patch_at_equal_load() -> None:
    for name in ("table-6-2-195-65r15", "jenkins"):
        tire = read_tire(name).tire
        wheel = Ring.of(tire, np.linspace(1.3e5, 2.5e5, 7))
        contact = load(compliance(wheel, 59.0, 60), Tread.of(tire), 4266.0)
        assert (np.diff(contact.deflection) < 0).all()
        assert (np.diff(contact.edges[:, 1] - contact.edges[:, 0]) < 0).all()


def test_stiff_tread_and_small_load_limits() -> None:
    """A stiff tread bends the belt onto the road; a small load presses only tread and belt."""
    soft, stiff = (
        press(ring(), replace(TREAD, normal_stiffness=k), 0.02).load[0] for k in (3e7, 3e8)
    )
    assert soft < stiff
    d0 = np.array([1e-9, 1e-8, 1e-7])
    tiny = press(ring(), TREAD, d0)
    half = np.sqrt(2 * d0 / TIRE.free_radius)  # a parabola of pressure on a belt that stays round
    expected = TIRE.ring_radius * TIRE.tread_stiffness * 4 / 3 * d0 * half
    # the belt gives way by some C Fz / d0, which falls as the root of d0
    share = 1 - tiny.load / expected
    assert share[0] < 0.03
    np.testing.assert_allclose(share[1:] / share[:-1], np.sqrt(10.0), rtol=0.15)


@pytest.mark.parametrize("given_load", [True, False])
def test_sidewall_softens_with_the_deflection_that_it_yields(given_load: bool) -> None:
    """Eq. (54): the ring at the solution is the ring of the solution's own deflection."""
    tire = TIRE.changed(radial_deflection_rate=-12.0)
    wheel = Ring.of(tire, tire.pressure)

    def at(deflection: np.ndarray) -> Compliance:
        return compliance(Ring.of(tire, tire.pressure, deflection), 59.0, 60)

    if given_load:
        contact = load(at, TREAD, np.array([1500.0, 4000.0, 7000.0]))
        np.testing.assert_allclose(contact.load, [1500.0, 4000.0, 7000.0], rtol=1e-9)
    else:
        contact = press(at, TREAD, np.array([0.01, 0.02, 0.04]))
    again = press(at(contact.deflection), TREAD, contact.deflection)
    np.testing.assert_allclose(again.load, contact.load, rtol=1e-8)
    stiffer = press(compliance(wheel, 59.0, 60), TREAD, contact.deflection)
    assert (stiffer.load > 1.05 * contact.load).all()


def test_hardening_tread_is_the_linear_one_at_first_order() -> None:
    base = load(ring(), TREAD, 4000.0)
    drop = []
    for c in (0.1, 0.2, 4.0):
        hard = load(ring(), replace(TREAD, hardening=c), 4000.0)
        drop.append(base.deflection[0] - hard.deflection[0])
        delta = hard.delta
        expected = TIRE.tread_stiffness * delta * (1 + c * delta / TIRE.tread_thickness)
        np.testing.assert_allclose(hard.pressure, expected, rtol=1e-12)
        np.testing.assert_allclose(hard.compression(hard.phi), delta, atol=1e-9 * delta.max())
    assert drop[0] > 0
    assert drop[1] / drop[0] == pytest.approx(2.0, rel=0.02)
    assert drop[2] < 40 * drop[0]


def test_other_line_loads_move_the_belt_as_the_ring_says() -> None:
    """Traction of one sign shifts the contact; its opposite mirrors it without damping."""
    extra = np.zeros((1, 61, 3), dtype=complex)
    extra[0, 1:6, 1] = 2000.0
    one = press(ring(0.0), TREAD, 0.025, extra=extra)
    other = press(ring(0.0), TREAD, 0.025, extra=-extra)
    none = press(ring(0.0), TREAD, 0.025)
    np.testing.assert_allclose(one.edges[:, ::-1], -other.edges, atol=1e-9)
    assert abs(one.pressure_centre[0]) > 1e-4
    np.testing.assert_allclose(one.compression(one.phi), one.delta, atol=1e-12)
    assert one.edges[0, 0] != pytest.approx(none.edges[0, 0], abs=1e-4)


@settings(max_examples=10)
@given(st.lists(st.floats(500.0, 9000.0), min_size=2, max_size=70))
def test_many_points_at_once_are_the_points_alone(loads: list[float]) -> None:
    together = load(ring(), TREAD, np.array(loads))
    assert len(together) == len(loads)
    for i in {0, len(loads) // 2, len(loads) - 1}:
        alone = load(ring(), TREAD, loads[i])
        assert together.deflection[i] == pytest.approx(alone.deflection[0], rel=1e-10)
        np.testing.assert_allclose(together.edges[i], alone.edges[0], atol=1e-9)


def _softening(deflection: np.ndarray) -> Compliance:
    tire = TIRE.changed(radial_deflection_rate=-99.0)
    return compliance(Ring.of(tire, tire.pressure, deflection), 59.0, 60)


@pytest.mark.parametrize(
    ("make", "parts"),
    [
        (lambda: load(ring(), TREAD, -100.0), ["vertical load = -100 N", "> 0"]),
        (lambda: load(ring(), TREAD, np.array([4000.0, np.nan])), ["vertical load = nan"]),
        (lambda: press(ring(), TREAD, 0.0), ["deflection = 0 m", "> 0"]),
        (lambda: press(ring(), TREAD, np.inf), ["deflection = inf m"]),
        (lambda: press(ring(), TREAD, np.ones((2, 2))), ["shape (2, 2)"]),
        (
            lambda: load(
                compliance(replace(Ring.of(TIRE, 1e5), damping=[0.0, 0.1]), 59.0, 60),
                TREAD,
                np.array([1e3, 2e3, 3e3]),
            ),
            ["2", "3 points"],
        ),
        (lambda: press(ring(), TREAD, 0.2), ["200.0 mm", "free radius", "metres"]),
        (lambda: press(ring(), TREAD, 25.0), ["deflection", "half of the free radius", "metres"]),
        (lambda: press(ring(), TREAD, 0.13), ["0.75 rad", "lower"]),
        (lambda: load(ring(), TREAD, 60000.0), ["0.75 rad", "lower"]),
        (lambda: load(ring(), TREAD, 1e9), ["load", "lower"]),
        (lambda: press(ring(), TREAD, 0.02, n_nodes=41), ["41 nodes", "even"]),
        (lambda: press(ring(), TREAD, 0.02, n_nodes=2), ["2 nodes", ">= 4"]),
        (lambda: fit_edges(ring(), TREAD, np.array([[0.2, -0.2]])), ["leading < trailing"]),
        (lambda: fit_edges(ring(), TREAD, np.array([-0.2, 0.2])), ["shape (2,)"]),
        (lambda: fit_edges(ring(), TREAD, np.array([[-0.2, np.nan]])), ["leading < trailing"]),
        (lambda: fit_edges(ring(), TREAD, np.array([[-0.2, 1.2]])), ["1.200 rad", "0.75"]),
        (lambda: Tread(0.3, -1.0), ["normal_stiffness = -1", "> 0"]),
        (lambda: Tread(np.array([0.3, np.nan]), 1e7), ["free_radius = nan"]),
        (lambda: Tread(0.3, 1e7, hardening=-0.5), ["hardening = -0.5", ">= 0"]),
        (
            lambda: press(ring(), TREAD, 0.02, extra=np.zeros((1, 12, 3), dtype=complex)),
            ["extra", "(1, 12, 3)", "(1, 61, 3)"],
        ),
    ],
)
def test_bad_input_is_named(make: object, parts: list[str]) -> None:
    with pytest.raises(ParameterError) as caught:
        make()  # type: ignore[operator]
    for part in parts:
        assert part in str(caught.value)


@pytest.mark.parametrize(("size", "where"), [(1e4, 0.0), (1e4, 0.1)])
def test_a_belt_that_lifts_off_is_refused_with_the_last_contact(size: float, where: float) -> None:
    """An inward pull inside the patch lifts the tread there: two patches, which this is not."""
    n = np.arange(61)
    extra = np.zeros((1, 61, 3), dtype=complex)
    extra[0, :, 0] = -size * np.exp(-0.001 * n**2) * np.exp(-1j * n * where)
    with pytest.raises(ConvergenceError) as caught:
        press(ring(), TREAD, 0.02, extra=extra)
    assert isinstance(caught.value.iterate, RadialContact)
    assert caught.value.residual > 1e-6
    assert "not one patch" in str(caught.value) or "still change" in str(caught.value)
