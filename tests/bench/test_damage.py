"""Damage on a line: nothing wrong is accepted, little is lost, memory does not grow."""

import gc
import tracemalloc
from collections import Counter

import numpy as np
import pytest

from build.bench_damage import (
    BUS_KINDS,
    CHANGED,
    KINDS,
    damaged,
    strike_bus,
    strike_map,
    strike_serial,
    strike_slcan,
)
from tests.bench.test_slcan import Keep
from tirebench.protocols.layouts import RAW12C, RAW16
from tirebench.protocols.slcan import SlcanDecoder, encode
from tirebench.wire.can_batch import same_kind
from tirebench.wire.line_counts import LineCounts


def test_twenty_thousand_frames_damaged_none_accepted_wrong() -> None:
    """At one damage in 25 frames; two in the same frame would cost one and flatter the figure."""
    outcome = strike_serial(800, seed=7)
    assert outcome.sent >= 20_000
    assert outcome.damaged == 800
    assert set(outcome.kinds) == set(KINDS)
    assert outcome.wrong == 0
    assert outcome.lost_per_damage <= 1.1
    assert outcome.counts.bad >= 0.8 * outcome.good_lost


def test_a_line_that_a_map_describes_takes_nothing_wrong() -> None:
    outcome = strike_map(800, seed=7)
    assert set(outcome.kinds) == set(KINDS)
    assert outcome.wrong == 0
    assert 0.8 <= outcome.lost_per_damage <= 1.1


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
    gc.collect()
    gc.freeze()  # what other tests left behind is not looked through each time
    tracemalloc.start()
    for _ in range(30):
        decoder.frames_of(damaged(text, 40, rng, Counter()))
        gc.collect()
        sizes.append(tracemalloc.get_traced_memory()[0])
    tracemalloc.stop()
    gc.unfreeze()
    assert max(sizes[10:]) < max(sizes[5:10]) + 10_000


@pytest.mark.parametrize(("kind", "most"), [(RAW16, 1.1), (RAW12C, 1.5)])
def test_an_slcan_line_takes_nothing_shorter_or_longer_for_whole(kind: str, most: float) -> None:
    outcome = strike_slcan(400, 3, kind, ("cut", "insertion"))
    assert set(outcome.kinds) == {"cut", "insertion"}
    assert outcome.wrong == 0
    assert 0.8 <= outcome.lost_per_damage <= most  # two in one frame cost one
    assert outcome.counts.framing >= 0.5 * outcome.good_lost


def test_what_a_text_without_checksum_cannot_see_is_counted_as_wrong() -> None:
    """Else the zero of the others would only say that nobody looked."""
    outcome = strike_slcan(400, 4, RAW16, CHANGED)
    assert 0.2 * outcome.damaged < outcome.wrong < 0.6 * outcome.damaged
    assert outcome.lost_per_damage <= 1.1


def test_a_bus_takes_no_foreign_frame_and_none_of_another_length() -> None:
    outcome = strike_bus(800, seed=5)
    assert set(outcome.kinds) == set(BUS_KINDS)
    assert outcome.wrong == 0
    # what comes twice is not lost
    assert outcome.good_lost == outcome.damaged - outcome.kinds["doubled"]
    strangers = outcome.kinds["foreign"] + outcome.kinds["other length"]
    assert outcome.counts.unknown == strangers
