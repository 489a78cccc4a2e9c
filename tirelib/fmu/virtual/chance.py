"""Random numbers by place, not by order: any sample can be asked for again, in any frame."""

from functools import lru_cache

import numpy as np
from scipy.special import ndtri

from tirelib.core.arrays import FloatArray

BLOCK = 256
"""Samples that are drawn at a time."""
_NOISE, _LOSS = 1, 2


@lru_cache(maxsize=16)
def _block(seed: int, number: int, gages: int) -> FloatArray:
    bits = np.random.Philox(key=seed, counter=[0, number, _NOISE, 0]).random_raw(BLOCK * gages)
    found: FloatArray = ndtri(_even(bits)).reshape(BLOCK, gages)
    found.flags.writeable = False
    return found


def _even(bits: np.ndarray) -> FloatArray:
    """Return numbers evenly spread over (0, 1) from 64 random bits each."""
    return np.asarray(((bits >> np.uint64(11)).astype(np.float64) + 0.5) * 2.0**-53)


def noise(seed: int, first: int, count: int, gages: int) -> FloatArray:
    """Return standard normal numbers of samples, shape (count, gages).

    Parameters
    ----------
    seed : int
    first, count : int
        The samples, counted since the start.
    gages : int

    Examples
    --------
    >>> bool(np.all(noise(7, 300, 2, 5) == noise(7, 250, 60, 5)[50:52]))
    True
    """
    number, start = divmod(first, BLOCK)
    if start + count <= BLOCK:
        return _block(seed, number, gages)[start : start + count]
    blocks = range(number, (first + count - 1) // BLOCK + 1)
    found = np.concatenate([_block(seed, number, gages) for number in blocks])
    return found[start : start + count]


def chance(seed: int, sample: int) -> float:
    """Return a number uniformly distributed over (0, 1) that decides whether this frame is lost."""
    bits = np.random.Philox(key=seed, counter=[0, sample, _LOSS, 0]).random_raw(1)
    return float(_even(bits)[0])
