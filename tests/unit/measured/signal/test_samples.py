"""The last samples keep their numbers when old ones make room, and when they are taken over."""

import numpy as np

from tirelib.measured.signal.samples import LastSamples

STRAIN = np.arange(25.0)[None]


def filled(stop: int) -> LastSamples:
    """Return the last of the samples before `stop`; there is room for ten, and three are wanted."""
    kept = LastSamples(1, 0, 10)
    for first in range(0, stop, 5):
        kept.take(STRAIN, {}, None, slice(first, first + 5), oldest=first - 3)
    return kept


def test_old_samples_make_room_and_the_others_keep_their_numbers() -> None:
    kept = filled(15)
    assert (kept.base, kept.end) == (7, 15)  # all that nobody wants has gone at once
    np.testing.assert_array_equal(kept.strain(7, 15), STRAIN[:, 7:15])
    kept = filled(25)
    np.testing.assert_array_equal(kept.strain(kept.base, 25), STRAIN[:, kept.base : 25])


def test_samples_that_are_taken_over_keep_their_numbers() -> None:
    kept = filled(15)
    other = LastSamples(1, 0, 10)
    other.refill(kept.since(9), kept.end)
    assert (other.base, other.end) == (9, 15)
    for each in (kept, other):
        each.take(STRAIN, {}, None, slice(15, 17), oldest=12)
        np.testing.assert_array_equal(each.strain(12, 17), STRAIN[:, 12:17])
