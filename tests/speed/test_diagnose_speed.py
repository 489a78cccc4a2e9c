"""How the cost of a diagnosis grows: with the runs and with the effects no faster than they do."""

import time
from collections.abc import Callable

import numpy as np
import pytest

from tests.unit.inference.diagnose.planted import runs
from tests.unit.inference.identify.model_waves import TIRE
from tirelib.effects import CATALOGUE
from tirelib.inference.diagnose.diagnose import diagnose
from tirelib.inference.identify.campaign_data import StraightRuns, straight_runs
from tirelib.model.base import values_of

pytestmark = [pytest.mark.speed, pytest.mark.usefixtures("copies")]

EFFECTS = [effect for effect in CATALOGUE.values() if effect.hook != "brush"]


def cost(work: Callable[[], object]) -> float:
    """Return the least processor time of two calls."""
    times = []
    for _ in range(2):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return min(times)


def several(times: int) -> StraightRuns:
    """Return the planted runs repeated."""
    waves = runs().waves
    index = np.tile(np.arange(len(waves)), times)
    return straight_runs(waves.take(index))


def test_the_cost_grows_no_faster_than_the_runs() -> None:
    small, large = several(2), several(6)
    values = values_of(TIRE)
    few = cost(lambda: diagnose(small, values, EFFECTS))
    many = cost(lambda: diagnose(large, values, EFFECTS))
    assert many < 1.5 * 3.0 * few


def test_the_cost_grows_no_faster_than_the_effects() -> None:
    given, values = several(2), values_of(TIRE)
    living = [e for e in EFFECTS if not e.untestable and "lateral" not in e.varies_with]
    few = cost(lambda: diagnose(given, values, living[:6]))
    many = cost(lambda: diagnose(given, values, living[:18]))
    assert many < 1.5 * 3.0 * few
