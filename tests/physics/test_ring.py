"""Laws of the rolling ring: inextensible, Bernoulli-Euler, as in the dissertation's chapter 6."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse.linalg import spsolve

from tirelib.core.parameters import read_tire
from tirelib.physics.contact.fourier import evaluate, load_harmonics
from tirelib.physics.ring.compliance import compliance
from tirelib.physics.ring.ring import Ring, plain_stiffness

TIRE = read_tire("table-6-1").tire
RING = replace(Ring.of(TIRE, TIRE.pressure), damping=0.0)

rings = st.builds(
    Ring,
    radius=st.floats(0.15, 0.6),
    bending_stiffness=st.floats(0.2, 20.0),
    mass=st.floats(0.5, 10.0),
    inflation=st.floats(0.0, 8e4),
    radial_stiffness=st.floats(5e4, 3e6),
    tangential_stiffness=st.floats(1e4, 1e6),
)
speeds = st.floats(-400.0, 400.0)


@given(rings, speeds)
def test_without_damping_the_ring_answers_alike_at_every_speed(ring: Ring, omega: float) -> None:
    """(M_n - G_n) / k_n(0) = 1, errata of Eq. (85): the tension holds its centrifugal part."""
    still, rolling = compliance(ring, 0.0, 40), compliance(ring, omega, 40)
    # (1 - n^2)^2 - (1 + n^2)^2 + 4 n^2 is a sum of whole numbers: exactly zero
    np.testing.assert_allclose(rolling.matrix, still.matrix, rtol=1e-13, atol=0)


def test_printed_stiffness_without_centrifugal_tension_would_have_a_critical_speed() -> None:
    n = np.arange(1.0, 61.0)
    k = plain_stiffness(RING, 60)[0, 1:]
    inertia = TIRE.mass * (
        -((1 + n**2) ** 2) + 4 * n**2
    )  # of Eq. (89), the tension's part left out
    assert ((k + inertia * 300.0**2) < 0).any()
    assert np.all(compliance(RING, 300.0, 60).radial[0, 1:].real > 0)


def fourier_operator(symbol: np.ndarray) -> np.ndarray:
    """Matrix of a multiplier on point values."""
    identity = np.eye(symbol.size)
    return np.fft.ifft(symbol[:, None] * np.fft.fft(identity, axis=0), axis=0).real


@pytest.mark.parametrize("omega", [0.0, 59.0, -80.0])
def test_modal_sum_solves_equation_76_in_the_road_frame(omega: float) -> None:
    """Collocation of the corrected Eq. (76) with d/dt = Omega d/dphi and dense matrices."""
    size, lam = 96, 0.06
    ring = replace(RING, damping=lam)
    r, m = TIRE.ring_radius, TIRE.mass
    phi = np.arange(size) * 2 * np.pi / size
    n = np.fft.fftfreq(size, 1.0 / size)
    n[size // 2] = 0.0
    first, one = fourier_operator(1j * n), np.eye(size)
    second = first @ first
    static = _printed_stiffness(n)
    damper = fourier_operator(2 * lam * np.sqrt(m * (1 + n**2) * static) * 1j * n * omega)
    pb, ei = TIRE.pressure * TIRE.belt_width, TIRE.bending_stiffness
    tension = pb * r + m * r**2 * omega**2
    left = (
        -ei / r**4 * (second + 2 * second @ second + second @ second @ second)
        + tension / r**2 * (one + 2 * second + second @ second)
        - pb / r * (one + second)
        + damper
        - TIRE.radial_stiffness * second
        + TIRE.tangential_stiffness * one
        + m * omega**2 * (second - second @ second - 4 * second + second - one)
    )
    q_u = -3e4 * np.exp(2 * np.cos(phi - 0.3) - 2) * (1 + 0.4 * np.sin(3 * phi))
    q_v = 4e3 * np.exp(np.cos(phi + 1.0) - 1)
    q_beta = 30.0 * np.cos(2 * phi - 0.4) + 10 * np.sin(5 * phi)
    v = np.linalg.solve(left, q_v + first @ q_u + (q_beta + second @ q_beta) / r)
    u = -first @ v
    beta = (v - first @ u) / r

    modes = 40
    loads = np.stack(
        [load_harmonics(phi[None], q[None] * 2 * np.pi / size, modes) for q in (q_u, q_v, q_beta)],
        axis=-1,
    )
    found = (compliance(ring, omega, modes).matrix @ loads[..., None])[..., 0]
    for i, expected in enumerate((u, v, beta)):
        got = evaluate(found[..., i], phi)[0]
        # sixth derivatives on 96 points cost some seven digits
        np.testing.assert_allclose(got, expected, atol=1e-9 * np.abs(expected).max())


def _printed_stiffness(n: np.ndarray) -> np.ndarray:
    """k_n of Eq. (85) at rest, written from the print."""
    r, pb = TIRE.ring_radius, TIRE.pressure * TIRE.belt_width
    bending = TIRE.bending_stiffness / r**4 * n**2 + pb * r / r**2
    return (
        bending * (1 - n**2) ** 2
        - pb / r * (1 - n**2)
        + TIRE.tangential_stiffness
        + TIRE.radial_stiffness * n**2
    )


def test_static_ring_is_the_least_energy_of_a_finite_difference_ring() -> None:
    """Energies of bending, tension, pressure and sidewall on grids of 360 and 720 points."""
    found, expected = [], []
    for size in (360, 720):
        h = 2 * np.pi / size
        phi = np.arange(size) * h
        q = 3e4 * np.exp(-((phi - np.pi) ** 2) / 0.1)  # inward, about the bottom at pi
        modal = compliance(RING, 0.0, 80).radial * load_harmonics(phi[None], -q[None] * h, 80)
        found.append(_least_energy(size, -q)[:: size // 360])
        expected.append(evaluate(modal, phi)[0][:: size // 360])
    scale = np.abs(expected[0]).max()
    coarse, fine = (np.abs(u - e).max() / scale for u, e in zip(found, expected, strict=True))
    assert fine < 1e-4
    assert coarse / fine == pytest.approx(4.0, rel=0.03)  # second order
    extrapolated = (4 * found[1] - found[0]) / 3
    # fourth order is left, and the rounding of sixth differences on 720 points
    np.testing.assert_allclose(extrapolated, expected[1], atol=1e-5 * scale)


def _least_energy(size: int, q_u: np.ndarray) -> np.ndarray:
    """Radial displacement at the nodes; v stands on the half nodes, u = -v' is central."""
    r, pb = TIRE.ring_radius, TIRE.pressure * TIRE.belt_width
    h = 2 * np.pi / size
    one = sp.identity(size, format="csr")
    back = sp.csr_matrix(np.roll(np.eye(size), 1, axis=1).T)  # value of the node before
    to_nodes = (one - back) / h  # d/dphi from half nodes to nodes
    to_halves = (back.T - one) / h
    u = -to_nodes
    beta = (one - to_halves @ u) / r
    bend = to_nodes @ beta / r
    stretch = pb * r * beta.T @ beta  # tension p b R
    push = pb / r * (one - to_nodes.T @ to_nodes)  # follower pressure
    energy = (
        TIRE.bending_stiffness * bend.T @ bend
        + stretch
        - push
        + TIRE.radial_stiffness * u.T @ u
        + TIRE.tangential_stiffness * one
    )
    return u @ spsolve(energy.tocsc(), u.T @ q_u)


