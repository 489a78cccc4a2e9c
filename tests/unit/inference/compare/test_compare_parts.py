"""Laws of the parts: set points, noise, contact length, floor, forces' words."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.synthetic import waveform
from tests.unit.inference.compare.compare_synthetic import bump, model_file, waveforms
from tirelib.campaign import Tolerance
from tirelib.inference.compare.model import model_of
from tirelib.inference.compare.regions import bin_edges, find_regions
from tirelib.inference.compare.set_points import predict_set_points
from tirelib.inference.compare.strain import compare_strain
from tirelib.inference.compare.tracks import contact_edges, pooled
from tirelib.inference.identify.noise import RepeatNoise
from tirelib.inference.identify.random_effects import scales
from tirelib.measured.waveforms import GRID

MODEL = model_of(model_file())


def shapes(n: int) -> np.ndarray:
    """Four slopes and the zero, the same for n runs."""
    wave = waveform(GRID)
    rows = [np.gradient(wave) * 30, np.cos(2 * GRID) * 2e-3, wave - wave.mean(), np.sin(GRID) * 0.1]
    return np.tile(np.stack([*rows, np.ones_like(GRID)], axis=1), (n, 1, 1))


def test_planted_set_points_are_predicted() -> None:
    rng = np.random.default_rng(3)
    n = 30
    scale = scales(Tolerance(0.005, 0.002, 0.001, 0.003), np.full(n, 1e-3))
    true = scale * rng.standard_normal((n, 4))
    tangent = shapes(n)
    rest = np.einsum("rnk,rk->rn", tangent[..., :4], true) + 4e-4
    rest += 1e-7 * rng.standard_normal(rest.shape)
    found = predict_set_points(rest, tangent, scale, 1e-7)
    assert found.value == pytest.approx(true, abs=1e-4)
    # the zero of the strain is free
    assert rest - found.shift == pytest.approx(0.0, abs=1e-6)


def test_little_is_predicted_where_the_tolerance_is_small_beside_the_noise() -> None:
    rng = np.random.default_rng(3)
    n = 10
    scale = np.full((n, 4), 1e-6)
    rest = 1e-4 * rng.standard_normal((n, GRID.size))
    found = predict_set_points(rest, shapes(n), scale, 1e-4)
    assert np.abs(found.scaled).max() < 0.2


def test_a_misfit_in_the_contact_is_not_taken_for_a_load_error() -> None:
    found = compare_strain(waveforms(plant=bump(-0.1, 0.1, 5e-4), spread=0.0), MODEL)
    assert np.abs(found.points.scaled[:, 0]).max() < 1.0


def test_the_variance_of_one_sample_is_that_of_the_noise_and_means_are_surer() -> None:
    power = np.zeros(GRID.size // 2 + 1)
    power[1:25] = 9e-12 / 24
    noise = RepeatNoise(3e-6, 5, power, 200.0, 50.0)
    single, few, turn = np.zeros((3, GRID.size))
    single[17], few[10:30], turn[:] = 1.0, 1 / 20, 1 / GRID.size
    variance = noise.variance(np.stack([single, few, turn]))
    assert variance[0] == pytest.approx(9e-12, rel=1e-9)
    assert variance[1] < 0.7 * variance[0]
    assert variance[2] == pytest.approx(0.0, abs=1e-25)


def test_the_mean_of_a_region_is_twice_as_sure_with_four_times_the_runs() -> None:
    power = np.full(GRID.size // 2 + 1, 9e-12 / GRID.size)
    noise = RepeatNoise(3e-6, 5, power, 200.0, 50.0)
    inside = (bin_edges()[20] <= GRID) & (bin_edges()[24] > GRID)
    deviation = []
    for n in (4, 16):
        still: Any = SimpleNamespace(
            tangent=np.zeros((n, GRID.size, 5)), covariance=np.zeros((n, 5, 5))
        )
        rest = np.tile(1e-4 * inside, (n, 1))
        (found,) = find_regions(rest, rest, np.ones(n, dtype=bool), (), noise, still)
        assert (found.start, found.stop) == (bin_edges()[20], bin_edges()[24])
        own = noise.variance(inside[None] / inside.sum())[0]
        assert found.std == pytest.approx(np.sqrt(own / n))
        deviation.append(found.std)
    assert deviation[0] == pytest.approx(2.0 * deviation[1])


def test_stated_deviations_hold_on_new_noise() -> None:
    """Mean differences over their own standard deviation scatter by one."""
    ratios = []
    for seed in range(6):
        found = compare_strain(waveforms(seed=seed), MODEL)
        ratios += [c.mean / c.std for c in found.table if c.by == "all"]
    # 36 ratios, neighbours correlated; noise up to 15 % too large
    assert 0.4 < np.sqrt(np.mean(np.square(ratios))) < 1.5


def test_contact_length_is_from_steepest_rise_to_steepest_fall() -> None:
    for half in (0.15, 0.22):
        wave = waveform(GRID, half=half, edge=0.04, dip=0.0)[None]
        assert np.ptp(contact_edges(wave)) == pytest.approx(2 * half, abs=2e-3)
        moved = waveform(GRID - 0.03, half=half, edge=0.04, dip=0.0)[None]
        assert np.ptp(contact_edges(moved)) == pytest.approx(2 * half, abs=4e-3)


def test_tracks_of_own_data_agree_within_their_bands() -> None:
    found = compare_strain(waveforms(), MODEL)
    names = [track.name for track in found.tracks]
    assert names == ["contact length", "deflection", "contact entry", "contact exit"]
    length, depth, entry, leaving = found.tracks
    for track, room in ((length, 0.2e-3), (depth, 0.2e-3), (entry, 3e-4), (leaving, 3e-4)):
        band = np.hypot(track.model_std, np.nan_to_num(track.noise)) + room
        assert (np.abs(track.model - track.measured) < 3.0 * band).mean() > 0.9
    assert length.measured.max() > 1.3 * length.measured.min()


def test_pooled_deviation_knows_only_repeats() -> None:
    values = np.array([1.0, 3.0, 10.0, 14.0, 100.0])
    # (2 + 8) / 2 degrees of freedom
    std, freedom = pooled(values, np.array([0, 0, 1, 1, 2]))
    assert std == pytest.approx(np.sqrt(5.0))
    assert freedom == 2
    unknown, freedom = pooled(values, np.arange(5))
    assert np.isnan(unknown)
    assert freedom == 0


def test_the_floor_is_what_the_history_says_and_only_for_these_data() -> None:
    waves, file = waveforms(plant=bump(-0.1, 0.1, 3e-4)), model_file()

    def floor(*entries: dict[str, Any], data: str = "hash") -> float:
        model = model_of(replace(file, extra={"history": list(entries)}))
        return compare_strain(waves, model, data).floor.value

    assert np.isnan(floor())
    last = {"floor": 2.5, "data_sha256": "hash"}
    assert floor({"floor": 3.0, "data_sha256": "hash"}, last) == 2.5
    assert floor(last, {"floor": 9.0, "data_sha256": "hash", "quantity": "Fy"}) == 2.5
    assert np.isnan(floor(last, data="other"))


def test_a_smooth_misfit_is_known_as_smooth_and_a_ripple_is_not() -> None:
    smooth = compare_strain(
        waveforms(
            plant=lambda load, phi: np.outer(load / 4000.0, 5e-5 * np.exp(-((phi / 0.2) ** 2)))
        ),
        MODEL,
    )
    ripple = compare_strain(
        waveforms(plant=lambda load, phi: np.outer(np.cos(load), 5e-5 * np.cos(23 * phi))), MODEL
    )
    assert smooth.floor.share > 0.8
    assert ripple.floor.share < 0.5
