"""Laws of cutting turns: frames do not matter, faults are flagged, nothing is repaired silently."""

import gc
import tracemalloc
from dataclasses import fields
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.synthetic import LATERAL, RATE, frames, record
from tirelib.core.errors import ParameterError, ShapeError
from tirelib.core.flags import INVALIDATING, TurnFlag
from tirelib.fmu.virtual.spec import default_surface
from tirelib.fmu.virtual.surface import shared_surface
from tirelib.measured.signal import LowPass, Turn, TurnCutter, Turns, cut_turns, stack_turns
from tirelib.measured.signal.quality import SPIKE_BEND, inspect


def turns_of(strain: np.ndarray, **options: object) -> Turns:
    return cut_turns(strain, RATE, LATERAL, **{"speed": 18.0, **options})


def by_numpy(strain: np.ndarray) -> Turns:
    """Cut turns without the compiled core, which `turns_of` uses where there is one."""
    cut = TurnCutter(LATERAL, RATE).push(strain, speed=18.0)
    return stack_turns(cut, np.array(LATERAL), RATE)


def has(turns: Turns, flag: TurnFlag, turn: int, gage: int | None = None) -> bool:
    flags = turns.flags[turn] if gage is None else turns.gage_flags[turn, gage]
    return bool(flags & flag)


def middle_of(turns: Turns, turn: int) -> int:
    return int(turns.time[turn] * RATE)


def assert_same(a: Turn, b: Turn) -> None:
    for field in fields(Turn):
        np.testing.assert_allclose(
            getattr(a, field.name), getattr(b, field.name), rtol=1e-9, atol=1e-12
        )


@settings(max_examples=15)
@given(
    start=st.floats(-3.0, 3.0),
    longest=st.sampled_from([1, 2, 10, 100, 2000]),
    seed=st.integers(0, 99),
)
def test_frames_of_any_length_give_the_same_turns_as_the_whole_record(
    start: float, longest: int, seed: int
) -> None:
    strain, trigger, _ = record(turns=4.3, noise=4e-6, start=start)
    whole = TurnCutter(LATERAL, RATE).push(strain, speed=18.0, trigger=trigger)
    cutter, pieces = TurnCutter(LATERAL, RATE), []
    for part in frames(strain.shape[1], longest, seed):
        pieces += cutter.push(strain[:, part], speed=18.0, trigger=trigger[part])
    assert len(pieces) == len(whole) >= 3
    for piece, turn in zip(pieces, whole, strict=True):
        assert_same(piece, turn)


def test_a_turn_comes_with_the_last_of_the_samples_that_its_contact_lacks() -> None:
    strain, _, _ = record(turns=4)
    cutter, told = TurnCutter(LATERAL, RATE), 0
    for i in range(strain.shape[1]):
        lacking = cutter.lacking
        turns = cutter.push(strain[:, i : i + 1], speed=18.0)
        if lacking is not None:
            assert lacking >= 1
            assert bool(turns) == (lacking == 1)
            assert turns or cutter.lacking == lacking - 1
            told += bool(turns)
    assert told == 3  # the first contact has no turn before it


def test_a_turn_is_ready_twenty_degrees_and_half_the_filter_after_the_pulse() -> None:
    strain, _, omega = record(turns=4)
    cutter = TurnCutter(LATERAL, RATE)
    given_at = [i for i in range(strain.shape[1]) if cutter.push(strain[:, i : i + 1], speed=18.0)]
    turns = turns_of(strain)
    for turn in range(1, len(turns)):
        fall = turns.time[turn] * RATE + turns.trace.pulse[turn] / omega * RATE
        reach = np.deg2rad(20.0) + 4 * LowPass().sigma(omega / (2 * np.pi))
        assert 0 < given_at[turn] - fall <= reach / omega * RATE + 2


def test_offset_of_every_gage_is_removed_and_reported() -> None:
    strain, _, _ = record(noise=0.0)
    offsets = np.array([1e-3, -2e-3, 0.0, 4e-3, 3e-4])
    moved = turns_of(strain + offsets[:, None])
    plain = turns_of(strain)
    np.testing.assert_allclose(moved.trace.strain[1:], plain.trace.strain[1:], atol=1e-12)
    np.testing.assert_allclose((moved.offset - plain.offset)[1:], np.tile(offsets, (4, 1)))


