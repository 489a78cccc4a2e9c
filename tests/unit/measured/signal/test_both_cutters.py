"""What ends the validity of a turn, by the compiled cutter and by that of numpy, each by itself."""

from collections.abc import Callable

import numpy as np
import pytest

from tests.synthetic import LATERAL, RATE, record, waveform
from tirelib.core.flags import TurnFlag
from tirelib.measured.signal import TurnCutter, Turns, cut_turns, stack_turns

Cut = Callable[..., Turns]


def by_numpy(strain: np.ndarray, **held: object) -> Turns:
    return stack_turns(TurnCutter(LATERAL, RATE).push(strain, **held), np.array(LATERAL), RATE)


def by_either(strain: np.ndarray, **held: object) -> Turns:
    return cut_turns(strain, RATE, LATERAL, **held)


CUTS = pytest.mark.parametrize("cut", [by_numpy, by_either])


def rolled(ratio: float) -> np.ndarray:
    """Half a turn, two turns of 0.1 s, and two of another length; they change in the contact."""
    first, other = 0.1, 0.1 * ratio
    counts = [round(x * RATE) for x in (0.5 * first, 2.0 * first, 2.5 * other)]
    ends = np.array([np.pi, 5.0 * np.pi, 10.0 * np.pi]) - np.pi
    begins = np.concatenate(([-np.pi], ends[:-1]))
    phi = np.concatenate(
        [np.linspace(a, b, n, endpoint=False) for a, b, n in zip(begins, ends, counts, strict=True)]
    )
    noise = 4e-6 * np.random.default_rng(0).standard_normal((5, phi.size))
    return np.tile(waveform(phi), (5, 1)) + 2.7e-3 + noise


@CUTS
@pytest.mark.parametrize(
    ("ratio", "jump"), [(0.42, True), (0.56, False), (1.8, False), (2.3, True)]
)
def test_a_turn_of_half_or_twice_the_time_of_the_one_before_is_a_jump(
    cut: Cut, ratio: float, jump: bool
) -> None:
    turns = cut(rolled(ratio), speed=18.0)
    assert len(turns) >= 4
    flagged = (turns.flags & TurnFlag.PERIOD_JUMP) != 0
    assert flagged[3] == jump
    assert not flagged[:3].any()


@CUTS
@pytest.mark.parametrize(
    ("factor", "mismatch"),
    [(0.63, True), (0.7, False), (1.0, False), (1.45, False), (1.55, True), (-1.0, True)],
)
def test_a_turn_rate_two_thirds_or_half_as_much_again_of_the_contacts_is_a_mismatch(
    cut: Cut, factor: float, mismatch: bool
) -> None:
    strain, _, omega = record(turns=3.6)
    turns = cut(strain, speed=18.0, omega=factor * omega)
    assert len(turns) >= 3
    flagged = (turns.flags[1:] & TurnFlag.OMEGA_MISMATCH) != 0
    assert (flagged == mismatch).all()


@CUTS
def test_the_turn_after_a_contact_that_was_missed_has_no_period(cut: Cut) -> None:
    strain, _, omega = record(turns=5.6, start=np.pi)
    turn = 2.0 * np.pi / omega * RATE
    strain[:, round(2.4 * turn) : round(2.6 * turn)] = np.nan  # the first contact is at .5
    turns = cut(strain, speed=18.0)
    late = turns.flags[2]
    assert late & TurnFlag.FIRST_TURN
    assert late & TurnFlag.GAP
    assert not turns.flags[-1] & TurnFlag.FIRST_TURN


@CUTS
@pytest.mark.parametrize("speed", [0.8, 1.2, 1.8, 2.5, 4.0, 8.0])
def test_an_angle_is_in_doubt_from_two_hundredths_of_a_radian_on(cut: Cut, speed: float) -> None:
    turns = cut(record(turns=3.6, speed=speed)[0], speed=np.nan)
    doubt = turns.angle_std[1:]
    assert np.isfinite(doubt).all()
    flagged = (turns.flags[1:] & TurnFlag.ACCELERATING) != 0
    np.testing.assert_array_equal(flagged, doubt > 0.02)


@CUTS
def test_a_turn_waits_for_twenty_degrees_and_half_the_filter(cut: Cut) -> None:
    strain, _, omega = record(turns=4.0)
    turns = cut(strain, speed=18.0)
    late = (turns.ready - turns.time)[1:] * omega - turns.trace.pulse[1:]
    sigma = np.sqrt(np.log(2.0)) / 24.0
    step = omega / RATE
    np.testing.assert_allclose(late, np.deg2rad(20.0) + 4.0 * sigma, atol=0.005 + 3.0 * step)
