"""The transmitter's clock against the host's: what arrives soonest tells both."""

import numpy as np
import pytest

from tirebench.wire.clock import WINDOW, ClockFit

RATE, START = 100, 5_000_000_000
"""Frames a second, and the host's time of the first, [ns]."""


def fitted(drift: float, delay: float, seconds: int = 15) -> ClockFit:
    """Fit a clock that runs fast by a drift; a frame needs the delay [s] at least, and often more.

    One frame of each second, at a place of its own, comes without waiting.
    """
    fit, random = ClockFit(), np.random.default_rng(0)
    for second in range(seconds):
        prompt = random.integers(RATE)
        for k in range(RATE):
            sent = second + k / RATE
            late = 0.0 if k == prompt else random.exponential(5e-3) + 5e-4
            device = round(1e6 * (1.0 + drift) * sent)
            fit.push(device, START + round(1e9 * (sent + delay + late)))
    return fit


@pytest.mark.parametrize("drift", [0.0, 80e-6, -150e-6])
@pytest.mark.parametrize("seconds", [10, WINDOW + 15])
def test_a_moment_of_the_device_is_told_as_when_its_frame_could_have_come(
    drift: float, seconds: int
) -> None:
    delay = 1e-3
    fit = fitted(drift, delay, seconds)
    assert fit.drift_ppm == pytest.approx(1e6 * drift, abs=0.5)
    assert fit.residual < 2e-6
    for sent in (seconds - 8.0, seconds - 1.0, seconds + 10.0):  # within, and ahead of, the fit
        told = fit.host_time(1e6 * (1.0 + drift) * sent)
        # the device's clock counts whole microseconds
        assert told == pytest.approx(1e-9 * START + sent + delay, abs=1e-5)


def test_a_clock_that_begins_anew_is_fitted_anew() -> None:
    fit = fitted(0.0, 1e-3)
    fit.restart()
    assert np.isnan([fit.drift_ppm, fit.residual, fit.host_time(1e6)]).all()