@given(gain=st.floats(0.5, 1.8))
@settings(max_examples=10)
def test_strain_scales_with_the_gain(gain: float) -> None:
    strain, _, _ = record(turns=3)
    a, b = turns_of(strain), turns_of(gain * strain)
    np.testing.assert_allclose(b.trace.strain[1:], gain * a.trace.strain[1:], atol=1e-9)


def test_angle_domain_is_the_same_at_any_speed() -> None:
    slow, _, _ = record(turns=3, speed=3.0)
    fast, _, _ = record(turns=3, speed=40.0)
    a, b = turns_of(slow, speed=3.0), turns_of(fast, speed=40.0)
    # the pulse's flanks are crossed between samples: 2e-5 of 8e-3 at 40 m/s
    np.testing.assert_allclose(a.trace.strain[1], b.trace.strain[1], atol=3e-5)
    np.testing.assert_allclose(a.trace.rate[1], b.trace.rate[1], atol=3e-3)


def test_turn_rate_is_that_of_the_preceding_turn() -> None:
    strain, _, omega = record()
    turns = turns_of(strain)
    # crossings are interpolated linearly between samples: 0.02 of 1064
    np.testing.assert_allclose(turns.trace.conditions.omega[1:], omega, rtol=2e-5)
    assert np.isnan(turns.trace.conditions.omega[0])


def test_the_first_turn_is_flagged_and_says_nothing() -> None:
    strain, _, _ = record()
    turns = turns_of(strain)
    assert has(turns, TurnFlag.FIRST_TURN, 0)
    assert np.isnan(turns.trace.strain[0]).all()
    assert (turns.flags[1:] == 0).all()


def test_the_trigger_gives_the_angle_from_the_wheel_axis() -> None:
    strain, trigger, _ = record()
    shifted = np.roll(trigger, -12)
    step = 18.0 / 0.305 / RATE
    plain, early = turns_of(strain, trigger=trigger), turns_of(strain, trigger=shifted)
    np.testing.assert_allclose(plain.trace.axis_shift[1:], 0.0, atol=0.51 * step)
    moved = early.trace.axis_shift[1:] - plain.trace.axis_shift[1:]
    np.testing.assert_allclose(moved, 12 * step, rtol=2e-5)


@pytest.mark.parametrize("fault", ["none", "twice"])
def test_a_trigger_that_disagrees_is_flagged(fault: str) -> None:
    strain, trigger, _ = record()
    on = np.flatnonzero(trigger)
    trigger = trigger.copy()
    if fault == "none":
        trigger[on[2]] = False
    else:
        trigger[on[2] + 50] = True
    turns = turns_of(strain, trigger=trigger)
    wrong = [has(turns, TurnFlag.TRIGGER_MISMATCH, turn) for turn in range(len(turns))]
    assert wrong.count(True) == 1


def test_two_missing_samples_are_bridged_and_flagged() -> None:
    strain, _, _ = record()
    clean = turns_of(strain)
    at = middle_of(clean, 2) + 20
    holed = strain.copy()
    holed[1, at : at + 2] = np.nan
    turns = turns_of(holed)
    assert has(turns, TurnFlag.BRIDGED, 2, 1)
    assert not has(turns, TurnFlag.GAP, 2, 1)
    np.testing.assert_allclose(turns.trace.strain[2, 1], clean.trace.strain[2, 1], atol=1e-4)
    assert turns.gage_flags[2, [0, 2, 3, 4]].tolist() == [0, 0, 0, 0]


@pytest.mark.parametrize("length", [3, 30])
def test_a_longer_gap_makes_the_gage_say_nothing(length: int) -> None:
    strain, _, _ = record()
    at = middle_of(turns_of(strain), 2) + 20
    holed = strain.copy()
    holed[1, at : at + length] = np.nan
    turns = turns_of(holed)
    assert has(turns, TurnFlag.GAP, 2, 1)
    assert has(turns, TurnFlag.REDUCED_GAGES, 2)
    assert np.isnan(turns.trace.strain[2, 1]).all()
    assert np.isfinite(turns.trace.strain[2, 0]).any()


