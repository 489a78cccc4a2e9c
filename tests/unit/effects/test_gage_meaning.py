"""What each effect of the gages means: limits, and independent ways to the same number."""

import numpy as np
import pytest

from tests.physics.test_effects import BASE, PLAN, TIRE, VALUES, wave
from tests.unit.effects.test_meaning import at
from tirelib.core.arrays import FloatArray
from tirelib.effects import CATALOGUE
from tirelib.effects.state import State
from tirelib.measured.signal import LowPass
from tirelib.measured.waveforms import GRID
from tirelib.model.base import linearised, predict
from tirelib.model.solution import solved
from tirelib.physics.contact.fourier import evaluate
from tirelib.physics.ring.ring import ComplexArray


def test_nonuniformity_is_the_first_harmonic_with_its_phase() -> None:
    for strength, shape in (((10.0, 0.0), np.cos(GRID)), ((0.0, 10.0), np.sin(GRID))):
        added = wave(CATALOGUE["nonuniformity"].at(strength)) - BASE
        np.testing.assert_allclose(added, np.tile(1e-5 * shape, (72, 1)), atol=1e-15)


def harmonics(waveform: FloatArray) -> ComplexArray:
    """Return the coefficients of exp(i n phi), the mean being none, as the ring has them."""
    turn = np.exp(-1j * np.arange(GRID.size // 2 + 1) * GRID[0])
    series: ComplexArray = np.fft.rfft(waveform) / GRID.size * turn
    return series


@pytest.mark.parametrize(
    ("name", "strength"), [("gage_length", 400.0), ("low_pass", (0.5, 0.05)), ("angle_zero", 0.01)]
)
def test_what_acts_on_the_gages_signal_acts_on_what_large_displacements_add_to_it(
    name: str, strength: float | tuple[float, ...]
) -> None:
    points = PLAN.points.take(np.arange(0, 60, 7))
    change = CATALOGUE[name].at(strength)
    whole, base = (
        solved(VALUES, points, changes, low_pass=LowPass()).waveform for changes in ([change], [])
    )
    alone = predict(VALUES, points).wave
    parts = [
        change[1](State.of(VALUES, points, GRID).but(waveform=part)).wave
        for part in (alone, base - alone)
    ]
    np.testing.assert_allclose(whole, sum(parts), atol=1e-12)
    assert np.abs(parts[1] - (base - alone)).max() > 1e-5


def test_a_long_gage_takes_the_mean_over_its_length() -> None:
    length = 0.02
    strain, seen = harmonics(BASE), harmonics(at("gage_length", (1e3 * length) ** 2).waveform)
    half = 0.5 * length / TIRE.ring_radius
    nodes, weights = np.polynomial.legendre.leggauss(8)
    phi = np.array([-0.2, 0.0, 0.1, 0.3])
    mean = 0.5 * sum(
        w * evaluate(strain, phi + half * x) for x, w in zip(nodes, weights, strict=True)
    )
    np.testing.assert_allclose(evaluate(seen, phi), mean, atol=1e-12)


@pytest.mark.parametrize("damped", [np.inf, np.sqrt(0.5)], ids=["first order", "Butterworth"])
def test_a_lagging_amplifier_obeys_its_differential_equation(damped: float) -> None:
    # x + 2 d T x' + T^2 x'' = strain, or of first order
    tau = 0.5e-3
    square = 0.0 if np.isinf(damped) else (0.5 * tau / damped) ** 2
    strength = (1e3 * tau, 1e6 * (0.5 * tau**2 - square))
    assert (strength[1] == 0.0) is not np.isinf(damped)
    strain, seen = harmonics(BASE), harmonics(at("low_pass", strength).waveform)
    left = evaluate(seen, GRID)
    for order, weight in ((1, tau), (2, square)):
        rate = evaluate(seen, GRID, order) * PLAN.points.omega[:, None] ** order
        left = left + weight * rate
    np.testing.assert_allclose(left, evaluate(strain, GRID), atol=1e-12)


def test_gain_is_the_innerliner_offset_and_saturation_takes_from_large_strain_only() -> None:
    points = PLAN.points.take(np.arange(0, 60, 7))
    linear = linearised(VALUES, points)
    offset = linear.waveform_slopes[6]
    gain = (
        wave(CATALOGUE["gage_gain"].at(1e-3), points=points, lateral=0.0) - linear.waveform
    ) / 1e-3
    np.testing.assert_allclose(gain, offset, atol=1e-4 * np.abs(offset).max())
    shown = at("gage_saturation", 0.5).waveform
    assert shown is not None
    bent = BASE / np.sqrt(1.0 + (BASE / 5e-3) ** 2)
    np.testing.assert_allclose(shown, bent - bent.mean(axis=1, keepdims=True))


@pytest.mark.parametrize(
    ("name", "condition", "reference"),
    [("load", "load", 4000.0), ("pressure", "pressure", 2e5), ("speed", "speed", 20.0)],
)
def test_a_gain_goes_with_a_condition_about_its_reference(
    name: str, condition: str, reference: float
) -> None:
    shown = at(f"gain_{name}", 0.1).waveform
    assert shown is not None
    over = getattr(PLAN.points, condition) / reference
    assert np.ptp(over) > 0.2
    expected = np.tile(1.0 + 0.1 * (over - 1.0)[:, None], (1, GRID.size))
    np.testing.assert_allclose(shown / BASE, expected)


def test_drift_is_none_in_the_middle_of_the_campaign_and_the_angles_zero_shifts_later() -> None:
    ratio = at("gage_drift", 0.1).waveform
    assert ratio is not None
    np.testing.assert_allclose(
        ratio / BASE, np.tile((1.0 + 0.1 * (PLAN.points.order - 0.5))[:, None], (1, GRID.size))
    )
    later = at("angle_zero", 2.0 * float(GRID[1] - GRID[0])).waveform
    assert later is not None
    np.testing.assert_allclose(later, np.roll(BASE, 2, axis=1), atol=1e-14)
