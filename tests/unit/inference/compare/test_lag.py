"""The common delay of the gages is told and counted out; nothing else is taken for one."""

from dataclasses import replace

import numpy as np
import pytest

from tests.unit.inference.compare.compare_synthetic import model_file, waveforms
from tirelib.core.arrays import FloatArray
from tirelib.inference.compare.error import fitted_delay
from tirelib.inference.compare.model import model_of
from tirelib.inference.compare.strain import Comparison, compare_strain
from tirelib.inference.identify.delay import STD, earlier
from tirelib.inference.identify.random_effects import Whitening
from tirelib.measured.waveforms import GRID


def compared(delay: float) -> Comparison:
    """Return the comparison of the model's own waveforms that come late."""
    waves = waveforms()
    omega = waves.conditions["omega"]
    gages = [earlier(waves.strain[:, k], omega, -delay) for k in range(waves.strain.shape[1])]
    late = replace(waves, strain=np.stack(gages, axis=1))
    return compare_strain(late, model_of(model_file()))


@pytest.fixture(scope="module")
def on_time() -> Comparison:
    return compared(0.0)


@pytest.mark.parametrize("delay", [-4e-5, 6e-5])
def test_a_delay_is_found_told_and_counted_out(on_time: Comparison, delay: float) -> None:
    found = compared(delay)
    assert found.error.delay == pytest.approx(on_time.error.delay + delay, abs=3e-6)
    assert found.error.value == pytest.approx(on_time.error.value, rel=0.02)
    # a delay that is found to 3 microseconds leaves a twentieth of what it was
    assert found.error.rms == pytest.approx(on_time.error.rms, rel=0.05)
    late = found.chosen.strain - earlier(found.prediction.strain, omega(found), found.error.delay)
    assert np.sqrt(np.mean(late**2)) > 1.3 * found.error.rms
    side = "after" if delay > 0.0 else "before"
    told = [text for text in found.messages if "microseconds" in text]
    assert len(told) == 1
    assert f"{1e6 * abs(found.error.delay):.0f} microseconds {side} the trigger" in told[0]


def test_none_is_told_where_there_is_none(on_time: Comparison) -> None:
    assert on_time.error.delay_std < 0.3 * STD, "two speeds tell of it"
    assert abs(on_time.error.delay) < 2.0 * on_time.error.delay_std
    assert not [text for text in on_time.messages if "microseconds" in text]


def omega(found: Comparison) -> FloatArray:
    return np.asarray(found.chosen.waves.conditions["omega"])


def flat(noise: float, runs: int) -> Whitening:
    return Whitening(np.zeros((runs, GRID.size, 4)), np.zeros((runs, 4, 4)), noise)


def made(runs: int) -> tuple[FloatArray, FloatArray]:
    omega = np.linspace(30.0, 90.0, runs)
    return 1e-3 * np.exp(-((GRID / 0.2) ** 2)) * np.ones((runs, 1)), omega


def test_what_is_loud_leaves_the_delay_at_what_delays_are() -> None:
    wave, omega = made(4)
    found, std = fitted_delay(earlier(wave, omega, -5e-5), wave, omega, flat(10.0, 4), GRID.size)
    assert std == pytest.approx(STD, rel=1e-3)
    assert abs(found) < 1e-3 * STD


def test_its_deviation_is_that_of_repeated_fits() -> None:
    wave, omega = made(4)
    random, noise = np.random.default_rng(0), 3e-5
    fits = [
        fitted_delay(
            wave + noise * random.standard_normal(wave.shape),
            wave,
            omega,
            flat(noise, 4),
            GRID.size,
        )
        for _ in range(200)
    ]
    values = np.array([value for value, _ in fits])
    assert np.std(values) == pytest.approx(fits[0][1], rel=0.2)
    assert abs(np.mean(values)) < 4.0 * fits[0][1] / np.sqrt(200)


def test_fewer_independent_samples_tell_less() -> None:
    wave, omega = made(4)
    whole, few = (
        fitted_delay(wave, wave, omega, flat(3e-6, 4), n)[1] for n in (GRID.size, GRID.size / 9)
    )
    assert whole < 0.3 * STD, "the waveform tells, not the prior"
    assert few == pytest.approx(3.0 * whole, rel=0.25)


@pytest.mark.parametrize("spread", [0.0, 30.0])
def test_an_angle_that_all_runs_share_is_no_delay(spread: float) -> None:
    wave, _ = made(4)
    omega = 60.0 + spread * np.array([-1.0, -0.3, 0.3, 1.0])
    turned = earlier(wave, np.ones(4), -3e-3)  # by an angle, whatever the speed
    found, std = fitted_delay(turned, wave, omega, flat(3e-6, 4), GRID.size)
    assert abs(found) < 2e-6
    assert (std == pytest.approx(STD, rel=1e-3)) is (spread == 0.0)