def test_a_gap_in_the_centre_gage_forbids_an_estimate() -> None:
    strain, _, _ = record()
    at = middle_of(turns_of(strain), 2)
    holed = strain.copy()
    holed[2, at - 5 : at + 5] = np.nan
    assert has(turns_of(holed), TurnFlag.TOO_FEW_GAGES, 2)


def test_a_lost_frame_of_all_gages_forbids_an_estimate() -> None:
    strain, _, _ = record()
    at = middle_of(turns_of(strain), 2)
    holed = strain.copy()
    holed[:, at - 60 : at - 44] = np.nan
    assert has(turns_of(holed), TurnFlag.TOO_FEW_GAGES, 2)


@pytest.mark.parametrize("size", [0.004, -0.004, 0.02])
def test_a_spike_is_flagged_and_does_not_bend_the_trace(size: float) -> None:
    strain, _, _ = record(noise=4e-6)
    clean = turns_of(strain)
    spiked = strain.copy()
    spiked[3, middle_of(clean, 2) - 10] += size
    turns = turns_of(spiked)
    assert has(turns, TurnFlag.SPIKE, 2, 3)
    assert not has(turns, TurnFlag.SPIKE, 1, 3)
    np.testing.assert_allclose(turns.trace.strain[2, 3], clean.trace.strain[2, 3], atol=3e-5)


@pytest.mark.parametrize("step", [0.006, 0.0136, 0.03])
@pytest.mark.parametrize("degrees", [0.0, 4.0])
def test_a_contact_of_few_samples_is_no_spike_and_a_spike_in_it_is_one(
    step: float, degrees: float
) -> None:
    """A transmitter of 10 kHz at 65 and 150 km/h, and one of 2 kHz at 65 km/h."""
    surface = shared_surface(default_surface())
    angle = np.arange(-np.pi, np.pi, step)
    for load in (1500.0, 3000.0, 6500.0):
        state = np.array([[load, np.deg2rad(degrees), 0.0, 0.0, 18.0, 2.3e5]])
        strain = surface.strain(surface.answers(state), angle).T
        assert not (inspect(strain, step)[1] & TurnFlag.SPIKE).any(), load
        at = int(np.argmin(np.abs(angle)))  # the middle of the contact
        share = max(0.05, SPIKE_BEND * step**2)  # of a swing that holds the spike
        spiked = strain.copy()
        spiked[2, at] += (1.1 + share / (1.0 - share)) * np.ptp(strain[2])
        flags = inspect(spiked, step)[1]
        assert flags[2] & TurnFlag.SPIKE
        assert not (flags[[0, 1, 3, 4]] & TurnFlag.SPIKE).any()


def test_a_clipped_gage_is_flagged_saturated() -> None:
    strain, _, _ = record(noise=4e-6)
    clipped = strain.copy()
    clipped[0] = np.minimum(clipped[0], 0.0075)
    turns = turns_of(clipped)
    assert all(has(turns, TurnFlag.SATURATED, turn, 0) for turn in range(1, len(turns)))
    assert not any(has(turns, TurnFlag.SATURATED, turn, 1) for turn in range(len(turns)))


def test_a_flat_quantised_plateau_is_not_saturated() -> None:
    strain, _, _ = record(noise=0.0, speed=3.0, half=0.3)
    coarse = np.round(strain / 2.44e-6) * 2.44e-6
    turns = turns_of(coarse, speed=3.0)
    assert not (turns.gage_flags & int(TurnFlag.SATURATED)).any()


@pytest.mark.parametrize("level", [0.0, 2.7e-3, -1.0])
def test_a_dead_gage_is_flagged(level: float) -> None:
    strain, _, _ = record(noise=4e-6)
    dead = strain.copy()
    dead[4] = level
    turns = turns_of(dead)
    assert all(has(turns, TurnFlag.DEAD_GAGE, turn, 4) for turn in range(1, len(turns)))
    assert all(has(turns, TurnFlag.REDUCED_GAGES, turn) for turn in range(1, len(turns)))


