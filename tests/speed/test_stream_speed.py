"""Time of a push: `make bench`. Goals are in docs/reference/fmu_python.md; nothing fails on time.

The first two are pushed as they come in a real stream, ten samples at a time, so that a frame finds
the processor's caches as the frame before left them.
"""

from typing import Any

import numpy as np
import pytest

from tests.fmu import live
from tests.synthetic import LATERAL, record
from tirelib.stream import StreamEstimator

pytestmark = pytest.mark.speed
RATE = 1e4
HELD = {"speed": live.SPEED, "pressure": live.PRESSURE, "camber": 0.0}
TURNS = 60


def played(benchmark: Any, *, turn_ends: bool) -> None:
    """Time the pushes that end a turn, or the others, of a stream at 65 km/h and 10 kHz."""
    strain, _, _ = record(turns=TURNS, speed=live.SPEED, noise=4e-6, rate=RATE)
    frames = [strain[:, first : first + 10] for first in range(0, strain.shape[1] - 9, 10)]
    probe = StreamEstimator(live.calibration(), RATE, lateral=LATERAL)
    ends = [bool(probe.push(frame, **HELD)) for frame in frames]
    estimator = StreamEstimator(live.calibration(), RATE, lateral=LATERAL)
    waiting = iter(range(len(frames)))

    def next_frame() -> tuple[tuple[np.ndarray], dict[str, float]]:
        for number in waiting:
            if ends[number] == turn_ends:
                return (frames[number],), HELD
            estimator.push(frames[number], **HELD)
        raise StopIteration

    rounds = (sum(ends) if turn_ends else len(ends) - sum(ends)) - 5
    benchmark.pedantic(estimator.push, setup=next_frame, rounds=rounds)
    times = np.sort(benchmark.stats.stats.data) * 1e6
    for share in (50, 99):
        benchmark.extra_info[f"p{share}_us"] = round(float(np.percentile(times, share)), 1)
    what = "turn end" if turn_ends else "push of 10"
    print(f"\n{what}: {dict(benchmark.extra_info)}")


def test_push_of_ten_samples(benchmark: Any) -> None:
    """Goal: median under 30 us, 99th percentile under 100 us."""
    played(benchmark, turn_ends=False)


def test_push_that_ends_a_turn(benchmark: Any) -> None:
    """Goal: under 1.5 ms."""
    played(benchmark, turn_ends=True)


def test_state(benchmark: Any) -> None:
    """What getFMUstate costs."""
    strain, _, _ = record(turns=3.5, speed=live.SPEED, rate=RATE)
    estimator = StreamEstimator(live.calibration(), RATE)
    estimator.push(strain, **HELD)
    benchmark(estimator.state)
