"""Laws of SERIAL v1: what is sent arrives, what is damaged does not, whatever the reads are."""

import struct
import zlib

import numpy as np
import pytest
from cobs import cobs
from hypothesis import given
from hypothesis import strategies as st

from tests.synthetic import frames as cuts
from tirebench.protocols.decoder import SHORTEST_PERIOD, SerialDecoder
from tirebench.wire.frames import LONGEST_ON_WIRE, Frames, encode, strain_frames

FIELDS = ("wheel", "seq", "t_us", "period", "flags", "rssi", "temperature")


def some_frames(count: int, seed: int, samples: int = 16) -> Frames:
    rng = np.random.default_rng(seed)
    return Frames(
        wheel=rng.integers(0, 256, count),
        seq=rng.integers(0, 2**16, count),
        t_us=rng.integers(0, 2**32, count),
        period=rng.integers(SHORTEST_PERIOD, 2**16, count),
        flags=rng.integers(0, 256, count),
        rssi=rng.integers(-128, 128, count),
        temperature=rng.integers(-128, 128, count),
        counts=rng.integers(-(2**15), 2**15, (count, samples, 5)).astype(np.int16),
    )


def keys(batches: list[Frames]) -> list[tuple[object, ...]]:
    """Everything that a frame says, as something to compare."""
    return [
        (*(int(getattr(batch, name)[row]) for name in FIELDS), batch.counts[row].tobytes())
        for batch in batches
        for row in range(len(batch))
    ]


@given(count=st.integers(1, 12), samples=st.integers(1, 255), seed=st.integers(0, 10**6))
def test_frames_arrive_as_they_were_sent(count: int, samples: int, seed: int) -> None:
    sent = some_frames(count, seed, samples)
    decoder = SerialDecoder()
    assert keys(decoder.push(b"".join(encode(sent)))) == keys([sent])
    assert (decoder.counts.ok, decoder.counts.bad) == (count, 0)


def test_the_layout_is_the_published_one() -> None:
    sent = some_frames(1, 3)
    body = cobs.decode(encode(sent)[0][:-1])
    head = struct.pack(
        "<BBHIHBBbb",
        1,
        *(int(getattr(sent, n)[0]) for n in ("wheel", "seq", "t_us", "period")),
        16,
        *(int(getattr(sent, n)[0]) for n in ("flags", "rssi", "temperature")),
    )
    assert body[:14] == head
    assert body[14:-4] == struct.pack("<80h", *sent.counts.ravel().tolist())
    assert body[-4:] == struct.pack("<I", zlib.crc32(body[:-4]))
    assert len(encode(sent)[0]) == 180


@given(seed=st.integers(0, 10**6), longest=st.integers(1, 400), damage=st.integers(0, 10))
def test_frames_and_counts_do_not_depend_on_the_reads(seed: int, longest: int, damage: int) -> None:
    stream = damaged(b"".join(encode(some_frames(20, seed))), damage, seed)
    whole, parts = SerialDecoder(), SerialDecoder()
    together = keys(whole.push(stream))
    apart = [k for cut in cuts(len(stream), longest, seed) for k in keys(parts.push(stream[cut]))]
    assert apart == together
    assert parts.counts == whole.counts


def damaged(stream: bytes, faults: int, seed: int) -> bytes:
    """Flip, cut, insert or splice at `faults` places."""
    rng = np.random.default_rng(seed)
    data = bytearray(stream)
    for _ in range(faults):
        at = int(rng.integers(len(data)))
        match rng.integers(4):
            case 0:
                data[at] ^= 1 << int(rng.integers(8))
            case 1:
                del data[at : at + int(rng.integers(1, 9))]
            case 2:
                data[at:at] = rng.bytes(int(rng.integers(1, 40)))
            case _:
                other = int(rng.integers(len(data)))
                data[at : at + 20] = data[other : other + 20]
    return bytes(data)


