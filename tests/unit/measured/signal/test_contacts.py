"""Laws of the contact search."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.synthetic import RATE, frames, record, synthetic_run, waveform, wrapped
from tirelib.measured.signal import Contact, ContactFinder


def middles(contacts: list[Contact]) -> list[float]:
    return [contact.middle for contact in contacts]


@given(
    speed=st.floats(2.0, 50.0),
    half=st.floats(0.08, 0.35),
    tension=st.floats(4e-3, 1.2e-2),
    dip=st.floats(0.0, 1.0),
    start=st.floats(-np.pi, np.pi),
)
def test_every_contact_is_found_once_at_its_middle(
    speed: float, half: float, tension: float, dip: float, start: float
) -> None:
    strain, _, omega = record(
        speed=speed, half=half, tension=tension, dip=dip * tension, start=start
    )
    found = ContactFinder(int(3 * RATE)).push(strain[2])
    first = (0.0 - start) % (2 * np.pi)
    last = strain.shape[1] / RATE * omega
    true = np.arange(first, last, 2 * np.pi) / omega * RATE
    # the first one may be cut off by the start of the record, or too little be seen before it;
    # the last one by its end
    assert 3 <= len(found) <= true.size
    error = [np.abs(true - middle).min() for middle in middles(found)]
    assert max(error) < 0.1  # the pulse is symmetric: its middle is phi = 0
    assert np.diff(middles(found)) == pytest.approx(2 * np.pi / omega * RATE, rel=1e-4)
    assert [contact.fresh for contact in found] == [True] + [False] * (len(found) - 1)


@given(
    start=st.floats(-3.0, 3.0),
    noise=st.floats(0.0, 2e-5),
    longest=st.sampled_from([1, 2, 7, 50, 700, 3000]),
    seed=st.integers(0, 99),
)
def test_contacts_do_not_depend_on_how_the_samples_are_cut(
    start: float, noise: float, longest: int, seed: int
) -> None:
    strain, _, _ = record(turns=4, noise=noise, start=start)
    whole = ContactFinder(int(3 * RATE)).push(strain[2])
    finder = ContactFinder(int(3 * RATE))
    pieces: list[Contact] = []
    for part in frames(strain.shape[1], longest, seed):
        pieces += finder.push(strain[2, part])
    assert pieces == whole
    assert len(whole) >= 3


def test_noise_without_contact_is_no_contact() -> None:
    rng = np.random.default_rng(1)
    assert ContactFinder(int(3 * RATE)).push(2.5e-3 + 5e-6 * rng.standard_normal(20000)) == []


def test_a_lone_spike_is_no_contact() -> None:
    strain, _, _ = record()
    spiked = strain[2].copy()
    spiked[[700, 1777, 3000]] = 0.05
    finder, clean = ContactFinder(int(3 * RATE)), ContactFinder(int(3 * RATE))
    assert middles(finder.push(spiked)) == pytest.approx(middles(clean.push(strain[2])), abs=0.01)


def test_standstill_starts_the_search_afresh() -> None:
    strain, _, _ = record(turns=3)
    stand = np.full(40000, 2.7e-3)
    found = ContactFinder(int(3 * RATE)).push(np.concatenate((strain[2], stand, strain[2])))
    assert [contact.fresh for contact in found].count(True) == 2
    assert found[0].fresh
    assert found[3].fresh


@pytest.mark.parametrize("start", [0.0, 0.1, -0.1, 0.3, 1.0, -0.5, 2.0, np.pi])
def test_a_start_anywhere_gives_at_most_one_contact_less(start: float) -> None:
    strain, _, omega = record(start=start, turns=5)
    found = ContactFinder(int(3 * RATE)).push(strain[2])
    assert len(found) >= 4
    assert np.diff(middles(found)) == pytest.approx(2 * np.pi / omega * RATE, abs=0.02)


def test_two_humps_within_one_contact_are_one_contact() -> None:
    phi = np.pi + np.arange(6000) * 2 * np.pi / 1000
    humps = waveform(phi, half=0.3) - 2.5e-3 * np.exp(-((np.sin(phi / 2) / 0.07) ** 2))
    found = ContactFinder(int(3 * RATE)).push(humps)
    assert np.diff(middles(found)) == pytest.approx(1000.0, abs=0.02)


def test_missing_samples_count_as_time() -> None:
    strain, _, omega = record(turns=6)
    holed = strain[2].copy()
    period = 2 * np.pi / omega * RATE
    away = int(2.0 * period)  # opposite a contact: start is pi
    holed[away - 40 : away + 40] = np.nan
    clean = ContactFinder(int(3 * RATE)).push(strain[2])
    assert middles(ContactFinder(int(3 * RATE)).push(holed)) == pytest.approx(middles(clean))


def test_load_may_grow_and_fall_from_turn_to_turn() -> None:
    phi = np.pi + np.arange(9000) * 2 * np.pi / 1000
    turn = ((phi - np.pi) // (2 * np.pi)).astype(int)
    scale = np.array([1.0, 1.0, 1.6, 2.0, 1.2, 0.8, 0.8, 1.3, 1.0])[turn]
    found = ContactFinder(int(3 * RATE)).push(scale * waveform(phi))
    assert np.diff(middles(found)) == pytest.approx(1000.0, abs=1.0)
    assert len(found) == 9


@given(
    start=st.floats(-np.pi, np.pi),
    imbalance=st.floats(-2e-3, 2e-3),
    seed=st.integers(0, 50),
)
def test_levels_that_move_make_no_contact_of_their_own(
    start: float, imbalance: float, seed: int
) -> None:
    """A record may start where the extremes of the first turn are not yet seen."""
    strain, _, omega = record(start=start, imbalance=imbalance, noise=8e-6, seed=seed)
    found = ContactFinder(int(3 * RATE)).push(strain[2])
    assert [contact.fresh for contact in found] == [True] + [False] * (len(found) - 1)
    assert np.diff(middles(found)) == pytest.approx(2 * np.pi / omega * RATE, rel=1e-3)


def test_a_new_level_below_the_strain_just_reached_starts_no_pulse() -> None:
    """The first turn's extremes were not all seen, so the second sets a lower level."""
    run = synthetic_run(0, slip_ratio=-0.3)
    assert run.strain is not None
    found = ContactFinder(int(3 * RATE)).push(run.strain[2])
    assert [contact.fresh for contact in found] == [True, False, False, False]


