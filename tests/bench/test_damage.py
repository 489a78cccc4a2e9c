"""Damage on a line: nothing wrong is accepted, little is lost, memory does not grow."""

import gc
import tracemalloc
from collections import Counter

import numpy as np

from bench.can_batch import same_kind
from bench.damage import KINDS, damaged, strike_serial
from bench.line_counts import LineCounts
from bench.protocols.slcan import SlcanDecoder, encode
from tests.bench.test_slcan import Keep


def test_twenty_thousand_frames_damaged_none_accepted_wrong() -> None:
    """At one damage in 25 frames; two in the same frame would cost one and flatter the figure."""
    outcome = strike_serial(800, seed=7)
    assert outcome.sent >= 20_000
    assert outcome.damaged == 800
    assert set(outcome.kinds) == set(KINDS)
    assert outcome.wrong == 0
    assert outcome.lost_per_damage <= 1.1
    assert outcome.counts.bad >= 0.8 * outcome.good_lost


def test_damage_does_damage() -> None:
    """Were the stream left as it is, the figures would mean nothing."""
    outcome = strike_serial(800, seed=8)
    assert outcome.lost_per_damage >= 0.8


def test_memory_stays_flat_under_damage() -> None:
    """A decoder that kept what it cannot use would grow with the line."""
    rng = np.random.default_rng(1)
    text = b"".join(encode(same_kind(0x120, rng.integers(0, 256, (200, 64), np.uint8), fd=True)))
    decoder = SlcanDecoder(Keep(), LineCounts())
    sizes = []
    tracemalloc.start()
    for _ in range(30):
        decoder.frames_of(damaged(text, 40, rng, Counter()))
        gc.collect()
        sizes.append(tracemalloc.get_traced_memory()[0])
    tracemalloc.stop()
    assert max(sizes[10:]) < max(sizes[5:10]) + 10_000


def test_an_slcan_line_loses_little_and_takes_no_cut_line_for_whole() -> None:
    """The text has no checksum: a digit that became another passes, a line of odd length never."""
    rng = np.random.default_rng(3)
    data = rng.integers(0, 256, (4000, 64), np.uint8)
    lines = encode(same_kind(0x120, data, fd=True))
    whole = {bytes(row) for row in data}
    decoder = SlcanDecoder(Keep(), LineCounts())
    decoder.frames_of(b"\r")
    arrived, lost, cut = 0, 0, 0
    for start in range(0, 4000, 200):
        text = bytearray(b"".join(lines[start : start + 200]))
        for _ in range(8):
            place = int(rng.integers(len(text) - 10))
            del text[place : place + int(rng.integers(1, 9))]
            cut += 1
        batch = decoder.frames_of(bytes(text))
        arrived += len(batch)
        assert all(bytes(row) in whole for row in batch.data)
    lost = 4000 - arrived
    assert 0.8 * cut <= lost <= 1.3 * cut
