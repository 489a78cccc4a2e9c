"""The sample rate that was said, held against the device's clock."""

import numpy as np

from bench.errors import DeviceError
from bench.frames import IntArray

JUDGED = 64
"""Steps of the clock after which the rate is judged; a few lost frames do not sway a median."""
TOLERANCE = 0.005
"""A quartz is better by far; a wrong rate is worse by far."""


class RateCheck:
    """Refuse a sample rate that the device's clock contradicts.

    Parameters
    ----------
    wheel : int
    expected : float, [us]
        Time from one frame to the next.
    samples : int
        In a frame.
    """

    def __init__(self, wheel: int, expected: float, samples: int) -> None:
        self._wheel = wheel
        self._expected = expected
        self._samples = samples
        self._steps: list[int] = []
        self._last: int | None = None
        self._done = False

    def push(self, seq: IntArray, t_us: IntArray) -> None:
        """Take numbers and times of frames in order.

        Raises
        ------
        DeviceError
            If most frames come in another rhythm than was said.
        """
        if self._done or len(seq) < 2:
            return
        following = np.diff(seq) % 2**16 == 1
        self._steps += np.diff(t_us)[following].tolist()
        if len(self._steps) < JUDGED:
            return
        self._done = True
        step = float(np.mean(np.sort(self._steps)[len(self._steps) // 4 : -len(self._steps) // 4]))
        if abs(step - self._expected) > TOLERANCE * self._expected:
            rate = 1e6 * self._samples / step if step > 0.0 else 0.0
            said = 1e6 * self._samples / self._expected
            raise DeviceError(
                f"wheel {self._wheel}: its clock shows {rate:.0f} samples a second, {said:.0f} "
                f"were said; both must agree within {TOLERANCE:.1%}; say --rate {rate:.0f}"
            )
