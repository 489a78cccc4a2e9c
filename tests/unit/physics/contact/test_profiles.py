"""Pressure profiles: load, centre, dip and crown, and what is refused."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from tirelib.core.errors import ParameterError, ShapeError
from tirelib.physics.contact.profiles import (
    PressureProfile,
    convex_concave,
    parabola,
    power_law,
    sampled,
)

A1, A2 = -0.06, 0.05
H = 0.055
MIDDLE = -0.005
# Gauss nodes are exact to this; 1e-9 only where a cusp sits close to the middle (S_f near 0).
EXACT = 1e-10


def carried(profile: PressureProfile) -> np.ndarray:
    return (profile.weight * profile.pressure).sum(axis=-1)


@given(n=st.floats(0.2, 8.0), load=st.floats(100.0, 9000.0))
def test_power_law_carries_its_load(n: float, load: float) -> None:
    """q0 comes from Gamma functions, the sum from the nodes: two independent ways."""
    profile = power_law(load, A1, A2, n)
    assert float(carried(profile)) == pytest.approx(load, rel=EXACT)


def test_power_law_is_parabola_and_ellipse() -> None:
    x = np.array([-0.05, -0.01, 0.0, 0.03])
    ellipse = power_law(4000.0, -0.06, 0.06, 2.0).pressure_at(x)
    np.testing.assert_allclose(
        ellipse, 2 * 4000.0 / (np.pi * 0.06) * np.sqrt(1 - (x / 0.06) ** 2), rtol=1e-12
    )
    np.testing.assert_allclose(
        parabola(4000.0, -0.06, 0.06).pressure_at(x),
        3 * 4000.0 * (0.06**2 - x**2) / (4 * 0.06**3),
        rtol=1e-12,
    )


@given(n=st.floats(0.2, 8.0))
def test_power_law_is_never_concave_in_the_middle(n: float) -> None:
    profile = power_law(4000.0, -0.06, 0.06, n)
    q = profile.pressure_at(np.array([0.0, 0.01, 0.02]))
    assert q[0] >= q[1] >= q[2]


@given(n_p=st.floats(0.5, 10.0), S_f=st.floats(0.5, 60.0), S=st.floats(-15.0, 15.0))
def test_concave_profile_carries_its_load(n_p: float, S_f: float, S: float) -> None:
    """Against quadrature with the end power as its weight; the skew is odd and adds nothing."""
    profile = convex_concave(4000.0, A1, A2, n_p, S_f, S)
    p, f = 1.0 / n_p, S_f / (5000.0 * H**2)
    half, _ = quad(
        lambda s: ((1.0 + s) * (f + s**2)) ** p,
        0.0,
        1.0,
        weight="alg",
        wvar=(0.0, p),
        epsabs=0.0,
        epsrel=1e-12,
        limit=200,
    )
    base = 2.0 * half
    middle = float(profile.pressure_at(MIDDLE)[0])
    assert middle == pytest.approx(4000.0 / H * f**p / base, rel=1e-9)
    assert float(carried(profile)) == pytest.approx(4000.0, rel=1e-9)


def test_concave_profile_is_the_corrected_formula() -> None:
    """Eq. (53) as corrected, literally, normalised by adaptive quadrature."""
    n_p, S_f, S = 4.0, 8.0, 5.0

    def base(x: float) -> float:
        inner = (x - A1) * (A2 - x) * (S_f / 5000.0 + (x - MIDDLE) ** 2)
        return float((1.0 + S * (x - MIDDLE)) * inner ** (1.0 / n_p))

    whole = quad(base, A1, A2, epsabs=0.0, epsrel=1e-11, limit=200)[0]
    profile = convex_concave(4000.0, A1, A2, n_p, S_f, S)
    for x in (-0.055, -0.02, MIDDLE, 0.01, 0.049):
        assert float(profile.pressure_at(x)[0]) == pytest.approx(4000 * base(x) / whole, rel=1e-8)


def test_dip_turns_to_crown_at_5000_h_squared() -> None:
    """The threshold is 15.125 for this contact; the curvature changes sign across it."""
    profile = convex_concave(4000.0, A1, A2, 3.0, [14.97, 15.28])
    step = 1e-3
    q = profile.pressure_at(np.array([MIDDLE - step, MIDDLE, MIDDLE + step]))
    bend = q[:, 0] - 2.0 * q[:, 1] + q[:, 2]
    assert bend[0] > 0.0 > bend[1]


@given(S=st.floats(-17.0, 17.0), S_f=st.floats(1.0, 40.0))
def test_centre_of_pressure_is_middle_plus_skew_times_variance(S: float, S_f: float) -> None:
    level = convex_concave(4000.0, A1, A2, 3.0, S_f)
    variance = ((level.x - MIDDLE) ** 2 * level.weight * level.pressure).sum() / 4000.0
    assert float(level.center) == pytest.approx(MIDDLE, abs=1e-12)
    skewed = convex_concave(4000.0, A1, A2, 3.0, S_f, S)
    assert float(skewed.center) == pytest.approx(MIDDLE + S * variance, abs=1e-11)


def test_pressure_is_never_negative_and_large_skew_is_refused() -> None:
    assert np.all(convex_concave(4000.0, A1, A2, 3.0, 4.0, 0.999 / H).pressure >= 0.0)
    with pytest.raises(ParameterError, match=r"S = 18.5 1/m; allowed is abs\(S\) < 1/h"):
        convex_concave(4000.0, A1, A2, 3.0, 4.0, 18.5)


def test_cumulative_load_agrees_with_quadrature() -> None:
    """Where sliding begins inside the contact, load and moment up to there must be exact."""
    profile = convex_concave(4000.0, A1, A2, 4.0, 6.0, 5.0)
    u = np.array([0.0, 1e-6, 0.2, 0.5, 0.7, 1.0])
    load, moment = profile.curve.cumulative(u, np.zeros(u.size, np.int64))
    for k, end in enumerate(u):

        def q(s: float) -> float:
            return float(profile.pressure_at(A2 - s * 2 * H)[0]) * 2 * H

        cuts = [0.5] if end > 0.5 else None
        part = quad(q, 0.0, end, points=cuts, epsabs=1e-9, limit=300)[0]
        arm = quad(lambda s: s * q(s), 0.0, end, points=cuts, epsabs=1e-9, limit=300)[0]
        assert load[k] == pytest.approx(part, abs=1e-5)  # adaptive quadrature at the end power
        assert moment[k] == pytest.approx(arm, abs=1e-5)
    assert load[-1] == pytest.approx(4000.0, rel=1e-10)


def test_operating_points_are_independent() -> None:
    loads = np.array([[1000.0, 2000.0, 3000.0], [4000.0, 5000.0, 6000.0]])
    half = np.array([0.04, 0.05, 0.06])
    many = power_law(loads, -half, half, 2.0)
    assert many.shape == (2, 3)
    one = power_law(5000.0, -0.05, 0.05, 2.0)
    np.testing.assert_allclose(many.pressure[1, 1], one.pressure, rtol=1e-14)
    np.testing.assert_allclose(many.pressure_at(0.01)[1, 1], one.pressure_at(0.01), rtol=1e-14)


def test_samples_are_nodes_and_straight_lines() -> None:
    x = np.array([-0.05, -0.03, 0.0, 0.045])
    q = np.array([[0.0, 2e4, 3e4, 1e4], [5e3, 5e3, 5e3, 5e3]])
    profile = sampled(x, q)
    np.testing.assert_allclose(profile.pressure, q)
    np.testing.assert_allclose(carried(profile), np.trapezoid(q, x, axis=-1))
    np.testing.assert_allclose(profile.load, np.trapezoid(q, x, axis=-1))
    np.testing.assert_allclose(profile.pressure_at(-0.04), [[1e4], [5e3]])
    np.testing.assert_allclose(profile.pressure_at(0.05), 0.0)
    assert float(profile.center[1]) == pytest.approx(-0.0025)


def test_sampled_cumulative_is_exact_between_samples() -> None:
    x = np.array([-0.05, -0.03, 0.0, 0.045])
    q = np.array([0.0, 2e4, 3e4, 1e4])
    profile = sampled(x, q)
    edge = -0.011
    load, moment = profile.curve.cumulative(np.array([(0.045 - edge) / 0.095]), np.array([0]))
    knots = np.array([edge, 0.0, 0.045])
    fine = np.interp(knots, x, q)
    assert float(load[0]) == pytest.approx(np.trapezoid(fine, knots))
    arm = sum(
        quad(lambda s: (0.045 - s) / 0.095 * np.interp(s, x, q), a, b)[0]
        for a, b in itertools.pairwise(knots)
    )
    assert float(moment[0]) == pytest.approx(arm)


def test_samples_can_be_scaled_to_a_load() -> None:
    profile = sampled([-0.05, 0.0, 0.05], [0.0, 1.0, 0.0], load=4000.0)
    assert float(carried(profile)) == pytest.approx(4000.0)
    assert float(profile.pressure_at(0.0)[0]) == pytest.approx(80000.0)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: parabola(-1.0, -0.05, 0.05), "load = -1 N"),
        (lambda: parabola(np.nan, -0.05, 0.05), "load = nan N"),
        (lambda: parabola(1.0, 0.05, -0.05), "trailing = 0.05 m, leading = -0.05 m"),
        (lambda: parabola(1.0, 0.06, 0.05), "needs? a minus sign"),
        (lambda: power_law(1.0, -0.05, 0.05, 0.0), "n = 0; allowed is n >= 0.05"),
        (lambda: convex_concave(1.0, -0.05, 0.05, -3.0, 5.0), "n_p = -3"),
        (lambda: convex_concave(1.0, -0.05, 0.05, 3.0, -5.0), "S_f = -5"),
        (lambda: parabola(1.0, -0.05, 0.05, nodes=9), "nodes = 9"),
        (lambda: sampled([0.05, 0.0, -0.05], [0.0, 1.0, 0.0]), "does not ascend"),
        (lambda: sampled([-0.05, 0.0, 0.05], [0.0, -1.0, 0.0]), "must be finite and >= 0"),
        (lambda: sampled([-0.05, 0.0, 0.05], [0.0, 0.0, 0.0]), "zero everywhere"),
    ],
)
def test_bad_numbers_are_refused_with_what_is_allowed(make, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        make()


def test_bad_shapes_are_refused() -> None:
    with pytest.raises(ShapeError, match=r"load \(2,\)"):
        parabola([1.0, 2.0], [-0.1, -0.1, -0.1], 0.05)
    with pytest.raises(ShapeError, match=r"x has shape \(3,\)"):
        sampled([0.0, 1.0, 2.0], [0.0, 1.0])
    with pytest.raises(ShapeError, match="at least 3"):
        sampled([0.0, 1.0], [0.0, 1.0])
