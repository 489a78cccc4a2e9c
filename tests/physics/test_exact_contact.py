"""Laws of the geometrically exact ring on the road."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import simpson

from tirelib.core.errors import ConvergenceError, ParameterError
from tirelib.core.parameters import read_tire
from tirelib.physics.contact import exact, radial
from tirelib.physics.contact import exact_energy as energy
from tirelib.physics.contact.exact import load_exact
from tirelib.physics.contact.tread import Tread
from tirelib.physics.ring.compliance import compliance
from tirelib.physics.ring.ring import Ring

RING = Ring(
    radius=0.302,
    bending_stiffness=1.8,
    mass=3.3,
    inflation=2.1e5 * 0.165,
    radial_stiffness=4.5e5,
    tangential_stiffness=1.6e5,
)
TREAD = Tread(free_radius=0.3155, normal_stiffness=8.5e7, thickness=0.012)
LOADS = np.array([1500.0, 3000.0, 4500.0, 6000.0, 7500.0])
PHI = np.linspace(-np.pi, np.pi, 720, endpoint=False)


def test_a_small_load_gives_the_linear_ring() -> None:
    """The difference falls with the load: it is of second order in the displacement."""
    still = compliance(RING, 0.0, energy.N_MODES)
    errors = []
    for load in (100.0, 300.0, 900.0):
        linear = radial.load(still, TREAD, load).deflection[0]
        errors.append(abs(load_exact(RING, TREAD, load).deflection[0] / linear - 1.0))
    assert errors[0] < 3e-3
    assert errors[0] < errors[1] < errors[2]


def test_a_large_load_does_not() -> None:
    still = compliance(RING, 0.0, energy.N_MODES)
    linear = radial.load(still, TREAD, 7500.0).deflection[0]
    assert load_exact(RING, TREAD, 7500.0).deflection[0] > 1.05 * linear


def test_the_load_is_the_slope_of_the_energy() -> None:
    """Work of the load between two deflections equals the integral of load over deflection."""
    loads = np.linspace(3000.0, 3400.0, 9)
    solved = load_exact(RING, TREAD, loads)
    energy = _energy(solved)
    work = simpson(loads, x=solved.deflection)
    assert energy[-1] - energy[0] == pytest.approx(work, rel=5e-5)  # the edge lies between nodes


def _energy(solved: exact.ExactContact) -> np.ndarray:
    """Return the stored energy, integrated over angle on a fine grid, [J]."""
    phi = np.linspace(0.0, np.pi, 20001)
    basis = energy.basis(phi)
    x = np.concatenate([solved.even, solved.odd[:, 1:]], axis=1)
    u, v, e, c, da, dc = np.moveaxis(np.einsum("pid,nd->npi", basis, x), -1, 0)
    r, pb = 0.302, 2.1e5 * 0.165
    a = r + e
    q = a**2 + c**2
    stretch = np.sqrt(q) / r - 1.0
    bend = (a * dc - c * da) / q
    lean = phi - np.arctan2(c, a)
    h = 0.3155 - r
    tip = (r + u) * np.cos(phi) - v * np.sin(phi) + h * np.cos(lean)
    delta = np.maximum(tip - (0.3155 - solved.deflection[:, None]), 0.0)
    density = (
        r * (pb * r * stretch + 0.5 * exact.INEXTENSIBLE * stretch**2)
        + 0.5 * 1.8 * bend**2 / r
        + 0.5 * r * (4.5e5 * u**2 + 1.6e5 * v**2)
        - 0.5 * pb * ((r + u) * a - v * c)
        + 0.5 * r * 8.5e7 * delta**2
    )
    return 2.0 * np.trapezoid(density, phi, axis=1)


def test_the_inextensible_belt_keeps_its_length() -> None:
    solved = load_exact(RING, TREAD, LOADS)
    phi = np.linspace(0.0, np.pi, 4001)
    x = np.concatenate([solved.even, solved.odd[:, 1:]], axis=1)
    local = np.einsum("pid,nd->npi", energy.basis(phi), x)
    stretch = np.hypot(0.302 + local[..., 2], local[..., 3]) / 0.302 - 1.0
    assert np.abs(stretch).max() < 5e-4


def test_the_belt_is_flat_on_the_road() -> None:
    """In a long patch the middle has lost its curvature: the strain there is -y / R or more."""
    solved = load_exact(RING, TREAD, 7500.0)
    strain = solved.strain(-0.0033, np.array([0.0]))[0, 0]
    assert strain == pytest.approx(0.0033 / 0.302, rel=0.06)


def test_more_modes_and_nodes_change_little(monkeypatch: pytest.MonkeyPatch) -> None:
    coarse = load_exact(RING, TREAD, LOADS).deflection
    monkeypatch.setattr(energy, "N_MODES", 72)
    monkeypatch.setattr(energy, "N_PATCH", 110)
    for cached in (energy.quadrature, energy.basis_at_nodes, energy.fine):
        cached.cache_clear()
    fine = load_exact(RING, TREAD, LOADS).deflection
    monkeypatch.undo()
    for cached in (energy.quadrature, energy.basis_at_nodes, energy.fine):
        cached.cache_clear()
    np.testing.assert_allclose(coarse, fine, rtol=3e-4)


def test_the_filtered_strain_is_resolved_below_the_noise(monkeypatch: pytest.MonkeyPatch) -> None:
    """The contact's ends bend the belt over centimetres: too few modes ring all round the turn."""

    def strain() -> np.ndarray:
        waves = np.fft.rfft(load_exact(RING, TREAD, LOADS).strain(-0.0033, PHI))
        order = np.arange(waves.shape[1])
        return np.fft.irfft(waves * np.exp(-0.5 * (order / 24.0) ** 2), PHI.size)

    usual = strain()
    for name, value in (("N_MODES", 96), ("N_PATCH", 140), ("N_REST", 140)):
        monkeypatch.setattr(energy, name, value)
    for cached in (energy.quadrature, energy.basis_at_nodes, energy.fine):
        cached.cache_clear()
    fine = strain()
    monkeypatch.undo()
    for cached in (energy.quadrature, energy.basis_at_nodes, energy.fine):
        cached.cache_clear()
    assert np.sqrt(np.mean((usual - fine) ** 2, axis=1)).max() < 2e-6  # with 48 modes 8e-6
    assert np.abs(fine).max() > 1e-3