@pytest.mark.parametrize("start", [-60, -40, -20, 0, 20])
def test_a_gap_that_hides_an_extreme_moves_no_later_contact(start: int) -> None:
    """The levels follow the extremes, and a tilted pulse has another middle at another level."""
    phi = np.linspace(np.pi, 15.0 * np.pi, 7001)
    x = waveform(phi) * (1.0 + 2.0 * wrapped(phi))
    clean = middles(ContactFinder(int(3 * RATE)).push(x))
    holed = x.copy()
    at = round(clean[2]) + start
    holed[at : at + 50] = np.nan
    found = middles(ContactFinder(int(3 * RATE)).push(holed))
    assert len(found) == len(clean)
    np.testing.assert_allclose(found[3:], clean[3:], atol=0.02)


@pytest.mark.parametrize("at", [0.02, 0.1, 0.3, 0.46, 0.5, 0.54, 0.62, 0.9])
@pytest.mark.parametrize("length", [2, 3, 10, 20])
@pytest.mark.parametrize("height", [0.05, 0.014, -0.03, -0.005])
def test_a_short_burst_moves_no_other_contact(at: float, length: int, height: float) -> None:
    """Levels learned from it would be crossed by no contact for the 3 s of the longest turn."""
    strain, _, omega = record(turns=12, noise=4e-6)
    period = 2 * np.pi / omega * RATE
    clean = ContactFinder(int(3 * RATE)).push(strain[2])
    disturbed = strain[2].copy()
    start = int((5.0 + at) * period)  # a contact is at 0.5
    disturbed[start : start + length] = height
    found = ContactFinder(int(3 * RATE)).push(disturbed)
    middle = np.array(middles(found))
    others = [contact for contact in clean if abs(contact.middle - start) > 0.2 * period]
    away = [float(np.abs(middle - contact.middle).min()) for contact in others]
    assert max(away) < 0.1
    assert len(found) <= len(clean)
    assert sum(contact.burst for contact in found) >= 1
    assert sum(contact.fresh for contact in found) == 1


@pytest.mark.parametrize("turn", [0.3, 1.1, 1.9])
def test_a_burst_before_a_turn_is_known_costs_few_turns(turn: float) -> None:
    strain, _, omega = record(turns=14)
    period = 2 * np.pi / omega * RATE
    disturbed = strain[2].copy()
    disturbed[int(turn * period) : int(turn * period) + 3] = 0.05
    found = ContactFinder(int(3 * RATE)).push(disturbed)
    assert sum(not contact.fresh and contact.middle > 3.0 * period for contact in found) >= 9


@pytest.mark.parametrize("seed", [*range(8), 39, 56, 70, 89, 97, 193, 209, 217, 259, 293, 294])
def test_after_a_long_burst_turns_are_known_within_five(seed: int) -> None:
    """Levels learned from it would be crossed by no contact for the 3 s of the longest turn."""
    random = np.random.default_rng(seed)
    strain, _, omega = record(turns=16, noise=4e-6)
    period = 2 * np.pi / omega * RATE
    begin = int((5.0 + random.uniform()) * period)
    end = begin + int(random.uniform(0.05, 0.8) * period)
    disturbed = strain[2].copy()
    disturbed[begin:end] += random.choice([0.015, 0.03, 0.08]) * random.standard_normal(end - begin)
    found = ContactFinder(int(3 * RATE)).push(disturbed)
    known = [contact.middle for contact in found if not contact.fresh and contact.middle > end]
    assert known[0] < end + 5.0 * period
