"""A law guessed by sparse regression: found where there is one, none where there is none."""

import numpy as np
import pytest

from tests.unit.inference.diagnose.planted import runs
from tirelib.core.arrays import FloatArray
from tirelib.effects.state import Operating
from tirelib.inference.diagnose.guess import guess_law
from tirelib.measured.waveforms import GRID


@pytest.fixture(scope="module")
def given() -> tuple[FloatArray, Operating, FloatArray]:
    data = runs().data(with_deflection=False)
    half = 0.2 * np.sqrt(data.points.load / 4000.0)
    return data.strain, data.points, np.stack([-half, half], axis=1)


def test_a_law_of_angle_and_speed_is_found_with_its_size(
    given: tuple[FloatArray, Operating, FloatArray],
) -> None:
    strain, points, edges = given
    law = 30e-6 * (points.speed / 20.0)[:, None] ** 2 * np.cos(2.0 * GRID)
    noise = 1e-6 * np.random.default_rng(1).standard_normal(law.shape)
    guess = guess_law(law + noise, strain, points, edges, lambda rows: rows / 1e-5)
    assert guess is not None
    (term,) = guess.terms
    assert (term.shape, term.powers) == ("cos(2 phi)", (("speed", 2.0),))
    assert term.coefficient == pytest.approx(30e-6, rel=0.02)
    assert guess.explained > 0.95
    assert guess.powers["speed"].low < 2.0 < guess.powers["speed"].high
    assert guess.powers["speed"].value == pytest.approx(2.0, abs=0.05)
    assert guess.powers["load"].value == pytest.approx(0.0, abs=0.05)
    assert guess.law.startswith("30")
    assert "(speed/20 m/s)^2" in guess.law


def test_powers_are_those_of_the_law_though_the_fit_took_its_mean(
    given: tuple[FloatArray, Operating, FloatArray],
) -> None:
    strain, points, edges = given
    law = 30e-6 * (points.speed / 20.0)[:, None] ** 2 * np.cos(2.0 * GRID)

    def fitted(rows: FloatArray) -> FloatArray:
        return (rows - rows.mean(axis=1, keepdims=True)) / 1e-5

    noise = 1e-6 * np.random.default_rng(4).standard_normal(law.shape)
    guess = guess_law(law + noise, strain, points, edges, fitted)
    assert guess is not None
    assert guess.powers["load"].value == pytest.approx(0.0, abs=0.1)
    assert guess.powers["speed"].value > 0.5


def test_an_interval_of_a_power_is_the_scatter_of_repeats(
    given: tuple[FloatArray, Operating, FloatArray],
) -> None:
    """Where a run's noise has ten independent numbers, as it is taken to have."""
    strain, points, edges = given
    law = 30e-6 * (points.speed / 20.0)[:, None] ** 2 * np.cos(2.0 * GRID)
    order = np.arange(1, 6)[:, None] * GRID
    waves = np.concatenate([np.cos(order), np.sin(order)])
    random, found = np.random.default_rng(5), []
    for _ in range(30):
        noise = 3e-6 * random.standard_normal((len(points), 10)) @ waves
        guess = guess_law(law + noise, strain, points, edges, lambda rows: rows / 1e-5)
        assert guess is not None
        found.append(guess.powers["speed"])
    scatter = np.std([power.value for power in found], ddof=1)
    # thirty draws tell a deviation within 13 %
    assert scatter == pytest.approx(np.mean([power.half for power in found]) / 1.96, rel=0.25)


def test_nothing_is_guessed_of_noise(given: tuple[FloatArray, Operating, FloatArray]) -> None:
    strain, points, edges = given
    noise = 1e-5 * np.random.default_rng(2).standard_normal(strain.shape)
    assert guess_law(noise, strain, points, edges, lambda rows: rows / 1e-5) is None


def test_a_law_that_fails_on_left_out_levels_is_not_told(
    given: tuple[FloatArray, Operating, FloatArray],
) -> None:
    strain, points, edges = given
    # another sign and shape in every run: nothing that a condition tells
    random = np.random.default_rng(3)
    rest = (
        1e-5
        * random.standard_normal((len(points), 1))
        * np.cos(GRID + random.uniform(0, 6, (len(points), 1)))
    )
    assert guess_law(rest, strain, points, edges, lambda rows: rows / 1e-5) is None