def test_a_softer_belt_in_tension_deflects_more() -> None:
    stiff = load_exact(RING, TREAD, LOADS).deflection
    soft = load_exact(replace(RING, extension_stiffness=2e6), TREAD, LOADS).deflection
    assert (soft > stiff).all()


def test_many_points_are_solved_as_one() -> None:
    together = load_exact(RING, TREAD, LOADS)
    alone = [load_exact(RING, TREAD, load).deflection[0] for load in LOADS]
    np.testing.assert_allclose(together.deflection, alone, rtol=1e-9)


@pytest.mark.parametrize("load", [0.0, -100.0, np.nan])
def test_a_load_that_is_none_is_refused(load: float) -> None:
    with pytest.raises(ParameterError, match="load"):
        load_exact(RING, TREAD, load)


def test_what_is_no_number_or_out_of_range_is_refused_with_its_point() -> None:
    with pytest.raises(ParameterError, match="load = -1 N at point 1"):
        load_exact(RING, TREAD, np.array([3000.0, -1.0]))
    with pytest.raises(ParameterError, match="load is 'heavy'"):
        load_exact(RING, TREAD, "heavy")
    with pytest.raises(ParameterError, match=r"point 1 at 5 N .* half angle of 0.0\d+ rad"):
        load_exact(RING, TREAD, np.array([3000.0, 5.0]))
    thin = replace(TREAD, thickness=3e-4)
    with pytest.raises(ParameterError, match=r"point 1 at Fz = 3000 N.*thickness 0.3 mm"):
        load_exact(RING, thin, np.array([500.0, 3000.0]))
    with pytest.raises(ParameterError, match="outside the belt"):
        load_exact(RING, replace(TREAD, free_radius=0.3), 3000.0)
    with pytest.raises(ConvergenceError, match=r"point 1 at 40000 N.*carries 0 to about \d+ N"):
        load_exact(RING, TREAD, np.array([3000.0, 40000.0]))


