"""A wheel of the native core shows at every step what the FMU's wheel in Python shows."""

import ctypes
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.fmu import live
from tests.native.wheels import AXES, REASONS, NativeWheel
from tests.synthetic import record
from tirelib.core.flags import TurnFlag
from tirelib.core.held import HELD
from tirelib.estimators.calibration import Calibration
from tirelib.fmu.refusals import StepError
from tirelib.fmu.wheel import Wheel

TURN = int(2.0 * np.pi * live.RADIUS / live.SPEED * live.RATE)


def spoilt(kind: str) -> np.ndarray:
    """Five turns in which something happens."""
    strain = live.strain_of(4e3, 0.05, turns=5.4)[0]
    begin, end = int(2.6 * TURN), int(4.0 * TURN)
    if kind == "gap":
        strain[:, int(2.7 * TURN) : int(2.7 * TURN) + 40] = np.nan
    elif kind == "stop":
        strain[:, begin:end] = strain[:, begin][:, None]
    elif kind == "frozen gage":
        strain[1, begin:] = strain[1, begin]
    elif kind == "lifted gage":
        strain[4] = 2.7e-3 + 0.1 * (strain[4] - 2.7e-3)
    elif kind == "gage cut off":
        strain[1, begin:] = np.nan
    elif kind == "clipped gage":
        strain[3] = np.minimum(strain[3], np.quantile(strain[3], 0.8))
    elif kind == "silent gage":
        strain[4] = 2.7e-3
    elif kind == "jump":
        strain[:, begin:] *= 6.0
    elif kind == "another tire":
        strain = 2.7e-3 + (strain - 2.7e-3) ** 2 / 6e-3
    elif kind == "lost centre":
        strain[2, begin:] = np.inf
    return strain


KINDS = (
    *("well", "gap", "stop", "frozen gage", "lifted gage", "silent gage", "jump", "another tire"),
    *("lost centre", "gage cut off", "clipped gage"),
)