def test_a_gage_over_a_lifted_shoulder_shows_no_contact() -> None:
    """The belt bulges where the shoulder is off the road: the strain swings, without an edge."""
    strain, _, _ = record(noise=4e-6)
    lifted = strain.copy()
    phi = 2.0 * np.pi * np.arange(strain.shape[1]) * 18.0 / (2.0 * np.pi * 0.305 * 1e4) - np.pi
    lifted[4] = 1.5e-3 * np.cos(phi) + 4e-6 * np.random.default_rng(1).normal(size=phi.size)
    assert np.ptp(lifted[4]) > 0.25 * np.ptp(strain[4])
    turns = turns_of(lifted)
    assert all(has(turns, TurnFlag.DEAD_GAGE, turn, 4) for turn in range(1, len(turns)))
    assert all(has(turns, TurnFlag.REDUCED_GAGES, turn) for turn in range(1, len(turns)))


@pytest.mark.parametrize(("share", "dead"), [(0.22, True), (0.28, False)])
def test_a_gage_is_dead_below_a_quarter_of_the_others_steepness(share: float, dead: bool) -> None:
    strain, _, _ = record(noise=4e-6)
    strain[4] = share * strain[1]
    for turns in (turns_of(strain), by_numpy(strain)):
        assert has(turns, TurnFlag.DEAD_GAGE, 3, 4) == dead


@pytest.mark.parametrize(("share", "spike"), [(0.04, False), (0.06, True)])
def test_a_sample_is_a_spike_from_a_twentieth_of_the_swing_on(share: float, spike: bool) -> None:
    window = np.cos(0.001 * np.arange(-3000, 3000))[None] * 1e-3
    window[0, 2000] += share * np.ptp(window)
    _, flags = inspect(window, 0.001)
    assert bool(flags[0] & int(TurnFlag.SPIKE)) == spike


@pytest.mark.parametrize(("angle", "saturated"), [(0.036, False), (0.044, True)])
def test_a_gage_that_stands_at_its_extreme_is_saturated_from_four_hundredths_of_a_radian(
    angle: float, saturated: bool
) -> None:
    step = 0.001
    away = np.abs(step * np.arange(-500, 501))
    window = np.minimum(1.0 - away, 1.0 - 0.5 * angle)[None] * 1e-3
    _, flags = inspect(window, step)
    assert bool(flags[0] & int(TurnFlag.SATURATED)) == saturated


def test_drift_within_a_turn_is_flagged() -> None:
    strain, _, _ = record()
    n = strain.shape[1]
    drifting = strain.copy()
    drifting[1] += np.linspace(0.0, 6e-3, n)
    turns = turns_of(drifting)
    assert has(turns, TurnFlag.DRIFT, 3, 1)
    assert not has(turns, TurnFlag.DRIFT, 3, 0)


@pytest.mark.parametrize(("share", "flagged"), [(0.03, False), (0.075, True)])
def test_a_drift_counts_from_a_twentieth_of_the_swing_in_a_turn(
    share: float, flagged: bool
) -> None:
    strain, _, omega = record()
    passed = omega * np.arange(strain.shape[1]) / RATE / (2.0 * np.pi)
    strain[1] += share * np.ptp(strain[1]) * passed
    for turns in (turns_of(strain), by_numpy(strain)):
        assert has(turns, TurnFlag.DRIFT, 3, 1) == flagged


@pytest.mark.parametrize("cut_off", [0.5, 40.0, 2000.0, 4000.0])
def test_an_unsuitable_cut_off_is_flagged_and_gives_no_trace(cut_off: float) -> None:
    strain, _, _ = record()
    turns = turns_of(strain, low_pass=LowPass(cut_off=cut_off))
    assert len(turns) == 5
    assert all(has(turns, TurnFlag.CUT_OFF, turn) for turn in range(1, 5))
    assert np.isnan(turns.trace.strain).all()


@pytest.mark.parametrize(
    ("speed", "flag"),
    [(np.nan, TurnFlag.NO_SPEED), (0.0, TurnFlag.NO_SPEED), (-18.0, TurnFlag.REVERSED)],
)
def test_a_speed_that_says_nothing_is_flagged(speed: float, flag: TurnFlag) -> None:
    strain, _, _ = record()
    assert has(turns_of(strain, speed=speed), flag, 2)


