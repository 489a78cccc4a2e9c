"""Samples that are missing or wild: how many of them a straight line may replace."""

import numpy as np
import pytest

from tirelib.core.flags import TurnFlag
from tirelib.measured.signal.quality import LONGEST_BRIDGE, inspect

STEP = 0.005
WINDOW = 1e-3 * np.cos(STEP * np.arange(-600, 600))[None]


@pytest.mark.parametrize("lost", [1, LONGEST_BRIDGE, LONGEST_BRIDGE + 1, 20])
@pytest.mark.parametrize("first", [0, 400, 1180])
def test_missing_samples_are_bridged_up_to_two_in_a_row(lost: int, first: int) -> None:
    holed = WINDOW.copy()
    holed[0, first : first + lost] = np.nan
    mended, flags = inspect(holed, STEP)
    bridged = lost <= LONGEST_BRIDGE
    assert bool(flags[0] & TurnFlag.BRIDGED) == bridged
    assert bool(flags[0] & TurnFlag.GAP) != bridged
    if bridged:
        # a line over three steps, or the next sample at the end of the window
        assert np.abs(mended - WINDOW).max() < 2.0 * np.abs(np.diff(WINDOW)).max()


def test_single_samples_that_are_missing_here_and_there_are_no_gap() -> None:
    holed = WINDOW.copy()
    holed[0, 10:1190:4] = np.nan
    assert inspect(holed, STEP)[1].tolist() == [int(TurnFlag.BRIDGED)]


@pytest.mark.parametrize("beside", [1, 2])
def test_a_spike_beside_missing_samples_is_missing_as_well(beside: int) -> None:
    holed = WINDOW.copy()
    holed[0, 500 : 500 + beside] = np.nan
    holed[0, 505] += 1e-3
    apart = inspect(holed, STEP)[1]
    assert apart[0] & TurnFlag.SPIKE
    assert not apart[0] & TurnFlag.GAP
