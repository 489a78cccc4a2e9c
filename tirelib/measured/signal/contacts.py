"""Find the passages of a gage through the contact, sample by sample, in bounded memory.

The innerliner is stretched inside the contact (the belt is flattened) and compressed just outside
it, so a passage is a pulse of tension between two dips. A pulse begins when the strain rises above
a level and ends when it falls below a lower one. Both levels lie between the extremes of the
**preceding** turn, so a slow drift or a change of load moves them along. Before the first complete
turn the extremes since the start are used; a contact found that way is marked `fresh`.

The result depends on the samples alone, never on how they are cut into frames.
"""

from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import FloatArray

RISE = 0.7
"""Level of the pulse's edges, as a fraction from the lowest to the highest strain of a turn."""
FALL = 0.62
"""Level below which the pulse has ended (hysteresis against noise).

It must lie above the strain away from the contact, so the dips may be 1.6 times as deep as the
pulse is high: beyond what a tire shows, even at half its pressure and 1.5 times its load."""
JUMP = 2.5
"""A swing this many times the one that set the levels shows that they were set by no contact."""
SLEW = 32.0
"""Swings per radian of wheel angle: no edge of a contact is steeper. 2.5 times (`JUMP`) the
steepest of 537 turns measured on a tire in a laboratory (8.3 to 12.8). What departs faster from the
last good sample is a burst of disturbance: its samples count as missing, and no level follows
them."""
LEAST_SLEW = 0.1
"""Share of the swing by which samples may differ however slowly the wheel turns."""
LONGEST_BURST = 0.02
"""Turns that a burst lasts at the longest, less than a contact; what lasts longer is believed."""
NEAR_EDGE = 3
"""Samples before a pulse's edge that must be there, as the two next to it must, for the edge to
count."""
GAP_REACH = 0.1
"""Turns before a pulse and after the one before within which a gap may hide an extreme: the dips
lie within 0.6 rad of the pulse. The levels then stay as they were. With half and double the same
turns are valid and as exact (``python build/signal_constants.py``)."""
MOST_TURNS_WITHOUT_CONTACT = 2.5
"""Turns without a contact after which the search starts again.

It then waits as long again for the turns known last, and twice as long each further time, up to
`longest_turn`: what set the levels may be a burst, which no contact reaches."""
SHORTER = 0.5
"""A turn that takes at most this share of those known last is not believed for as long as the
search waits: what lies between two contacts may be a burst."""
MOST_PULSES_WITHOUT_CONTACT = 250.0
"""The same in widths of the pulse, while no turn is known: a pulse takes 1 % of a turn at least, so
that this is what such a pulse would wait. It ends the wait for a second burst like the first."""


@dataclass(frozen=True, slots=True)
class Contact:
    """One passage of the gage through the contact.

    Attributes
    ----------
    rise, fall : float, [samples since the start]
        Where the strain crosses the level, interpolated.
    fresh : bool
        No valid turn precedes it.
    damaged : bool
        Samples are missing where it begins or ends, so its middle is not to be trusted.
    burst : bool
        Samples were left out since the contact before: they departed faster than a tire's do.
    """

    rise: float
    fall: float
    fresh: bool
    damaged: bool = False
    burst: bool = False

    @property
    def middle(self) -> float:
        """Centre of the pulse, [samples since the start]: the reference of wheel angle zero."""
        return 0.5 * (self.rise + self.fall)


