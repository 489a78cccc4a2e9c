"""Laws of the line of samples: time goes on, losses are counted, nothing is invented."""

from collections import deque
from dataclasses import fields, replace
from itertools import chain, pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tirebench.protocols.decoder import SerialDecoder
from tirebench.wire.device import Device
from tirebench.wire.frames import FrameFlag, Frames, encode, select, strain_frames
from tirebench.wire.rate_check import BASELINE, JUDGED, LONGEST_WAIT
from tirebench.wire.timeline import Samples, Timeline

PERIOD = 1000  # ticks: 10 kHz


def line_of(count: int, *, seq: int = 0, t_us: int = 0) -> Frames:
    """Frames whose first gage counts samples."""
    counts = np.zeros((16 * count, 5), np.int16)
    counts[:, 0] = np.arange(16 * count)
    return strain_frames(counts, period=PERIOD, seq=seq, t_us=t_us)


def push(timeline: Timeline, frames: Frames, order: list[int] | None = None) -> list[Samples]:
    rows = np.arange(len(frames)) if order is None else np.array(order)
    return timeline.push(Frames(*(getattr(frames, n)[rows] for n in Frames.__slots__)))


def joined(blocks: list[Samples]) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """First gage of all samples, in counts."""
    return np.concatenate([block.strain[:, 0] for block in blocks]) / Device().scale


def test_frames_in_order_are_one_block() -> None:
    blocks = push(Timeline(Device()), line_of(50))
    assert [block.reset for block in blocks] == ["start", ""]
    np.testing.assert_allclose(joined(blocks), np.arange(800), atol=1e-9)


