"""The noise of forces is of the data alone."""

from dataclasses import replace

import numpy as np
import pytest

from tests.magic_sweep import Sweep, magic_sweep
from tirelib.inference.identify.force_data import ForceData
from tirelib.inference.identify.force_noise import force_noise
from tirelib.inference.identify.force_points import ForcePoints, force_points, noise_of

PLAN = Sweep(pressures=(0.8e5,), cambers=(0.0,))


def test_the_slope_of_the_force_within_a_cell_is_no_noise() -> None:
    points = force_points(magic_sweep(81, {}, PLAN))
    repeated = np.bincount(points.cell)[points.cell] > 1
    truth = PLAN.noise * np.sqrt(np.mean(1.0 / points.samples[repeated]))
    told, freedom, cells = force_noise(points, points.data.Fy)
    # a few hundred degrees of freedom, and slopes that are not known exactly
    assert told == pytest.approx(truth, rel=0.15)
    assert noise_of(points.data.Fy, points.cell)[0] > 1.5 * told
    assert (freedom, cells) == noise_of(points.data.Fy, points.cell)[1:]


def scattered(seed: int, bent: bool) -> tuple[ForcePoints, np.random.Generator]:
    """Return points at set points that repeat badly, with a force that has no noise."""
    random = np.random.default_rng(seed)
    angle = np.deg2rad(np.tile(np.arange(-4.0, 5.0), 6) + 0.1 * random.uniform(-1, 1, 54))
    load = np.repeat([2e3, 4e3, 6e3], 18) * (1.0 + 0.004 * random.uniform(-1, 1, 54))
    pressure = 2e5 * (1.0 + 0.002 * random.standard_normal(54))
    force = -load * np.tanh(12.0 * angle) if bent else -4e4 * angle
    nothing, flat = np.full(54, np.nan), np.zeros(54)
    data = ForceData(
        load, pressure, angle, flat, flat, nothing, nothing, force, nothing, np.arange(54)
    )
    return force_points(data), random


def test_set_points_that_repeat_badly_are_no_noise_and_a_flat_condition_no_slope() -> None:
    points, random = scattered(2, bent=True)
    force = points.data.Fy + 3.0 * random.standard_normal(54)
    told, _, cells = force_noise(points, force)
    raw = noise_of(force, points.cell)[0]
    assert cells > 15
    assert told < 0.3 * raw


def test_a_force_that_bends_between_cells_leaves_an_eighth_of_what_it_changes_within_them() -> None:
    shares = []
    for seed in range(30):
        points, _ = scattered(seed, bent=True)
        force = points.data.Fy
        shares.append(force_noise(points, force)[0] / noise_of(force, points.cell)[0])
    assert np.sqrt(np.mean(np.square(shares))) < 0.155


def test_the_noise_of_the_slopes_is_not_counted_as_noise_of_the_force() -> None:
    found = []
    for seed in range(60):
        points, random = scattered(seed, bent=False)
        force = points.data.Fy + 3.0 * random.standard_normal(54)
        found.append(force_noise(points, force)[0])
    # 60 variances of some 25 degrees of freedom each; 1.2 where it is counted
    assert np.mean(np.square(found)) / 9.0 == pytest.approx(1.0, abs=0.1)


def test_without_repeats_the_noise_is_unknown() -> None:
    points = force_points(magic_sweep(81, {}, PLAN))
    alone = replace(points, cell=np.arange(len(points)))
    assert np.isnan(force_noise(alone, points.data.Fy)[0])
