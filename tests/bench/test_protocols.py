"""Laws of the CAN frames: round trips, agreement with cantools, no doubt about what wrapped."""

from collections import deque
from pathlib import Path

import cantools
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tirebench.protocols import CAN, layouts
from tirebench.protocols.dbc import FILES, database, signals
from tirebench.protocols.layouts import LAYOUTS, RAW12, RAW12C, RAW16, Health, Raw
from tirebench.protocols.plan import ProtocolPlan
from tirebench.protocols.signals import Signal, raw_values
from tirebench.protocols.transmitter import CanTransmitter, Record
from tirebench.protocols.wheel_can import WheelCan
from tirebench.protocols.widening import Widener
from tirebench.wire.can_batch import CanBatch, joined, pack, same_kind, unpack
from tirebench.wire.device import Device
from tirebench.wire.frames import FrameFlag, Frames
from tirebench.wire.line_counts import LineCounts
from tirebench.wire.timeline import Timeline

FD_FILE, CLASSIC_FILE = FILES
ENCODE = {RAW16: layouts.encode_raw16, RAW12: layouts.encode_raw12}
DECODE = {RAW16: layouts.decode_raw16, RAW12: layouts.decode_raw12}


def some_raw(kind: str, count: int, seed: int) -> Raw:
    rng = np.random.default_rng(seed)
    shape = (count, LAYOUTS[kind].samples, 5)
    if kind == RAW16:
        counts = rng.integers(-(2**15), 2**15, shape)
    else:
        counts = 16 * rng.integers(-(2**11), 2**11, shape)
        counts[counts == 16 * 2047] = 2**15 - 1
    return Raw(rng.integers(0, 256, count), rng.integers(0, 2**24, count), counts.astype(np.int16))


@pytest.mark.parametrize("kind", [RAW16, RAW12])
@given(count=st.integers(1, 20), seed=st.integers(0, 10**6))
def test_frames_arrive_as_they_were_sent(kind: str, count: int, seed: int) -> None:
    sent = some_raw(kind, count, seed)
    back = DECODE[kind](ENCODE[kind](sent))
    for name in ("seq", "t_us", "counts"):
        np.testing.assert_array_equal(getattr(back, name), getattr(sent, name))


@given(seed=st.integers(0, 10**6), counter=st.integers(0, 10**6))
def test_single_samples_arrive_as_they_were_sent(seed: int, counter: int) -> None:
    counts = some_raw(RAW12, 3, seed).counts.reshape(-1, 5)
    numbers = counter + np.arange(len(counts))
    seen, back = layouts.decode_raw12c(layouts.encode_raw12c(numbers, counts))
    np.testing.assert_array_equal(seen, numbers % 16)
    np.testing.assert_array_equal(back, counts)


@given(
    st.integers(0, 65535),
    st.integers(-128, 127),
    st.integers(-128, 127),
    st.integers(0, 255),
    st.integers(0, 255),
    st.integers(0, 65535),
    st.integers(0, 2**32 - 1),
)
def test_health_and_sync_arrive(a: int, b: int, c: int, d: int, e: int, f: int, g: int) -> None:
    sent = Health(a, b, c, 0.02 * d, 2000.0 * e, f)
    back = layouts.decode_health(layouts.encode_health(sent)[0])
    assert (back.radio_lost, back.rssi, back.temperature, back.flags) == (a, b, c, f)
    assert (back.battery, back.pressure) == pytest.approx((sent.battery, sent.pressure))
    index, t_us = layouts.decode_sync(layouts.encode_sync([g], [g ^ 1]))
    assert (index[0], t_us[0]) == (g, g ^ 1)


def test_the_published_databases_are_the_ones_in_the_repository() -> None:
    for path, kinds in FILES.items():
        assert path.read_text(encoding="utf-8") == database(kinds)


