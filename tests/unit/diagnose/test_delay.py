"""The delay of the gages: a shift that goes with the speed, fitted with the tire."""

from dataclasses import replace

import numpy as np
import pytest

from tests.unit.diagnose.planted import model_file, runs
from tests.unit.identify.model_waves import TIRE
from tirelib.arrays import FloatArray
from tirelib.compare.model import model_of
from tirelib.diagnose.refit import Refit, refit
from tirelib.effects import CATALOGUE
from tirelib.extend.extension import _Strain
from tirelib.identify.delay import UNIT, by_delay, earlier, late
from tirelib.identify.waveform_fit import Data
from tirelib.model.base import predict, values_of
from tirelib.model.state import State
from tirelib.waveforms import GRID

DELAY = 4e-5
LAG = (0.2, 0.02)
"""Of first order: s_2 = s_1^2 / 2, [ms]."""


def shown(data: Data, delay: float) -> FloatArray:
    """Return the data's waveforms as gages show them that are late."""
    state = State.of(values_of(TIRE), data.points, GRID).but(waveform=data.strain)
    return late(delay)[1](state).wave


@pytest.fixture(scope="module")
def data() -> Data:
    return runs().data(with_deflection=False)


@pytest.fixture(scope="module")
def fitted(data: Data) -> tuple[Refit, Refit]:
    """Return the fits on time and late."""
    start = values_of(TIRE)
    return refit(data, start), refit(replace(data, strain=shown(data, DELAY)), start)


def test_each_run_comes_later_by_its_speed(data: Data) -> None:
    wave = np.cos(3.0 * GRID) + 0.2 * np.sin(7.0 * GRID)
    state = State.of(values_of(TIRE), data.points, GRID)
    moved = late(DELAY)[1](state.but(waveform=np.tile(wave, (len(data.points), 1)))).wave
    angle = GRID - DELAY * np.asarray(data.points.omega)[:, None]
    np.testing.assert_allclose(moved, np.cos(3.0 * angle) + 0.2 * np.sin(7.0 * angle), atol=1e-12)
    assert np.ptp(data.points.omega) > 10.0, "speeds differ"


def test_delays_add_up_and_none_changes_no_bit(data: Data, fitted: tuple[Refit, Refit]) -> None:
    assert np.array_equal(shown(data, 0.0), data.strain)
    smooth = replace(data, strain=fitted[0].waveform)
    twice = shown(replace(data, strain=shown(smooth, DELAY)), DELAY)
    np.testing.assert_allclose(twice, shown(smooth, 2.0 * DELAY), atol=1e-12)
    back = earlier(twice, data.points.omega, 2.0 * DELAY)
    np.testing.assert_allclose(back, smooth.strain, atol=1e-12)


def test_the_slope_is_the_derivative(data: Data) -> None:
    step = 1e-7
    change = (shown(data, step) - shown(data, -step)) / (2.0 * step)
    slope = by_delay(data.strain, data.points.omega) / UNIT
    np.testing.assert_allclose(slope, change, atol=1e-6 * np.abs(change).max())


def test_a_late_campaign_is_fitted_as_well_as_one_on_time(
    data: Data, fitted: tuple[Refit, Refit]
) -> None:
    prompt, behind = fitted
    assert behind.delay - prompt.delay == pytest.approx(DELAY, abs=2e-6)
    assert abs(prompt.delay) < 2e-6
    assert behind.error == pytest.approx(prompt.error, rel=0.01)
    apart = behind.whiten(behind.on_time(data.points).waveform - prompt.waveform)
    assert np.sqrt(np.mean(apart**2)) < 0.05, "a twentieth of the noise"


def test_the_model_shows_the_delay_wherever_it_is_solved(
    data: Data, fitted: tuple[Refit, Refit]
) -> None:
    for model in (fitted[1], fitted[1].on_time(data.points)):
        wave = predict(
            model.values,
            data.points,
            model.changes,
            low_pass=data.low_pass,
            correction=model.correction,
        ).wave
        np.testing.assert_allclose(wave, model.waveform, atol=1e-9)
    assert model.delay == 0.0


def test_without_a_trigger_there_is_nothing_to_fit(data: Data) -> None:
    free = replace(data, strain=shown(data, DELAY), angle_std=np.full(len(data.points), np.inf))
    assert abs(refit(free, values_of(TIRE)).delay) < 1e-6


def test_an_effect_that_comes_late_is_added_from_what_no_delay_could_do() -> None:
    planted = runs("low_pass", LAG).data(with_deflection=False)
    base = refit(planted, values_of(TIRE))
    assert base.delay > 1e-4, "it looks like a delay at first"
    subject = _Strain(runs("low_pass", LAG), model_of(model_file()), None)
    after = subject.with_effect(base, CATALOGUE["low_pass"])
    assert after.strengths[0] == pytest.approx(LAG, abs=0.01)
    assert abs(after.delay) < 1e-5
    assert after.error < 0.3 * base.error
