"""The sample rate that was said, held against the device's clock.

Serial frames say their sample period themselves, a CAN bus leaves it to an option or a map. Either
can be wrong, and every time and slip ratio with it, so the clock that the frames carry decides.
"""

from array import array

from tirebench.wire.frames import TICK, Frames

BASELINE = 32
"""Each frame's time is compared with that of the frame so many before it: a clock that tells whole
microseconds or milliseconds is not blamed for its rounding."""
JUDGED = 4 * BASELINE
"""Frames after which the rate is judged, again and again (0.2 s of SERIAL v1 at 10 kHz)."""
LONGEST_WAIT = 4 * JUDGED
"""Frames to wait for a wheel that restarts again and again before it can be checked; half of it
would report turns of a wheel whose first frames break off twice, double would keep twice as many in
memory."""
TOLERANCE = 0.005
"""What passes makes a slip ratio wrong by as much. A quartz is a hundred times better; half of it
would refuse a clock of whole milliseconds (`BASELINE` frames of 2.56 ms leave 0.3 %), double would
let an oscillator without quartz pass (1 to 2 %)."""
ROUNDING = 0.5
"""The period is said in whole ticks: half of one is no contradiction."""
PERIOD = "`period` in the transmitter's SERIAL v1 frames"


class RateCheck:
    """Find a sample rate that the clock of one wheel contradicts.

    Lost frames, or one jump of the clock, sway nothing: the middle third of the rates is judged,
    and one jump lies between a third of the pairs of frames. The check begins anew after a gap of
    more than `BASELINE` frames, because a transmitter may have paused in it: two such pauses would
    be a slower clock in two thirds of the pairs.

    Parameters
    ----------
    said_by : str
        Where the rate is said, for the message.

    Attributes
    ----------
    contradiction : str
        What the clock shows and what to correct; empty while both agree. It stays.
    judged : bool
        Whether what came since the last restart was judged, or was waited for in vain.
    """

    def __init__(self, said_by: str = PERIOD) -> None:
        self.contradiction = ""
        self._said_by = said_by
        self._unjudged = 0  # frames since the last judgement
        self.restart()

    def restart(self) -> None:
        """Forget what came: the clock or the period is another from here on."""
        self.judged = False
        self._collect()

    def _collect(self) -> None:
        """Collect frames for the next judgement."""
        self._seq = self._samples = -1
        self._places, self._times = array("q"), array("q")

    def push(self, wheel: int, frames: Frames) -> None:
        """Take frames of one wheel and one period, in order."""
        if self.contradiction:
            return
        for seq, t_us in zip(frames.seq.tolist(), frames.t_us.tolist(), strict=True):
            place = time = 0
            steps = (seq - self._seq) % 2**16
            if self._places and steps > BASELINE:
                self._collect()
            if self._places:
                place = self._places[-1] + steps * self._samples
                elapsed = t_us - self._times[-1]
                time = self._times[-1] + (elapsed + 2**31) % 2**32 - 2**31
            else:
                time = t_us
            self._seq, self._samples = seq, frames.samples
            self._places.append(place)
            self._times.append(time)
            if len(self._places) == JUDGED:
                self._judge(wheel, int(frames.period[0]))
                self.judged, self._unjudged = True, 0
                self._collect()
            elif not self.judged:
                self._unjudged += 1
                self.judged = self._unjudged >= LONGEST_WAIT

    def _judge(self, wheel: int, period: int) -> None:
        places, times = self._places, self._times
        shown = sorted(
            (times[i] - times[i - BASELINE]) / (places[i] - places[i - BASELINE])
            for i in range(BASELINE, JUDGED)
        )
        middle = shown[len(shown) // 3 : -len(shown) // 3]
        step, expected = sum(middle) / len(middle), 1e6 * period * TICK
        if abs(step - expected) <= max(TOLERANCE * expected, 1e6 * ROUNDING * TICK):
            return
        rate = 1e6 / step if step > 0.0 else 0.0
        self.contradiction = (
            f"wheel {wheel}: its clock shows {rate:.0f} samples a second, but {1e6 / expected:.0f} "
            f"were configured; the two must agree within {TOLERANCE:.1%}; correct {self._said_by}"
        )
