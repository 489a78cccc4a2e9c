"""What the ring model says of the dissertation's figures 6-29 to 6-40: trends, not numbers.

Where a sentence of the dissertation does not come out of the corrected equations, the test states
what does; such tests say so.
"""

import numpy as np
import pytest
from ring_figures import cases
from ring_figures.lateral import parabolic_profile, ring_profile
from ring_figures.speed import compression_to_edge

from tests.physics.figure_cases import (
    CASE,
    CONTACTS,
    TEST,
    deflections,
    flatness,
    grows,
    loads,
    speeds,
    tire,
)
from tirelib.physics.brush.forces import brush_forces
from tirelib.physics.brush.parameters import BrushParameters
from tirelib.report.simulation import Simulation

# Section 6.5.2.2: damping and speed


def test_without_damping_speed_changes_nothing() -> None:
    """M - G equals the standing stiffness at every speed."""
    done = speeds(0.0)
    for values in (done.pressure, done.strain, done.edges):
        scale = np.abs(values[0]).max()
        np.testing.assert_allclose(
            values, np.broadcast_to(values[:1], values.shape), atol=1e-6 * scale
        )


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
    monkeypatch.setattr("tirelib.report.simulation.modes", lambda *_: 60)
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
