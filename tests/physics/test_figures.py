"""What the ring model says of the dissertation's figures 5-10 to 6-40: trends, not numbers.

Where a sentence of the dissertation does not come out of the corrected equations, the test states
what does; such tests say so.
"""

from functools import cache

import numpy as np
import pytest

from tirelib.brush.forces import brush_forces
from tirelib.brush.parameters import BrushParameters
from tirelib.parameters import Tire, read_tire
from tirelib.report.figures import ring_cases as cases
from tirelib.report.figures.ring_lateral import parabolic_profile, ring_profile
from tirelib.report.figures.ring_speed import compression_to_edge
from tirelib.report.figures.ring_static import deformation_from_strain
from tirelib.report.simulation import Simulation, simulate

ROLLING, TEST = "table-6-1", "table-6-2-195-65r15"
CONTACTS = ("radial", "shear")
CASE = pytest.mark.parametrize("contact", CONTACTS)
STIFF, SOFT = cases.LUMPED_STIFFNESS, 1.144
"""Bending stiffness with the belt's tension lumped into it, and without, [N m^2]."""


@cache
def tire(name: str) -> Tire:
    return read_tire(name).tire


@cache
def deflections(contact: str) -> Simulation:
    return cases.by_deflection(tire(ROLLING), contact)


@cache
def loads(contact: str, damping: float = 0.0, speed: float = 0.0) -> Simulation:
    return cases.by_load(tire(TEST), contact, damping, speed)


@cache
def inflations(damping: float = 0.0, speed: float = 0.0) -> Simulation:
    return cases.by_inflation(tire(TEST), damping, speed)


@cache
def speeds(damping: float) -> Simulation:
    return cases.by_speed(tire(TEST), damping)


@cache
def standing(stiffness: float) -> cases.StaticRing:
    return cases.standing(tire(ROLLING).changed(bending_stiffness=stiffness))


def flatness(done: Simulation) -> "np.ndarray[tuple[int, ...], np.dtype[np.float64]]":
    """Pressure at the middle over the largest: 1 is convex, less is concave."""
    return done.middle_pressure / done.largest_pressure


def crown(done: Simulation, point: int) -> float:
    """Place of the largest pressure, 0 at the middle of the contact and 1 at an edge."""
    top = done.phi[np.argmax(done.pressure[point])]
    lead, trail = done.edges[point]
    return float(abs(top - 0.5 * (lead + trail)) / (0.5 * (trail - lead)))


def grows(values: object) -> bool:
    return bool((np.diff(np.asarray(values, dtype=float)) > 0.0).all())


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


# Section 6.5.2.2: damping and speed


def test_without_damping_speed_changes_nothing() -> None:
    """M - G equals the standing stiffness at every speed."""
    done = speeds(0.0)
    for values in (done.pressure, done.strain, done.edges):
        scale = np.abs(values[0]).max()
        np.testing.assert_allclose(values, np.broadcast_to(values[:1], values.shape),
                                   atol=1e-6 * scale)  # fmt: skip


def test_damping_shifts_the_pressure_to_the_entry_and_more_so_with_speed() -> None:
    """Fig. 6-29, upper row."""
    for damping in (0.05, 0.1):
        assert grows(-speeds(damping).pressure_centre)
        assert (speeds(damping).pressure_centre < 0.0).all()
    assert (speeds(0.1).pressure_centre < 1.5 * speeds(0.05).pressure_centre).all()
    fast = speeds(0.1)
    assert fast.phi[np.argmax(fast.pressure[-1])] < fast.edges[-1].mean() - 0.05


def test_damping_raises_the_first_compressive_peak_and_lowers_the_second() -> None:
    """Fig. 6-29, middle row; Fig. 6-10."""
    for damping in (0.05, 0.1):
        peaks = speeds(damping).peaks
        assert grows(-peaks.cp1)
        assert grows(peaks.cp2)
    for contact in CONTACTS:
        peaks = deflections(contact).peaks
        assert (peaks.cp1 < 1.03 * peaks.cp2).all()


def test_the_contact_moves_forward_with_speed_and_keeps_its_length() -> None:
    """Fig. 6-29: to 150 km/h the length changes by less than 1 %."""
    for damping in (0.05, 0.1):
        done = speeds(damping)
        assert grows(-done.edges[:, 0])
        assert grows(-done.edges[:, 1])
        np.testing.assert_allclose(done.contact_angle, done.contact_angle[0], rtol=0.01)


def test_rate_peaks_move_forward_with_the_contact_and_keep_their_distance() -> None:
    for damping in (0.05, 0.1):
        done = speeds(damping)
        peaks = done.peaks
        contact = done.edges.mean(axis=1)
        middle = 0.5 * (peaks.rate_lead_angle + peaks.rate_trail_angle)
        assert grows(-peaks.rate_lead_angle)
        assert grows(-peaks.rate_trail_angle)
        np.testing.assert_allclose(middle - middle[0], contact - contact[0], rtol=0.1, atol=1e-9)
        distance = peaks.rate_trail_angle - peaks.rate_lead_angle
        np.testing.assert_allclose(distance, distance[0], rtol=0.02)


