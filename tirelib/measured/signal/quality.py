"""Faults in a window of samples: missing, spiked, or constant samples.

Nothing is repaired silently: at most two samples in a row are bridged by a straight line, and the
gage then carries a flag for the turn. Anything longer makes the gage invalid for the turn.
"""

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray, IntArray
from tirelib.core.flags import TurnFlag

LONGEST_BRIDGE = 2
"""Samples in a row that a straight line may replace."""
SPIKE_SHARE = 0.05
"""A sample is a spike when it departs from its neighbours' median by this share of the swing,
and by `SPIKE_BEND` besides."""
SPIKE_BEND = 350.0
"""Share of the swing for each squared radian of wheel angle between samples, [rad^-2]: a peak of
the strain itself departs by up to 305 of it. ``python build/spike_bend.py`` has the source."""
DEAD_SHARE = 0.25
"""A gage shows no contact when its flanks have less than this share of the median gage's steepness.
The belt bulges over a shoulder that is lifted off the road, so a strain that only swings is no
contact. ``python build/cosim/lifted_shoulder.py`` has half and double."""
FLAT_ANGLE = 0.04
"""A gage is saturated when it stands still at its extreme over this wheel angle, [rad], and over
`FLAT_SAMPLES`, and then leaves it abruptly (`CORNER_ANGLE`)."""
FLAT_SAMPLES = 6
"""Least number of samples over which a saturated gage stands still."""
CORNER_ANGLE = 0.02
"""Wheel angle after the flat part, [rad], within which a saturated gage has left it."""
CORNER_SHARE = 0.02
"""Share of the swing by which it has left it. A rounded peak of a quantised signal may stand still,
too, but leaves slowly."""
UNUSABLE = TurnFlag.GAP | TurnFlag.SATURATED | TurnFlag.DEAD_GAGE
"""Flags with which a gage is not used in a turn."""


def inspect(window: FloatArray, step: float) -> tuple[FloatArray, IntArray]:
    """Look for faults in the samples of one turn's window.

    Parameters
    ----------
    window : array, shape (n_gages, n), [-]
        Raw strain; missing samples are NaN.
    step : float, [rad]
        Wheel angle per sample.

    Returns
    -------
    mended : array, shape (n_gages, n)
        With short gaps and spikes bridged (and flagged), and zeros where nothing can be said.
    flags : array of int, shape (n_gages,)
        `TurnFlag` bits of each gage.
    """
    flags = np.zeros(window.shape[0], dtype=np.int64)
    missing = ~np.isfinite(window)
    suspect = missing.any(axis=1)
    if suspect.any():
        flags[suspect] |= int(TurnFlag.BRIDGED)
        too_long = _longest_run(missing) > LONGEST_BRIDGE
        flags[too_long] = int(TurnFlag.GAP)
    known = np.where(missing, np.nan, window) if suspect.any() else window
    with np.errstate(invalid="ignore"):
        low = np.fmin.reduce(known, axis=1)
        high = np.fmax.reduce(known, axis=1)
    swing = np.nan_to_num(high - low)
    needed = max(FLAT_SAMPLES, int(FLAT_ANGLE / step))
    for extreme in (high, low):
        same = known == extreme[:, None]
        if not (same.sum(axis=1) >= needed).any():
            continue
        length = _longest_run(same)
        for row in np.flatnonzero((length >= needed) & (swing > 0.0)):
            if _has_corner(known[row], extreme[row], CORNER_SHARE * swing[row], step):
                flags[row] |= int(TurnFlag.SATURATED)
    spiked = _spikes(known, max(SPIKE_SHARE, SPIKE_BEND * step**2) * swing)
    if spiked.any():
        rows = spiked.any(axis=1)
        flags[rows] |= int(TurnFlag.SPIKE | TurnFlag.BRIDGED)
        missing = missing | spiked
        flags[_longest_run(missing) > LONGEST_BRIDGE] |= int(TurnFlag.GAP)
    if missing.any():
        window = _bridge(window, missing)
    return window, flags


def without_contact(rate: FloatArray) -> BoolArray:
    """Tell which gages show no contact while most do, shape (n_gages,).

    Parameters
    ----------
    rate : array, shape (n_gages, n), [1/rad]
        Smoothed strain rate over a contact.
    """
    steep = np.ptp(rate, axis=1)
    return np.asarray(steep < DEAD_SHARE * np.median(steep), dtype=np.bool_)


def _has_corner(samples: FloatArray, extreme: float, jump: float, step: float) -> bool:
    """Tell whether the samples leave their extreme by more than `jump` within a corner's angle."""
    flat = np.flatnonzero(samples == extreme)
    reach = max(1, round(CORNER_ANGLE / step))
    ends = np.clip((flat[0] - reach, flat[-1] + reach), 0, samples.size - 1)
    return bool((np.abs(samples[ends] - extreme) > jump).any())


def _spikes(known: FloatArray, least: FloatArray) -> BoolArray:
    """Mark samples further than `least`, shape (n_gages,), from the median of four neighbours."""
    apart = np.zeros(known.shape, dtype=np.bool_)
    bend = np.abs(known[:, 2:] - 2.0 * known[:, 1:-1] + known[:, :-2])
    limit = least[:, None]
    if known.shape[1] < 5 or not (bend > limit).any():
        return apart
    around = np.stack((known[:, :-4], known[:, 1:-3], known[:, 3:-1], known[:, 4:]))
    apart[:, 2:-2] = np.abs(known[:, 2:-2] - np.median(around, axis=0)) > limit
    return apart & (limit > 0.0)


def _longest_run(mask: BoolArray) -> IntArray:
    """Return the length of the longest run of True in each row."""
    if not mask.any():
        return np.zeros(mask.shape[0], dtype=np.int64)
    count = np.cumsum(mask, axis=1)
    reset = np.maximum.accumulate(np.where(mask, 0, count), axis=1)
    return np.asarray((count - reset).max(axis=1), dtype=np.int64)


def _bridge(window: FloatArray, missing: BoolArray) -> FloatArray:
    """Replace missing samples by straight lines; rows without any sample become zero."""
    mended = window.copy()
    index = np.arange(window.shape[1])
    for row in np.flatnonzero(missing.any(axis=1)):
        good = ~missing[row]
        mended[row] = np.interp(index, index[good], window[row, good]) if good.any() else 0.0
    return mended
