"""Points of forces: one per run, one per pass of a sweep; repeats, cells and rates."""

from dataclasses import replace

import numpy as np
import pytest

from tests.magic_sweep import CAMBERS, Sweep, magic_sweep
from tirelib.inference.identify.force_data import ForceData
from tirelib.inference.identify.force_points import force_points, noise_of, set_points

PLAN = Sweep(loads=(1000.0, 2500.0), pressures=(0.8e5,), cambers=CAMBERS[:1])
DATA = magic_sweep(1, {}, PLAN)
POINTS = force_points(DATA)


def steady(load: list[float], angle: list[float]) -> ForceData:
    n = len(load)
    column = np.asarray
    nothing, flat = np.full(n, np.nan), np.zeros(n)
    return ForceData(
        column(load),
        np.full(n, 2e5),
        column(angle),
        flat,
        flat,
        nothing,
        nothing,
        -5.0 * column(load) * column(angle),
        nothing,
        np.arange(n),
    )


def test_steady_runs_are_one_point_each_in_their_order() -> None:
    data = steady([3000.0, 1000.0, 3010.0], [0.02, 0.04, 0.0201])
    found = force_points(data)
    np.testing.assert_array_equal(found.data.load, data.load)
    assert not found.sweep.any()
    assert (found.slip_rate == 0.0).all()
    assert found.cell[0] == found.cell[2] != found.cell[1]


def test_every_sample_counts_once_and_means_stay_means() -> None:
    assert POINTS.samples.sum() == len(DATA)
    assert POINTS.sweep.all()
    for name in ("load", "slip_angle", "Fy", "temperature"):
        whole = np.average(getattr(POINTS.data, name), weights=POINTS.samples)
        assert whole == pytest.approx(getattr(DATA, name).mean(), rel=1e-9, abs=1e-12)


def test_a_pass_stays_in_one_cell_and_in_one_stretch_of_time() -> None:
    # a pass at the sweep's highest rate lasts 0.1 s; none is longer than its turning point
    assert POINTS.samples.max() < 3.0 * 25.0
    order = np.argsort(POINTS.data.time)
    # turning points come back to a cell within half a second and are one pass
    assert (np.diff(POINTS.data.time[order]) > -0.5).all()


def test_the_rate_of_the_slip_angle_is_that_of_the_sweep() -> None:
    within = POINTS.data.time % 32.0
    wanted = np.deg2rad(9.0) * 4 * np.pi / 12.0 * np.cos(4 * np.pi * within / 12.0)
    steep = np.abs(wanted) > 0.08
    # the slip angle's noise of 2e-4 rad over a pass of 0.1 s
    np.testing.assert_allclose(POINTS.slip_rate[steep], wanted[steep], rtol=0.15)


def test_both_passes_of_a_sweep_that_is_done_twice_are_repeats() -> None:
    once = force_points(magic_sweep(1, {}, replace(PLAN, twice=False)))
    same = np.zeros(len(POINTS))
    assert noise_of(same, POINTS.cell)[2] > 2 * noise_of(np.zeros(len(once)), once.cell)[2]


def test_noise_is_what_repeats_scatter_by() -> None:
    rng = np.random.default_rng(0)
    cell = np.repeat(np.arange(400), 3)
    difference = 100.0 * np.arange(400)[cell] + 7.0 * rng.standard_normal(1200)
    noise, freedom, repeats = noise_of(difference, cell)
    # 800 degrees of freedom: a standard deviation to 2.5 %
    assert noise == pytest.approx(7.0, rel=0.08)
    assert (freedom, repeats) == (800, 400)
    unknown, freedom, repeats = noise_of(difference[:5], np.arange(5))
    assert np.isnan(unknown)
    assert (freedom, repeats) == (0, 0)


def test_set_points_hold_together_and_a_sweep_of_load_is_cut_into_tenths() -> None:
    three = np.array([1000.0, 1010.0, 1990.0, 2010.0, 4000.0])
    number = set_points(three)
    assert number[0] == number[1] != number[2] == number[3] != number[4]
    ramp = np.geomspace(500.0, 3000.0, 4000)
    part = set_points(ramp)
    ratios = [ramp[part == k].max() / ramp[part == k].min() for k in np.unique(part)]
    assert max(ratios) < np.exp(0.1) * 1.001
    assert len(ratios) == 18
    assert (set_points(np.array([np.nan, 5.0])) == [-1, 0]).all()


def test_a_tire_that_rolls_backward_has_a_negative_speed() -> None:
    data = replace(DATA, omega=np.full(len(DATA), -50.0))
    assert (force_points(data).conditions.speed < 0.0).all()
    assert (POINTS.conditions.speed > 0.0).all()
