"""Laws of the static contact of ring, tread and flat road, Eq. (37), (47)-(54)."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq, nnls

from tirelib.core.errors import ConvergenceError, ParameterError
from tirelib.physics.contact.static import (
    StaticTire,
    press_to_deflection,
    press_to_load,
    road_gap,
)
from tirelib.physics.ring.green import point_response_series, pressed_shape

TIRE = StaticTire(
    ring_radius=0.3,
    free_radius=0.3125,
    bending_stiffness=1.144,
    radial_stiffness=6.24e5,
    tread_stiffness=7.5e7,
)
D0 = np.array([0.015, 0.025, 0.035, 0.045])
tires = st.builds(
    StaticTire,
    ring_radius=st.floats(0.28, 0.32),
    free_radius=st.floats(0.33, 0.34),
    bending_stiffness=st.floats(0.5, 10.0),
    radial_stiffness=st.floats(1e5, 2e6),
    tread_stiffness=st.floats(2e7, 1e8),
    exact_gap=st.booleans(),
)


def ring_of(tire: StaticTire) -> dict[str, float]:
    names = ("ring_radius", "bending_stiffness", "radial_stiffness")
    return {name: getattr(tire, name) for name in names}


def test_contact_of_reference_tire() -> None:
    # solved independently with another method; printed to the digits given
    contact = press_to_deflection(TIRE, D0)
    np.testing.assert_allclose(contact.half_angle, [0.20210, 0.30177, 0.38553, 0.46024], rtol=1e-4)
    np.testing.assert_allclose(contact.load, [1372.9, 2913.6, 4866.7, 7187.8], rtol=1e-4)
    np.testing.assert_allclose(contact.centre_pressure, [9398, 16838, 24280, 31724], rtol=1e-4)
    np.testing.assert_allclose(contact.peak_pressure, [15137, 20252, 24432, 31724], rtol=5e-4)
    assert (contact.residual < 1e-11).all()


@settings(max_examples=15)
@given(tire=tires, deflection=st.floats(0.008, 0.04))
def test_tread_pushes_where_it_touches_and_nowhere_else(
    tire: StaticTire, deflection: float
) -> None:
    contact = press_to_deflection(tire, deflection, nodes=161)
    angle, q = contact.angle, contact.pressure
    u_r = road_gap(angle, deflection, tire.free_radius, exact=tire.exact_gap)
    compression = contact.deformation - u_r
    inside = q > 0.0
    assert (q >= 0.0).all()
    np.testing.assert_allclose(
        q[inside], float(tire.tread_stiffness) * compression[inside], rtol=1e-6, atol=1e-6 * q.max()
    )
    assert (compression[~inside] <= 0.0).all()
    # the shape is that of the ring under this pressure
    np.testing.assert_allclose(
        contact.deformation,
        pressed_shape(angle, angle, q, **ring_of(tire)),
        atol=1e-9 * np.abs(contact.deformation).max(),
    )
    # below the wheel no other place touches
    far = np.linspace(-1.5, 1.5, 301)
    far = far[np.abs(far) > angle[-1]]
    lifted = pressed_shape(far, angle, q, **ring_of(tire))
    assert (lifted <= road_gap(far, deflection, tire.free_radius, exact=tire.exact_gap)).all()
    step = angle[1] - angle[0]
    assert np.abs(angle[inside]).max() <= contact.half_angle
    assert contact.half_angle <= np.abs(angle[inside]).max() + step


@settings(max_examples=10)
@given(tire=tires, deflection=st.floats(0.008, 0.04))
def test_foundation_carries_the_load_of_the_contact(tire: StaticTire, deflection: float) -> None:
    contact = press_to_deflection(tire, deflection, nodes=161)
    turn = np.linspace(-np.pi, np.pi, 1440, endpoint=False)
    ring = ring_of(tire)
    u = pressed_shape(turn, contact.angle, contact.pressure, **ring)
    carried = (
        -ring["radial_stiffness"] * ring["ring_radius"] * np.mean(u * np.cos(turn)) * 2 * np.pi
    )
    assert carried == pytest.approx(float(contact.load), rel=1e-6)  # kinks of the responses


def test_pressure_equals_that_of_an_independent_quadratic_program() -> None:
    """Energy of ring and tread is least under q >= 0: full matrix, Fourier kernel, NNLS."""
    d0, n = 0.03, 121
    contact = press_to_deflection(TIRE, d0, nodes=n)
    angle = contact.angle
    kernel = point_response_series(
        (angle[1] - angle[0]) * np.arange(n), **ring_of(TIRE), terms=4000
    )
    weight = 0.3 * (angle[1] - angle[0])
    energy = np.eye(n) / 7.5e7
    for i in range(n):
        for j in range(n):
            energy[i, j] -= weight * kernel[abs(i - j)]
    root = np.linalg.cholesky(energy)
    push = d0 - 0.3125 * (1.0 - np.cos(angle))
    q, _ = nnls(root.T, np.linalg.solve(root, push))
    np.testing.assert_allclose(contact.pressure, q, atol=1e-6 * q.max())


def test_stiff_ring_shifts_as_a_rigid_body() -> None:
    tire = replace(TIRE, bending_stiffness=1e9)
    d0, R, R0, k_u, k_t = 0.025, 0.3, 0.3125, 6.24e5, 7.5e7

    def load(shift: float) -> tuple[float, float]:
        edge = np.arccos((R0 - d0) / (R0 - shift))
        cos2 = edge + 0.5 * np.sin(2.0 * edge)  # int cos^2 over the contact
        return edge, k_t * R * ((R0 - shift) * cos2 - (R0 - d0) * 2.0 * np.sin(edge))

    shift = brentq(lambda s: load(s)[1] - np.pi * R * k_u * s, 0.0, d0 - 1e-9)
    edge, expected = load(shift)
    contact = press_to_deflection(tire, d0)
    assert float(contact.half_angle) == pytest.approx(edge, rel=1e-4)
    assert float(contact.load) == pytest.approx(expected, rel=1e-4)


def test_error_falls_with_the_square_of_the_node_distance() -> None:
    fine = press_to_deflection(TIRE, D0, nodes=1281)
    errors = []
    for nodes in (41, 81, 161, 321):
        contact = press_to_deflection(TIRE, D0, nodes=nodes)
        errors.append(np.abs(contact.load / fine.load - 1.0).max())
    # the edge lies anywhere between two nodes, so single steps scatter; over three halvings
    # second order is a factor 64, first order 8
    assert errors[0] / errors[-1] > 25.0
    assert errors[-1] < 2e-5


def test_edge_lies_between_nodes() -> None:
    fine = press_to_deflection(TIRE, D0, nodes=1281)
    coarse = press_to_deflection(TIRE, D0, nodes=161)
    step = coarse.angle[:, 1] - coarse.angle[:, 0]
    assert (np.abs(coarse.half_angle - fine.half_angle) < 0.05 * step).all()


@settings(max_examples=10)
@given(factor=st.floats(0.2, 5.0), deflection=st.floats(0.01, 0.04))
def test_load_scales_with_all_stiffnesses(factor: float, deflection: float) -> None:
    many = {
        name: factor * getattr(TIRE, name)
        for name in ("bending_stiffness", "radial_stiffness", "tread_stiffness")
    }
    one, other = (
        press_to_deflection(t, deflection, nodes=101) for t in (TIRE, replace(TIRE, **many))
    )
    assert float(other.load) == pytest.approx(factor * float(one.load), rel=1e-9)
    assert float(other.half_angle) == pytest.approx(float(one.half_angle), rel=1e-9)


@settings(max_examples=10)
@given(size=st.floats(0.5, 2.0))
def test_load_scales_with_the_square_of_the_size(size: float) -> None:
    larger = replace(
        TIRE,
        ring_radius=0.3 * size,
        free_radius=0.3125 * size,
        bending_stiffness=1.144 * size**4,
    )
    one, other = (
        press_to_deflection(t, d, nodes=101) for t, d in ((TIRE, 0.025), (larger, 0.025 * size))
    )
    assert float(other.load) == pytest.approx(size**2 * float(one.load), rel=1e-9)
    assert float(other.half_angle) == pytest.approx(float(one.half_angle), rel=1e-9)


@settings(max_examples=10)
@given(load=st.floats(500.0, 9000.0), softening=st.sampled_from([0.0, -8.0]))
def test_load_is_the_inverse_of_deflection(load: float, softening: float) -> None:
    tire = replace(TIRE, softening=softening)
    contact = press_to_load(tire, load, nodes=161)
    assert float(contact.load) == pytest.approx(load, rel=1e-10)
    again = press_to_deflection(tire, contact.deflection, nodes=161)
    np.testing.assert_array_equal(again.pressure, contact.pressure)


def test_softening_sidewall_is_the_tire_with_that_stiffness() -> None:
    soft = press_to_deflection(replace(TIRE, softening=-10.0), D0)
    stiffness = 6.24e5 * np.exp(-10.0 * D0)
    np.testing.assert_allclose(soft.radial_stiffness, stiffness, rtol=1e-14)
    plain = press_to_deflection(replace(TIRE, radial_stiffness=stiffness), D0)
    np.testing.assert_allclose(soft.load, plain.load, rtol=1e-14)
    assert (soft.load < press_to_deflection(TIRE, D0).load).all()


def test_softening_tire_takes_the_smaller_deflection_and_has_a_largest_load() -> None:
    tire = replace(TIRE, softening=-40.0)
    curve = press_to_deflection(tire, np.linspace(0.004, 0.078, 38), nodes=101)
    top = int(np.argmax(curve.load))
    assert 0 < top < 37  # the load falls again
    contact = press_to_load(tire, 0.8 * float(curve.load[top]), nodes=101)
    assert contact.deflection < curve.deflection[top]
    with pytest.raises(ParameterError, match="carries 0 to"):
        press_to_load(tire, 1.5 * float(curve.load[top]), nodes=101)


@pytest.mark.parametrize("softening", [-40.0, -60.0, -100.0])
def test_the_largest_load_of_a_softening_tire_is_named_and_carried(softening: float) -> None:
    tire = replace(TIRE, softening=softening)
    fine = np.linspace(5e-4, 0.078, 156)
    peak = float(press_to_deflection(tire, fine, nodes=121).load.max())
    found = press_to_load(tire, 0.997 * peak, nodes=121)
    assert float(found.load) == pytest.approx(0.997 * peak, rel=1e-9)
    with pytest.raises(ParameterError, match="point 1: load") as caught:
        press_to_load(tire, [100.0, 1.2 * peak], nodes=121)
    named = float(str(caught.value).split("carries 0 to ")[1].split(" N")[0])
    assert named == pytest.approx(peak, rel=3e-3)


def test_points_are_solved_together_as_alone() -> None:
    tire = replace(TIRE, radial_stiffness=np.array([4e5, 8e5])[:, None], exact_gap=True)
    together = press_to_load(tire, np.array([1000.0, 3000.0, 5000.0]), nodes=101)
    assert together.pressure.shape == (2, 3, 101)
    alone = press_to_load(replace(tire, radial_stiffness=8e5), 3000.0, nodes=101)
    np.testing.assert_allclose(together.pressure[1, 1], alone.pressure, rtol=1e-8, atol=1e-6)
    assert float(alone.half_angle) == pytest.approx(together.half_angle[1, 1], rel=1e-9)


def test_many_points_are_cut_into_parts() -> None:
    d0 = np.linspace(0.01, 0.04, 70)
    together = press_to_deflection(TIRE, d0, nodes=41)
    assert np.all(np.diff(together.load) > 0.0)
    last = press_to_deflection(TIRE, d0[-1], nodes=41)
    assert together.load[-1] == pytest.approx(float(last.load), rel=1e-12)


def test_short_contact_of_a_soft_ring_is_resolved() -> None:
    tire = replace(TIRE, radial_stiffness=2e3, tread_stiffness=2e9)
    coarse, fine = (press_to_deflection(tire, 0.03, nodes=n) for n in (41, 401))
    assert coarse.half_angle < 0.1 * np.arccos(1.0 - 0.03 / 0.3125)
    assert float(coarse.half_angle) == pytest.approx(float(fine.half_angle), rel=0.02)
    assert float(coarse.load) == pytest.approx(float(fine.load), rel=0.02)


def test_shape_changes_from_dip_to_crown_with_load() -> None:
    contact = press_to_deflection(TIRE, [0.015, 0.05])
    assert contact.centre_pressure[0] < 0.7 * contact.peak_pressure[0]
    assert contact.centre_pressure[1] == contact.peak_pressure[1]


@given(angle=st.floats(-1.2, 1.2))
def test_road_is_a_straight_line(angle: float) -> None:
    d0, R0 = 0.03, 0.3125
    exact = road_gap(angle, d0, R0, exact=True)
    assert (R0 + exact) * np.cos(angle) == pytest.approx(R0 - d0, rel=1e-14)


def test_road_gap_is_right_to_first_order() -> None:
    # in a contact phi^2 is of the order d0 / R0; what (37) leaves out is of second order
    for d0 in (1e-3, 1e-4, 1e-5):
        angle = np.sqrt(d0 / 0.3125)
        exact, first = (road_gap(angle, d0, 0.3125, exact=x) for x in (True, False))
        assert abs(exact - first) < 3.0 * d0**2 / 0.3125
    assert road_gap(0.0, 0.02, 0.3125) == pytest.approx(-0.02)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"radial_stiffness": -1.0}, "radial_stiffness = -1; must be finite and > 0"),
        ({"tread_stiffness": np.nan}, "tread_stiffness = nan"),
        ({"free_radius": 0.29}, "not below free_radius"),
        ({"softening": 5.0}, "softening = 5 1/m; must be finite and <= 0"),
    ],
)
def test_bad_tire_is_refused(changes: dict[str, float], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        replace(TIRE, **changes)


def test_bad_conditions_are_refused() -> None:
    with pytest.raises(ParameterError, match=r"load = 1e\+06 N; this tire carries 0 to 1.* N"):
        press_to_load(TIRE, 1e6, nodes=41)
    with pytest.raises(ParameterError, match="load = -5"):
        press_to_load(TIRE, -5.0)
    with pytest.raises(ParameterError, match=r"deflection = 0\.1 m; must be below 0.078125 m"):
        press_to_deflection(TIRE, 0.1)
    with pytest.raises(ParameterError, match="deflection = nan"):
        press_to_deflection(TIRE, np.nan)
    with pytest.raises(ParameterError, match="nodes = 100; must be odd"):
        press_to_deflection(TIRE, 0.02, nodes=100)
    with pytest.raises(ParameterError, match=r"point 0 at .* N: .* its thickness 0.0125 m"):
        press_to_deflection(replace(TIRE, tread_stiffness=4e5), 0.05)
    with pytest.raises(ParameterError, match="meets the road only below"):
        road_gap(1.6, 0.02, 0.3, exact=True)
    with pytest.raises(ParameterError, match="not finite"):
        road_gap(0.1, np.inf, 0.3)


def test_failed_iteration_hands_over_its_last_iterate() -> None:
    with pytest.raises(ConvergenceError, match="still change after 1 steps") as caught:
        press_to_deflection(TIRE, 0.03, nodes=41, max_iterations=1)
    assert np.shape(caught.value.iterate) == (1, 21)
    assert caught.value.residual > 0.0