@given(rings)
def test_a_free_ring_buckles_at_the_classical_line_load(ring: Ring) -> None:
    """P b = -EI (n^2 - 1) / R^3, where bending and pressure cancel."""
    n = np.arange(2.0, 13.0)
    ku, kv = ring.radial_stiffness, ring.tangential_stiffness
    bending, loaded = (
        plain_stiffness(replace(ring, inflation=p), 12)[0, 2:] - (kv + ku * n**2) for p in (0, 1e4)
    )
    buckling = -bending * 1e4 / (loaded - bending)
    # k_u n^2 is subtracted from up to 1e3 times more than what is left of it
    np.testing.assert_allclose(
        buckling, -ring.bending_stiffness * (n**2 - 1) / ring.radius**3, rtol=1e-6
    )


def test_buckling_load_of_the_table_6_1_tire() -> None:
    n, small = 2, replace(RING, radial_stiffness=1e-6, tangential_stiffness=0.0)
    slope = plain_stiffness(replace(small, inflation=1.0), n) - plain_stiffness(
        replace(small, inflation=0.0), n
    )
    zero = -plain_stiffness(replace(small, inflation=0.0), n)[0, n] / slope[0, n]
    assert zero == pytest.approx(-127.111, abs=6e-4)


@given(rings, speeds)
def test_a_shift_of_the_rim_meets_pi_r_times_both_stiffnesses(ring: Ring, omega: float) -> None:
    """Eq. (112) with pi R, not 2 pi: q_u = q cos(phi) is a force pi R q and shifts the belt."""
    shift = compliance(ring, omega, 3).radial[0, 1].real
    force = np.pi * ring.radius
    expected = np.pi * ring.radius * (ring.radial_stiffness + ring.tangential_stiffness)
    assert force / shift == pytest.approx(expected, rel=1e-12)


@given(rings, speeds, st.floats(0.001, 0.3))
def test_damping_only_takes_energy(ring: Ring, omega: float, lam: float) -> None:
    """A harmonic in steady rolling lags, never leads, and by the angle of Eq. (89)."""
    radial = compliance(replace(ring, damping=lam), omega, 20).radial[0, 1:]
    n = np.arange(1.0, 21.0)
    k = plain_stiffness(ring, 20)[0, 1:]
    c = 2 * lam * np.sqrt(ring.mass * (1 + n**2) * k)
    amplitude = n**2 / np.hypot(k, n * omega * c)
    np.testing.assert_allclose(np.abs(radial), amplitude, rtol=1e-12)
    np.testing.assert_allclose(np.angle(radial), -np.arctan2(n * omega * c, k), atol=1e-13)


def test_inextensible_belt_keeps_its_length_and_its_normals() -> None:
    matrix = compliance(RING, 59.0, 30).matrix[0]
    n = np.arange(31.0)[:, None]
    u, v, beta = matrix[:, 0], matrix[:, 1], matrix[:, 2]
    np.testing.assert_allclose(u + 1j * n * v, 0, atol=1e-20)
    np.testing.assert_allclose(TIRE.ring_radius * beta - v + 1j * n * u, 0, atol=1e-18)