@pytest.mark.parametrize(
    ("file", "kind"),
    [
        (FD_FILE, RAW16),
        (FD_FILE, RAW12),
        (CLASSIC_FILE, RAW12C),
        (CLASSIC_FILE, "SYNC"),
        (CLASSIC_FILE, "HEALTH"),
    ],
)
def test_cantools_reads_what_is_sent(file: Path, kind: str) -> None:
    """The published database and our layouts say the same, bit for bit."""
    db = cantools.database.load_file(file)
    message = db.get_message_by_name(f"{kind}_2")
    layout = LAYOUTS[kind]
    assert (message.frame_id, message.length, message.is_fd) == (
        layout.base + 2,
        layout.length,
        layout.fd,
    )
    rng = np.random.default_rng(3)
    data = rng.integers(0, 256, (50, layout.length)).astype(np.uint8)
    ours = raw_values(data, signals(kind))
    for row in range(len(data)):
        theirs = message.decode(data[row].tobytes(), scaling=False)
        assert [theirs[s.name] for s in signals(kind)] == ours[row].tolist()
    if kind in (RAW16, RAW12):
        counts = DECODE[kind](data).counts.reshape(50, -1)
        theirs = message.decode(data[7].tobytes())
        expected = [theirs[s.name] for s in signals(kind)[:-2]]
        sound = counts[7] != 2**15 - 1  # the mark, above what twelve bits can say
        np.testing.assert_array_equal(counts[7][sound], np.array(expected)[sound])


@given(
    start=st.integers(0, 40),
    length=st.integers(1, 24),
    signed=st.booleans(),
    big=st.booleans(),
    value=st.integers(0, 2**24 - 1),
)
def test_a_signal_is_found_wherever_a_dbc_puts_it(
    start: int, length: int, signed: bool, big: bool, value: int
) -> None:
    signal = Signal("x", start, length, signed, big_endian=big)
    text = f'VERSION ""\nBU_: A\nBO_ 16 M: 8 A\n{signal.line}\n'
    places = signal.places
    if places.max() >= 64 or places.min() < 0:
        return
    message = cantools.database.load_string(text, "dbc").messages[0]
    raw = value % 2**length
    raw -= 2**length if signed and raw >> (length - 1) else 0
    data = np.frombuffer(message.encode({"x": raw}, scaling=False, strict=False), np.uint8)
    assert raw_values(data[None, :], [signal])[0, 0] == raw


@pytest.mark.parametrize("tick", [1.0, 0.5, 20.0])
@given(
    gaps=st.lists(st.integers(1, 60_000), min_size=1, max_size=12),
    jitter=st.floats(-0.2, 0.2),
    begin=st.integers(0, 2**24),
)
def test_numbers_and_times_are_widened_across_any_gap(
    tick: float, gaps: list[int], jitter: float, begin: int
) -> None:
    """Gaps of up to 36 s: two to four turns of the clock and 234 of the number."""
    number = np.concatenate(([0], np.cumsum(gaps)))
    wide, frame = Widener(600.0, tick=tick), round(600.0 / tick)
    for place in range(len(number)):
        n = int(number[place])
        arrival = round(1e9 * (0.6e-3 * n + 1.0 + jitter * (place % 2)))
        time = begin + frame * n
        seq, t_us = wide.widen(np.array([n % 256]), np.array([time % 2**24]), arrival)
        assert seq[0] == n % 2**16
        assert (t_us[0] - round(tick * (begin % 2**24)) - 600 * n) % 2**32 in (0, 1, 2**32 - 1)


def record_of(samples: int, wheel: int = 0, period: int = 1000) -> Record:
    counts = (16 * (np.arange(samples)[:, None] % 1000 - 500 + np.arange(5))).astype(np.int16)
    return Record(wheel, 5_000_000, period, counts, np.zeros(samples, np.int16))


def strain_of(frames: list[Frames], timeline: Timeline) -> np.ndarray:
    blocks = [block for batch in frames for block in timeline.push(batch)]
    return np.concatenate([block.strain for block in blocks]) / (0.02 / 32768)


@pytest.mark.parametrize("kind", [RAW16, RAW12, RAW12C])
@pytest.mark.parametrize("pieces", [1, 7, 500])
def test_what_a_wheel_sends_is_what_its_gages_showed(kind: str, pieces: int) -> None:
    from tirebench.wire.device import Device

    record = record_of(4800)
    sent = CanTransmitter(kind).send(record, 0, 4800).frames
    decoder = WheelCan(1e4, LineCounts())
    cuts = np.array_split(np.arange(len(sent)), pieces)
    frames = [f for i, rows in enumerate(cuts) for f in decoder.push(sent.take(rows), 10**6 * i)]
    timeline = Timeline(Device(), 0)
    np.testing.assert_allclose(strain_of(frames, timeline), record.counts, atol=1e-6)
    assert timeline.counts.gaps == 0
    assert timeline.counts.resets == 0  # announced once, acted on once
    assert decoder.health[0].battery == pytest.approx(3.6)


