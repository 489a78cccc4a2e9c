"""slcan text: every line is judged alone, whatever the bytes, the reads and the damage."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.synthetic import frames as cuts
from tirebench.protocols.slcan import LONGEST_LINE, SlcanDecoder, encode
from tirebench.wire.can_batch import CanBatch, joined, same_kind
from tirebench.wire.frames import Frames
from tirebench.wire.line_counts import LineCounts


class Keep:
    """Frames are not looked into."""

    def push(self, batch: CanBatch, arrival: int) -> list[Frames]:
        return []

    def interrupt(self) -> None:
        pass


def decoder() -> SlcanDecoder:
    return SlcanDecoder(Keep(), LineCounts())


def some_frames(count: int, seed: int) -> CanBatch:
    """Classic and FD frames, of all lengths, mixed."""
    rng = np.random.default_rng(seed)
    parts = []
    for _ in range(count):
        fd = bool(rng.integers(2))
        size = int(rng.choice([*range(9), 12, 16, 20, 24, 32, 48, 64] if fd else range(9)))
        data = rng.integers(0, 256, (1, size)).astype(np.uint8)
        part = same_kind(int(rng.integers(2**11)), data, fd=fd)
        if rng.random() < 0.2:
            part = CanBatch(
                part.identifier + 2**20, ~part.extended, part.fd, part.length, part.data
            )
        parts.append(part)
    return joined(parts)


def keys(batch: CanBatch) -> list[tuple[object, ...]]:
    return [
        (
            int(batch.identifier[i]),
            bool(batch.extended[i]),
            bool(batch.fd[i]),
            batch.data[i, : batch.length[i]].tobytes(),
        )
        for i in range(len(batch))
    ]


@given(count=st.integers(1, 30), seed=st.integers(0, 10**6), longest=st.integers(1, 300))
def test_lines_come_back_in_order_whatever_the_reads(count: int, seed: int, longest: int) -> None:
    sent = some_frames(count, seed)
    text = b"".join(encode(sent))
    reader = decoder()
    seen = [k for cut in cuts(len(text), longest, seed) for k in keys(reader.frames_of(text[cut]))]
    assert seen == keys(sent)
    assert reader.counts.framing == 0


BAD = {
    "a bad digit": b"t1238001122G344556677\r",
    "a cut line": b"t12380011\r",
    "a byte of 0x80 and more": b"t123800112233\x80\xff556677\r",
    "an empty body": b"t\r",
    "too long a length code": b"t1239001122334455667788\r",
    "an identifier that cannot be": b"tFFF20011\r",
    "a letter that nobody knows": b"q1232001\r",
    "two lines run together": b"t1232AABBt1232AABB\r",
    "noise": bytes(range(14, 256)) + b"\r",
    "a line that does not end": b"t" * 500 + b"\r",
    "an odd digit": b"t12320011A\r",
}


@pytest.mark.parametrize("bad", list(BAD))
def test_bad_bytes_cost_their_line_and_no_other(bad: str) -> None:
    good = b"".join(encode(some_frames(3, 5)))
    reader = decoder()
    assert len(reader.frames_of(good + BAD[bad] + good)) == 6
    assert reader.counts.framing == 1


def test_replies_and_time_stamps_are_no_damage_and_full_buffers_are_counted() -> None:
    reader = decoder()
    text = b"\r\x07z\rV1013\rt1232AABB1F2C\rF09\rF00\rr1230\rt1232AABB\r"
    seen = keys(reader.frames_of(b"\r" + text))
    assert seen == [(0x123, False, False, b"\xaa\xbb")] * 2
    assert (reader.counts.framing, reader.counts.overruns) == (0, 1)


def test_joining_inside_a_line_is_no_damage() -> None:
    text = b"".join(encode(some_frames(3, 1)))
    reader = decoder()
    assert len(reader.frames_of(b"AB12\r" + text)) == 3
    assert reader.counts.framing == 0


def test_a_line_without_end_fills_no_memory() -> None:
    reader = decoder()
    for _ in range(100):
        reader.frames_of(b"t" * 10_000)
    assert len(reader._tail) <= LONGEST_LINE


@given(st.binary(max_size=3000))
def test_any_bytes_are_taken_and_the_next_line_is_read(noise: bytes) -> None:
    reader = decoder()
    reader.frames_of(noise + b"\r")
    assert len(reader.frames_of(b"t1232AABB\r")) == 1
