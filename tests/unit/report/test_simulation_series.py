"""Harmonics of the simulation: the claimed accuracy of peaks, checked against longer series."""

import numpy as np
import pytest

from tirelib.core.parameters import read_tire
from tirelib.report import simulation, simulation_series
from tirelib.report.simulation import simulate
from tirelib.report.simulation_series import (
    LEAST_MODES,
    MOST_MODES,
    Peaks,
    bending_length,
    find_peaks,
    fine_grid,
    modes,
    nodes,
    of_grid,
    on_grid,
    wanted_modes,
)

TIRE = read_tire("table-6-1").tire
OWN = np.array([TIRE.pressure])
LARGEST_SHARE, LARGEST_ANGLE = 0.005, 1e-3
"""What the documentation claims."""


def check_peaks(found: Peaks, better: Peaks) -> None:
    for name in ("cp1", "tp", "cp2", "rate_lead", "rate_trail"):
        expected = getattr(better, name)
        np.testing.assert_allclose(getattr(found, name), expected, rtol=LARGEST_SHARE, err_msg=name)
    # the angle of the largest tension is left out: at large loads the strain is flat there
    for name in ("cp1_angle", "cp2_angle", "rate_lead_angle", "rate_trail_angle"):
        expected = getattr(better, name)
        np.testing.assert_allclose(getattr(found, name), expected, atol=LARGEST_ANGLE, err_msg=name)


def test_peaks_with_shear_stand_although_f_t_has_a_kink(monkeypatch: pytest.MonkeyPatch) -> None:
    """Twice the series, twice the angles, 2.5 times the harmonics and nodes of the contact."""
    loads = [4000.0, 9000.0]
    found = simulate(TIRE, load=loads, turn_rate=60.0, contact="shear")
    monkeypatch.setattr(simulation, "modes", lambda *_: 500)
    monkeypatch.setattr(simulation, "N_SHEAR_NODES", 200)
    monkeypatch.setattr(simulation, "N_SERIES", 12_000)
    for module in (simulation, simulation_series):
        monkeypatch.setattr(module, "FINE_ANGLES_PER_ANGLE", 96)
    better = simulate(TIRE, load=loads, turn_rate=60.0, contact="shear")
    check_peaks(found.peaks, better.peaks)
    np.testing.assert_allclose(found.strain, better.strain, atol=1e-4 * found.strain.max())


def test_the_long_series_is_the_contacts_own_belt(monkeypatch: pytest.MonkeyPatch) -> None:
    """Loads between the nodes say the same as those at the nodes; the rest are high harmonics."""
    done = simulate(TIRE, load=4000.0, turn_rate=60.0, contact="shear")
    monkeypatch.setattr(simulation, "long_series", lambda found, *_: found.displacement)
    few = simulate(TIRE, load=4000.0, turn_rate=60.0, contact="shear")
    np.testing.assert_allclose(done.u, few.u, atol=2e-5 * np.abs(few.u).max())
    np.testing.assert_allclose(done.v, few.v, atol=2e-5 * np.abs(few.u).max())


@pytest.mark.parametrize("bending", [TIRE.bending_stiffness, 0.1])
def test_peaks_with_radial_contact_stand_however_soft_the_belt(
    bending: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    tire = TIRE.changed(bending_stiffness=bending)
    found = simulate(tire, load=[1500.0, 9000.0], turn_rate=60.0)
    monkeypatch.setattr(simulation, "modes", lambda *_: 1200)
    check_peaks(found.peaks, simulate(tire, load=[1500.0, 9000.0], turn_rate=60.0).peaks)


@pytest.mark.parametrize("angle", [-0.6, 0.0, 0.6])
def test_peaks_lie_about_the_contact_wherever_it_is(angle: float) -> None:
    """The larger dip is before the contact, the smaller one behind it, and none is both."""
    phi = fine_grid(121)
    x, edges = phi - angle, angle + np.array([[-0.2, 0.2]])
    dips = 2.0 * np.exp(-(((x + 0.35) / 0.1) ** 2)) + np.exp(-(((x - 0.35) / 0.1) ** 2))
    strain = 4.0 * np.exp(-((x / 0.15) ** 2)) - dips
    found = find_peaks(phi, strain[None], np.gradient(strain, phi)[None], edges)
    still = find_peaks(phi - angle, strain[None], np.gradient(strain, phi)[None], edges - angle)
    for name in Peaks.__slots__:
        moved = angle if name.endswith("angle") else 0.0
        expected = getattr(still, name) + moved
        np.testing.assert_allclose(getattr(found, name), expected, atol=1e-9, err_msg=name)
    assert found.cp1[0] < 1.5 * found.cp2[0] < 0.0
    assert found.cp1_angle[0] < found.tp_angle[0] < found.cp2_angle[0]


def test_harmonics_follow_the_bending_length() -> None:
    """sqrt(EI / N) of the tension, (4 EI / k_t)^(1/4) of the tread: the shorter one."""
    tension = TIRE.pressure * TIRE.belt_width * TIRE.ring_radius
    assert bending_length(TIRE, OWN) == pytest.approx(np.sqrt(TIRE.bending_stiffness / tension))
    hard = TIRE.changed(tread_stiffness=100.0 * TIRE.tread_stiffness)
    tread = (4.0 * hard.bending_stiffness / hard.tread_stiffness) ** 0.25
    assert bending_length(hard, OWN) == pytest.approx(tread)
    assert bending_length(TIRE, 0.0 * OWN) > bending_length(TIRE, OWN)
    assert modes(TIRE, OWN) == LEAST_MODES
    soft = TIRE.changed(bending_stiffness=0.1)
    assert modes(soft, OWN) == wanted_modes(soft, OWN) > 2 * LEAST_MODES
    assert modes(TIRE.changed(bending_stiffness=0.01), OWN) == MOST_MODES
    assert nodes(LEAST_MODES) == 120


def test_a_series_comes_back_from_its_grid() -> None:
    rng = np.random.default_rng(1)
    harmonics = rng.normal(size=(2, 6)) + 1j * rng.normal(size=(2, 6))
    harmonics[:, 0] = harmonics[:, 0].real
    phi = fine_grid(5)
    values = on_grid(harmonics, phi.size - 1)
    expected = (harmonics[:, :, None] * np.exp(1j * np.arange(6)[:, None] * phi)).real.sum(axis=1)
    np.testing.assert_allclose(values, expected, atol=1e-12)
    np.testing.assert_allclose(of_grid(values, 5), harmonics, atol=1e-12)
