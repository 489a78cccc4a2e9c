"""What the ring model says of the dissertation's figures 5-10 to 6-28: trends, not numbers.

Where a sentence of the dissertation does not come out of the corrected equations, the test states
what does; such tests say so.
"""

import numpy as np
import pytest
from ring_figures import cases
from ring_figures.static import deformation_from_strain

from tests.physics.figure_cases import (
    CASE,
    CONTACTS,
    ROLLING,
    SOFT,
    STIFF,
    TEST,
    crown,
    deflections,
    flatness,
    grows,
    inflations,
    loads,
    standing,
    tire,
)
from tirelib.report.simulation import simulate

# Section 5: the standing ring


def test_static_pressure_turns_from_convex_to_concave_with_load() -> None:
    """Fig. 5-22, where bending carries what the tension of the belt does."""
    contact = standing(STIFF).contact
    shape = contact.centre_pressure / contact.peak_pressure
    assert shape[0] == pytest.approx(1.0)
    assert shape[-1] < 0.85
    assert (np.diff(shape) <= 1e-12).all()


def test_a_soft_static_belt_is_concave_first_and_grows_a_crown_with_load() -> None:
    """Against the sentence at Fig. 5-22: without tension Table 6-1 goes the other way."""
    contact = standing(SOFT).contact
    shape = contact.centre_pressure / contact.peak_pressure
    assert shape[0] < 0.7
    assert grows(shape[:3])
    assert shape[-1] == pytest.approx(1.0)


def test_static_tension_grows_with_load_to_the_reference_load() -> None:
    """Section 5.4, from 1416 to 5666 N, which no measured tire shows; a soft belt does not."""
    assert grows(standing(STIFF).strain.max(axis=1)[:3])
    assert grows(-standing(SOFT).strain.max(axis=1))


@pytest.mark.parametrize("stiffness", [SOFT, STIFF])
def test_static_compression_and_width_grow_with_load(stiffness: float) -> None:
    ring = standing(stiffness)
    assert grows(-ring.strain.min(axis=1))
    assert grows(ring.contact.half_angle)
    assert grows((ring.strain > 0.5 * ring.strain.max(axis=1, keepdims=True)).sum(axis=1))


def test_deformation_from_strain_is_that_of_the_ring_and_grows_with_load() -> None:
    """Fig. 5-10. Second-order differences on 201 nodes leave less than 1e-4 of the depth."""
    ring = standing(STIFF)
    found = deformation_from_strain(ring)
    for point in range(len(cases.STATIC_LOADS)):
        own = np.interp(found.angle[point], ring.phi, ring.u[point])
        depth = np.abs(own).max()
        np.testing.assert_allclose(found.deformation[point], own, atol=1e-4 * depth)
    assert grows(-found.deformation.min(axis=1))


# Section 6.4: two contacts


def test_radial_contact_dips_at_small_and_humps_at_large_deflection() -> None:
    """Fig. 6-9 (b): the hump at 45 mm."""
    done = deflections("radial")
    assert crown(done, 0) > 0.4
    assert done.middle_pressure[0] < 0.98 * done.largest_pressure[0]
    assert crown(done, 1) < 0.06
    assert crown(done, 2) < 0.06


def test_contact_with_shear_has_no_hump_and_grows_more_concave() -> None:
    """Fig. 6-9 (a), upper chart."""
    done = deflections("shear")
    assert grows(-flatness(done))
    assert flatness(done)[-1] < 0.97
    places = [crown(done, point) for point in range(3)]
    assert places[0] > 0.3
    assert grows(places)


@CASE
def test_contact_grows_with_deflection_and_load(contact: str) -> None:
    for done in (deflections(contact), loads(contact)):
        assert grows(done.contact_angle)
        assert grows(done.largest_pressure)
        assert grows(-done.peaks.cp1)
        assert grows(-done.peaks.cp2)
        assert grows(done.peaks.rate_lead)


def test_shear_is_outward_and_radial_pressure_inward_along_the_road() -> None:
    """Fig. 6-9, lower charts: outward is the sign of the wheel angle."""
    outward, inward = deflections("shear"), deflections("radial")
    for done, sign in ((outward, 1.0), (inward, -1.0)):
        # free rolling of Eq. (103) leaves a small traction where damping shifts the zero
        far = np.abs(done.phi) > 0.02
        for point in range(3):
            inside = far & (done.pressure[point] > 0.0)
            assert (sign * np.sign(done.phi[inside]) * done.shear[point, inside] > 0.0).all()


def test_shear_shortens_the_contact_and_hardly_changes_the_belt() -> None:
    """Fig. 6-9, 6-11: "almost the same" is 0.8, 2.2 and 3.8 % of the depth, at the edges."""
    shear, radial = deflections("shear"), deflections("radial")
    assert (shear.contact_angle < 0.96 * radial.contact_angle).all()
    difference = np.abs(shear.u - radial.u)
    share = difference.max(axis=1) / np.abs(radial.u).max(axis=1)
    assert (share < (0.01, 0.025, 0.04)).all()
    place = radial.phi[difference.argmax(axis=1)]
    np.testing.assert_allclose(place, radial.edges[:, 0], rtol=0.1)


