"""The ring models against finite elements of the same tire, a two-dimensional section.

The reference (`tests/golden/fem_tire*`, remade by ``make fem``) is a belt and a tread of continuum
elements with finite rotation, inflated by a follower pressure and pressed on a flat road with
Coulomb friction; `docs/theory/finite_elements.md` describes it. Nothing in it comes from the
library. The bounds are what was measured, plus a fifth: they say how far the ring is from the
continuum, and fail when it drifts away.
"""

import numpy as np
import pytest

from tests.physics.fem_reference import (
    PAIRS,
    Answer,
    Reference,
    apart,
    exact,
    reference,
    tensioned,
    within,
)
from tirelib.physics.contact.static import StaticTire, press_to_load
from tirelib.physics.ring.green import pressed_shape

INFLATED = ("solid_mu050", "solid_mu000", "solid_mu100", "blocks_mu050", "blocks_mu000")
INFLATED += ("stretchy_mu050", "stretchy_mu000")


def slack(fem: Reference) -> Answer:
    """Ring without tension on radial springs alone."""
    tire = fem.tire
    ring = {
        "ring_radius": tire["ring_radius_m"],
        "bending_stiffness": tire["bending_stiffness_N_m2"],
    }
    solved = press_to_load(
        StaticTire(
            free_radius=tire["free_radius_m"],
            radial_stiffness=tire["radial_stiffness_N_per_m2"],
            tread_stiffness=tire["tread_stiffness_N_per_m2"],
            **ring,
        ),
        fem.loads,
        nodes=361,
    )
    step = 1e-3
    u = [
        pressed_shape(
            fem.phi + shift,
            solved.angle,
            solved.pressure,
            radial_stiffness=solved.radial_stiffness,
            **ring,
        )
        for shift in (-step, 0.0, step)
    ]
    bend = u[1] + (u[0] - 2.0 * u[1] + u[2]) / step**2
    strain = -tire["innerliner_offset_m"] / tire["ring_radius_m"] ** 2 * bend
    pressure = [
        np.interp(fem.phi, a, q) for a, q in zip(solved.angle, solved.pressure, strict=True)
    ]
    return Answer(strain, np.array(pressure), solved.deflection, solved.half_angle)


@pytest.mark.parametrize("case", INFLATED)
def test_reference_carries_its_load(case: str) -> None:
    fem = reference(case)
    near = fem["x_m"] < 0.2  # the bottom half; at the top x returns to 0
    bottom = near & (fem.phi < 0.5 * np.pi)
    carried = 2.0 * np.trapezoid(np.where(bottom, fem["pressure_N_per_m"], 0.0), fem["x_m"])
    # The pressure is nodal, the last node of the contact carries an error of its spacing (1 mm).
    np.testing.assert_allclose(carried, fem.loads, rtol=0.015)
    np.testing.assert_allclose(fem.summary["load_N"], fem.loads, rtol=1e-6)


@pytest.mark.parametrize("case", INFLATED)
def test_reference_obeys_coulomb(case: str) -> None:
    fem = reference(case)
    friction = float(fem.summary["friction"])
    # Without the contact's last element (2 mm), where nodal values are extrapolated.
    inside = fem.phi < fem.summary["edge_rad"][:, None] - 0.01
    shear, limit = np.abs(fem["shear_N_per_m"]), friction * fem["pressure_N_per_m"]
    assert np.all(shear[inside] <= 1.001 * limit[inside])
    if friction:
        assert shear.max() > 0.1 * fem["pressure_N_per_m"].max()  # 0.19 blocks, 0.29 solid
        assert np.all(fem["shear_N_per_m"][inside & (fem.phi > 0.0)] > 0.0)  # outward


@pytest.mark.parametrize("tire", PAIRS)
def test_friction_lowers_the_tension_by_less_than_a_tenth(tire: str) -> None:
    rubbing, slippery = reference(f"{tire}_mu050"), reference(f"{tire}_mu000")
    drop = 1.0 - rubbing["beam_strain"][:, 0] / slippery["beam_strain"][:, 0]
    assert np.all(drop > 0.03)
    assert np.all(drop < 0.09)


@pytest.mark.parametrize("case", INFLATED)
def test_tension_rises_and_then_levels_with_and_without_friction(case: str) -> None:
    tension = reference(case)["beam_strain"][:, 0]
    assert np.all(tension[1:] > 1.3 * tension[0])
    assert np.all(np.diff(tension)[:2] > 0.0)
    assert tension[-1] > 0.97 * tension.max()


@pytest.mark.parametrize("tire", PAIRS)
def test_friction_does_not_make_the_tension_fall_with_load(tire: str) -> None:
    """Friction in the plane of the section makes the small fall at high load smaller still."""

    def fall(case: str) -> float:
        tension = reference(case)["beam_strain"][:, 0]
        return float(1.0 - tension[-1] / tension.max())

    assert fall(f"{tire}_mu050") < fall(f"{tire}_mu000")
    assert fall(f"{tire}_mu050") < 0.005


def test_twice_the_friction_changes_next_to_nothing() -> None:
    """At 0.5 nearly all of the contact sticks already."""
    half, full = (reference(f"solid_mu{mu}")["beam_strain"][:, 0] for mu in ("050", "100"))
    np.testing.assert_allclose(full, half, rtol=0.015)