@pytest.mark.parametrize("seed", range(5))
def test_damage_costs_little_and_nothing_wrong_is_accepted(seed: int) -> None:
    count, faults = 2000, 80
    sent = some_frames(count, seed)
    decoder = SerialDecoder()
    arrived = keys(decoder.push(damaged(b"".join(encode(sent)), faults, seed)))
    assert set(arrived) <= set(keys([sent]))
    lost = count - len(set(arrived))
    assert lost <= 1.5 * faults  # a fault on a delimiter costs two, and one in 180 bytes is one
    assert decoder.counts.bad >= 0.5 * lost


@given(st.binary(max_size=4000))
def test_noise_is_no_frame(noise: bytes) -> None:
    decoder = SerialDecoder()
    assert decoder.push(noise + b"\0") == []
    good = encode(some_frames(1, 1))[0]
    assert len(decoder.push(good)) == 1  # one delimiter is enough to go on


def test_a_line_without_delimiter_fills_no_memory() -> None:
    decoder = SerialDecoder()
    decoder.push(b"\0")
    for _ in range(100):
        decoder.push(b"\xff" * 10_000)
    assert len(decoder._tail) <= LONGEST_ON_WIRE
    decoder.push(b"\0")
    assert decoder.counts.framing == 1


def test_joining_in_the_middle_of_a_frame_is_no_damage() -> None:
    wire = encode(some_frames(3, 7))
    decoder = SerialDecoder()
    assert len(keys(decoder.push(wire[0][50:] + wire[1] + wire[2]))) == 2
    assert decoder.counts.bad == 0


@pytest.mark.parametrize(
    ("body", "counter"),
    [
        (b"\x01" * 10, "framing"),  # too short
        (b"\x02" + b"\1" * 177, "unknown"),  # another type
        (b"\x01" + b"\1" * 177, "framing"),  # says n = 1
        (b"\x01" + b"\1" * 9 + b"\0" + b"\1" * 3, "framing"),  # no sample at all
    ],
)
def test_a_good_crc_is_not_enough(body: bytes, counter: str) -> None:
    body = body[:-4] + zlib.crc32(body[:-4]).to_bytes(4, "little") if len(body) > 50 else body
    if len(body) == 14:
        body += zlib.crc32(body).to_bytes(4, "little")
    decoder = SerialDecoder()
    assert decoder.push(b"\0" + cobs.encode(body) + b"\0") == []
    assert getattr(decoder.counts, counter) == 1


def test_a_record_becomes_full_frames_with_device_time() -> None:
    frames = strain_frames(np.zeros((64, 5), np.int16), period=1000, seq=65534, t_us=2**32 - 1600)
    assert frames.seq.tolist() == [65534, 65535, 0, 1]
    assert frames.t_us.tolist() == [2**32 - 1600, 0, 1600, 3200]


@pytest.mark.parametrize("period", [0, 1, SHORTEST_PERIOD - 1])
def test_a_period_that_cannot_be_true_is_damage(period: int) -> None:
    """Such a frame may have a right checksum all the same; it must not end a session."""
    good = strain_frames(np.zeros((16, 5), np.int16), period=1000)
    bad = strain_frames(np.zeros((16, 5), np.int16), period=period)
    decoder = SerialDecoder()
    batches = decoder.push(b"".join(encode(good) + encode(bad) + encode(good)))
    assert sum(len(batch) for batch in batches) == 2
    assert decoder.counts.framing == 1


def test_what_follows_an_interruption_in_the_middle_of_a_frame_is_no_damage() -> None:
    wire = encode(some_frames(6, 1))
    decoder = SerialDecoder()
    whole = decoder.push(b"".join(wire[:2]) + wire[2][:40])
    decoder.interrupt()
    whole += decoder.push(wire[3][60:] + b"".join(wire[4:]))  # it comes back within another frame
    assert sum(map(len, whole)) == 4
    assert (decoder.counts.ok, decoder.counts.bad) == (4, 0)
