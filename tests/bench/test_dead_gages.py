"""A gage that stands still while the wheel turns is named, once."""

import numpy as np
import pytest

from tirebench.estimator.dead_gages import DeadGages
from tirebench.estimator.standing import Level
from tirelib.core.arrays import FloatArray

LATERAL = (0.06, -0.03, 0.0, 0.03, -0.06)


def level(swing: list[float]) -> Level:
    """Return a block of wheel 3 whose gages swing so much [microstrain]."""
    high: FloatArray = 1e-6 * np.array(swing)
    return Level(3, 0.25, np.zeros(5), np.zeros(5), high, np.zeros(5))


TURNS = level([1500.0, 20.0, 1800.0, 1600.0, 400.0])
STANDS = level([10.0, 0.0, 10.0, 10.0, 10.0])
WHOLE = level([1500.0, 1500.0, 1800.0, 1600.0, 400.0])


def test_a_dead_gage_is_named_with_its_place_once() -> None:
    gages = DeadGages(LATERAL)
    assert gages.take([TURNS]) == []
    assert gages.take([STANDS, TURNS]) == ["wheel 3: gage 2 (y -30 mm) is dead"]
    assert gages.take([WHOLE, TURNS, TURNS, TURNS]) == []
    assert gages.said == ["wheel 3: gage 2 (y -30 mm) is dead"]


@pytest.mark.parametrize(
    "blocks",
    [[STANDS] * 9, [TURNS, WHOLE] * 9, [level([1500.0, np.nan, 1800.0, 1600.0, 400.0])] * 9],
    ids=["stands", "now and then", "nothing known"],
)
def test_no_gage_is_dead(blocks: list[Level]) -> None:
    assert DeadGages(LATERAL).take(blocks) == []


def test_without_positions_the_number_is_said() -> None:
    assert DeadGages().take([TURNS, TURNS]) == ["wheel 3: gage 2 is dead"]
