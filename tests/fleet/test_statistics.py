"""Tires side by side: outliers, changes, and the join of siblings, on numbers that are known."""

import numpy as np
import pytest

pytest.importorskip("fsspec", reason="the extra tirelib[fleet] is not installed")

from tirelib.fleet.siblings import join
from tirelib.fleet.spread import centre_of, change_of, spread_of


def test_a_wide_interval_does_not_stand_out_and_a_narrow_one_does() -> None:
    rng = np.random.default_rng(0)
    values = 100.0 + rng.normal(0.0, 3.0, 20)
    stds = np.full(20, 1.0)
    values[4], stds[4] = 140.0, 20.0
    values[9] = 130.0
    values[13] = 131.0  # beside it, so that neither may hide the other
    found = spread_of(values, stds)
    assert np.flatnonzero(found.outlier).tolist() == [9, 13]
    assert found.scatter == pytest.approx(3.0, rel=0.4)


def test_equal_tires_seldom_stand_out() -> None:
    rng = np.random.default_rng(1)
    marked = [
        spread_of(rng.normal(0.0, 1.0, 12), np.full(12, 0.3)).outlier.any() for _ in range(60)
    ]
    # 5 % are allowed: more than 7 of 60 would come once in a hundred times
    assert sum(marked) <= 7


def test_scatter_is_zero_where_the_intervals_explain_everything() -> None:
    centre, scatter, doubt = centre_of(np.array([1.0, 1.1, 0.9]), np.array([1.0, 1.0, 1.0]))
    assert (centre, scatter) == (pytest.approx(1.0), 0.0)
    assert doubt == pytest.approx(1 / np.sqrt(3))


def test_a_slow_leak_is_found_and_weather_is_not() -> None:
    rng = np.random.default_rng(2)
    time = 86400.0 * np.arange(20.0)
    weather = 2.3 + rng.normal(0.0, 0.03, 20)
    still, leak = change_of(time, weather), change_of(time, weather - 0.01 * np.arange(20))
    assert still is not None
    assert leak is not None
    assert still.p > 0.01
    assert leak.p < 1e-4
    assert leak.change == pytest.approx(-0.19, abs=0.07)


def test_a_condition_that_drifts_is_taken_out() -> None:
    rng = np.random.default_rng(3)
    time = np.arange(30.0)
    pressure = 2.3 - 0.01 * time + rng.normal(0.0, 0.03, 30)
    radius = 305.0 + 8.0 * pressure + rng.normal(0.0, 0.05, 30)
    alone, given = change_of(time, radius), change_of(time, radius, [pressure])
    assert alone is not None
    assert given is not None
    assert alone.p < 1e-4 < given.p


def test_too_few_recordings_say_nothing() -> None:
    assert change_of(np.arange(4.0), np.arange(4.0)) is None
    assert change_of(np.zeros(9), np.arange(9.0)) is None


def test_joined_intervals_hold_and_a_poor_tire_gains() -> None:
    rng = np.random.default_rng(4)
    inside, alone, after, gain = [], [], [], []
    for _ in range(200):
        true = np.exp(rng.normal(np.log(2e5), 0.06, 8))
        relative = np.full(8, 0.02)
        relative[0] = 0.2
        values = true * (1.0 + relative * rng.standard_normal(8))
        found = join(values, relative * values)
        assert found is not None
        inside.append((found.low < true) & (true < found.high))
        alone.append(values[0] / true[0] - 1.0)
        after.append(found.value[0] / true[0] - 1.0)
        gain.append(found.gain[0])
    # 1,600 intervals: 95 % +- 1.6 % at three standard deviations, and the log of a value
    assert 0.925 < np.mean(inside) < 0.975
    assert np.std(after) < 0.5 * np.std(alone)
    assert np.mean(gain) == pytest.approx(np.std(alone) / np.std(after), rel=0.35)


def test_siblings_that_scatter_lend_nothing() -> None:
    values = np.array([100.0, 300.0, 700.0, 1500.0, 40.0])
    found = join(values, 0.02 * values)
    assert found is not None
    np.testing.assert_allclose(found.value, values, rtol=0.002)
    np.testing.assert_allclose(found.gain, 1.0, atol=0.01)
    assert join(values[:3], values[:3]) is None
