"""The last seconds of a wheel's line: how much came of what was expected, what was lost.

A pause that the wheel itself declares, such as that between two runs of an emulator, is no loss:
nothing is expected in it.
"""

import time
from collections import deque
from typing import Any, NamedTuple

from tirebench.estimator.wheels import Wheel

WINDOW_SECONDS = 5.0
"""Length of the window of the recent counters, [s]."""
SHORTEST_WINDOW = 1.0
"""Shortest window for which values are given, [s]."""


class _Seen(NamedTuple):
    moment: float
    received: int
    lost: int
    saturated: int
    turns: int
    invalid: int
    low_battery: int
    paused: float


class Recent:
    """Counters of one wheel over the last seconds; looked at some times a second."""

    def __init__(self) -> None:
        self._seen: deque[_Seen] = deque()

    def look(
        self, wheel: Wheel, turns: int, invalid: int, now: float | None = None
    ) -> dict[str, Any]:
        """Return what came and was lost in the last seconds; null before the shortest window.

        Parameters
        ----------
        wheel : Wheel
        turns, invalid : int
            Number of turns and of invalid turns of the wheel so far.
        now : float, optional, [s]
            Monotonic.
        """
        counts = wheel.timeline.counts
        now = time.monotonic() if now is None else now
        seen = self._seen
        seen.append(
            _Seen(
                now,
                wheel.timeline.received,
                counts.lost_samples,
                sum(counts.saturated),
                turns,
                invalid,
                counts.low_battery,
                wheel.timeline.paused,
            )
        )
        while len(seen) > 2 and now - seen[1].moment >= WINDOW_SECONDS:
            seen.popleft()
        first, last = seen[0], seen[-1]
        elapsed, expected = last.moment - first.moment, wheel.timeline.rate
        came, lost, all_turns = (
            last.received - first.received,
            last.lost - first.lost,
            last.turns - first.turns,
        )
        known = elapsed >= SHORTEST_WINDOW
        sending = elapsed - (last.paused - first.paused)
        return {
            "rate_hz": came / elapsed if known else None,
            "rate_expected_hz": expected or None,
            "rate_percent": 100.0 * came / sending / expected
            if known and expected and sending > 0.0
            else None,
            "loss_percent": 100.0 * lost / (came + lost) if known and came + lost else None,
            "saturated_percent": 20.0 * (last.saturated - first.saturated) / came
            if known and came
            else None,
            "invalid_percent": 100.0 * (last.invalid - first.invalid) / all_turns
            if known and all_turns
            else None,
            "battery_is_low": last.low_battery > first.low_battery,
        }
