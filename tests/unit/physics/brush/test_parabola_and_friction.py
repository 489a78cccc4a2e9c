"""Closed forms (3), (4), (5), (8), (26), and friction from forces with its honest range."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tirelib.core.errors import ParameterError
from tirelib.physics.brush.friction import (
    FrictionEstimate,
    friction_from_moment,
    friction_from_stiffness,
    friction_from_two_angles,
)
from tirelib.physics.brush.parabola import (
    aligning_moment,
    bristle_stiffness,
    friction_at_angle,
    friction_at_sliding,
    lateral_force,
    sliding_angle,
)

LOAD, A, STIFFNESS = 4000.0, 0.06, 6e4
CPY = STIFFNESS / (2 * A**2)
mus = st.floats(0.3, 1.4)
shares = st.floats(0.05, 0.98)


def angle_at(share: float, mu: float) -> float:
    """Slip angle at a share of tan alpha_sl."""
    return float(np.arctan(share * np.tan(sliding_angle(CPY, mu, LOAD, A))))


def test_closed_form_against_quadrature_of_eq_23() -> None:
    """Certified: independent quadrature of (23) with the corrected (25)."""
    np.testing.assert_allclose(
        lateral_force(np.radians([1.0, 3.0, 5.0, 8.0]), CPY, 0.9, LOAD, A),
        [-949.0269693522, -2317.7946803, -3111.2690409, -3562.0747311],
        rtol=1e-10,
    )


@given(mu=mus, share=shares)
def test_friction_from_eq_8_is_the_friction_put_in(mu: float, share: float) -> None:
    """The printed (8) multiplies: 7.6e-6 at 0.01 degrees."""
    alpha = angle_at(share, mu)
    force = lateral_force(alpha, CPY, mu, LOAD, A)
    limit = sliding_angle(CPY, mu, LOAD, A)
    assert float(friction_at_angle(force, LOAD, alpha, limit)) == pytest.approx(mu, rel=1e-12)
    assert float(friction_at_sliding(CPY, limit, LOAD, A)) == pytest.approx(mu, rel=1e-12)


def test_moment_over_force_starts_at_a_third_and_ends_at_zero() -> None:
    alpha = np.array([1e-8, 0.5])
    trail = -aligning_moment(alpha, CPY, 0.9, LOAD, A) / lateral_force(alpha, CPY, 0.9, LOAD, A)
    np.testing.assert_allclose(trail, [A / 3, 0.0], atol=1e-8)


@given(alpha=st.floats(-0.3, 0.3))
def test_moment_is_the_integral_of_x_times_the_pointwise_minimum(alpha: float) -> None:
    x = np.linspace(-A, A, 20001)
    q = 3 * LOAD * (A**2 - x**2) / (4 * A**3)
    f = -np.sign(alpha) * np.minimum(CPY * abs(np.tan(alpha)) * (A - x), 0.9 * q)
    moment = aligning_moment(alpha, CPY, 0.9, LOAD, A)
    assert float(moment) == pytest.approx(np.trapezoid(x * f, x), abs=2e-5)


def test_bristle_stiffness_is_the_cornering_slope() -> None:
    c = bristle_stiffness(STIFFNESS, A)
    assert float(lateral_force(1e-8, c, 0.9, LOAD, A)) / 1e-8 == pytest.approx(-STIFFNESS, rel=1e-6)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@given(mu=mus, share=shares)
def test_moment_tells_friction(sign: float, mu: float, share: float) -> None:
    alpha = sign * angle_at(share, mu)
    force = lateral_force(alpha, CPY, mu, LOAD, A)
    moment = aligning_moment(alpha, CPY, mu, LOAD, A)
    found = friction_from_moment(force, moment, LOAD, A, Fy_std=1e-3, Mz_std=1e-4)
    assert bool(found.determined)
    assert float(found.friction) == pytest.approx(mu, rel=1e-9)
    assert float(found.sliding) == pytest.approx(share, rel=1e-7)


@given(mu=mus, share=st.floats(0.05, 1.5))
def test_stiffness_tells_friction(mu: float, share: float) -> None:
    alpha = angle_at(share, mu)
    force = lateral_force(alpha, CPY, mu, LOAD, A)
    found = friction_from_stiffness(force, alpha, LOAD, STIFFNESS, Fy_std=1e-3)
    assert float(found.friction) == pytest.approx(mu, rel=1e-7)


@given(mu=mus, share=st.floats(0.1, 2.0))
def test_two_angles_tell_friction(mu: float, share: float) -> None:
    alpha = np.array([angle_at(0.4 * share, mu), angle_at(share, mu)])
    force = lateral_force(alpha, CPY, mu, LOAD, A)
    found = friction_from_two_angles(force, alpha, LOAD, Fy_std=1e-3)
    assert float(found.friction) == pytest.approx(mu, rel=1e-6)


@pytest.mark.parametrize("share", [0.25, 0.5, 0.8])
@pytest.mark.parametrize("way", ["moment", "stiffness", "two"])
def test_standard_deviation_is_the_scatter_of_repeats(way: str, share: float) -> None:
    """20000 draws tell a deviation within 1 %; 12 % leaves room for the second order."""
    rng = np.random.default_rng(3)
    n, s_force, s_moment = 20_000, 10.0, 0.3
    alpha = np.array([angle_at(0.5 * share, 0.9), angle_at(share, 0.9)])
    both = np.array([[0.2 * s_force], [s_force]])
    force = lateral_force(alpha, CPY, 0.9, LOAD, A)[:, None] + both * rng.normal(0, 1, (2, n))
    moment = aligning_moment(alpha[1], CPY, 0.9, LOAD, A) + rng.normal(0, s_moment, n)
    load = LOAD + rng.normal(0, 15.0, n)
    if way == "moment":
        found = friction_from_moment(
            force[1], moment, load, A, Fy_std=s_force, Mz_std=s_moment, load_std=15.0
        )
    elif way == "stiffness":
        s_alpha, s_C = 2e-4, 300.0
        found = friction_from_stiffness(
            force[1],
            alpha[1] + rng.normal(0, s_alpha, n),
            load,
            STIFFNESS + rng.normal(0, s_C, n),
            Fy_std=s_force,
            slip_angle_std=s_alpha,
            load_std=15.0,
            cornering_stiffness_std=s_C,
        )
    else:
        found = friction_from_two_angles(force, alpha[:, None], LOAD, Fy_std=both)
    assert found.determined.mean() > 0.99
    scatter = np.nanstd(found.friction)
    assert float(np.median(found.std)) == pytest.approx(scatter, rel=0.12)


SOFT = 8000.0
"""Cornering stiffness with which the contact slides at half a radian only, [N/rad]."""


@pytest.mark.parametrize("tell", [friction_from_moment, friction_from_stiffness])
@pytest.mark.parametrize("share", [0.3, 0.6])
def test_each_input_alone_gives_its_slope_times_its_deviation(
    tell: Callable[..., FrictionEstimate], share: float
) -> None:
    c = SOFT / (2 * A**2)
    alpha = np.arctan(share * np.tan(sliding_angle(c, 0.9, LOAD, A)))
    assert alpha > 0.3  # tan and its argument differ
    given = {"Fy": lateral_force(alpha, c, 0.9, LOAD, A), "load": LOAD}
    if tell is friction_from_moment:
        given |= {"Mz": aligning_moment(alpha, c, 0.9, LOAD, A), "half_length": A}
    else:
        given |= {"slip_angle": alpha, "cornering_stiffness": SOFT}
    none = {f"{name}_std": 0.0 for name in given}
    for name, value in given.items():
        step = 1e-6 * np.abs(value)
        ends = [tell(**{**given, name: value + k * step}, **none).friction for k in (-1.0, 1.0)]
        std = tell(**given, **{**none, f"{name}_std": step}).std
        # a central difference: of the second order in a step of 1e-6
        np.testing.assert_allclose(std, np.abs(ends[1] - ends[0]) / 2.0, rtol=1e-5)


def test_tiny_slip_tells_nothing() -> None:
    """Force and moment there follow from stiffness alone: no number is handed out."""
    alpha = 0.0005
    force = lateral_force(alpha, CPY, 0.9, LOAD, A)
    moment = aligning_moment(alpha, CPY, 0.9, LOAD, A)
    a = friction_from_moment(force, moment, LOAD, A, Fy_std=2.0, Mz_std=0.1)
    b = friction_from_stiffness(force, alpha, LOAD, STIFFNESS, Fy_std=2.0)
    c = friction_from_two_angles(
        lateral_force(np.array([alpha, 2 * alpha]), CPY, 0.9, LOAD, A),
        np.array([alpha, 2 * alpha]),
        LOAD,
        Fy_std=2.0,
    )
    for found in (a, b, c):
        assert not found.determined
        assert np.isnan(found.friction)
        assert float(found.std) > 0.1


@pytest.mark.parametrize(("Fy", "Mz"), [(0.0, 0.0), (-2000.0, -30.0), (-2000.0, 41.0)])
def test_impossible_moments_are_flagged(Fy: float, Mz: float) -> None:
    """No force, a trail of the wrong sign, a trail beyond a third of half the length."""
    found = friction_from_moment(Fy, Mz, LOAD, A, Fy_std=10.0, Mz_std=1.0)
    assert not found.determined
    assert np.isnan(found.friction)


def test_full_sliding_is_force_over_load() -> None:
    found = friction_from_moment(-3600.0, 0.0, LOAD, A, Fy_std=36.0, Mz_std=0.1)
    assert float(found.friction) == pytest.approx(0.9)
    assert float(found.sliding) == 1.0
    assert float(found.std) == pytest.approx(0.009, rel=0.01)
    pair = friction_from_two_angles([-3600.0, -3600.0], [0.3, 0.4], LOAD, Fy_std=36.0)
    assert float(pair.friction) == pytest.approx(0.9)
    assert float(pair.std) == pytest.approx(0.009, rel=0.01)


def test_bad_inputs_are_refused() -> None:
    with pytest.raises(ParameterError, match="load = -1"):
        friction_from_moment(-1.0, 1.0, -1.0, A, Fy_std=1.0, Mz_std=1.0)
    with pytest.raises(ParameterError, match="standard deviation is negative"):
        friction_from_moment(-1.0, 1.0, 1.0, A, Fy_std=-1.0, Mz_std=1.0)
    with pytest.raises(ParameterError, match="smaller one"):
        friction_from_two_angles([-1.0, -1.0], [0.2, 0.1], LOAD, Fy_std=1.0)
    with pytest.raises(ParameterError, match="two forces"):
        friction_from_two_angles([-1.0, -1.0, -1.0], 0.1, LOAD, Fy_std=1.0)
    with pytest.raises(ParameterError, match="slip_angle = 0"):
        friction_at_angle(0.0, LOAD, 0.0, 0.1)
    with pytest.raises(ParameterError, match="half_length = 0 m"):
        bristle_stiffness(6e4, 0.0)
    with pytest.raises(ParameterError, match="in radians"):
        lateral_force(8.0, CPY, 0.9, LOAD, A)
