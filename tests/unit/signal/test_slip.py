"""What a slip ratio may change by within a turn: by the load and by the acceleration."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tirelib.signal.course import Course, course
from tirelib.signal.slip import GRAVITY, SLIP_STIFFNESS, unseen_change

TURN, RATE = 1000.0, 1e4


def told(speed: np.ndarray) -> Course:
    found = course(speed, -TURN, TURN)
    assert found is not None
    return found


def after_the_last_contact() -> np.ndarray:
    return np.arange(-1000, 100) / RATE


@given(acceleration=st.floats(-9.0, 9.0), half=st.floats(0.05, 0.3))
def test_even_braking_at_a_held_load_leaves_nothing_unseen(
    acceleration: float, half: float
) -> None:
    speed = told(20.0 + acceleration * after_the_last_contact())
    assert unseen_change(speed, TURN / RATE, half, half) == pytest.approx(0.0, abs=1e-9)


def test_a_brake_that_comes_within_the_turn_is_slip_at_its_end() -> None:
    time = after_the_last_contact()
    speed = told(20.0 - 0.5 * 80.0 * (time + 0.1) ** 2)  # 0 to -8 m/s2, its mean -4
    expected = 4.0 / (GRAVITY * SLIP_STIFFNESS)
    assert unseen_change(speed, TURN / RATE, 0.2, 0.2) == pytest.approx(expected, rel=1e-6)


def test_a_load_that_changes_between_contacts_moves_the_rolling_radius() -> None:
    free_to_loaded = np.cos(0.15) - np.cos(0.2)  # the most that the radius can change
    change = unseen_change(None, TURN / RATE, 0.2, 0.15)
    assert change == pytest.approx(free_to_loaded / np.sqrt(3.0), rel=0.02)


def test_noise_of_the_speed_is_no_braking() -> None:
    rng = np.random.default_rng(3)
    rows = np.repeat(20.0 + 0.02 * rng.standard_normal((200, 55)), 20, axis=1)
    slips = np.array([unseen_change(told(row), TURN / RATE, 0.2, 0.2) for row in rows])
    assert np.mean(slips > 0.0) < 0.32  # less often than noise exceeds its standard deviation


def test_what_a_cubic_cannot_follow_is_more_uncertain_than_noise_of_its_size() -> None:
    time = after_the_last_contact()
    kink = 20.0 - 8.0 * np.maximum(time + 0.03, 0.0)
    scatter = np.std(kink - np.polyval(np.polyfit(time, kink, 3), time))
    noise = scatter * np.random.default_rng(4).standard_normal((50, time.size // 20))
    usual = np.median([told(20.0 + np.repeat(row, 20)).std for row in noise])
    assert told(kink).std > 2.0 * usual
    at_contact = abs(float(told(kink).shape[0]) - (20.0 - 8.0 * 0.03)) / told(kink).mean
    assert at_contact < 3.0 * told(kink).std
