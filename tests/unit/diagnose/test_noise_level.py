"""The noise level of repeats is a matter of what is known, not of the errors of differences."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tirelib.arrays import FloatArray
from tirelib.diagnose.noise import white_level

SAMPLES = 180
ANGLE = 2.0 * np.pi * np.arange(SAMPLES) / SAMPLES
RANDOM = np.random.default_rng(4)
# smooth noise, as repeats have it: a few of the lowest orders
ORDERS = np.concatenate([[np.cos(k * ANGLE), np.sin(k * ANGLE)] for k in range(1, 6)])
STRAIN = 1e-6 * RANDOM.standard_normal((12, len(ORDERS))) @ ORDERS
GROUP = np.repeat(np.arange(6), 2)


def level(slopes: FloatArray) -> float:
    """Return the level of repeats in pairs, with slopes (n_free, n_phi) that all runs share."""
    runs: Any = SimpleNamespace(waves=SimpleNamespace(group=GROUP))
    whiten = SimpleNamespace(basis=np.tile(np.eye(SAMPLES, 4), (12, 1, 1)), noise=1e-5)
    model: Any = SimpleNamespace(whiten=whiten, slopes=np.tile(slopes[:, None], (1, 12, 1)))
    return white_level(runs, model, STRAIN)


def test_two_stiffnesses_that_one_pressure_cannot_tell_apart_count_once() -> None:
    one = 1e-3 * np.exp(-8.0 * (ANGLE - np.pi) ** 2)
    alone = level(one[None])
    for error in ORDERS[:4]:  # what finite differences leave is smooth, as the noise is
        assert level(np.stack([one, 2.0 * one + 1e-10 * error])) == pytest.approx(alone)


def test_what_slopes_explain_of_the_differences_is_no_noise() -> None:
    assert level(ORDERS) < 1e-3 * level(np.zeros((1, SAMPLES)))