def test_twenty_newton_are_still_resolved(monkeypatch: pytest.MonkeyPatch) -> None:
    """Against twice the modes and nodes: deflection 0.13 %, half angle 0.4 %, pressure 1.0 %."""
    middle = np.zeros(1)
    coarse = load_exact(RING, TREAD, 20.0)
    for name, value in (("N_MODES", 96), ("N_PATCH", 128), ("N_REST", 120)):
        monkeypatch.setattr(energy, name, value)
    for cached in (energy.quadrature, energy.basis_at_nodes, energy.fine):
        cached.cache_clear()
    fine = load_exact(RING, TREAD, 20.0)
    found = fine.deflection, fine.half_angle, fine.pressure_at(middle)[:, 0]
    monkeypatch.undo()
    for cached in (energy.quadrature, energy.basis_at_nodes, energy.fine):
        cached.cache_clear()
    was = coarse.deflection, coarse.half_angle, coarse.pressure_at(middle)[:, 0]
    for one, other, most in zip(was, found, (2e-3, 6e-3, 1.5e-2), strict=True):
        np.testing.assert_allclose(one, other, rtol=most)


def test_the_pressure_carries_the_load() -> None:
    solved = load_exact(RING, TREAD, LOADS)
    phi = np.linspace(-0.5, 0.5, 8001)
    q = solved.pressure_at(phi)
    # per length of belt along the deformed normal; the road is flat, so all of it is vertical
    np.testing.assert_allclose(
        np.trapezoid(q, phi, axis=1) * 0.302, LOADS, rtol=4e-3
    )  # the edge lies between its nodes: 0.26 %
    edge = solved.compression(solved.half_angle[:, None] * np.ones(1))
    assert np.abs(np.diagonal(edge)).max() < 1e-6


def test_a_shear_flexible_belt_is_refused() -> None:
    with pytest.raises(ParameterError, match="shear stiffness"):
        load_exact(replace(RING, shear_stiffness=7e4), TREAD, 4000.0)


def test_the_energys_slope_is_its_difference() -> None:
    """And the Newton matrix that of the slope: both by differences in random directions."""
    rng = np.random.default_rng(1)
    solved = load_exact(replace(RING, extension_stiffness=4e6), TREAD, LOADS[[0, 3]])
    x, d0, k = solved.coefficients, solved.deflection, solved.constants
    step = rng.standard_normal(x.shape) / (1.0 + np.arange(x.shape[1]) % 49) ** 2
    h = 1e-7
    ends = [energy.residual(x + s * h * step, d0 + s * h, k) for s in (-1.0, 1.0)]
    found = (energy.jacobian(x, d0, k) @ np.c_[step, np.ones(2)][..., None])[..., 0]
    expected = (ends[1] - ends[0]) / (2.0 * h)
    np.testing.assert_allclose(found, expected, atol=1e-5 * np.abs(expected).max())


def test_a_solution_nearby_is_a_start_that_changes_nothing() -> None:
    near = load_exact(RING, TREAD, LOADS)
    loads = 1.05 * LOADS
    cold = load_exact(RING, TREAD, loads)
    warm = load_exact(RING, TREAD, loads, start=near)
    np.testing.assert_allclose(warm.deflection, cold.deflection, atol=2e-9)
    np.testing.assert_allclose(warm.strain(-0.003, PHI), cold.strain(-0.003, PHI), atol=1e-8)


def test_a_start_for_other_points_is_refused() -> None:
    solved = load_exact(RING, TREAD, LOADS[:2])
    with pytest.raises(ParameterError, match="2 points for 3 loads"):
        load_exact(RING, TREAD, LOADS[:3], start=solved)


def test_a_thin_belt_under_a_hard_tread_is_refused_for_the_short_contact() -> None:
    """A bicycle's wheel at 30 N: its linear start settles, and the reason is the true one."""
    base = read_tire("table-6-1").tire
    bicycle = base.changed(
        ring_radius=0.330,
        free_radius=0.3335,
        belt_width=0.026,
        tread_thickness=0.0035,
        innerliner_offset=-0.001,
        bending_stiffness=0.0207,
        mass=0.25,
        pressure=5.664e5,
        radial_stiffness=2.6e4,
        tangential_stiffness=4e4,
        tread_stiffness=2.79e9,
    )
    at = Ring.of(bicycle, bicycle.pressure), Tread.of(bicycle)
    with pytest.raises(ParameterError, match=r"resolve 0\.015 rad.*a softer tread"):
        load_exact(*at, 30.0)
    assert load_exact(*at, 400.0).half_angle[0] > 0.015