def conditions_at(step: int) -> np.ndarray:
    """Conditions that change now and then, some of them unknown."""
    known = {
        "speed": live.SPEED + 0.01 * (step // 30),
        "pressure": live.PRESSURE,
        "camber": np.inf if step % 70 > 60 else 0.0,
        "omega": 0.0 if 300 < step < 305 else live.SPEED / live.RADIUS,
        "friction": 0.9 if step % 50 else np.nan,
    }
    return np.array([known.get(name, np.nan) for name in HELD])


class Both:
    """The same wheel twice."""

    def __init__(
        self,
        core: ctypes.CDLL,
        samples: int,
        axes: str = "iso",
        known: Calibration | None = None,
    ) -> None:
        known = known or live.calibration()
        self.wanted = Wheel(known, live.RATE, samples, axes)
        self.got = NativeWheel(core, known, live.RATE, samples, axes)

    def step(
        self,
        frame: np.ndarray,
        step: float,
        conditions: np.ndarray,
        valid: bool = True,
        count: int | None = None,
    ) -> str:
        """Do a step with both, and compare what they show; return the status."""
        flat: np.ndarray[Any, Any] = np.ascontiguousarray(frame.T)
        done = self.got.step(flat, step, valid, conditions, count)
        given = flat.ravel().tolist(), step, valid, *conditions.tolist()
        if done < 0:
            with pytest.raises(StepError, match=REASONS[done]) as refused:
                self.wanted.step(*given, count=count)
            return str(refused.value)
        self.wanted.step(*given, count=count)
        return self.compare()

    def compare(self) -> str:
        (reals, others), (numbers, rest) = self.got.outputs(), self.wanted.outputs()
        assert others == rest
        np.testing.assert_allclose(reals, numbers, rtol=1e-9, atol=1e-9)
        return str(rest[-1])


@pytest.mark.parametrize(
    ("kind", "samples"), [("stop", 1), *((kind, n) for kind in KINDS for n in (10, 64))]
)
def test_it_shows_the_same_at_every_step(core: ctypes.CDLL, kind: str, samples: int) -> None:
    strain, both = spoilt(kind), Both(core, samples)
    told = set()
    for number, start in enumerate(range(0, strain.shape[1] - samples, samples)):
        frame = strain[:, start : start + samples]
        valid = samples != 64 or number % 23 != 17
        told.add(both.step(frame, samples / live.RATE, conditions_at(number), valid))
    assert len(told) > 1


@pytest.mark.parametrize("axes", AXES)
def test_axes_turn_signs_and_gages(core: ctypes.CDLL, axes: str) -> None:
    strain, both = live.strain_of(4e3, 0.1, turns=3.4)[0], Both(core, 50, axes)
    for start in range(0, strain.shape[1] - 50, 50):
        both.step(strain[:, start : start + 50], 50 / live.RATE, conditions_at(1))
    assert both.wanted.outputs()[1][2]


def test_a_buffer_takes_what_is_new(core: ctypes.CDLL) -> None:
    strain, both, at = live.strain_of(4e3, 0.1, turns=4.4)[0], Both(core, 40), 0
    rng = np.random.default_rng(4)
    while at + 40 < strain.shape[1]:
        count = int(rng.integers(0, 41))
        both.step(
            strain[:, at : at + 40], float(rng.uniform(1e-4, 0.02)), conditions_at(1), True, count
        )
        at += count
    for _ in range(30):
        told = both.step(strain[:, :40], 0.05, conditions_at(1), True, 0)
    assert "no_contact" in told


def test_steps_that_cannot_be_are_refused_and_change_nothing(core: ctypes.CDLL) -> None:
    both, frame = Both(core, 10), live.strain_of(4e3, 0.1)[0][:, :10]
    for step in (0.0, -1.0, 1.5 / live.RATE, np.nan, np.inf, 4.0, 1e-9):
        assert "step" in both.step(frame, step, conditions_at(0))
    for count in (41, 11):
        assert "samples = " in both.step(frame, 0.1, conditions_at(0), True, count)
    assert both.step(frame, 4.0, conditions_at(0), True, 3)
    assert both.compare() == "first_turn"


def test_a_longer_or_shorter_step_than_the_frame(core: ctypes.CDLL) -> None:
    strain, both = live.strain_of(4e3, 0.1, turns=5.4)[0], Both(core, 10)
    for number, start in enumerate(range(0, strain.shape[1] - 10, 10)):
        samples = {100: 300, 200: 5}.get(number, 10)
        told = both.step(strain[:, start : start + 10], samples / live.RATE, conditions_at(1))
    assert "first_turn" not in told


@pytest.mark.parametrize("kind", ["well", "gap", "stop"])
def test_a_state_goes_on_exactly_alike(core: ctypes.CDLL, kind: str) -> None:
    strain, known = spoilt(kind), live.calibration()
    wheel = NativeWheel(core, known, live.RATE, 20)

    def step(one: NativeWheel, start: int) -> tuple[Any, ...]:
        frame = np.ascontiguousarray(strain[:, start : start + 20].T)
        one.step(frame, 20 / live.RATE, True, conditions_at(start))
        return one.outputs()

    starts = range(0, strain.shape[1] - 20, 20)
    states = []
    for start in starts:
        states.append(wheel.state())
        step(wheel, start)
    for index in range(0, len(starts), 3):
        one, other = (NativeWheel(core, known, live.RATE, 20) for _ in range(2))
        assert one.restore(states[index])
        for early in starts[: 2 * TURN // 20 : 7]:
            step(other, early)  # another past
        assert other.restore(states[index])
        assert other.state() == states[index]
        for start in starts[index : index + TURN // 10]:
            assert repr(step(one, start)) == repr(step(other, start))
        following = index + len(starts[index : index + TURN // 10])
        if following < len(states):
            assert one.state() == states[following]


@pytest.mark.parametrize("gap", [6, 7])
def test_a_gap_before_the_first_contact_is_remembered_within_it(
    core: ctypes.CDLL, gap: int
) -> None:
    """At 200 Hz the contact begins with sample 8; what lies before tells that it is damaged."""
    strain, known = record(turns=4.6, speed=live.SPEED, rate=200.0)[0], live.calibration()
    strain[2, gap] = np.nan
    one, other = (NativeWheel(core, known, 200.0, 1) for _ in range(2))
    flags = set()
    for sample in range(strain.shape[1]):
        frame = np.ascontiguousarray(strain[:, sample])
        if sample == 12:
            assert other.restore(one.state())
        for wheel in (one, other) if sample >= 12 else (one,):
            wheel.step(frame, 1 / 200.0, True, conditions_at(1))
        if sample >= 12:
            assert repr(other.outputs()) == repr(one.outputs())
            flags.add(one.outputs()[1][1])
    assert any(told & TurnFlag.GAP for told in flags)


def test_what_is_no_state_of_the_wheel_is_refused(core: ctypes.CDLL) -> None:
    known = live.calibration()
    wheel = NativeWheel(core, known, live.RATE, 20)
    state = wheel.state()
    assert len(state) < 1e4
    assert not NativeWheel(core, known, live.RATE, 10).restore(state)
    assert not NativeWheel(core, known, 2e3, 20).restore(state)
    assert not NativeWheel(core, known, live.RATE, 20, "sae").restore(state)
    rng = np.random.default_rng(0)
    for _ in range(200):
        bytes_ = bytearray(state)
        bytes_[rng.integers(0, len(state))] ^= int(rng.integers(1, 256))
        assert not wheel.restore(bytes(bytes_))
    assert not any(wheel.restore(state[:n]) for n in range(0, len(state), 13))
    assert wheel.restore(state)


def test_two_wheels_do_not_meet(core: ctypes.CDLL) -> None:
    one, other = Both(core, 30), Both(core, 30, "sae")
    first, second = spoilt("well"), spoilt("frozen gage")
    for number, start in enumerate(range(0, first.shape[1] - 30, 30)):
        one.step(first[:, start : start + 30], 30 / live.RATE, conditions_at(number))
        other.step(second[:, start : start + 30], 30 / live.RATE, conditions_at(number))


def test_with_a_gage_out_the_others_estimate_and_all_is_not_well(core: ctypes.CDLL) -> None:
    both, strain = Both(core, 20), live.strain_of(4e3, 0.1, turns=5.4)[0]
    strain[1, 2 * TURN :] = strain[1, 2 * TURN]
    for start in range(0, strain.shape[1] - 20, 20):
        both.step(strain[:, start : start + 20], 20 / live.RATE, conditions_at(1))
    valid, load_valid = both.wanted.outputs()[1][2:4]
    assert load_valid
    assert not valid


def test_with_a_saturated_slip_angle_the_others_are_valid_and_all_is_not(core: ctypes.CDLL) -> None:
    known, strain = live.calibration(), live.strain_of(4e3, 0.1, turns=3.4)[0]
    chains = {}
    for missing, chain in known.chains.items():
        assert chain.angle is not None
        unsure = replace(chain.angle.polynomial, residual=np.deg2rad(1.2), floor=0.0)
        angle = replace(chain.angle, polynomial=unsure, blur=0.0, bend=0.0)
        chains[missing] = replace(chain, angle=angle, sliding=None)
    both = Both(core, 20, known=replace(known, chains=chains))
    for start in range(0, strain.shape[1] - 20, 20):
        status = both.step(strain[:, start : start + 20], 20 / live.RATE, conditions_at(1))
    valid, load_valid, angle_valid, _, force_valid = both.wanted.outputs()[1][2:7]
    assert "alpha_saturated" in status
    assert load_valid
    assert force_valid
    assert not angle_valid
    assert not valid
