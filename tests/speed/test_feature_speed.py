"""Cost of the measured chain, beside what scipy's filter alone takes on the same samples.

Run by `make bench`. Goals: features of one turn of five gages (10 kHz, 65 km/h) under 1 ms; a
campaign of 60 runs featured in under 3 s, reading included.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from tests.synthetic import LATERAL, RATE, record, synthetic_run, write
from tirelib.campaign import read_campaign
from tirelib.measured.features import extract_features
from tirelib.measured.observations import observe
from tirelib.measured.signal import cut_turns

pytestmark = pytest.mark.speed
TURNS = 20


@pytest.fixture(scope="module")
def strain() -> np.ndarray:
    return record(turns=TURNS, noise=4e-6)[0]


@pytest.mark.benchmark(group="twenty turns of five gages")
def test_floor_scipy_filter(benchmark: Any, strain: np.ndarray) -> None:
    sos = butter(4, 225.0, fs=RATE, output="sos")
    benchmark(sosfiltfilt, sos, strain)


@pytest.mark.benchmark(group="twenty turns of five gages")
def test_turns_and_features(benchmark: Any, strain: np.ndarray) -> None:
    found = benchmark(lambda: extract_features(cut_turns(strain, RATE, LATERAL, speed=18.0)))
    assert len(found) == TURNS
    per_turn = benchmark.stats.stats.median / TURNS
    benchmark.extra_info["ms per turn"] = round(1e3 * per_turn, 3)


@pytest.mark.benchmark(group="twenty turns of five gages")
def test_features_alone(benchmark: Any, strain: np.ndarray) -> None:
    turns = cut_turns(strain, RATE, LATERAL, speed=18.0)
    benchmark(extract_features, turns)


@pytest.mark.benchmark(group="campaign of sixty runs")
def test_campaign_of_sixty_runs(benchmark: Any, tmp_path: Path) -> None:
    folder = write(tmp_path / "sixty", [synthetic_run(i) for i in range(60)])
    observed = benchmark.pedantic(
        lambda: observe([read_campaign(folder)]), rounds=3, warmup_rounds=1
    )
    assert np.unique(observed.run).size == 60