def test_sixteen_lost_single_samples_are_seen() -> None:
    """The counter alone shows nothing: it is the SYNC that tells."""
    from tirebench.wire.device import Device

    record = record_of(4800, period=2000)
    sent = CanTransmitter(RAW12C).send(record, 0, 4800).frames
    strain = np.flatnonzero(sent.identifier == LAYOUTS[RAW12C].base)
    for gap in (16, 5, 32):
        counts = LineCounts()
        decoder, timeline = WheelCan(5e3, counts), Timeline(Device(), 0)
        kept = np.delete(np.arange(len(sent)), strain[1010 : 1010 + gap])
        seen = strain_of(decoder.push(sent.take(kept), 0), timeline)
        known = np.isfinite(seen[:, 0])
        np.testing.assert_allclose(seen[known], record.counts[known], atol=1e-6)
        lost = 4800 - int(known.sum())
        assert gap <= lost <= gap + 100
        assert (counts.unplaced > 0) == (gap % 16 == 0)
        assert counts.unplaced == lost - gap


def test_single_samples_without_sync_are_counted_not_guessed() -> None:
    counts = LineCounts()
    data = layouts.encode_raw12c(np.arange(70_000), np.zeros((70_000, 5), np.int16))
    decoder = WheelCan(5e3, counts)
    for part in np.array_split(data, 10):
        assert decoder.push(same_kind(0x120, part, fd=False), 0) == []
    assert counts.unplaced > 65_000


@pytest.mark.parametrize("kind", [RAW16, RAW12C])
def test_a_wrong_sample_rate_is_found_with_the_right_one(kind: str) -> None:
    sent = CanTransmitter(kind).send(record_of(4800, period=2000), 0, 4800).frames
    frames = WheelCan(1e4, LineCounts()).push(sent, 0)
    timeline = Timeline(Device(), rate_said_by=ProtocolPlan(CAN, 1e4).rate_said_by)
    deque(map(timeline.push, frames), 0)
    assert "5000 samples a second, but 10000 were configured" in timeline.contradiction
    assert timeline.contradiction.endswith("correct --rate")


def test_health_flags_hold_for_the_frames_after_them() -> None:
    raw = some_raw(RAW16, 4, 1)
    strain = same_kind(0x123, layouts.encode_raw16(raw), fd=True)
    told = [same_kind(0x13B, layouts.encode_health(Health(flags=f)), fd=False) for f in (128, 31)]
    rows = [strain.take(np.array([i])) for i in range(4)]
    batch = joined([rows[0], told[0], rows[1], rows[2], told[1], rows[3]])
    frames = WheelCan(1e4, LineCounts()).push(batch, 0)
    assert frames[0].flags.tolist() == [0, 128, 128, 0]  # saturation is marked in band only
    assert int(FrameFlag.RADIO_LOSS) == 128


def test_foreign_frames_are_counted_and_left_alone() -> None:
    counts = LineCounts()
    decoder = WheelCan(1e4, counts)
    other = same_kind(np.array([0x7FF, 0x11F, 0x140]), np.zeros((3, 8), np.uint8), fd=False)
    odd = same_kind(0x120, np.zeros((2, 7), np.uint8), fd=False)
    assert decoder.push(joined([other, odd]), 0) == []
    assert (counts.ok, counts.unknown) == (0, 5)
    own = same_kind(0x120, layouts.encode_raw16(some_raw(RAW16, 4, 1)), fd=True)
    decoder.push(own, 0)
    decoder.push(joined([own, other]), 0)
    assert (counts.ok, counts.unknown) == (8, 8)


@given(seed=st.integers(0, 10**6), fd=st.booleans(), count=st.integers(0, 9))
@settings(max_examples=30)
def test_packed_frames_come_back(seed: int, fd: bool, count: int) -> None:
    rng = np.random.default_rng(seed)
    width = 64 if fd else 8
    batch = CanBatch(
        rng.integers(0, 2**11, count),
        rng.random(count) < 0.5,
        np.full(count, fd),
        np.full(count, width),
        rng.integers(0, 256, (count, width)).astype(np.uint8),
    )
    back = unpack(pack(batch))
    assert back is not None
    for name in CanBatch.__slots__:
        np.testing.assert_array_equal(getattr(back, name), getattr(batch, name))
    assert unpack(pack(batch)[:-1]) is None or count == 0