@pytest.mark.parametrize("seq", [0, 65530])
@pytest.mark.parametrize("t_us", [0, 2**32 - 5000])
def test_lost_frames_become_nan_across_wraps(seq: int, t_us: int) -> None:
    timeline = Timeline(Device())
    order = [i for i in range(20) if i not in (5, 6, 13)]
    seen = joined(push(timeline, line_of(20, seq=seq, t_us=t_us), order))
    lost = np.isin(np.arange(320) // 16, (5, 6, 13))
    np.testing.assert_allclose(seen, np.where(lost, np.nan, np.arange(320)), atol=1e-9)
    counts = timeline.counts
    assert (counts.gaps, counts.lost_frames, counts.lost_samples, counts.resets) == (2, 3, 48, 0)


@given(
    keep=st.lists(st.sampled_from(["ok", "lost", "dup", "late"]), min_size=2, max_size=40),
    pieces=st.integers(1, 7),
)
def test_samples_fill_the_device_time_and_batches_do_not_matter(
    keep: list[str], pieces: int
) -> None:
    order: list[int] = [0]
    for number, fate in enumerate(keep, start=1):
        order += [] if fate == "lost" else [number]
        order += [number] if fate == "dup" else [max(0, number - 2)] if fate == "late" else []
    frames = line_of(len(keep) + 1, seq=65500, t_us=2**32 - 10_000)
    whole, parts = Timeline(Device()), Timeline(Device())
    together = joined(push(whole, frames, order))
    apart = joined(
        [
            b
            for i in range(0, len(order), pieces)
            for b in push(parts, frames, order[i : i + pieces])
        ]
    )
    np.testing.assert_array_equal(together, apart)
    assert whole.counts == parts.counts
    assert together.size == 16 * (1 + max(order))
    known = np.isfinite(together)
    np.testing.assert_allclose(together[known], np.flatnonzero(known), atol=1e-9)


def test_repeated_and_late_frames_are_dropped_and_counted() -> None:
    timeline = Timeline(Device())
    seen = joined(push(timeline, line_of(10), [0, 1, 1, 2, 4, 3, 5, 5, 5]))
    assert seen.size == 96
    assert (timeline.counts.duplicates, timeline.counts.out_of_order) == (3, 1)


def test_a_long_gap_starts_a_new_segment() -> None:
    timeline = Timeline(Device())
    blocks = push(timeline, line_of(1000), [0, 1, 700, 701])
    assert [block.reset for block in blocks] == ["start", "", "long_gap", ""]
    assert blocks[-1].segment == 1
    assert timeline.counts.lost_frames == 698
    assert not np.isnan(joined(blocks)).any()
    assert blocks[2].t_us == 700 * 1600


def test_a_time_reset_is_acted_on_once_and_may_be_announced_often() -> None:
    timeline = Timeline(Device())
    frames = line_of(30)
    frames.flags.flags.writeable = True
    flags = frames.flags.copy()
    flags[10:18] = FrameFlag.TIME_RESET
    flagged = Frames(*(flags if n == "flags" else getattr(frames, n) for n in Frames.__slots__))
    blocks = push(timeline, flagged, [i for i in range(30) if i != 10])  # the first is lost
    assert [block.reset for block in blocks if block.reset] == ["start", "time_reset"]
    assert sum(len(block.strain) for block in blocks if block.segment == 1) == 19 * 16
    assert (timeline.counts.gaps, timeline.counts.resets) == (0, 1)


def test_a_pause_that_the_wheel_announces_is_the_time_in_which_it_sent_nothing() -> None:
    timeline = Timeline(Device())
    for number in range(3):  # four frames, then two seconds of silence
        frames = line_of(4, seq=4 * number, t_us=number * (4 * 1600 + 2_000_000))
        flags = np.where(np.arange(4) == 0, int(FrameFlag.TIME_RESET), 0)
        timeline.push(replace(frames, flags=flags))
    assert timeline.counts.resets == 2
    assert timeline.paused == pytest.approx(4.0, abs=1e-9)


@pytest.mark.parametrize("error", [-5e-4, 0.0, 5e-4])
def test_what_is_lost_is_counted_though_the_clock_is_a_little_off(error: float) -> None:
    timeline = Timeline(Device())
    blocks = push(timeline, paced(300, error), [k for k in range(300) if not 100 <= k < 130])
    assert timeline.counts.lost_frames == 30
    assert timeline.counts.lost_samples == 30 * 16
    assert joined(blocks).size == 300 * 16


def test_a_transmitter_that_restarts_begins_a_segment_and_time_does_not_go_back() -> None:
    timeline = Timeline(Device())
    first = push(timeline, line_of(200, seq=5000, t_us=9_000_000))
    second = push(timeline, line_of(3))
    assert second[0].reset == "clock_back"
    assert second[0].t_us >= first[-1].t_us + 16 * 100
    assert timeline.counts.out_of_order == 0


def test_a_frame_just_within_the_window_is_late_and_one_beyond_a_restart() -> None:
    for back, resets in ((64, 0), (65, 1)):
        timeline = Timeline(Device())
        push(timeline, line_of(200), [*range(150), 149 - back])
        assert timeline.counts.resets == resets
        assert timeline.counts.out_of_order == 1 - resets


def test_another_sample_period_begins_a_segment() -> None:
    timeline = Timeline(Device())
    push(timeline, line_of(2))
    other = strain_frames(np.zeros((16, 5), np.int16), period=500, seq=2, t_us=3200)
    assert timeline.push(other)[0].reset == "period_change"


def test_other_wheels_are_counted_and_left_alone() -> None:
    timeline = Timeline(Device(), wheel=0)
    frames = line_of(4)
    other = Frames(*(getattr(frames, n) + (3 if n == "wheel" else 0) for n in Frames.__slots__))
    assert timeline.push(other) == []
    assert len(joined(timeline.push(frames))) == 64
    assert timeline.counts.other_wheel == 4


def test_a_sample_clock_that_is_a_little_off_loses_nothing() -> None:
    frames = line_of(500)
    drifted = select(frames, slice(None))
    time = np.rint(np.arange(500) * 1600 * 1.0005).astype(np.int64)  # 500 ppm fast
    drifted = Frames(*(time if n == "t_us" else getattr(frames, n) for n in Frames.__slots__))
    timeline = Timeline(Device())
    assert joined(timeline.push(drifted)).size == 8000
    assert timeline.counts.gaps == 0


def paced(count: int, error: float, *, t_us: int = 0) -> Frames:
    """Frames that say 10 kHz, of a wheel whose clock shows `error` more time a sample."""
    frames = line_of(count)
    time = t_us + np.rint(np.arange(count) * 1600.0 * (1.0 + error)).astype(np.int64)
    return replace(frames, t_us=time % 2**32)


@pytest.mark.parametrize("error", [-0.5, -0.1, -0.03, -0.006, 0.006, 0.03, 0.1, 1.0])
@pytest.mark.parametrize("lost", [0.0, 0.2])
@pytest.mark.parametrize("a_read", [1, 3, 50])
def test_a_clock_that_contradicts_the_period_is_found(
    error: float, lost: float, a_read: int
) -> None:
    count = 6 * JUDGED
    kept = np.random.default_rng(5).random(count) >= lost
    wire = encode(select(paced(count, error, t_us=2**32 - 10**5), kept))
    reads = [b"".join(wire[first : first + a_read]) for first in range(0, len(wire), a_read)]
    frames = chain.from_iterable(map(SerialDecoder().push, reads))
    timeline = Timeline(Device())
    deque(map(timeline.push, frames), 0)
    said = timeline.contradiction
    assert f"{1e4 / (1.0 + error):.0f} samples a second, but 10000 were configured" in said
    assert "correct `period` in the transmitter's SERIAL v1 frames" in said


def test_a_rate_is_judged_anew_after_each_start_and_is_not_waited_for_without_end() -> None:
    """Here the wheel begins anew every 100 frames, before it can be judged again."""
    begun, timeline, judged = JUDGED + 5, Timeline(Device()), []
    for number in range(begun + LONGEST_WAIT + 150):
        reset = number >= begun and (number - begun) % 100 == 0
        frame = line_of(1, seq=number, t_us=1600 * number)
        timeline.push(replace(frame, flags=np.array([FrameFlag.TIME_RESET * reset])))
        judged.append(timeline.judged)
    waited = begun + LONGEST_WAIT - 1
    assert [now for now, then in pairwise(judged) if now != then] == [
        False,
        True,
        False,
    ]
    assert [judged.index(True), judged.index(False, JUDGED), judged.index(True, begun)] == [
        JUDGED - 1,
        begun,
        waited,
    ]


@pytest.mark.parametrize("heard", [BASELINE + 1, 60, JUDGED + 40])
def test_pauses_of_the_transmitter_while_the_cable_is_out_are_no_slower_clock(heard: int) -> None:
    """Between two runs time goes on and the frames' numbers do not; no receiver hears it here."""
    count = 8 * JUDGED
    frames = paced(count, 0.0)
    part = np.arange(count) // heard
    paused = replace(frames, t_us=frames.t_us + part // 2 * 100_000)
    timeline = Timeline(Device())
    timeline.push(select(paused, part % 2 == 0))
    assert not timeline.contradiction


@given(
    error=st.floats(-0.0045, 0.0045),
    jump=st.integers(-(10**6), 10**7),
    at=st.integers(1, 5 * JUDGED),
    restarts=st.booleans(),
)
def test_a_clock_that_agrees_is_taken_whatever_else_happens(
    error: float, jump: int, at: int, restarts: bool
) -> None:
    frames = paced(5 * JUDGED + 1, error, t_us=2**31)
    after = np.arange(len(frames)) >= at
    seq = np.where(after & restarts, frames.seq - at, frames.seq)
    timeline = Timeline(Device())
    timeline.push(replace(frames, t_us=frames.t_us + jump * after, seq=seq))
    assert not timeline.contradiction


def test_samples_come_out_of_another_process_as_they_went_in() -> None:
    strain = np.arange(6.0).reshape(3, 2)
    strain[1] = np.nan
    lost, saturated = np.isnan(strain[:, 0]), strain > 4.0

    def sent(rows: slice) -> Samples:
        return Samples(2, "gap", 7, 5, 1e-4, strain[rows], lost[rows], saturated[rows])

    for n in (3, 0):
        whole = sent(slice(n))
        assert_same(Samples.unpack(whole.pack()), whole)
        assert Samples.unpack(whole.pack()).pack() == whole.pack()  # a reader compares them
    parts = (sent(rows).pack() for rows in (slice(1), slice(1, 3)))
    assert_same(Samples.unpack(*parts), sent(slice(3)))


def assert_same(one: Samples, other: Samples) -> None:
    for field in fields(Samples):
        pair = getattr(one, field.name), getattr(other, field.name)
        np.testing.assert_array_equal(*pair, strict=True)
