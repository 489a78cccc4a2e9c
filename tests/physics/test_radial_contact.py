"""Laws of the contact through radial tread springs: balance, complementarity, anchors."""

import numpy as np
import pytest
from hypothesis import given
from scipy.optimize import fsolve

from tests.physics.radial_case import TIRE, TREAD, contacts, on_a_grid, printed_response, ring
from tirelib.core.parameters import Tire
from tirelib.physics.contact.fourier import evaluate
from tirelib.physics.contact.free_boundary import Start
from tirelib.physics.contact.radial import RadialContact, fit_edges, load, press

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
        fz, edges = on_a_grid(lam, 0.03, size)
        step = 1.0 / (size - 1)
        np.testing.assert_allclose(edges, exact.edges[0], atol=step)
        error.append(abs(fz / exact.load[0] - 1) / step**2)
    # the error's factor hangs on where the edges fall between nodes
    assert max(error) < 25.0


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
    amplitude, lag, n = printed_response(lam, n_modes)
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


@given(contacts())
def test_a_start_nearby_or_useless_changes_nothing(contact: RadialContact) -> None:
    """Edges within 1e-9 rad are what the tolerance of a solution leaves."""
    plain = load(contact.compliance, contact.tread, 0.9 * contact.load)
    nowhere = Start(contact.edges + 1.0, 9.0 * contact.deflection, np.nan * contact.delta)
    two = contact.start.tiled(2)
    for start in (contact.start, nowhere, two):
        found = load(contact.compliance, contact.tread, 0.9 * contact.load, start=start)
        np.testing.assert_allclose(found.edges, plain.edges, atol=5e-9)
        np.testing.assert_allclose(found.deflection, plain.deflection, rtol=5e-9)
        np.testing.assert_allclose(found.load, plain.load, rtol=5e-9)
    again = load(contact.compliance, contact.tread, contact.load, start=contact.start)
    assert again.iterations <= plain.iterations
