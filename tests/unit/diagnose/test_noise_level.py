"""The noise level of repeats is a matter of what is known, not of the errors of differences."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tirelib.arrays import FloatArray
from tirelib.diagnose.noise import WhiteNoise, white_noise

SAMPLES = 180
ANGLE = 2.0 * np.pi * np.arange(SAMPLES) / SAMPLES
RANDOM = np.random.default_rng(4)
# smooth noise, as repeats have it: a few of the lowest orders
ORDERS = np.concatenate([[np.cos(k * ANGLE), np.sin(k * ANGLE)] for k in range(1, 6)])
STRAIN = 1e-6 * RANDOM.standard_normal((12, len(ORDERS))) @ ORDERS
GROUP = np.repeat(np.arange(6), 2)


def noise(slopes: FloatArray) -> WhiteNoise:
    """Return the noise of repeats in pairs, with slopes (n_free, n_phi) that all runs share."""
    runs: Any = SimpleNamespace(waves=SimpleNamespace(group=GROUP))
    whiten = SimpleNamespace(basis=np.tile(np.eye(SAMPLES, 4), (12, 1, 1)), noise=1e-5)
    model: Any = SimpleNamespace(whiten=whiten, slopes=np.tile(slopes[:, None], (1, 12, 1)))
    return white_noise(runs, model, STRAIN)


def test_two_stiffnesses_that_one_pressure_cannot_tell_apart_count_once() -> None:
    one = 1e-3 * np.exp(-8.0 * (ANGLE - np.pi) ** 2)
    alone = noise(one[None]).smooth
    for error in ORDERS[:4]:  # what finite differences leave is smooth, as the noise is
        made = noise(np.stack([one, 2.0 * one + 1e-10 * error]))
        assert made.smooth == pytest.approx(alone)


def test_what_slopes_explain_of_the_differences_is_no_noise() -> None:
    none = noise(np.zeros((1, SAMPLES)))
    assert noise(ORDERS).sample < 1e-3 * none.sample


def test_a_smooth_shape_meets_more_of_smooth_noise_than_a_sample_does() -> None:
    made = noise(np.zeros((1, SAMPLES)))
    rms = float(np.sqrt(np.mean((STRAIN[::2] - STRAIN[1::2]) ** 2) / 2.0)) / 1e-5
    assert made.sample == pytest.approx(rms, rel=0.05)
    # ten of 180 orders hold all of it
    assert (made.smooth / made.sample) ** 2 == pytest.approx(SAMPLES / 10.0, rel=0.2)
