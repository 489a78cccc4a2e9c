"""Random effects whiten to unit variance; noise comes out of repeats."""

from dataclasses import replace

import numpy as np
import pytest

from tests.unit.inference.identify.model_waves import (
    ANGLE_STD,
    TIRE,
    TOLERANCE,
    made_waves,
    operating,
)
from tirelib.effects.state import Operating
from tirelib.inference.identify.noise import (
    LEAST_NOISE,
    RepeatNoise,
    independent,
    measured_tangents,
    repeat_noise,
)
from tirelib.inference.identify.random_effects import (
    angle_slope,
    scales,
    tangents,
    whitening_of,
)
from tirelib.measured.signal import LowPass
from tirelib.measured.waveforms import GRID, N_PHI, Waveforms
from tirelib.model.base import predict, values_of

NOISE = 1e-5
LOADS = np.array([2500.0, 4500.0, 6500.0])


@pytest.fixture(scope="module")
def waveform() -> np.ndarray:
    points = operating(LOADS, np.full(3, 2.1e5))
    found = predict(values_of(TIRE), points, low_pass=LowPass()).waveform
    assert found is not None
    return found


def linear_tangents(waveform: np.ndarray, points: Operating) -> np.ndarray:
    """Slopes of the linear ring by load, pressure, gain and angle, by differences."""

    def wave(at: Operating) -> np.ndarray:
        return np.asarray(predict(values_of(TIRE), at, low_pass=LowPass()).wave)

    here, step = wave(points), 1e-3
    heavier = wave(replace(points, load=points.load * (1.0 + step)))
    firmer = wave(replace(points, pressure=points.pressure * (1.0 + step)))
    return tangents(waveform, (heavier - here) / step, (firmer - here) / step)


def simulated(waveform: np.ndarray, draws: int, angle_std: float) -> np.ndarray:
    """Residuals with all four random effects and noise, (draws, n_runs, n_phi)."""
    rng = np.random.default_rng(5)
    points = operating(LOADS, np.full(3, 2.1e5))
    tangent = linear_tangents(waveform, points)
    size = np.array([TOLERANCE.load, TOLERANCE.pressure, TOLERANCE.gain, angle_std])
    part = rng.standard_normal((draws, 3, 4)) * size
    noise = NOISE * rng.standard_normal((draws, *waveform.shape))
    return np.asarray(np.einsum("rnk,drk->drn", tangent, part) + noise)


def whiten(waveform: np.ndarray, residual: np.ndarray, angle_std: float) -> np.ndarray:
    points = operating(LOADS, np.full(3, 2.1e5))
    scale = scales(TOLERANCE, np.full(3, angle_std))
    return whitening_of(linear_tangents(waveform, points), scale, NOISE)(residual)


def test_whitening_gives_unit_variance_on_what_the_rig_does(waveform: np.ndarray) -> None:
    residual = simulated(waveform, 400, ANGLE_STD)
    assert np.std(residual) > 1.5 * NOISE, "the random effects have to matter"
    white = whiten(waveform, residual, ANGLE_STD)
    # 432,000 numbers: their variance scatters by 0.2 %
    assert np.mean(white**2) == pytest.approx(1.0, abs=0.01)
    # and in the four directions of the random effects alone: 4800 numbers, 2 %
    points = operating(LOADS, np.full(3, 2.1e5))
    basis = np.linalg.qr(linear_tangents(waveform, points))[0]
    inside = np.einsum("rnk,drn->drk", basis, white)
    assert np.mean(inside**2) == pytest.approx(1.0, abs=0.08)


def test_whitening_leaves_no_correlation_between_random_directions(waveform: np.ndarray) -> None:
    white = whiten(waveform, simulated(waveform, 1500, ANGLE_STD), ANGLE_STD)
    points = operating(LOADS, np.full(3, 2.1e5))
    basis = np.linalg.qr(linear_tangents(waveform, points))[0]
    inside = np.einsum("rnk,drn->drk", basis, white)[:, 1]
    assert np.corrcoef(inside.T) == pytest.approx(np.eye(4), abs=0.12)  # 1/sqrt(1500) = 0.026


