"""What a slip ratio may change by within a turn: by the load and by the traction."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tirelib.measured.signal.course import Course, course
from tirelib.measured.signal.slip import (
    NOTHING,
    PULL_SLIP,
    pull,
    unseen_by_load,
    unseen_by_traction,
)
from tirelib.measured.signal.turn import PHI

TURN, RATE = 1000.0, 1e4


def told(speed: np.ndarray) -> Course:
    found = course(speed, -TURN, TURN)
    assert found is not None
    return found


def after_the_last_contact() -> np.ndarray:
    return np.arange(-1000, 100) / RATE


def strained(before: float, behind: float) -> np.ndarray:
    """Tension of 4e-3 in the contact between two dips."""
    dips = before * np.exp(-(((PHI + 0.3) / 0.1) ** 2)) + behind * np.exp(
        -(((PHI - 0.3) / 0.1) ** 2)
    )
    return np.where(np.abs(PHI) < 0.15, 4e-3, -dips)


def test_a_held_load_leaves_nothing_unseen() -> None:
    assert unseen_by_load(0.2, 0.2) == 0.0


def test_a_load_that_changes_between_contacts_moves_the_rolling_radius() -> None:
    free_to_loaded = np.cos(0.15) - np.cos(0.2)  # the most that the radius can change
    assert unseen_by_load(0.2, 0.15) == pytest.approx(free_to_loaded / np.sqrt(3.0), rel=0.02)
    assert unseen_by_load(0.15, 0.2) == unseen_by_load(0.2, 0.15)


def test_after_an_unknown_contact_all_of_the_load_s_share_is_unseen() -> None:
    assert unseen_by_load(0.2, np.nan) == unseen_by_load(0.2, 0.0) > 0.0


@given(gain=st.floats(0.2, 5.0), dip=st.floats(2e-4, 2e-3), more=st.floats(0.0, 1e-3))
def test_the_pull_is_that_of_the_deeper_dip_whatever_the_gain(
    gain: float, dip: float, more: float
) -> None:
    braked = pull(gain * strained(dip, dip + more))
    assert braked == pytest.approx(more / 4e-3, rel=1e-3, abs=1e-6)
    assert pull(gain * strained(dip + more, dip)) == pytest.approx(-braked, rel=1e-3, abs=1e-6)


def test_the_pull_is_unknown_where_the_strain_is() -> None:
    assert np.isnan(pull(np.full(PHI.size, np.nan)))
    partly = np.where(PHI > 0.7, np.nan, strained(1e-3, 2e-3))
    assert pull(partly) == pytest.approx(0.25, rel=1e-3)
    raised = partly + 5e-3  # dips that are no compression any more
    assert pull(raised) == pytest.approx(1e-3 / 9e-3, rel=1e-3)
    assert np.isnan(pull(partly - 5e-3)), "without tension there is no contact"


@given(slip=st.floats(-0.03, 0.03), half=st.floats(0.05, 0.2), at=st.floats(0.9, 1.1))
def test_what_the_pull_tells_of_a_slip_is_what_the_turns_have_missed(
    slip: float, half: float, at: float
) -> None:
    before, pulled = (at, 0.02), 0.02 - slip * half**1.5 / PULL_SLIP
    followed = unseen_by_traction((at * (1.0 + slip), pulled), before, half)
    assert followed == pytest.approx(0.0, abs=1e-12)
    missed = unseen_by_traction((at, pulled), before, half)
    assert missed == pytest.approx(abs(slip), abs=1e-12)


def test_without_a_contact_before_nothing_is_said_of_traction() -> None:
    assert unseen_by_traction((1.0, 0.1), NOTHING, 0.1) == 0.0
    assert unseen_by_traction((1.0, np.nan), (1.0, 0.1), 0.1) == 0.0
    assert unseen_by_traction((np.inf, 0.1), (1.0, 0.1), 0.1) == 0.0


def test_what_a_cubic_cannot_follow_is_more_uncertain_than_noise_of_its_size() -> None:
    time = after_the_last_contact()
    kink = 20.0 - 8.0 * np.maximum(time + 0.03, 0.0)
    scatter = np.std(kink - np.polyval(np.polyfit(time, kink, 3), time))
    noise = scatter * np.random.default_rng(4).standard_normal((50, time.size // 20))
    usual = np.median([told(20.0 + np.repeat(row, 20)).std for row in noise])
    assert told(kink).std > 2.0 * usual
    at_contact = abs(float(told(kink).shape[0]) - (20.0 - 8.0 * 0.03)) / told(kink).mean
    assert at_contact < 3.0 * told(kink).std
