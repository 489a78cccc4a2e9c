"""A wheel's clock against the host's: the lowest-latency arrival of each second, a line over 20.

Bytes come late by chance, never early, so that the earliest arrivals lie on the line between the
two clocks. What remains unknown is the constant smallest latency. Nothing here decides what is
estimated; it gives the error of the quartz, and the host time at which a sample was taken.
"""

from collections import deque

import numpy as np

WINDOW = 20
"""Seconds that the line spans."""
SECONDS_FOR_A_FIT = 3
"""Seconds that a line needs."""


class ClockFit:
    """Fit device time to host time as arrivals come.

    Examples
    --------
    A device that is 100 ppm fast:

    >>> fit = ClockFit()
    >>> for millisecond in range(10_000):
    ...     fit.push(round(1000 * millisecond * 1.0001), 1_000_000 * (millisecond + 1))
    >>> round(fit.drift_ppm, 1)
    100.0
    """

    def __init__(self) -> None:
        self._points: deque[tuple[float, float]] = deque(maxlen=WINDOW)
        self._second = -1
        self._best: tuple[float, float] | None = None
        self._line: tuple[float, float, float] | None = None  # middle, delay there, slope
        self._residual = float("nan")

    def push(self, device_us: int, arrival: int) -> None:
        """Take the device time of the newest sample [us] and its arrival [ns, monotonic]."""
        second = arrival // 1_000_000_000
        delay = 1e-3 * arrival - device_us
        if second > self._second:
            if self._best is not None:
                self._points.append(self._best)
                self._fit()
            self._second, self._best = second, None
        if self._best is None or delay < self._best[1]:
            self._best = (float(device_us), delay)

    def restart(self) -> None:
        """Forget: the device's clock has jumped."""
        self._points.clear()
        self._second = -1
        self._best, self._line, self._residual = None, None, float("nan")

    @property
    def drift_ppm(self) -> float:
        """How much the device's clock is fast; NaN until three seconds have passed."""
        return float("nan") if self._line is None else -1e6 * self._line[2]

    @property
    def residual(self) -> float:
        """Root mean square of the arrivals about the line, [s]; NaN without one."""
        return self._residual

    def host_time(self, device_us: float) -> float:
        """Return when a sample was taken at the host [s, monotonic], but for a constant."""
        if self._line is None:
            return float("nan")
        middle, delay, slope = self._line
        return 1e-6 * (device_us + delay + slope * (device_us - middle))

    def _fit(self) -> None:
        if len(self._points) < SECONDS_FOR_A_FIT:
            return
        time, delay = np.array(self._points).T
        middle = float(time.mean())
        centred = time - middle
        spread = float(centred @ centred)
        if spread <= 0.0:
            return
        slope = float(centred @ (delay - delay.mean())) / spread
        left = delay - delay.mean() - slope * centred
        self._line = (middle, float(delay.mean()), slope)
        self._residual = 1e-6 * float(np.sqrt(np.mean(left**2)))
