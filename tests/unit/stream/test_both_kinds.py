"""Laws of a live signal that the compiled estimator and that of numpy keep, each by itself."""

import json
from dataclasses import replace

import numpy as np
import pytest

from tests.fmu import live
from tirelib.core.errors import FormatError
from tirelib.core.flags import TurnFlag
from tirelib.stream import NumpyEstimator, StreamEstimator

HELD = {"speed": live.SPEED, "pressure": live.PRESSURE, "camber": 0.0}
KINDS = pytest.mark.parametrize("kind", [StreamEstimator, NumpyEstimator])
Kind = type[StreamEstimator]


def strain() -> np.ndarray:
    return live.strain_of(4e3, 0.05, turns=3.0)[0]


def played(kind: Kind, samples: np.ndarray | None = None, **held: float) -> StreamEstimator:
    estimator = kind(live.calibration(), live.RATE)
    estimator.push(strain() if samples is None else samples, **(HELD | held))
    return estimator


def deadline(estimator: StreamEstimator) -> float:
    """Two turns after the middle of the last contact, [s]."""
    last = estimator.latest
    assert last is not None
    return last.time + 2.0 * float(last.features.period[0])


@KINDS
def test_samples_without_a_contact_and_time_without_samples_end_validity_alike(kind: Kind) -> None:
    for samples in (True, False):
        estimator = played(kind)
        assert estimator.valid
        left = deadline(estimator) - estimator.elapsed
        for share, valid in ((0.98, True), (0.04, False)):
            if samples:
                end = np.repeat(strain()[:, -1:], round(share * left * live.RATE), axis=1)
                estimator.push(end, **HELD)
            else:
                estimator.wait(share * left)
            assert estimator.valid == estimator.is_valid("Fz") == valid
            assert bool(estimator.flags & TurnFlag.NO_CONTACT) != valid


@KINDS
@pytest.mark.parametrize(("omega", "stands"), [(0.045, True), (0.055, False)])
def test_a_wheel_stands_below_a_twentieth_of_a_radian_a_second(
    kind: Kind, omega: float, stands: bool
) -> None:
    for side in (omega, -omega):
        for frame in (side, np.full(2, side)):
            estimator = played(kind)
            estimator.push(strain()[:, -2:], omega=frame, **HELD)
            assert estimator.stale == stands


@KINDS
def test_a_gage_that_lives_may_lack_the_road_and_one_that_shows_nothing_is_out(kind: Kind) -> None:
    for share, whole in ((0.1, True), (0.0, False)):
        samples = strain()
        samples[4] = 2.7e-3 + share * (samples[4] - 2.7e-3)
        estimator = played(kind, samples)
        assert estimator.valid == whole
        assert estimator.is_valid("Fz")


@KINDS
@pytest.mark.parametrize("calibrated", [True, False])
def test_without_a_speed_the_rest_is_valid_and_the_whole_is_not(
    kind: Kind, calibrated: bool
) -> None:
    """Also where the slip ratio, which needs it, is not calibrated."""
    known = live.calibration()
    if not calibrated:
        known = replace(known, chains={k: replace(c, radius=None) for k, c in known.chains.items()})
    for speed, valid in ((live.SPEED, True), (np.nan, False)):
        estimator = kind(known, live.RATE)
        estimator.push(strain(), **(HELD | {"speed": speed}))
        assert estimator.is_valid("Fz")
        assert estimator.valid == valid


@KINDS
def test_a_state_holds_the_last_estimate_and_the_time_waited(kind: Kind) -> None:
    estimator, again = played(kind), kind(live.calibration(), live.RATE)
    estimator.wait(0.01)
    again.restore(json.loads(json.dumps(estimator.state())))
    assert again.elapsed == estimator.elapsed == again.time + 0.01
    assert again.age == estimator.age
    assert again.latest is not None
    assert estimator.latest is not None
    assert again.latest.value("Fz") == estimator.latest.value("Fz")


@KINDS
def test_a_state_of_other_places_of_the_gages_is_refused(kind: Kind) -> None:
    known = live.calibration()
    other = kind(replace(known, lateral=tuple(y + 1e-3 for y in known.lateral)), live.RATE)
    with pytest.raises(FormatError, match="restore it where it was saved"):
        other.restore(played(kind).state())