def test_half_the_period_is_flagged() -> None:
    slow, _, _ = record(turns=3, speed=8.0)
    fast, _, _ = record(turns=3, speed=30.0)
    turns = turns_of(np.concatenate((slow, fast), axis=1))
    assert any(has(turns, TurnFlag.PERIOD_JUMP, turn) for turn in range(len(turns)))


def test_conditions_are_the_mean_of_what_was_held_over_the_turn() -> None:
    strain, _, _ = record()
    n = strain.shape[1]
    pressure = np.where(np.arange(n) < n // 2, 2.0e5, 2.4e5)
    turns = turns_of(strain, pressure=pressure)
    assert turns.trace.conditions.pressure[1] == pytest.approx(2.0e5)
    assert turns.trace.conditions.pressure[-1] == pytest.approx(2.4e5)


def test_memory_does_not_grow() -> None:
    strain, _, _ = record(turns=5)
    cutter = TurnCutter(LATERAL, RATE)
    cutter.push(strain)

    def held() -> int:
        """Return the memory in use after eight records more, [bytes]."""
        for _ in range(8):
            for part in frames(strain.shape[1], 20, 0):
                cutter.push(strain[:, part])
        gc.collect()
        return tracemalloc.get_traced_memory()[0]

    tracemalloc.start()
    held()  # the interpreter fills its free lists
    before = held()
    grown = held() - before
    tracemalloc.stop()
    # one of the eight records of strain alone would be 213 kB
    assert grown < 40_000


def test_wrong_shapes_and_rates_are_refused() -> None:
    with pytest.raises(ShapeError, match=r"strain has shape \(4, 10\); \(5, n\) is needed"):
        TurnCutter(LATERAL, RATE).push(np.zeros((4, 10)))
    with pytest.raises(ParameterError, match="must be above 0"):
        TurnCutter(LATERAL, 0.0)


def test_spikes_away_from_the_contact_do_not_move_the_offset() -> None:
    strain, _, omega = record(noise=4e-6)
    clean = turns_of(strain)
    spiked = strain.copy()
    half_turn = int(np.pi / omega * RATE)
    for turn in range(1, 5):
        at = middle_of(clean, turn) - half_turn
        spiked[:, at - 10 : at + 10 : 10] += 0.5
    turns = turns_of(spiked)
    np.testing.assert_allclose(turns.offset[1:], clean.offset[1:], atol=2e-6)


def from_opposite(turns: Turns, turn: int, samples: int, omega: float) -> np.ndarray:
    """Return the angle of samples from the point opposite the contact of a turn, [rad]."""
    return np.abs((np.arange(samples) - middle_of(turns, turn)) * omega / RATE + np.pi)


@pytest.mark.parametrize(
    ("low", "high", "moves"), [(0.52, 1.2, False), (0.38, 0.48, True)], ids=["outside", "inside"]
)
def test_the_offset_is_the_strain_within_half_a_radian_of_the_point_opposite_the_contact(
    low: float, high: float, moves: bool
) -> None:
    strain, _, omega = record(noise=4e-6)
    clean = turns_of(strain)
    away = from_opposite(clean, 3, strain.shape[1], omega)
    changed = strain + 1e-4 * ((low < away) & (away < high))
    for turns in (turns_of(changed), by_numpy(changed)):
        moved = np.abs(turns.offset - clean.offset)[3]
        assert (moved > 1e-7).all() if moves else (moved < 1e-12).all()


@pytest.mark.parametrize(("every", "gap"), [(12, False), (8, True)])
def test_an_offset_needs_nine_tenths_of_its_samples(every: int, gap: bool) -> None:
    strain, _, omega = record(noise=4e-6)
    away = from_opposite(turns_of(strain), 3, strain.shape[1], omega)
    strain[1, (away < 0.5) & (np.arange(strain.shape[1]) % every == 0)] = np.nan
    for turns in (turns_of(strain), by_numpy(strain)):
        assert has(turns, TurnFlag.GAP, 3, 1) == gap


@pytest.mark.parametrize("rising", [0.0, 1e-4])
def test_a_gap_opposite_the_contact_leaves_the_next_turn_a_doubt_of_its_offset(
    rising: float,
) -> None:
    """How far the offset moved is read over the two turns that are known."""
    strain, _, omega = record(turns=6.0)
    turn = 2.0 * np.pi / omega * RATE
    strain += rising * np.arange(strain.shape[1]) / turn
    at = middle_of(turns_of(strain), 2) - int(turn / 2.0)
    holed = strain.copy()
    holed[:, at - 100 : at + 100] = np.nan
    for turns in (turns_of(holed), by_numpy(holed)):
        assert has(turns, TurnFlag.TOO_FEW_GAGES, 2)
        assert np.isnan(turns.offset_std[2]).all()
        assert (turns.flags[3] & int(INVALIDATING)) == 0
        # in half a turn it may have moved by half of what it moved in the two turns before
        np.testing.assert_allclose(turns.offset_std[3], 0.25 * 2.0 * rising, atol=3e-6)
        assert np.isfinite(turns.offset_std[3:]).all()


def test_a_gage_whose_swing_is_not_known_does_not_drift() -> None:
    strain, _, _ = record(noise=4e-6)
    at = middle_of(turns_of(strain), 2)
    strain[1, at - 20 : at + 20] = np.nan
    for turns in (turns_of(strain), by_numpy(strain)):
        assert has(turns, TurnFlag.GAP, 2, 1)
        assert not has(turns, TurnFlag.DRIFT, 2)


@pytest.mark.parametrize("length", [2, 3, 16, 64])
@pytest.mark.parametrize("shift", [-40, -34, -30, 20, 30, 34, 40])
def test_a_gap_at_one_contact_does_not_spoil_the_next_turn(length: int, shift: int) -> None:
    """The middle of a damaged contact moves, and with it the period of the turn that follows."""
    strain, _, omega = record(noise=4e-6)
    at = middle_of(turns_of(strain), 2) + shift
    holed = strain.copy()
    holed[:, at : at + length] = np.nan
    turns = turns_of(holed)
    usable = (turns.flags & int(INVALIDATING)) == 0
    np.testing.assert_allclose(turns.trace.conditions.omega[usable], omega, rtol=1e-4)
    assert usable[3:].sum() >= 1


@pytest.mark.parametrize("before", range(-6, 7))
@pytest.mark.parametrize("length", [1, 3, 5])
def test_a_gap_at_the_end_of_the_window_reads_the_same_in_any_frames(
    before: int, length: int
) -> None:
    strain, _, _ = record(turns=3.6)
    ready = round(turns_of(strain).ready[1] * RATE)
    strain[2, ready + before : ready + before + length] = np.nan
    whole = TurnCutter(LATERAL, RATE).push(strain, speed=18.0)
    for size in (1, 7, 16):
        cutter, pieces = TurnCutter(LATERAL, RATE), []
        # in such frames near the gap, where they matter; other tests cut a whole record into them
        near = range(ready - 10 * 16, ready + 10 * 16, size)
        for start, stop in pairwise((0, *near, strain.shape[1])):
            pieces += cutter.push(strain[:, start:stop], speed=18.0)
        for piece, turn in zip(pieces, whole, strict=True):
            assert_same(piece, turn)


@pytest.mark.parametrize("speed", [2.8, 18.0, 40.0])
@pytest.mark.parametrize("share", [0.5, 0.7, 0.9])
def test_clipping_is_seen_at_any_speed(speed: float, share: float) -> None:
    strain, _, _ = record(noise=4e-6, speed=speed, turns=4)
    low, high = strain[2].min(), strain[2].max()
    strain[2] = np.minimum(strain[2], low + share * (high - low))
    turns = turns_of(strain, speed=speed)
    assert all(has(turns, TurnFlag.SATURATED, turn, 2) for turn in range(1, len(turns)))


def test_a_wheel_that_turns_does_not_stand() -> None:
    strain, _, _ = record()
    assert np.isnan(turns_of(strain, speed=0.0).trace.conditions.speed).all()