def test_strains_of_both_contacts_agree_outside_but_not_inside() -> None:
    """Fig. 6-10: "almost identical" holds for compression; tension differs by 4, 8 and 13 %."""
    shear, radial = deflections("shear").peaks, deflections("radial").peaks
    np.testing.assert_allclose(shear.cp1, radial.cp1, rtol=0.02)
    np.testing.assert_allclose(shear.cp2, radial.cp2, rtol=0.02)
    ratio = shear.tp / radial.tp
    assert grows(ratio)
    assert 1.03 < ratio[0] < ratio[-1] < 1.15


@CASE
def test_no_contact_loses_much_tension_as_measured_tires_do(contact: str) -> None:
    """Section 6.4: both fail to show a considerable decrease; it stays within 10 %."""
    tension = deflections(contact).peaks.tp
    assert (np.abs(tension / tension[0] - 1.0) < 0.10).all()


def test_rate_peaks_lie_inside_the_contact_and_nearer_to_its_edges_with_shear() -> None:
    """Fig. 6-12: peak to peak is slightly smaller than the contact angle."""
    short = {}
    for contact in CONTACTS:
        done = deflections(contact)
        peaks = done.peaks
        short[contact] = done.contact_angle - (peaks.rate_trail_angle - peaks.rate_lead_angle)
        assert (short[contact] > 0.0).all()
        assert (short[contact] < 0.1 * done.contact_angle).all()
    assert (short["shear"] < 0.4 * short["radial"]).all()


# Section 6.5.2.1: loads and inflation, no damping


def test_pressure_grows_concave_with_load_and_convex_with_inflation() -> None:
    """Fig. 6-22, 6-23."""
    assert flatness(loads("radial"))[0] == pytest.approx(1.0, abs=1e-4)
    assert grows(-flatness(loads("radial")))
    assert grows(flatness(inflations()))


def test_inflation_at_equal_load_shortens_the_contact_and_raises_the_pressure() -> None:
    """Fig. 6-23, 6-35."""
    for done in (inflations(), inflations(cases.DYNAMIC_DAMPING, cases.DYNAMIC_SPEED)):
        np.testing.assert_allclose(done.load, cases.REFERENCE_LOAD, rtol=1e-6)
        assert grows(-done.contact_angle)
        assert grows(done.largest_pressure)
        assert grows(-done.deflection)


def test_inflation_at_equal_deflection_lengthens_the_contact_if_the_sidewall_stiffens() -> None:
    """Fig. 6-7 (b) with the tire whose k_u grows from 2.6e5 to 4.4e5 N/m^2 with pressure."""
    done = cases.by_inflation_at_equal_deflection(tire("jenkins"))
    assert grows(done.contact_angle)
    assert grows(done.load)
    assert done.contact_angle[1] / done.contact_angle[0] == pytest.approx(1.12, abs=0.02)


@pytest.mark.parametrize("name", [ROLLING, TEST])
def test_inflation_at_equal_deflection_shortens_the_contact_if_the_sidewall_does_not(
    name: str,
) -> None:
    """Against the explanation at Fig. 6-35: the larger load alone does not lengthen it."""
    done = cases.by_inflation_at_equal_deflection(tire(name))
    assert grows(-done.contact_angle)
    assert grows(done.load)


def test_lower_inflation_acts_like_more_load_but_less() -> None:
    """Fig. 6-26, 6-28: width and compression over the ranges of table 3-3."""
    by_load, by_inflation = loads("radial"), inflations()
    for read in (lambda done: done.contact_angle, lambda done: -done.peaks.cp1):
        of_load, of_inflation = read(by_load), read(by_inflation)
        assert of_inflation[0] > of_inflation[-1]
        assert of_inflation[0] / of_inflation[-1] < 0.6 * of_load[-1] / of_load[0]


def test_at_equal_load_shear_raises_and_hollows_the_pressure() -> None:
    """Fig. 6-24 against 6-22."""
    shear, radial = loads("shear"), loads("radial")
    assert (shear.largest_pressure > 1.01 * radial.largest_pressure).all()
    assert (shear.contact_angle < radial.contact_angle).all()
    assert flatness(shear)[-1] < flatness(radial)[-1]


def test_without_damping_everything_is_symmetric() -> None:
    for done in (loads("radial"), loads("shear"), inflations()):
        np.testing.assert_allclose(done.edges[:, 0], -done.edges[:, 1], rtol=1e-6)
        np.testing.assert_allclose(done.pressure_centre, 0.0, atol=1e-6)
        np.testing.assert_allclose(done.strain, done.strain[:, ::-1], atol=1e-6)


def test_equal_arguments_give_the_points_of_a_list_one_by_one() -> None:
    """A figure's operating points do not know of each other."""
    together = simulate(tire(ROLLING), load=[2000.0, 5000.0], turn_rate=[0.0, 59.0])
    alone = simulate(tire(ROLLING), load=5000.0, turn_rate=59.0)
    np.testing.assert_allclose(together.strain[1], alone.strain[0], atol=1e-9)
