"""How much strain each gage shows while the wheel stands: means and ranges of short blocks."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tirebench.errors import DeviceError
from tirebench.wire.timeline import Samples
from tirelib.core.arrays import FloatArray

EVERY = 0.25
"""Length of a block, [s]."""
SHORTEST_MEAN = 1.0
"""A mean is taken over at least so much, [s]."""
LARGEST_STANDING_RANGE = 100e-6
"""Within a block the strain of a standing wheel stays within this: noise of 14 microstrain (3.5
standard deviations either way in 2,500 samples); half of it refuses noise of 7, twice of it 28. A
turning tire shows thousands. `--still` sets another."""
LARGEST_STANDING_DRIFT = 0.2
"""The means of blocks stay within this part of it: a wheel that creeps drifts from one to the next.
"""


@dataclass(frozen=True, slots=True)
class Level:
    """Strain of a block; arrays of shape (n_gages,), NaN where a gage showed nothing.

    Attributes
    ----------
    wheel : int
    seconds : float, [s]
    mean, low, high : array
    missing : array
        Share of samples that are lost or saturated.
    """

    wheel: int
    seconds: float
    mean: FloatArray
    low: FloatArray
    high: FloatArray
    missing: FloatArray


class Levels:
    """Cuts the samples of a wheel into blocks."""

    def __init__(self, wheel: int) -> None:
        self._wheel = wheel
        self._waiting: list[FloatArray] = []
        self._count = 0

    def take(self, samples: Samples) -> list[Level]:
        """Take samples; return the block that they fill, if they do."""
        if samples.reset:
            self._waiting, self._count = [], 0
        self._waiting.append(samples.strain)
        self._count += len(samples.strain)
        if self._count * samples.period < EVERY:
            return []
        strain = np.concatenate(self._waiting)
        self._waiting, self._count = [], 0
        known = np.isfinite(strain)
        count = known.sum(axis=0)
        mean = np.where(known, strain, 0.0).sum(axis=0) / np.where(count, count, np.nan)
        low, high = (pick.reduce(strain.T.copy(), axis=1) for pick in (np.fmin, np.fmax))
        missing = 1.0 - count / len(strain)
        return [Level(self._wheel, len(strain) * samples.period, mean, low, high, missing)]


def standing_mean(levels: Sequence[Level], still: float = LARGEST_STANDING_RANGE) -> FloatArray:
    """Return the mean strain of each gage, shape (n_gages,); NaN where it showed nothing.

    Raises
    ------
    DeviceError
        If the wheel turned, a gage was saturated now and then, or there is too little.
    """
    seconds = sum(level.seconds for level in levels)
    if seconds < SHORTEST_MEAN:
        raise DeviceError(
            f"{seconds:.1f} s of samples; at least {SHORTEST_MEAN:.0f} s are needed; wait, then "
            "try again"
        )
    means = np.array([level.mean for level in levels])
    there = ~np.all([level.missing == 1.0 for level in levels], axis=0)
    missing = np.max([level.missing for level in levels], axis=0)
    spread = np.max([level.high - level.low for level in levels], axis=0)
    drift = np.ptp(means, axis=0)
    faults = []
    for gage in np.flatnonzero(there).tolist():
        if missing[gage] > 0.01:
            faults.append(
                f"gage {gage + 1}: {100.0 * missing[gage]:.0f} % of its samples are lost or "
                "saturated; all samples are needed; repair the line or the bridge"
            )
        elif spread[gage] > still or drift[gage] > LARGEST_STANDING_DRIFT * still:
            faults.append(
                f"gage {gage + 1}: its strain varies by {1e6 * spread[gage]:.0f} microstrain and "
                f"drifts by {1e6 * drift[gage]:.0f}; on a standing wheel it varies by up to "
                f"{1e6 * still:.0f} and drifts by up to "
                f"{1e6 * LARGEST_STANDING_DRIFT * still:.0f}; stop the wheel"
            )
    if not there.any():
        faults.append("no gage sends values; at least one is needed; check the link")
    if faults:
        raise DeviceError(faults)
    return np.asarray(means.mean(axis=0))