def test_compressive_peaks_move_backward_while_the_contact_moves_forward() -> None:
    """Against the sentence that they stay: they move the other way, up to as far."""
    for damping in (0.05, 0.1):
        done = speeds(damping)
        peaks = done.peaks
        forward = peaks.rate_trail_angle[0] - peaks.rate_trail_angle
        for angle in (peaks.cp1_angle, peaks.cp2_angle):
            backward = angle - angle[0]
            assert grows(backward)
            assert (backward[1:] < forward[1:]).all()
            assert (backward[1:] > 0.3 * forward[1:]).all()


def test_too_few_harmonics_hold_the_compressive_peaks_in_place(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The minima are flat: with 60 harmonics the end of the series decides where they are."""
    assert np.ptp(speeds(0.1).peaks.cp2_angle) > 0.015
    monkeypatch.setattr("tirelib.report.simulation.N_MODES", 60)
    assert np.ptp(cases.by_speed(tire(TEST), 0.1).peaks.cp2_angle) < 0.003


def test_distance_from_compression_to_edge_tells_damping_but_twice_the_shift() -> None:
    """Eq. (113): grows with damping and speed; it is not the shift of the contact itself."""
    shift = {}
    for damping in (0.05, 0.1):
        done = speeds(damping)
        distance = compression_to_edge(done)
        shift[damping] = distance - distance[0]
        moved = done.edges.mean(axis=1)
        ratio = shift[damping][1:] / (moved[0] - moved[1:])
        assert grows(shift[damping])
        assert ((ratio > 1.6) & (ratio < 2.1)).all()
    np.testing.assert_allclose(shift[0.1][1:] / shift[0.05][1:], 2.0, atol=0.3)


@CASE
def test_damped_pressure_leans_forward_at_every_load(contact: str) -> None:
    """Fig. 6-34, 6-36: higher in front of the contact's middle, and more concave with load."""
    done = loads(contact, cases.DYNAMIC_DAMPING, cases.DYNAMIC_SPEED)
    middle = done.edges.mean(axis=1)
    top = done.phi[done.pressure.argmax(axis=1)]
    assert (top < middle).all()
    assert (done.pressure_centre / done.tire.ring_radius < middle).all()
    assert grows(middle - done.pressure_centre / done.tire.ring_radius)
    assert grows(-flatness(done))


def test_the_tread_slides_at_the_exit_only_and_is_sheared_outward_before() -> None:
    """Fig. 6-36, lower chart."""
    done = loads("shear", cases.DYNAMIC_DAMPING, cases.DYNAMIC_SPEED)
    assert done.sliding_onset is not None
    place = (done.sliding_onset - done.edges[:, 0]) / done.contact_angle
    assert ((place > 0.9) & (place < 1.0)).all()
    for point in range(len(done)):
        lead, trail = done.edges[point]
        early = (done.phi > lead) & (done.phi < 0.4 * lead)
        late = (done.phi > 0.4 * trail) & (done.phi < trail)
        assert (done.shear[point, early] < 0.0).all()
        assert (done.shear[point, late] > 0.0).all()


# Section 6.6: the brush on the ring's pressure


def force(done: Simulation, point: int, degrees: float) -> tuple[float, float]:
    """|Fy| with the ring's pressure and with the parabola."""
    brush = BrushParameters(
        lateral_stiffness=done.tire.bristle_lateral, friction=done.tire.friction
    )
    profiles = ring_profile(done, point), parabolic_profile(done, point)
    ring, parabola = (float(brush_forces(p, brush, np.deg2rad(degrees)).Fy) for p in profiles)
    return -ring, -parabola


def test_ring_pressure_gives_more_lateral_force_at_small_and_less_at_large_slip() -> None:
    """Fig. 6-40, 6-41: more pressure near the exit, where sliding begins, less in the middle.

    Against the sentence that the parabola stays below beyond 4 deg: it ends above.
    """
    done = loads("radial", cases.DYNAMIC_DAMPING, cases.DYNAMIC_SPEED)
    for point in (1, 2):
        ring, parabola = force(done, point, 1.0)
        assert ring > 1.03 * parabola
        ring, parabola = force(done, point, 4.0)
        assert ring < 0.98 * parabola


def test_ring_pressure_and_parabola_agree_in_both_limits() -> None:
    """At no slip the stiffness of the same contact, at full slip the same friction."""
    done = loads("radial", cases.DYNAMIC_DAMPING, cases.DYNAMIC_SPEED)
    for point in range(len(done)):
        ring, parabola = force(done, point, 0.01)
        assert ring == pytest.approx(parabola, rel=2e-3)
        ring, parabola = force(done, point, 60.0)
        assert ring == pytest.approx(done.tire.friction * done.load[point], rel=2e-3)
        assert parabola == pytest.approx(ring, rel=2e-3)


def test_equal_arguments_give_the_points_of_a_list_one_by_one() -> None:
    """A figure's operating points do not know of each other."""
    together = simulate(tire(ROLLING), load=[2000.0, 5000.0], turn_rate=[0.0, 59.0])
    alone = simulate(tire(ROLLING), load=5000.0, turn_rate=59.0)
    np.testing.assert_allclose(together.strain[1], alone.strain[0], atol=1e-9)
