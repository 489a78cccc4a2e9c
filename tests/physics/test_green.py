"""Laws of the point-load response of the static ring, Eq. (41)-(47)."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tirelib.core.errors import ParameterError, ShapeError
from tirelib.physics.ring.green import (
    modal_response,
    point_response,
    point_response_series,
    pressed_shape,
)

SET_K = {"ring_radius": 0.3, "bending_stiffness": 2.0, "radial_stiffness": 6.3e5}
TURN = np.linspace(-np.pi, np.pi, 4096, endpoint=False)
STEP = TURN[1] - TURN[0]
rings = st.fixed_dictionaries(
    {
        "ring_radius": st.floats(0.2, 0.5),
        "bending_stiffness": st.floats(0.5, 50.0),
        "radial_stiffness": st.floats(1e3, 3e6),
    }
)


def lam_squared(ring: dict[str, float]) -> float:
    return ring["ring_radius"] ** 4 * ring["radial_stiffness"] / ring["bending_stiffness"] + 1.0


@given(ring=rings)
def test_closed_form_equals_fourier_series(ring: dict[str, float]) -> None:
    angle = np.linspace(-3.0, np.pi, 12)
    closed, series = point_response(angle, **ring), point_response_series(angle, **ring)
    peak = abs(point_response(0.0, **ring))
    assert np.abs(closed - series).max() < 1e-9 * peak  # the series leaves out 1e-10


@pytest.mark.parametrize("stiffness", [1e-6, 1.0, 1e9, 1e12, 1e15])
def test_closed_form_equals_fourier_series_from_loose_to_stiff(stiffness: float) -> None:
    # alpha from 3e-5 to 1003: cosh(2 pi alpha) itself would overflow from alpha = 113 on
    ring = SET_K | {"radial_stiffness": stiffness}
    angle = np.array([0.0, 1e-3, 0.05, 3.0])
    closed, series = point_response(angle, **ring), point_response_series(angle, **ring)
    np.testing.assert_allclose(closed, series, rtol=0.0, atol=1e-9 * abs(closed[0]))


def test_displacement_of_reference_ring() -> None:
    load, top = point_response([0.0, np.pi], **SET_K)
    assert load == pytest.approx(-1.258297e-5, rel=1e-6)  # derived and checked independently
    assert top == pytest.approx(8.417650e-7, rel=1e-6)


@given(ring=rings)
def test_foundation_carries_the_load(ring: dict[str, float]) -> None:
    u = point_response(TURN, **ring)
    lifted = ring["radial_stiffness"] * u * np.cos(TURN)
    # the trapezoid's error by the third-derivative kink is below 1e-7 on this grid
    assert ring["ring_radius"] * lifted.sum() * STEP == pytest.approx(-1.0, abs=1e-6)


@given(ring=rings)
def test_ring_keeps_its_length(ring: dict[str, float]) -> None:
    u = point_response(TURN, **ring)
    assert abs(u.mean()) < 1e-7 * np.abs(u).max()


@given(ring=rings)
def test_slope_vanishes_under_the_load_and_opposite(ring: dict[str, float]) -> None:
    slope = point_response([0.0, np.pi], **ring, derivative=1)
    assert np.abs(slope).max() < 1e-9 * np.abs(point_response(TURN, **ring, derivative=1)).max()


@given(ring=rings)
def test_third_derivative_jumps_by_the_load(ring: dict[str, float]) -> None:
    before, after = point_response([-1e-14, 0.0], **ring, derivative=3)
    jump = -(ring["ring_radius"] ** 3) / ring["bending_stiffness"]
    assert after - before == pytest.approx(jump, rel=1e-9)


@given(ring=rings, angle=st.floats(0.05, 3.1))
def test_unloaded_ring_obeys_the_differential_equation(
    ring: dict[str, float], angle: float
) -> None:
    first, third, fifth = (point_response(angle, **ring, derivative=k) for k in (1, 3, 5))
    terms = np.array([fifth, 2.0 * third, lam_squared(ring) * first])
    assert abs(terms.sum()) < 1e-10 * np.abs(terms).max()


@pytest.mark.parametrize("order", [1, 2, 3, 4])
def test_derivatives_are_those_of_the_values(order: int) -> None:
    angle, h = np.array([-2.0, -0.3, 0.2, 1.1]), 1e-4
    below, above = (point_response(angle + x, **SET_K, derivative=order - 1) for x in (-h, h))
    # error of the central difference: (beta h)^2 / 6 = 4e-8 of the next but one derivative
    found = point_response(angle, **SET_K, derivative=order)
    np.testing.assert_allclose(found, (above - below) / (2 * h), rtol=1e-5)


@given(ring=rings, angle=st.floats(-3.0, 3.0), turns=st.integers(-3, 3))
def test_response_is_even_and_periodic(ring: dict[str, float], angle: float, turns: int) -> None:
    there = point_response(angle, **ring)
    scale = 1e-12 * abs(point_response(0.0, **ring))
    assert abs(point_response(-angle + 2.0 * np.pi * turns, **ring) - there) < scale


def test_stiff_foundation_gives_the_straight_beam() -> None:
    ring = SET_K | {"radial_stiffness": 1e13}
    k = (1e13 / (4.0 * 2.0)) ** 0.25
    angle = np.linspace(0.0, 0.02, 9)
    s = k * 0.3 * angle
    beam = -k / (2.0 * 1e13) * np.exp(-s) * (np.cos(s) + np.sin(s))
    beam += 1.0 / (2.0 * np.pi * 0.3 * 1e13)  # the ring keeps its length: it grows elsewhere
    # curvature of the ring enters with 1 / alpha^2 = 1e-5
    np.testing.assert_allclose(point_response(angle, **ring), beam, atol=3e-5 * abs(beam[0]))


def test_loose_foundation_lets_the_ring_shift() -> None:
    ring = SET_K | {"radial_stiffness": 1e-6}
    shift = -np.cos(TURN) / (np.pi * 0.3 * 1e-6)
    np.testing.assert_allclose(point_response(TURN, **ring), shift, atol=1e-9 * shift.max())


def test_sets_of_parameters_broadcast() -> None:
    R, EI, k_u = np.array([0.3, 0.32])[:, None, None], np.array([1.0, 2.0, 9.0])[:, None], 6e5
    angle = np.array([0.0, 0.3, -2.0, 7.0])
    many = point_response(angle, ring_radius=R, bending_stiffness=EI, radial_stiffness=k_u)
    series = point_response_series(angle, ring_radius=R, bending_stiffness=EI, radial_stiffness=k_u)
    assert many.shape == series.shape == (2, 3, 4)
    one = point_response(angle, ring_radius=0.32, bending_stiffness=9.0, radial_stiffness=6e5)
    np.testing.assert_allclose(many[1, 2], one, rtol=1e-14)
    np.testing.assert_allclose(series, many, atol=1e-9 * np.abs(many).max())


@given(ring=rings, order=st.integers(0, 12))
def test_harmonic_pressure_answers_with_its_modal_response(
    ring: dict[str, float], order: int
) -> None:
    at = np.linspace(-np.pi, np.pi, 721)
    angle = np.array([0.1, 1.0, -2.0])
    u = pressed_shape(angle, at, np.cos(order * at), **ring)
    expected = modal_response(order, **ring) * np.cos(order * angle)
    scale = abs(modal_response(1, **ring))
    assert np.abs(u - expected).max() < 1e-5 * scale  # trapezoid on 720 nodes across the kink


def test_pressure_at_one_node_is_a_line_force() -> None:
    pressure = np.zeros(5)
    pressure[2] = 10.0
    u = pressed_shape([0.0, 0.4], np.linspace(-0.2, 0.2, 5), pressure, **SET_K)
    np.testing.assert_allclose(u, 10.0 * 0.3 * 0.1 * point_response([0.0, 0.4], **SET_K))


def test_inward_pressure_pushes_the_belt_inward() -> None:
    at = np.linspace(-0.2, 0.2, 41)
    shape = pressed_shape(at, at, np.full((3, 41), 1e4), **SET_K)
    assert shape.shape == (3, 41)
    assert (shape[:, 20] < 0.0).all()


@pytest.mark.parametrize("name", list(SET_K))
@pytest.mark.parametrize("value", [-1.0, 0.0, np.nan, np.inf])
def test_bad_parameter_is_named(name: str, value: float) -> None:
    with pytest.raises(ParameterError, match=f"{name} = .*must be finite and > 0"):
        point_response(0.0, **(SET_K | {name: value}))


def test_bad_angles_orders_and_nodes_are_refused() -> None:
    with pytest.raises(ParameterError, match="angle is not finite"):
        point_response(np.nan, **SET_K)
    with pytest.raises(ParameterError, match="derivative = -1"):
        point_response(0.0, **SET_K, derivative=-1)
    with pytest.raises(ParameterError, match=r"order = 1\.5; must be 0, 1"):
        modal_response(1.5, **SET_K)
    with pytest.raises(ParameterError, match="terms = 0"):
        point_response_series(0.0, **SET_K, terms=0)
    with pytest.raises(ShapeError, match=r"\(3,\) but pressure has \(4,\)"):
        pressed_shape(0.0, np.arange(3.0), np.ones(4), **SET_K)
    with pytest.raises(ParameterError, match="nodes must be finite and increase"):
        pressed_shape(0.0, np.array([0.0, 0.0]), np.ones(2), **SET_K)