class ContactFinder:
    """Find contacts in the strain of one gage (the centre one).

    Parameters
    ----------
    longest_turn : int, [samples]
        A turn that lasts longer is taken as standstill; the search starts afresh.
    smallest_swing : float, [-]
        Strain swing below which nothing is called a contact, until a turn is known.

    Examples
    --------
    >>> phi = 2 * np.pi * np.arange(3500) / 1000.0
    >>> pulse = 8e-3 * np.exp(-((np.cos(phi / 2) / 0.1) ** 2))
    >>> [(round(c.middle), c.fresh) for c in ContactFinder(5000).push(pulse)]
    [(500, True), (1500, False), (2500, False)]
    """

    def __init__(self, longest_turn: int, *, smallest_swing: float = 5e-4) -> None:
        self._longest_turn = longest_turn
        self._smallest_swing = smallest_swing
        self._count = 0  # samples taken, after the median
        self._tail: FloatArray = np.empty(0)  # last two raw samples, for the median of three
        self._held = np.nan  # last finite sample
        self._missing = np.empty(
            0, dtype=np.int64
        )  # numbers of samples missing since the last rise
        self._bursts: tuple[int, int] | None = None  # first and last left out since the last rise
        self._apart = 0  # samples left out since the last good one
        self._patience = longest_turn
        self._turns, self._turns_at = 0, 0  # patience of the turns known last, and when they ended
        self._restart()

    def _restart(self) -> None:
        self._level: float | None = None  # None: start-up
        self._armed = True  # the strain has been below the lower level since the last pulse
        self._low_level = np.nan
        self._swing = np.nan
        self._lowest, self._highest = np.inf, -np.inf
        self._pulse: list[FloatArray] | None = None  # samples since the rise, one before included
        self._pulse_start = 0
        self._before = np.nan  # sample before the current one
        self._last_middle: float | None = None
        self._last_period: float | None = None
        self._since = self._count

    @property
    def oldest(self) -> int:
        """Number of the first sample that the next contact or its turn may begin with."""
        if self._last_middle is not None:
            return int(self._last_middle) - 1
        return self._pulse_start if self._pulse is not None else self._count - 1

    def push(self, samples: FloatArray) -> list[Contact]:
        """Take the next samples, shape (n,), and return the contacts that ended in them.

        A sample that is not finite counts as time passed; for the search alone the last finite one
        stands in its place.
        """
        x = self._without_gaps(np.asarray(samples, dtype=np.float64))
        x = self._median_of_three(x)
        found: list[Contact] = []
        if self._nothing_happens(x):
            return found
        start = 0
        while start < x.size:
            start = self._advance(x, start, found)
        return found

    def _nothing_happens(self, x: FloatArray) -> bool:
        """Pass over a frame in which neither a level is crossed nor patience ends.

        The same as `_advance`, for the many short frames of a stream.
        """
        n = x.size
        if self._level is None or n == 0 or self._room() <= n:
            return n == 0
        low, high = float(x.min()), float(x.max())
        falling = self._pulse is not None or not self._armed
        within = low >= self._low_level if falling else high <= self._level
        lowest, highest = min(self._lowest, low), max(self._highest, high)
        if not within or not highest - lowest <= JUMP * self._swing:
            return False
        if self._last_period is not None:
            change = float(np.abs(np.diff(x, prepend=self._before)).max())
            if self._apart or not change <= self._largest_change():
                return False
        self._lowest, self._highest = lowest, highest
        if self._pulse is not None:
            self._pulse.append(x)
        self._count += n
        self._before = float(x[-1])
        return True

    def _without_gaps(self, x: FloatArray) -> FloatArray:
        finite = np.isfinite(x)
        if not finite.all():
            missing = np.flatnonzero(~finite) + self._count + self._tail.size
            self._missing = np.concatenate((self._missing, missing))[-self._longest_turn :]
            last = np.maximum.accumulate(np.where(finite, np.arange(x.size), -1))
            x = np.where(last >= 0, x[last], self._held)
        if x.size:
            self._held = float(x[-1])
        return x

    def _median_of_three(self, x: FloatArray) -> FloatArray:
        """Median of each sample and its two neighbours; a lone spike is no contact."""
        x = np.concatenate((self._tail, x))
        self._tail = x[-2:]
        if x.size < 3:
            return np.empty(0)
        a, b, c = x[:-2], x[1:-1], x[2:]
        low, high = np.minimum(a, b), np.maximum(a, b)
        return np.maximum(low, np.minimum(high, c))

    def _advance(self, x: FloatArray, start: int, found: list[Contact]) -> int:
        """Go to the next event in ``x[start:]``; return the index from which to go on."""
        y = x[start:]
        if np.isnan(y[0]):  # nothing finite seen yet
            finite = np.flatnonzero(~np.isnan(y))
            skip = int(finite[0]) if finite.size else y.size
            self._count += skip
            self._since = self._count
            return start + skip
        y = self._until_jump(self._until_burst(y))
        if self._level is None:
            lows = np.minimum(np.minimum.accumulate(y), self._lowest)
            highs = np.maximum(np.maximum.accumulate(y), self._highest)
            swing = highs - lows
            known = swing > self._smallest_swing
            above = known & (y > lows + RISE * swing)
            below = ~known | (y < lows + FALL * swing)
        else:
            above, below = y > self._level, y < self._low_level
        arming = self._pulse is None and not self._armed
        event = below if self._pulse is not None or arming else above
        first = int(np.argmax(event)) if event.any() else -1
        taken = y if first < 0 else y[: first + 1]
        taken = taken[: self._room()]
        expired = taken.size < (y.size if first < 0 else first + 1) or self._room() <= taken.size
        self._lowest = min(self._lowest, float(taken.min()))
        self._highest = max(self._highest, float(taken.max()))
        if self._pulse is not None:
            self._pulse.append(taken)
        elif first >= 0 and not expired and arming:
            self._armed = True
        elif first >= 0 and not expired:
            before = float(taken[-2]) if taken.size > 1 else self._before
            self._pulse = [np.array([before, taken[-1]])]
            self._pulse_start = self._count + taken.size - 2
        ended = event is below and first >= 0 and not expired and not arming
        self._count += taken.size
        self._before = float(taken[-1])
        if expired:
            longer = max(2 * self._patience + 1, self._turns)
            self._patience = min(longer, self._longest_turn)
            self._restart()
        elif ended:
            self._finish(found)
        return start + taken.size

    def _largest_change(self) -> float:
        """Return how far a sample may be from the good one before it."""
        if self._last_period is None:
            return np.inf
        step = 2.0 * np.pi / self._last_period
        return self._swing * max(LEAST_SLEW, SLEW * step)

    def _until_burst(self, y: FloatArray) -> FloatArray:
        """Return the samples before a burst, or the good sample that stands for one within it."""
        if self._level is None or self._last_period is None:
            self._apart = 0
            return y
        wild = np.abs(np.diff(y, prepend=self._before)) > self._largest_change()
        for lost in self._missing[self._missing >= self._count] - self._count:
            wild[max(lost - 2, 0) : lost + 1] = False  # the median has a sample that is missing
        if wild[0] and self._apart < LONGEST_BURST * self._last_period:
            self._apart += 1
            number = self._count + 1  # the median of three lags by one sample
            self._bursts = (self._bursts[0] if self._bursts else number, number)
            return np.array([self._before])
        self._apart = 0
        wild[0] = False
        return y[: int(np.argmax(wild))] if wild.any() else y

    def _until_jump(self, y: FloatArray) -> FloatArray:
        """Return the samples before the swing outgrows the levels; go to start-up if it has."""
        if self._level is None:
            return y
        limit = JUMP * self._swing
        low, high = min(self._lowest, float(y.min())), max(self._highest, float(y.max()))
        if high - low <= limit:
            return y
        lows = np.minimum(np.minimum.accumulate(y), self._lowest)
        highs = np.maximum(np.maximum.accumulate(y), self._highest)
        first = int(np.argmax(highs - lows > limit))
        if first > 0:
            return y[:first]
        self._level, self._last_middle, self._last_period = None, None, None
        self._armed = True
        return y

    def _room(self) -> int:
        """Return the samples left until patience ends."""
        return max(1, self._since + self._patience - self._count)

    def _extreme_hidden(self) -> bool:
        """Tell whether samples are missing where the turn's extremes may have been."""
        missing = self._missing[self._missing < self._count]
        if self._bursts is not None:
            missing = np.append(missing, self._bursts)
        if self._last_period is None or missing.size == 0:
            return missing.size > 0
        reach = GAP_REACH * self._last_period
        near = (missing < self._since + reach) | (missing > self._pulse_start - reach)
        return bool(near.any())

    def _finish(self, found: list[Contact]) -> None:
        """Close the pulse, and set the levels of the next one."""
        pulse = np.concatenate(self._pulse or [])
        self._pulse = None
        swing = self._highest - self._lowest
        own_level = self._lowest + RISE * swing
        start_up = self._level is None
        fresh = start_up or self._last_middle is None
        level = own_level if self._level is None else self._level
        above = np.flatnonzero(pulse > level)
        i, j = (int(above[0]), int(above[-1])) if above.size else (0, 0)
        seen = self._pulse_start + i - self._since
        if i == 0 or j == pulse.size - 1 or (start_up and seen < j - i):
            if not start_up:
                self._restart()
            return  # too little has been seen of what lies before it
        if start_up or not self._extreme_hidden():
            self._level = own_level
            self._low_level = self._lowest + FALL * swing
            self._swing = swing
        self._armed = False  # the new levels may lie below the strain just reached
        self._lowest = self._highest = self._before
        rise = i - 1 + (level - pulse[i - 1]) / (pulse[i] - pulse[i - 1])
        fall = j + (pulse[j] - level) / (pulse[j] - pulse[j + 1])
        shift = self._pulse_start + 1  # the median of three lags by one sample
        bursts = self._bursts
        damaged = bursts is not None and bursts[1] >= int(rise + shift) - NEAR_EDGE
        contact = Contact(
            float(rise + shift), float(fall + shift), fresh, damaged, bursts is not None
        )
        self._missing = self._missing[self._missing > contact.rise]
        if bursts is not None:
            within = bursts[1] > contact.rise
            self._bursts = (max(bursts[0], int(contact.rise) + 1), bursts[1]) if within else None
        self._since = self._count
        if fresh or self._last_middle is None:
            self._last_period = None
            width = contact.fall - contact.rise  # after a jump, patience is what it was
            self._patience = int(min(self._patience, MOST_PULSES_WITHOUT_CONTACT * width))
        else:
            self._last_period = contact.middle - self._last_middle
            turns = MOST_TURNS_WITHOUT_CONTACT * self._last_period
            self._patience = int(min(self._longest_turn, turns))
            late = self._count - self._turns_at > self._turns
            if late or self._patience > SHORTER * self._turns:
                self._turns, self._turns_at = self._patience, self._count
        self._last_middle = contact.middle
        found.append(contact)