def test_an_unknown_angle_zero_makes_a_shift_free(waveform: np.ndarray) -> None:
    shift = 2e-3 * angle_slope(waveform)
    held = whiten(waveform, shift, 1e-5)
    free = whiten(waveform, shift, np.inf)
    assert np.sum(free**2) < 1e-3 * np.sum(held**2)


def test_tangents_are_derivatives(waveform: np.ndarray) -> None:
    points = operating(LOADS, np.full(3, 2.1e5))
    tangent = linear_tangents(waveform, points)
    h = 2e-4
    for k, name in ((0, "load"), (1, "pressure")):
        ends = [
            predict(
                values_of(TIRE),
                replace(points, **{name: getattr(points, name) * (1.0 + s)}),
                low_pass=LowPass(),
            ).waveform
            for s in (-h, h)
        ]
        assert ends[0] is not None
        assert ends[1] is not None
        slope = (ends[1] - ends[0]) / (2.0 * h)
        # a one-sided step of 1e-3 errs by its half times the curvature
        assert tangent[..., k] == pytest.approx(slope, abs=5e-3 * np.abs(slope).max())
    assert tangent[..., 2] == pytest.approx(waveform)


def test_the_slope_by_angle_is_that_of_a_series() -> None:
    wave = 3.0 * np.cos(5.0 * GRID + 0.4) - np.sin(40.0 * GRID)
    exact = -15.0 * np.sin(5.0 * GRID + 0.4) - 40.0 * np.cos(40.0 * GRID)
    assert angle_slope(wave) == pytest.approx(exact, abs=1e-9)
    assert angle_slope(np.cos(N_PHI / 2 * GRID)) == pytest.approx(0.0, abs=1e-9)


def test_what_follows_the_four_tangents_does_not_count(waveform: np.ndarray) -> None:
    tangent = linear_tangents(waveform, operating(LOADS, np.full(3, 2.1e5)))
    zero = np.concatenate([tangent, np.ones((3, N_PHI, 1))], axis=2)
    residual = simulated(waveform, 1, ANGLE_STD)
    found = whitening_of(zero, scales(TOLERANCE, np.full(3, ANGLE_STD)), NOISE)(residual)
    assert found == pytest.approx(whiten(waveform, residual, ANGLE_STD))


def test_an_angle_zero_that_is_unknown_may_be_off_by_a_radian() -> None:
    scale = scales(TOLERANCE, np.array([ANGLE_STD, ANGLE_STD, np.inf]))
    assert scale[:, :3] == pytest.approx(
        np.tile([TOLERANCE.load, TOLERANCE.pressure, TOLERANCE.gain], (3, 1))
    )
    assert scale[:, 3].tolist() == [ANGLE_STD, ANGLE_STD, 1.0]


def noise_of(waves: Waveforms, strain: np.ndarray) -> RepeatNoise:
    return repeat_noise(strain, waves.group, measured_tangents(waves, strain))


def test_noise_from_repeats_is_the_noise_put_in() -> None:
    noise = 3e-5
    waves = made_waves(noise=noise, repeats=6, seed=3)
    centre = waves.strain[:, 2]
    found = noise_of(waves, centre)
    assert found.repeats == 6
    # 6 x 356 numbers: 1.5 %; set points are taken out by their shapes
    assert found.std == pytest.approx(noise, rel=0.06)
    raw = repeat_noise(centre, waves.group, np.zeros((*centre.shape, 0)))
    assert raw.std > 1.1 * noise, "repeats differ by set points, which are no noise"
    flat = np.full(N_PHI, 1.0 / N_PHI)[None]
    assert found.variance(np.eye(N_PHI)[:1]) == pytest.approx(found.std**2)
    assert found.variance(flat) == pytest.approx(0.0, abs=1e-20), "waveforms have no mean"