# Deviations of the ring from the continuum, per load, as measured;
# see docs/theory/finite_elements.md.
MEASURED = {
    "solid_mu000": {
        "centre tension": (-0.0117, -0.0368, -0.0527, -0.0663, -0.0794),
        "deepest compression": (-0.0399, -0.0736, -0.1010, -0.1260, -0.1502),
        "strain inside": (0.0130, 0.0333, 0.0521, 0.0706, 0.0894),
        "strain outside": (0.0081, 0.0155, 0.0273, 0.0428, 0.0618),
        "deflection": (-0.0134, -0.0326, -0.0484, -0.0620, -0.0741),
        "edge": (0.0785, 0.0433, 0.0258, 0.0162, 0.0104),
        "centre pressure": (0.0320, 0.0256, 0.0330, 0.0429, 0.0500),
        "largest pressure": (0.0320, 0.0256, 0.0326, 0.0365, 0.0383),
    },
    "blocks_mu000": {
        "centre tension": (-0.0020, -0.0207, -0.0404, -0.0590, -0.0761),
        "deepest compression": (-0.0559, -0.0827, -0.1050, -0.1280, -0.1500),
        "strain inside": (0.0201, 0.0368, 0.0550, 0.0738, 0.0925),
        "strain outside": (0.0087, 0.0163, 0.0276, 0.0422, 0.0607),
        "deflection": (-0.0199, -0.0364, -0.0509, -0.0638, -0.0755),
        "edge": (0.0313, 0.0057, -0.0026, -0.0074, -0.0093),
        "centre pressure": (0.0500, 0.0489, 0.0500, 0.0526, 0.0548),
        "largest pressure": (0.0500, 0.0489, 0.0492, 0.0489, 0.0499),
    },
    "solid_mu050": {
        "centre tension": (0.0716, 0.0501, 0.0234, -0.0023, -0.0255),
        "deepest compression": (-0.0200, -0.0503, -0.0792, -0.1070, -0.1320),
        "strain inside": (0.0453, 0.0389, 0.0507, 0.0695, 0.0891),
        "strain outside": (0.0172, 0.0246, 0.0331, 0.0463, 0.0631),
        "deflection": (-0.0080, -0.0272, -0.0441, -0.0586, -0.0714),
        "edge": (0.1070, 0.0825, 0.0632, 0.0486, 0.0381),
        "centre pressure": (-0.0210, -0.0649, -0.0862, -0.0888, -0.0832),
        "largest pressure": (-0.0210, -0.0649, -0.0858, -0.0813, -0.0746),
    },
}


@pytest.mark.parametrize("case", MEASURED)
def test_ring_with_tension_stays_this_near_to_the_continuum(case: str) -> None:
    fem = reference(case)
    within(apart(tensioned(fem, extensible=False), fem), MEASURED[case])


@pytest.mark.parametrize("case", ["solid_mu000", "blocks_mu000"])
def test_ring_with_tension_grows_exact_as_the_load_falls(case: str) -> None:
    """What is missing are large rotations: the deviation follows the load."""
    fem = reference(case)
    found = apart(tensioned(fem, extensible=False), fem)
    for name in ("strain inside", "strain outside", "deflection", "deepest compression"):
        assert np.all(np.diff(np.abs(found[name])) > 0.0), name


def test_stretch_brings_the_ring_nearer_outside_the_contact() -> None:
    fem = reference("stretchy_mu000")
    stiff, soft = (apart(tensioned(fem, extensible=x), fem) for x in (False, True))
    for name in ("strain outside", "deepest compression"):
        assert np.all(np.abs(soft[name]) < 0.75 * np.abs(stiff[name])), name


@pytest.mark.parametrize("tire", PAIRS)
def test_the_exact_ring_is_the_continuum_within_two_percent(tire: str) -> None:
    """Measured: deflection 0.5 %, strain rms 0.9 % outside and 2.0 % inside the contact."""
    fem = reference(f"{tire}_mu000")
    found = apart(exact(fem), fem)
    assert np.all(np.abs(found["deflection"]) < 0.006)
    assert np.all(found["strain outside"] < 0.011)
    assert np.all(found["strain inside"] < 0.025)
    assert np.all(np.abs(found["deepest compression"]) < 0.05)


def test_large_displacements_are_what_the_linear_ring_lacks() -> None:
    fem = reference("stretchy_mu000")
    linear, large = apart(tensioned(fem, extensible=True), fem), apart(exact(fem), fem)
    heavy = fem.loads > 4000.0
    for name in ("strain inside", "strain outside", "deflection", "deepest compression"):
        assert np.all(np.abs(large[name][heavy]) < 0.5 * np.abs(linear[name][heavy])), name


SLACK_MEASURED = {
    "centre tension": (-0.0118, -0.0126, -0.0109, -0.0245, -0.0397),
    "deepest compression": (-0.0298, -0.0416, -0.0565, -0.0742, -0.0914),
    "strain inside": (0.0154, 0.0213, 0.0359, 0.0548, 0.0718),
    "strain outside": (0.0080, 0.0125, 0.0280, 0.0484, 0.0717),
    "deflection": (-0.0135, -0.0239, -0.0366, -0.0480, -0.0578),
    "edge": (0.0766, 0.0003, -0.0098, -0.0111, -0.0128),
    "centre pressure": (0.0509, 0.0667, 0.0741, 0.0446, 0.0311),
    "largest pressure": (0.0509, 0.0667, 0.0283, 0.0332, 0.0374),
}


def test_ring_without_tension_stays_this_near_to_the_slack_continuum() -> None:
    fem = reference("slack_mu000")
    within(apart(slack(fem), fem), SLACK_MEASURED)


def test_ring_without_tension_is_not_the_inflated_tire() -> None:
    """Without the tension of the inflation it is half as stiff: the tension is no detail."""
    fem = reference("solid_mu000")
    found = apart(slack(fem), fem)
    assert np.all(found["deflection"] > 0.4)
    assert np.all(found["edge"] > 0.8)
