"""The offset of each gage at the contact, from what is read opposite of it."""

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.measured.signal.angle import AngleLaw, minmod


def nothing_read(gages: int) -> FloatArray:
    """Return times and offsets of two turns, shape (2, 2, n_gages), none of them known."""
    return np.full((2, 2, gages), np.nan)


def offset_at(
    read: FloatArray, opposite: FloatArray, law: AngleLaw
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return the offset at the contact, its std, and how it moved since it was last read.

    What is read half a turn before the contact moves on until there: the hoop strain with the
    square of the turn rate, the gage's zero with its temperature. It is followed as the turn
    rate is, see `tirelib.measured.signal.angle`. Each gage is compared with the last turns in
    which its samples are not missing there.

    Parameters
    ----------
    read : array, shape (2, 2, n_gages)
        Times and offsets of the last two turns; what follows them is returned last.
    opposite : array, shape (n_gages,)
        What is read opposite of the contact, NaN where too much is missing.
    law : AngleLaw
    """
    time = np.where(np.isnan(opposite), np.nan, law.sample(-np.pi))
    (first, last), now = read, np.array([time, opposite])
    following = np.where(np.isnan(now), read, [last, now])
    moved, before = np.nan_to_num(opposite - last[1]), np.nan_to_num(last[1] - first[1])
    share = np.nan_to_num((law.middle - time) / (time - last[0]))
    followed = minmod(moved, before)
    left = np.where(np.isnan(opposite), np.nan, share * np.abs(moved - followed))
    return opposite + share * followed, left, moved, following