def test_every_set_point_is_taken_out_of_the_repeats() -> None:
    """Without noise repeats differ by load, pressure, gain and angle alone: next to nothing left.

    Slopes between neighbours are secants, which leaves some tenths of the differences.
    """
    waves = made_waves(noise=0.0, repeats=6, seed=3)
    centre = waves.strain[:, 2]
    raw = repeat_noise(centre, waves.group, np.zeros((*centre.shape, 0)))
    tangent = measured_tangents(waves, centre)
    assert noise_of(waves, centre).std < 0.12 * raw.std
    for k in (0, 1):
        without = np.delete(tangent, k, axis=2)
        assert repeat_noise(centre, waves.group, without).std > 1.5 * noise_of(waves, centre).std


def test_measured_tangents_are_those_of_the_model() -> None:
    waves = made_waves(noise=0.0, repeats=0, random=False)
    found = measured_tangents(waves, waves.strain[:, 2])
    points = operating(waves.conditions["Fz"], waves.conditions["pressure"])
    model = linear_tangents(waves.strain[:, 2], points)
    for k in (0, 1):
        cosine = np.sum(found[..., k] * model[..., k], axis=1) / (
            np.linalg.norm(found[..., k], axis=1) * np.linalg.norm(model[..., k], axis=1)
        )
        # secants over a third of the load, and the linear ring; a wrong sign gives -1
        assert (cosine > 0.8).all(), k
        assert np.median(cosine) > 0.9
        size = np.linalg.norm(found[..., k]) / np.linalg.norm(model[..., k])
        assert size == pytest.approx(1.0, abs=0.25)


def test_a_condition_that_is_not_known_shows_no_slope() -> None:
    waves = made_waves(noise=0.0, repeats=1, random=False, loads=LOADS_FEW)
    lost = waves.conditions["pressure"] * np.nan
    bare = replace(waves, conditions={**waves.conditions, "pressure": lost})
    tangent = measured_tangents(bare, bare.strain[:, 2])
    assert (tangent[..., 1] == 0.0).all()
    assert np.isfinite(repeat_noise(bare.strain[:, 2], bare.group, tangent).std)


LOADS_FEW = (2400.0, 6000.0)


def test_the_mean_over_five_gages_has_less_noise() -> None:
    waves = made_waves(noise=3e-5, repeats=6, seed=3)
    found = noise_of(waves, waves.strain.mean(axis=1))
    assert found.std == pytest.approx(3e-5 / np.sqrt(5.0), rel=0.1)


def test_without_repeats_there_is_no_noise_value() -> None:
    waves = made_waves(repeats=0, loads=LOADS_FEW)
    found = noise_of(waves, waves.strain[:, 2])
    assert found.repeats == 0
    assert not found.known
    assert np.isnan(found.std)


def test_equal_repeats_have_a_floor() -> None:
    waves = made_waves(repeats=3, noise=0.0, random=False, loads=LOADS_FEW)
    assert noise_of(waves, waves.strain[:, 2]).std == LEAST_NOISE


def test_white_noise_has_as_many_independent_samples_as_orders() -> None:
    white = np.random.default_rng(0).standard_normal((400, N_PHI))
    assert independent(white) == pytest.approx(N_PHI, rel=0.05)
    assert independent(np.zeros((2, N_PHI))) == N_PHI


@pytest.mark.parametrize("size", [15, 16])
def test_white_noise_is_as_large_in_the_highest_harmonic_as_in_any_other(size: int) -> None:
    """An even number of samples has one wave that changes its sign from each to the next."""
    groups = 400
    drawn = NOISE * np.random.default_rng(0).standard_normal((2 * groups, size))
    drawn -= drawn.mean(axis=1, keepdims=True)
    nothing = np.zeros((2 * groups, size, 4))
    found = repeat_noise(drawn, np.repeat(np.arange(groups), 2), nothing)
    order = np.arange(1, size // 2 + 1)
    waves = np.cos(2.0 * np.pi * order[:, None] * np.arange(size) / size)
    waves /= np.linalg.norm(waves, axis=1, keepdims=True)
    # five harmonics of 400 pairs are taken together: their mean power is known to 3 %
    np.testing.assert_allclose(found.variance(waves) / found.std**2, 1.0, atol=0.15)
