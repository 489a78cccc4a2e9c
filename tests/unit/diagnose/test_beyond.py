"""What a joint fit leaves is weighed by what noise and structure leave in every sample."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tirelib.diagnose.noise import WhiteNoise
from tirelib.diagnose.stage import USUAL, Stage
from tirelib.diagnose.structure import ALIKE, LEAST, spread_of

SAMPLES = 360


def beyond(rms: float, noise: WhiteNoise, runs: int) -> float:
    """Return it where a joint fit leaves so much in every whitened sample."""
    variance = spread_of(noise.smooth, runs) ** 2
    after = runs * SAMPLES * rms**2 / variance  # as the metric counts what nothing explains
    stage: Any = SimpleNamespace(
        noise=noise,
        scores=SimpleNamespace(after=after),
        model=SimpleNamespace(waveform=np.zeros((runs, SAMPLES))),
        ranking=SimpleNamespace(structure=SimpleNamespace(variance=variance)),
    )
    return float(vars(Stage)["beyond"].fget(stage))


@pytest.mark.parametrize("smooth", [0.3, 1.5])
def test_noise_is_no_more_than_noise_however_smooth_it_is(smooth: float) -> None:
    assert beyond(0.3, WhiteNoise(0.3, smooth), 15) == pytest.approx(1.0, rel=0.01)
    assert beyond(0.6, WhiteNoise(0.3, smooth), 15) == pytest.approx(4.0, rel=0.01)


def test_without_noise_the_unit_is_a_share_of_what_structure_outside_leaves_at_least() -> None:
    quiet = WhiteNoise(0.0, 0.0)
    usual = LEAST * float(np.sqrt(USUAL))
    assert beyond(usual, quiet, ALIKE) == pytest.approx(1.0)
    # it repeats in like runs: four times the runs allow twice as much
    assert beyond(2.0 * usual, quiet, 4 * ALIKE) == pytest.approx(1.0)
    assert beyond(usual, quiet, 4) == pytest.approx(1.0)
