"""Laws of wheel angle over time: exact under an even acceleration, unmoved by noise."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.synthetic import LATERAL, RATE, waveform
from tirelib.core.flags import TurnFlag, flag_names
from tirelib.measured.features.extract import Features, extract_features
from tirelib.measured.signal import TurnCutter, cut_turns
from tirelib.measured.signal.angle import AngleLaw, angle_law
from tirelib.measured.signal.course import Course, course

RADIUS = 0.305
SOURCES = ("omega", "speed", "none")


class Wheel:
    """A wheel whose rate changes evenly: its angle, strain and conditions over time."""

    def __init__(self, first: float, gain: float, seconds: float) -> None:
        self.first, self.gain = first, gain
        self.time = np.arange(int(seconds * RATE)) / RATE
        self.omega = first + gain * self.time
        self.strain = np.tile(waveform(self.angle(self.time)), (5, 1)) + 2.7e-3

    def angle(self, time: np.ndarray) -> np.ndarray:
        return np.asarray(np.pi + self.first * time + 0.5 * self.gain * time**2)

    def held(self, source: str) -> dict[str, np.ndarray]:
        told = {"omega": {"omega": self.omega}, "speed": {"speed": RADIUS * self.omega}, "none": {}}
        return told[source]

    def features(self, source: str) -> Features:
        return extract_features(cut_turns(self.strain, RATE, LATERAL, **self.held(source)))


BRAKING = Wheel(48.0, -26.0, 1.0)  # -8 m/s2 from 53 to 24 km/h
DRIVING = Wheel(25.0, 26.0, 1.0)


def laws(wheel: Wheel, source: str) -> list[AngleLaw]:
    """Laws of the turns between contacts whose times are known exactly."""
    turns = np.arange(2.0 * np.pi, wheel.angle(wheel.time)[-1], 2.0 * np.pi)
    root = np.sqrt(wheel.first**2 + 2.0 * wheel.gain * (turns - np.pi))
    middles = (root - wheel.first) / wheel.gain * RATE
    past, found = (), []
    for before, middle in pairwise(middles):
        first, stop = int(np.ceil(before)), int(middle + 0.1 * (middle - before))
        told = {
            name: course(x[first:stop], first - middle, middle - before)
            for name, x in wheel.held(source).items()
        }
        found.append(angle_law(middle, middle - before, stop - middle, told, past))
        past = found[-1].past
    return found


@pytest.mark.parametrize("wheel", [BRAKING, DRIVING], ids=["braking", "driving"])
@pytest.mark.parametrize("source", SOURCES)
def test_an_even_acceleration_is_followed_exactly(wheel: Wheel, source: str) -> None:
    for law in laws(wheel, source)[2:]:
        samples = law.middle + np.linspace(-1.0, 0.1, 12) * law.turn
        there = wheel.angle(samples / RATE) - wheel.angle(np.array(law.middle / RATE))
        np.testing.assert_allclose(law.at(samples), there, atol=1e-6)
        assert law.step * RATE == pytest.approx(
            wheel.first + wheel.gain * law.middle / RATE, rel=1e-6
        )
        assert law.std < 1e-6
        assert law.sample(-2.0) == pytest.approx(np.interp(-2.0, law.at(samples), samples), abs=1.0)
        assert float(law.at(np.array(law.sample(-2.0)))) == pytest.approx(-2.0, abs=1e-12)


@pytest.mark.parametrize("wheel", [BRAKING, DRIVING], ids=["braking", "driving"])
@pytest.mark.parametrize("source", SOURCES)
def test_features_of_a_wheel_that_brakes_are_those_of_steady_rolling(
    wheel: Wheel, source: str
) -> None:
    found, steady = wheel.features(source), Wheel(40.0, 1e-9, 1.0).features("none")
    first = 3 if source == "none" else 1  # without a source three turns tell the acceleration
    assert len(found) > first + 1
    for name in ("contact_angle", "rate_lead", "rate_trail", "cp1", "cp2", "tp", "e_vertical"):
        wanted = getattr(steady, name)[2]
        got = getattr(found, name)[first:]
        np.testing.assert_allclose(got, np.tile(wanted, (len(got), 1)), rtol=3e-4, err_msg=name)
    assert (found.flags[first:] & ~int(TurnFlag.NO_SPEED) == 0).all()


@given(turn=st.floats(300.0, 3000.0), middle=st.floats(1e3, 1e6))
def test_a_steady_wheel_turns_evenly(turn: float, middle: float) -> None:
    still = Course(np.ones(1), 18.0, 0.0, known=False)
    past = tuple(
        (middle - (k + 0.5) * turn, np.nan, 1.0 / turn / 18.0, 1.0 / turn) for k in (4, 3, 2, 1)
    )
    law = angle_law(middle, turn, 0.1 * turn, {"speed": still}, past)
    samples = middle + np.linspace(-1.0, 0.1, 12) * turn
    np.testing.assert_allclose(law.at(samples), (samples - middle) * 2.0 * np.pi / turn, atol=1e-12)
    assert (law.std, law.slip_std) == pytest.approx((0.0, 0.0), abs=1e-9)
    assert law.speed == pytest.approx(18.0, rel=1e-9)


@given(seed=st.integers(0, 999), held=st.sampled_from([1, 10, 100]))
def test_noise_of_a_source_moves_a_steady_wheel_less_than_the_noise_of_its_mean(
    seed: int, held: int
) -> None:
    rng = np.random.default_rng(seed)
    noise = np.repeat(rng.standard_normal((40, 1200 // held)), held, axis=1)
    found = [course(18.0 * (1.0 + 5e-3 * row), -1090.0, 1090.0) for row in noise]
    ratio = np.array(
        [c.shape[0] / (c.shape @ [1, -1 / 2, 1 / 3, -1 / 4][: c.shape.size]) for c in found]
    )
    told = min(1200 // held, 64)
    apart = 5e-3 * np.sqrt(min(held * 64 / 1200, 1.0) / told * 1.0)
    assert ratio.std() < 3.0 * apart
    assert ratio.std() < 1.5 * np.mean([c.std for c in found])


def test_a_source_that_was_hardly_renewed_has_no_course() -> None:
    steps = np.repeat([18.0, 17.5], 500)
    held = course(steps, -900.0, 900.0)
    assert held is not None
    assert not held.known
    assert held.mean == pytest.approx((500 * 18.0 + 400 * 17.5) / 900)
    assert course(np.full(1000, np.nan), -900.0, 900.0) is None
    assert course(np.linspace(-1.0, 1.0, 1000), -900.0, 900.0) is None


def test_a_single_jump_is_not_followed_and_widens_the_doubt() -> None:
    turn, rates = 1000.0, (1.0, 1.0, 1.0, 0.95, 0.95, 0.95, 0.95, 0.95)
    past, middle, doubts = (), 0.0, []
    for rate in rates:
        middle += turn / rate
        law = angle_law(middle, turn / rate, 100.0, {}, past)
        past = law.past
        assert law.step == pytest.approx(2.0 * np.pi / turn * rate, rel=1e-12)
        doubts.append(law.std)
    assert doubts[3] > 0.02
    assert doubts[4] > 0.02
    assert doubts[:3] + doubts[6:] == pytest.approx([0.0] * 5, abs=1e-12)


def test_what_cannot_be_followed_is_flagged() -> None:
    time = np.arange(int(0.8 * RATE)) / RATE
    jump = 45.0 * time - 15.0 * np.maximum(time - 0.45, 0.0)  # a third of the rate is lost at once
    strain = np.tile(waveform(np.pi + jump), (5, 1)) + 2.7e-3
    turns = cut_turns(strain, RATE, LATERAL, speed=45.0 * RADIUS)
    names = [flag_names(flags) for flags in turns.flags.tolist()]
    late = int(np.argmax(turns.time > 0.45))
    assert "accelerating" in names[late]
    assert not any("accelerating" in flags for flags in names[:late])


@pytest.mark.parametrize("change", [-26.0, 26.0])
def test_a_wheel_that_stops_or_starts_hard_is_cut_into_turns(change: float) -> None:
    time = np.arange(int(1.45 * RATE)) / RATE
    first = 40.0 if change < 0.0 else 2.3
    phi = first * time + 0.5 * change * time**2
    strain = np.tile(waveform(np.pi + phi), (5, 1)) + 2.7e-3
    held = np.repeat((first + change * time)[::20], 20)[: time.size]
    turns = cut_turns(strain, RATE, LATERAL, speed=RADIUS * held, omega=held)
    contacts = 1 + int(phi[-1] / (2.0 * np.pi))
    assert len(turns.time) == contacts
    assert np.isfinite(turns.trace.strain[2:, :, 200]).all()


@pytest.mark.parametrize("source", SOURCES)
def test_frames_give_the_turns_of_the_whole_record_while_braking(source: str) -> None:
    held = BRAKING.held(source)
    whole = TurnCutter(LATERAL, RATE).push(BRAKING.strain, **held)
    for size in (1, 16, 333):
        cutter, pieces = TurnCutter(LATERAL, RATE), []
        for start in range(0, BRAKING.time.size, size):
            part = slice(start, start + size)
            told = {name: x[part] for name, x in held.items()}
            pieces += cutter.push(BRAKING.strain[:, part], **told)
        assert repr(pieces) == repr(whole)


def test_the_speed_told_is_that_at_the_contact() -> None:
    found = BRAKING.features("speed")
    here = RADIUS * (BRAKING.first + BRAKING.gain * found.time)
    np.testing.assert_allclose(found.speed[1:], here[1:], rtol=1e-4)
    np.testing.assert_allclose(found.omega[1:] * RADIUS / found.speed[1:], 1.0, rtol=1e-4)


def test_a_slip_that_grows_evenly_is_told_at_the_contact() -> None:
    wheel, slip = DRIVING, 0.05
    speed = RADIUS * wheel.omega / (1.0 + slip * wheel.time)
    turns = cut_turns(wheel.strain, RATE, LATERAL, speed=speed)
    found = turns.trace.conditions.omega * RADIUS / turns.trace.conditions.speed - 1.0
    np.testing.assert_allclose(found[3:], slip * turns.time[3:], atol=2e-4)


@pytest.mark.parametrize("turns_left", np.linspace(0.05, 0.95, 10))
@pytest.mark.parametrize("onward", [0.0, 0.012])
def test_a_slip_that_stops_or_turns_round_is_told_within_three_standard_deviations(
    turns_left: float, onward: float
) -> None:
    """The speed is held and known; the slip ratio falls evenly, then stays or comes back."""
    period, corner = 1000.0, 6500.0 - 1000.0 * turns_left
    time = np.arange(0.0, 12e3)
    slip = -0.012 / period * np.minimum(time, corner) + onward / period * np.fmax(time - corner, 0)
    angle = np.cumsum(1.0 + slip) / period  # in turns; a contact in the middle of each
    middles = np.interp(np.arange(0.5, angle[-1]), angle, time)
    known, past, over = Course(np.array([20.0]), 20.0, 0.0, known=True), (), []
    for before, middle in pairwise(middles):
        law = angle_law(middle, middle - before, 0.1 * period, {"speed": known}, past)
        past = law.past
        slip_here = law.step / law.speed * 20.0 * period / (2.0 * np.pi) - 1.0
        over.append(abs(slip_here - np.interp(middle, time, slip)) / max(law.slip_std, 1e-12))
    assert max(over[3:]) < 3.0  # it had lasted for three turns


def test_a_held_value_is_taken_at_the_time_of_its_measurement() -> None:
    sample = np.arange(-1000, 100)
    measured = 100 * (sample // 100)  # 100 values a second
    found = course(20.0 - 8.0 * measured / RATE, -1000.0, 1000.0)
    assert found is not None
    assert found.shape[0] == pytest.approx(20.0, rel=3e-4)  # 20.04 as if measured when held
    assert found.mean == pytest.approx(20.0 + 8.0 * 500.0 / RATE, rel=3e-4)


def test_a_first_turn_of_which_nothing_is_known_has_the_doubt_of_an_acceleration() -> None:
    first = angle_law(1000.0, 1000.0, 50.0, {}, (), unknown=0.01)
    assert first.std == pytest.approx(0.01)
    second = angle_law(2000.0, 1000.0, 50.0, {}, first.past, unknown=0.01)
    assert second.std == 0.0


def test_a_slip_ratio_that_cannot_be_followed_is_all_doubt() -> None:
    known = course(np.full(1001, 20.0), -950.0, 950.0)
    past = ((0.0, np.nan, 1.0, 1e-3), (1000.0, np.nan, 0.3, 1e-3))
    law = angle_law(2500.0, 1000.0, 50.0, {"speed": known}, past)
    assert law.speed > 0.0
    assert (law.std, law.slip_std) == (1.0, 1.0)
