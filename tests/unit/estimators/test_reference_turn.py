"""A calibration carries a measured turn that it takes for valid, and that can be played again."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tirelib.campaign import Campaign
from tirelib.core.errors import ParameterError
from tirelib.estimators.calibration import Calibration
from tirelib.estimators.calibration_file import read_calibration, write_calibration
from tirelib.estimators.reference_turn import STRAIN_UNIT, ReferenceTurn, folded
from tirelib.estimators.train import Trained
from tirelib.estimators.typical import typical_turn
from tirelib.measured.observations import Observations
from tirelib.stream import StreamEstimator

RATE = 1e4


@pytest.fixture(scope="module")
def turn(cornering: Campaign, observed: Observations, trained: Trained) -> ReferenceTurn:
    found = typical_turn([cornering], observed, trained.calibration)
    assert found is not None
    return found


@given(
    middle=st.floats(300.0, 700.0),
    period=st.floats(60.0, 500.0),
    drift=st.floats(-1e-3, 1e-3),
    level=st.floats(-1.0, 1.0),
)
def test_a_periodic_signal_folds_to_itself_whatever_drifts(
    middle: float, period: float, drift: float, level: float
) -> None:
    index = np.arange(1000.0)
    angle = 2.0 * np.pi * (index - middle) / period
    strain = np.stack([level + np.cos(angle) + drift * (index - middle), np.sin(angle)])
    turn = folded(strain, middle, period, 256)
    assert turn is not None
    grid = np.linspace(-np.pi, np.pi, 256, endpoint=False)
    start = level - 0.5 * drift * period  # the zero where the turn begins is kept
    between = 2.0 * (2.0 * np.pi / period) ** 2 / 8.0  # of a straight line, ends included twice
    np.testing.assert_allclose(turn[0], start + np.cos(grid), atol=between + 1e-12)
    np.testing.assert_allclose(turn[1], np.sin(grid), atol=between + 1e-12)


@pytest.mark.parametrize("middle", [20.0, 970.0])
def test_half_a_turn_is_no_turn(middle: float) -> None:
    assert folded(np.zeros((2, 1000)), middle, 100.0) is None


def test_a_turn_with_a_hole_is_no_turn() -> None:
    strain = np.zeros((2, 1000))
    strain[1, 510] = np.nan
    assert folded(strain, 500.0, 100.0) is None
    assert folded(strain, 400.0, 100.0) is not None


@pytest.mark.parametrize("period", [0.0, -5.0, float("nan")])
def test_a_period_must_be_above_zero(period: float) -> None:
    with pytest.raises(ParameterError, match="must be above 0"):
        folded(np.zeros((2, 1000)), 500.0, period)


def test_it_comes_from_the_middle(observed: Observations, turn: ReferenceTurn) -> None:
    number = int(turn.run.rsplit(" ", 1)[1])
    rows = observed.run == number
    loads = np.unique(observed.nominal["load"])
    angles = np.unique(observed.nominal["slip_angle"])
    assert loads[0] < observed.nominal["load"][rows][0] < loads[-1]
    assert angles[0] < observed.nominal["slip_angle"][rows][0] < angles[-1]
    assert np.isclose(turn.omega, observed.features.omega[rows]).any()
    assert turn.run.startswith(observed.headers[0].name)


def test_played_again_and_again_it_is_valid(turn: ReferenceTurn, trained: Trained) -> None:
    estimator = StreamEstimator(trained.calibration, RATE)
    angle = np.pi + turn.omega / RATE * np.arange(int(4.5 * 2.0 * np.pi / turn.omega * RATE))
    held = {"speed": turn.speed, "pressure": turn.pressure, "camber": turn.camber}
    told = estimator.push(turn.at(angle), **held)
    assert [one.valid for one in told] == [False, True, True, True]
    assert [one.flags for one in told[1:]] == [0, 0, 0]


def test_a_file_keeps_it(turn: ReferenceTurn, trained: Trained, tmp_path: Path) -> None:
    path = tmp_path / "cal.toml"
    write_calibration(replace(trained.calibration, reference=turn), path)
    kept = read_calibration(path).reference
    assert kept is not None
    np.testing.assert_allclose(kept.strain, turn.strain, rtol=0.0, atol=0.51 * STRAIN_UNIT)
    for name in ("speed", "pressure", "camber", "omega", "run"):
        np.testing.assert_equal(getattr(kept, name), getattr(turn, name))


def test_without_a_valid_turn_there_is_none(
    cornering: Campaign, observed: Observations, trained: Trained
) -> None:
    def nowhere(calibration: Calibration) -> Calibration:
        chain = calibration.chains[-1]
        guards = {
            name: tuple(replace(known, low=9e9, high=9e9) for known in ranges)
            for name, ranges in chain.guards.items()
        }
        return replace(
            calibration, chains={**calibration.chains, -1: replace(chain, guards=guards)}
        )

    assert typical_turn([cornering], observed, nowhere(trained.calibration)) is None
