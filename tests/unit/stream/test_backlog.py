"""Law of samples that wait: they change nothing but the time at which they are looked at."""

import json
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.fmu import live
from tests.synthetic import frames as cut
from tirelib.core.flags import TurnFlag
from tirelib.core.held import HELD
from tirelib.measured.signal.turns import TurnCutter
from tirelib.stream.backlog import quiet_range
from tirelib.stream.reference import NumpyEstimator

TURN = int(2.0 * np.pi * live.RADIUS / live.SPEED * live.RATE)


def spoilt(kind: str) -> np.ndarray:
    """Five turns in which something happens."""
    strain = live.strain_of(4e3, 0.05, turns=5.4)[0]
    middle = slice(int(2.6 * TURN), int(2.8 * TURN))
    if kind == "gap":
        strain[:, int(2.7 * TURN) : int(2.7 * TURN) + 40] = np.nan
    elif kind == "centre infinite":
        strain[2, middle] = np.inf
    elif kind == "jump":
        strain[:, int(2.6 * TURN) :] *= 6.0
    elif kind == "drift":
        strain += np.linspace(0.0, 4e-3, strain.shape[1])
    elif kind == "spikes":
        strain[2, int(2.6 * TURN) :: 97] += 0.02
    elif kind == "stop":
        strain[:, int(2.7 * TURN) : int(4.0 * TURN)] = strain[:, int(2.7 * TURN)][:, None]
    return strain


def held(at: int) -> dict[str, Any]:
    """Conditions that change now and then."""
    known = {
        "speed": live.SPEED + 0.01 * (at // 300),
        "pressure": live.PRESSURE,
        "camber": 0.0 if at % 700 else 0.01,
        "friction": 0.5 + 0.1 * (at // 500),
    }
    return {name: known.get(name, math.nan) for name in HELD}


def told(estimator: NumpyEstimator) -> Any:
    return (estimator.turns, estimator.valid, estimator.flags, repr(estimator.age), estimator.time)


KINDS = ["well", "gap", "centre infinite", "jump", "drift", "spikes", "stop"]


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=6)
@given(longest=st.sampled_from([3, 17, 60, 700]), seed=st.integers(0, 99))
def test_taken_samples_say_at_every_step_what_pushed_ones_do(
    kind: str, longest: int, seed: int
) -> None:
    strain = spoilt(kind)
    one, two = (NumpyEstimator(live.calibration(), live.RATE) for _ in range(2))
    for part in cut(strain.shape[1], longest, seed=seed):
        conditions = held(part.start)
        pushed = one.push(strain[:, part], **conditions)
        taken = two.take(strain[:, part].T.ravel().tolist(), [*conditions.values()])
        assert repr(taken) == repr(pushed)
        assert told(two) == told(one)
    assert json.dumps(two.state()) == json.dumps(one.state())


def test_most_of_a_turn_waits_and_never_more_than_a_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    estimator = NumpyEstimator(live.calibration(), live.RATE)
    strain = live.strain_of(4e3, 0.05, turns=6.4)[0]
    estimator.push(strain[:, : 2 * TURN], **held(0))
    calls, honest = [], TurnCutter.push

    def counted(self: TurnCutter, frame: np.ndarray, **options: Any) -> Any:
        calls.append(frame.shape[1])
        return honest(self, frame, **options)

    monkeypatch.setattr(TurnCutter, "push", counted)
    rest = strain[:, 2 * TURN : 2 * TURN + 4 * TURN // 10 * 10]
    for first in range(0, rest.shape[1], 10):
        estimator.take(rest[:, first : first + 10].T.ravel().tolist(), [*held(0).values()])
    assert len(calls) < 0.35 * rest.shape[1] / 10
    assert 100 < max(calls) <= 512


def test_a_slow_wheel_waits_for_no_more_samples_than_the_bound() -> None:
    estimator = NumpyEstimator(live.calibration(), live.RATE)
    strain = live.strain_of(4e3, 0.05, turns=3.0, speed=4.5)[0]
    estimator.push(strain, **held(1))
    found = quiet_range(vars(estimator)["_cutter"])
    assert found is not None
    assert 500 < found[2] <= 512


def test_samples_wait_no_longer_than_the_finder_has_patience() -> None:
    """Two and a half turns after a contact it starts anew, with levels that are not known yet."""
    estimator = NumpyEstimator(live.calibration(), live.RATE)
    strain = live.strain_of(4e3, 0.05, turns=3.0)[0]
    estimator.push(strain, **held(1))
    rooms = []
    for _ in range(4 * TURN // 10):
        estimator.push(np.repeat(strain[:, -1:], 10, axis=1), **held(1))
        cutter = vars(estimator)["_cutter"]
        if (found := quiet_range(cutter)) is not None:
            rooms.append((found[2], vars(cutter)["_finder"]._room()))
    waits, patience = np.array(rooms).T
    assert (waits <= np.maximum(patience - 3, 0)).all()
    assert patience.min() < 20


def test_a_standing_wheel_is_seen_at_once() -> None:
    estimator = NumpyEstimator(live.calibration(), live.RATE)
    estimator.push(live.strain_of(4e3, 0.05, turns=3.0)[0], **held(1))
    assert quiet_range(vars(estimator)["_cutter"]) is not None
    assert estimator.valid
    estimator.take([0.0] * 5, [*{**held(1), "omega": 0.0}.values()])
    assert not estimator.valid
    assert estimator.flags & int(TurnFlag.NO_CONTACT)


def test_before_the_first_contact_nothing_waits() -> None:
    cutter = TurnCutter(live.calibration().lateral, live.RATE)
    assert quiet_range(cutter) is None
    cutter.push(np.zeros((5, 50)))
    assert quiet_range(cutter) is None
