"""Where version 5 of the Magic Formula differs from version 6, in closed form."""

import numpy as np

from tests.unit.physics.brush.test_mf import EVERY_5, FZ0, LOADS, PLAIN, R0, SHIFTS, tire
from tirelib.physics.brush.mf import NEW, magic_forces

BARE = {k: v for k, v in PLAIN.items() if k[0] == "P"} | {"QBZ1": 9.0, "QCZ1": 1.15, "QDZ1": 0.11}
TRAIL = 0.11 * R0 / FZ0 * LOADS
"""Pneumatic trail at no slip of these coefficients, (4.E42)."""


def test_version_5_equals_version_6_where_they_coincide() -> None:
    """Same coefficients, no camber: 5 at tan(alpha) is 6 at alpha."""
    values = {**PLAIN, **{k: v for k, v in SHIFTS.items() if k[0] in "PR"}}
    alpha = np.array([[-0.12], [0.01], [0.09]])
    six = magic_forces(tire(values), LOADS, alpha, -0.05)
    five = magic_forces(tire(values, 52), LOADS, np.tan(alpha), -0.05)
    np.testing.assert_allclose(five.Fx, six.Fx, rtol=1e-12)
    np.testing.assert_allclose(five.Fy, six.Fy, rtol=1e-12)
    pure6 = magic_forces(tire({**PLAIN, **SHIFTS}), LOADS, alpha, combined=False)
    pure5 = magic_forces(tire({**PLAIN, **SHIFTS}, 52), LOADS, np.tan(alpha), combined=False)
    cosine = np.cos(np.tan(alpha)) / np.cos(alpha)
    np.testing.assert_allclose(pure5.Mz, pure6.Mz * cosine, rtol=1e-10)


def test_version_5_camber_shifts_the_curve() -> None:
    one = tire({**PLAIN, "PHY3": 0.03, "LGAY": 2.0}, 6)
    lean, up = (magic_forces(one, LOADS, a, camber=g) for a, g in ((0.02, 0.1), (0.026, 0.0)))
    np.testing.assert_allclose(lean.Fy, up.Fy, rtol=1e-12)


def test_the_trail_belongs_to_the_force_with_camber_in_version_5_to_the_upright_one_in_6() -> None:
    five = magic_forces(tire({**BARE, "PVY3": -0.3}, 52), LOADS, 0.0, camber=0.05)
    six = magic_forces(tire({**BARE, "PKY6": -0.9}), LOADS, 0.0, camber=0.05)
    assert np.all(np.abs(six.Fy) > 50.0)
    np.testing.assert_allclose(five.Mz, -TRAIL * five.Fy, rtol=1e-9)
    np.testing.assert_allclose(six.Mz, 0.0, atol=1e-9)


def test_camber_lengthens_the_trail_by_its_sign_in_version_5_and_by_its_size_in_6() -> None:
    values = {**BARE, "QDZ3": 0.4}
    for gamma in (0.05, -0.05):
        five = magic_forces(tire({**values, "PVY3": -0.3}, 52), LOADS, 0.0, camber=gamma)
        np.testing.assert_allclose(-five.Mz / five.Fy, TRAIL * (1.0 + 0.4 * gamma), rtol=1e-9)
        six = magic_forces(tire(values), LOADS, 1e-7, camber=gamma)
        longer = 1.0 + 0.4 * np.sin(0.05)
        np.testing.assert_allclose(-six.Mz / six.Fy, TRAIL * longer, rtol=1e-6)


def test_trail_and_arm_refer_to_the_nominal_load_which_only_version_6_scales() -> None:
    values = {**BARE, "LFZO": 0.8, "SSZ2": -0.02}
    for fit, share in ((52, 1.0), (61, 0.8)):
        found = magic_forces(tire(values, fit), LOADS, 1e-7)
        np.testing.assert_allclose(-found.Mz / found.Fy, TRAIL / share, rtol=1e-6)
        a, b = (
            magic_forces(tire({**values, "SSZ2": z}, fit), LOADS, 0.05, 0.1) for z in (0.5, 0.0)
        )
        arm = R0 * 0.5 * a.Fy / (share * FZ0)
        np.testing.assert_allclose(a.Mz - b.Mz, arm * a.Fx, rtol=1e-9)


def test_shifts_fall_with_friction_in_version_5_and_less_than_it_in_6() -> None:
    values = {**BARE, "PVX1": 0.01, "PVY1": 0.02, "LMUX": 0.5, "LMUY": 0.4}
    for fit, x, y in ((52, 0.5, 0.4), (61, 5.0 / 5.5, 4.0 / 4.6)):
        found = magic_forces(tire(values, fit), LOADS, 0.0)
        np.testing.assert_allclose(found.Fx, 0.01 * LOADS * x, rtol=1e-9)
        np.testing.assert_allclose(found.Fy, 0.02 * LOADS * y, rtol=1e-9)


def test_version_5_knows_nothing_of_what_came_with_6() -> None:
    at = (LOADS, 0.05, -0.04, 0.05)
    new = dict.fromkeys(NEW, 0.7)
    old, same = (magic_forces(tire({**EVERY_5, **more}, 52), *at) for more in ({}, new))
    for name in ("Fx", "Fy", "Mz"):
        np.testing.assert_array_equal(getattr(same, name), getattr(old, name))


def test_the_force_of_a_slip_ratio_has_camber_itself_in_version_5_and_its_sine_in_6() -> None:
    values = {**BARE, "RVY3": 0.5, "RVY5": 1.0, "RVY6": 5.0}
    for fit, lean in ((52, 0.3), (61, np.sin(0.3))):
        with_, without = (
            magic_forces(tire({**values, "RVY3": v}, fit), LOADS, 0.0, 0.05, 0.3)
            for v in (0.5, 0.0)
        )
        force = with_.friction_y * LOADS * 0.5 * lean * np.sin(np.arctan(0.25))
        np.testing.assert_allclose(with_.Fy - without.Fy, force, rtol=1e-9)


def test_slip_angle_and_slip_ratio_shorten_the_trail_together() -> None:
    """(4.E77): the hypotenuse of the slips, in version 5 its angle."""
    alpha, kappa = 0.2, -0.15
    for fit in (52, 61):
        found = magic_forces(tire(BARE, fit), LOADS, alpha, kappa)
        slip = np.hypot(np.tan(alpha), found.slip_stiffness / found.cornering_stiffness * kappa)
        slip = np.arctan(slip) if fit == 52 else slip
        trail = TRAIL * np.cos(1.15 * np.arctan(9.0 * slip)) * np.cos(alpha)
        np.testing.assert_allclose(-found.Mz / found.Fy, trail, rtol=1e-8)
