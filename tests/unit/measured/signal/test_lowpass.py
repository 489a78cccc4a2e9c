"""Laws of the low-pass: no phase shift, exact on lines, its cut-off where it is stated."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tirelib.core.errors import ParameterError
from tirelib.measured.signal.lowpass import LowPass, half_width, smooth_to_angle

STEP = 2 * np.pi / 1000


def evaluate(samples: np.ndarray, phi: np.ndarray, sigma: float, zero: float = 1000.0):
    return smooth_to_angle(samples[None], (np.arange(samples.size) - zero) * STEP, phi, sigma)


@given(a=st.floats(-1, 1), b=st.floats(-1, 1), zero=st.floats(990, 1010), s=st.floats(0.02, 0.1))
def test_a_straight_line_passes_unchanged(a: float, b: float, zero: float, s: float) -> None:
    phi = np.linspace(-0.5, 0.5, 11)
    line = a + b * (np.arange(2000) - zero) * STEP
    strain, rate = evaluate(line, phi, s, zero)
    np.testing.assert_allclose(strain[0], a + b * phi, atol=1e-9)  # the support may end unevenly
    np.testing.assert_allclose(rate[0], b, atol=1e-9)


@pytest.mark.parametrize("order", [8.0, 24.0, 60.0])
def test_gain_has_fallen_to_half_the_power_at_the_cut_off(order: float) -> None:
    sigma = LowPass(order).sigma(turn_rate=10.0)
    index = np.arange(2000) - 1000.0
    wave = np.cos(order * index * STEP)
    strain, _ = evaluate(wave, np.array([0.0]), sigma)
    # the finite support lets through a little less than the ideal Gaussian
    assert strain[0, 0] == pytest.approx(np.sqrt(0.5), abs=2e-3)


@given(order=st.floats(1.0, 60.0), sigma=st.floats(0.02, 0.06))
def test_no_phase_shift_at_any_frequency(order: float, sigma: float) -> None:
    index = np.arange(2000) - 1000.0
    odd = np.sin(order * index * STEP)
    strain, _ = evaluate(odd, np.array([0.0]), sigma)
    assert abs(strain[0, 0]) < 1e-12
    even = np.cos(order * index * STEP)
    assert abs(evaluate(even, np.array([0.0]), sigma)[1][0, 0]) < 1e-9


def test_rate_is_the_slope_of_a_smooth_curve_to_second_order_in_sigma() -> None:
    index = np.arange(2000) - 1000.0
    wave = np.sin(3 * index * STEP)
    errors = [
        abs(evaluate(wave, np.array([0.0]), sigma)[1][0, 0] - 3.0) for sigma in (0.02, 0.04, 0.08)
    ]
    slopes = np.diff(np.log(errors)) / np.log(2.0)
    np.testing.assert_allclose(slopes, 2.0, atol=0.1)


def test_an_angle_between_samples_is_as_good_as_one_on_a_sample() -> None:
    index = np.arange(2000) - 1000.0
    sigma = 0.035
    phi = np.linspace(-0.02, 0.02, 41)
    strain, _ = evaluate(np.cos(20 * index * STEP), phi, sigma)
    gain = strain[0] / np.cos(20 * phi)
    assert np.ptp(gain) < 1e-4


def test_noise_falls_with_the_width_of_the_filter() -> None:
    rng = np.random.default_rng(0)
    noise = rng.standard_normal((400, 2000))
    phi = np.array([0.0])
    angle = (np.arange(2000) - 1000) * STEP
    spread = [smooth_to_angle(noise, angle, phi, sigma)[0].std() for sigma in (0.02, 0.08)]
    assert spread[0] / spread[1] == pytest.approx(2.0, rel=0.2)  # root of the width's ratio


def test_cut_off_by_order_follows_the_turn_rate_and_in_hz_does_not() -> None:
    by_order, in_hz = LowPass(24.0), LowPass(cut_off=300.0)
    assert by_order.frequency(9.4) == pytest.approx(225.6)
    assert by_order.sigma(1.5) == pytest.approx(by_order.sigma(21.0))
    assert in_hz.frequency(1.5) == in_hz.frequency(21.0) == 300.0


@pytest.mark.parametrize(("kmh", "suits"), [(10, False), (30, True), (65, True), (150, True)])
def test_300_hz_is_checked_against_the_turn_rate(kmh: float, suits: bool) -> None:
    turn_rate = kmh / 3.6 / (2 * np.pi * 0.305)
    assert LowPass(cut_off=300.0).suits(turn_rate, 1e4) is suits
    assert LowPass().suits(turn_rate, 1e4)


def test_a_slow_sample_rate_does_not_suit() -> None:
    assert not LowPass().suits(turn_rate=20.0, rate=1000.0)


@pytest.mark.parametrize("order", [0.0, 7.9, 121.0, np.nan])
def test_an_unsuitable_order_is_refused(order: float) -> None:
    with pytest.raises(ParameterError, match=r"allowed are 8 \.\. 120 cycles per turn"):
        LowPass(order)


@pytest.mark.parametrize("cut_off", [0.0, -5.0, np.nan])
def test_an_impossible_cut_off_is_refused(cut_off: float) -> None:
    with pytest.raises(ParameterError, match="must be above 0"):
        LowPass(cut_off=cut_off)


def test_the_filter_never_reaches_beyond_the_samples() -> None:
    with pytest.raises(ParameterError, match=r"filter needs samples -\d+ .. "):
        evaluate(np.zeros(2000), np.array([0.0]), 0.05, zero=10.0)


def test_support_is_four_sigma() -> None:
    assert half_width(0.035) == pytest.approx(0.14)
