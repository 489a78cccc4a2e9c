"""Cut a stream of strain into turns, each ending with its contact.

For the contact k, with the middles of the centre gage's pulses m at k-1 and k:

- wheel angle over time from the preceding turn, ``2 pi`` from m at k-1 to m at k, and from how the
  wheel's rate changes within it: `tirelib.measured.signal.angle`,
- offset of each gage: median over +-0.5 rad round the point half-way round from the contact,
- conditions: mean over the preceding turn of what was held; the camber, the turn rate and the speed
  are those of the contact,
- strain and rate over wheel angle: `tirelib.measured.signal.lowpass`, up to 20 degrees after the
  pulse.

`TurnCutter` takes samples in frames of any length; it is the readable reference. `cut_turns` cuts a
whole record, by the compiled core where there is one; both agree to 1e-9, flags included.
"""

from collections import deque
from collections.abc import Sequence
from typing import Unpack

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray, IntArray
from tirelib.core.compiled import loaded_core, memory
from tirelib.core.errors import ParameterError, ShapeError
from tirelib.core.flags import TurnFlag
from tirelib.core.held import Held
from tirelib.measured.signal.angle import SOURCES, AngleLaw, Past, angle_law
from tirelib.measured.signal.compiled import Record, cut_by_core
from tirelib.measured.signal.contacts import NEAR_EDGE, Contact, ContactFinder
from tirelib.measured.signal.course import course
from tirelib.measured.signal.lowpass import LowPass, half_width, smooth_to_angle
from tirelib.measured.signal.offset import nothing_read, offset_at
from tirelib.measured.signal.quality import UNUSABLE, inspect, without_contact
from tirelib.measured.signal.samples import LastSamples
from tirelib.measured.signal.slip import NOTHING, Rolled, pull, unseen_by_load, unseen_by_traction
from tirelib.measured.signal.turn import PHI, Turn, Turns, stack_turns, unknown_turn

__all__ = ["PHI", "Turn", "TurnCutter", "Turns", "cut_turns", "stack_turns"]

AFTER = np.deg2rad(20.0)
"""Wheel angle after the end of the pulse up to which a turn is evaluated, [rad]."""
OFFSET_HALF_WIDTH = 0.5
"""Half-width of the sector opposite the contact from which the offset is taken, [rad]."""
LARGEST_PERIOD_RATIO = 2.0
DRIFT_SHARE = 0.05
MISSED_RATIO = 1.5
"""A turn with a gap that lasts this many times the one before has hidden a contact in it: two turns
last twice as long. ``python build/signal_constants.py`` has half and double."""
LARGEST_OMEGA_RATIO = 1.5
"""Measured turn rate over that which the contacts give, or the other way round, beyond which it is
a wrong unit or another wheel's: 30/pi for revolutions a minute, 2 pi for those a second. A sensor
that is held for 0.1 s differs by 1.1 where a wheel at 14 m/s brakes with 8 m/s^2."""
LARGEST_ANGLE_STD = 0.02
"""Relative uncertainty of the wheel angle's scale beyond which a turn is `accelerating`."""
USUAL_CHANGE = 1.0
"""Standard deviation of the change of a turn rate of which nothing is known, [turns/s^2]: that of a
car on tires of 2 m circumference with 2 m/s^2, so that 95 % lie within 3.9 m/s^2; a stop for which
roads are designed has 3.4 m/s^2 (AASHTO, *Green Book*, stopping sight distance). A first turn is
`accelerating` below 10 m/s; with half of it below 7, with double below 14 m/s."""
LONGEST_TURN = 3.0
"""A turn that lasts longer is standstill, [s]."""


class TurnCutter:
    """Cut frames of samples into turns, with bounded memory.

    Parameters
    ----------
    lateral : sequence of float, [m]
        Lateral gage positions (ISO), in the order of the samples' rows. The gage nearest to zero
        finds the contacts.
    rate : float, [Hz]
        Sample rate.
    low_pass : LowPass
    """

    def __init__(
        self, lateral: Sequence[float], rate: float, low_pass: LowPass | None = None
    ) -> None:
        if not rate > 0.0:
            raise ParameterError(f"sample rate = {rate} Hz; must be above 0")
        self.lateral = np.asarray(lateral, dtype=np.float64)
        self.rate = float(rate)
        self.low_pass = low_pass or LowPass()
        self._centre = int(np.argmin(np.abs(self.lateral)))
        self._gages = self.lateral.size
        longest = int(LONGEST_TURN * rate)
        self._finder = ContactFinder(longest)
        self._keep = 2 * longest
        self._samples = LastSamples(self._gages, self._centre, 2 * self._keep)
        self._waiting: deque[Contact] = deque()
        self._previous: Contact | None = None
        self._previous_period = np.nan
        self._offsets = nothing_read(self._gages)
        self._past: Past = ()
        self._rolled: Rolled = NOTHING  # in the contact before

    def push(
        self,
        strain: FloatArray,
        *,
        trigger: BoolArray | None = None,
        **held: Unpack[Held],
    ) -> list[Turn]:
        """Take a frame and return the turns that it completes.

        Parameters
        ----------
        strain : array, shape (n_gages, n), [-]
            Raw strain, oldest first; a lost sample is NaN, so that time goes on.
        trigger : array of bool, shape (n,)
            True at the sample at which the gages pass the top of the wheel; None if there is none.
        **held : array of shape (n,) or a number
            Conditions, see `Held`; those that are not given are unknown.
        """
        check_gages(strain, self._gages)
        turns: list[Turn] = []
        for start in range(0, strain.shape[1], self._keep):
            part = slice(start, min(start + self._keep, strain.shape[1]))
            self._samples.take(strain, held, trigger, part, self._oldest())
            self._waiting.extend(self._finder.push(strain[self._centre, part]))
            while self._waiting:
                turn = self._next_turn()
                if turn is None:
                    break
                turns.append(turn)
        return turns

    def _oldest(self) -> int:
        """Return the number of the first sample that a turn still to come may need."""
        first = self._finder.oldest
        if self._waiting and self._previous is not None:
            first = min(first, int(self._previous.middle) - 1)
        first -= NEAR_EDGE  # they tell whether the contact is damaged
        return max(self._samples.base, min(first, self._samples.end))

    def needed(self) -> FloatArray:
        """Return the samples that turns to come may need, newest last, conditions below."""
        return self._samples.since(self._oldest())

    def refill(self, samples: FloatArray, end: int) -> None:
        """Restore the samples that `needed` returned when `end` samples had come."""
        self._samples.refill(samples, end)

    @property
    def taken(self) -> int:
        """Number of samples that have come."""
        return self._samples.end

    def _next_turn(self) -> Turn | None:
        """Work on the first waiting contact; None while its samples are not all there."""
        contact, before = self._waiting[0], self._previous
        if contact.fresh or before is None:
            self._waiting.popleft()
            self._previous = self._samples.inspected(contact)
            self._previous_period, self._past = np.nan, ()
            self._offsets = nothing_read(self._gages)
            self._rolled = NOTHING
            flags = TurnFlag.FIRST_TURN | (TurnFlag.SPIKE if contact.burst else TurnFlag(0))
            return unknown_turn(
                contact.middle / self.rate, contact.fall / self.rate, self._gages, flags
            )
        law, stop = self._needs(contact, before)
        if law is None or stop > self._samples.end:
            return None
        self._waiting.popleft()
        contact = self._samples.inspected(contact)
        self._previous = contact
        turn = self._full_turn(contact, before, law, stop)
        self._previous_period = contact.middle - before.middle
        if not turn.flags & TurnFlag.FIRST_TURN:
            self._past = law.past
        return turn

    @property
    def lacking(self) -> int | None:
        """Number of samples that the waiting contact still needs; None if none waits."""
        if not self._waiting or self._previous is None:
            return None
        stop = self._needs(self._waiting[0], self._previous)[1]
        return stop - self._samples.end

    def _needs(self, contact: Contact, before: Contact) -> tuple[AngleLaw | None, int]:
        """Return the law of a turn's wheel angle, and the sample after the last one that it needs.

        The law waits for the samples that a wheel of steady rate would need; what it then says may
        need more of them.
        """
        turn = contact.middle - before.middle
        steady = angle_law(contact.middle, turn, 0.0, {}, ())
        stop = self._stop(contact, steady)
        if stop > self._samples.end:
            return None, stop
        first = int(np.ceil(before.middle))
        courses = {
            name: course(self._samples.held(name, first, stop), first - contact.middle, turn)
            for name in SOURCES
        }
        law = angle_law(
            contact.middle,
            turn,
            stop - contact.middle,
            courses,
            self._past,
            unknown=0.5 * USUAL_CHANGE * (turn / self.rate) ** 2,
        )
        return law, max(stop, self._stop(contact, law))

    def _sigma(self, law: AngleLaw) -> float | None:
        """Return the filter's width, [rad]; None where it does not suit the turn."""
        turn_rate = law.step * self.rate / (2.0 * np.pi)
        suits = self.low_pass.suits(turn_rate, self.rate)
        return self.low_pass.sigma(turn_rate) if suits else None

    def _stop(self, contact: Contact, law: AngleLaw) -> int:
        """Return the number of the sample after the last one that a turn needs."""
        sigma = self._sigma(law) or LowPass().sigma(1.0)
        seen = PHI[_pulse(contact, law) + AFTER >= PHI]
        end = float(seen[-1] if seen.size else PHI[0])
        return int(law.sample(end + half_width(sigma)) + 2.0) + 1

    def _full_turn(self, contact: Contact, before: Contact, law: AngleLaw, stop: int) -> Turn:
        period = contact.middle - before.middle
        sigma = self._sigma(law)
        flags = TurnFlag(0)
        ratio = period / self._previous_period
        if not np.isnan(ratio) and not 1 / LARGEST_PERIOD_RATIO <= ratio <= LARGEST_PERIOD_RATIO:
            flags |= TurnFlag.PERIOD_JUMP
        if law.std > LARGEST_ANGLE_STD:
            flags |= TurnFlag.ACCELERATING
        if sigma is None:
            flags |= TurnFlag.CUT_OFF
        missed = ratio > MISSED_RATIO and self._samples.gap_between(before, contact)
        if contact.damaged or before.damaged or missed:
            flags |= TurnFlag.FIRST_TURN | TurnFlag.GAP  # its period is unknown
        if contact.burst or (before.burst and before.damaged):
            flags |= TurnFlag.SPIKE
        pulse = _pulse(contact, law)
        if np.isnan(pulse):
            flags |= TurnFlag.ACCELERATING  # so much that its angle is unknown
        strain, rate, gage_flags = self._window(law, sigma, pulse, stop)
        sector = (law.sample(-np.pi + side * OFFSET_HALF_WIDTH) for side in (-1.0, 1.0))
        opposite, gap = self._samples.mean_strain(*sector, robust=True)
        offset, offset_std, moved, self._offsets = offset_at(self._offsets, opposite, law)
        mean, gap_in_turn = self._samples.mean_strain(before.middle, contact.middle)
        gage_flags[gap | gap_in_turn] |= int(TurnFlag.GAP)
        unusable = (gage_flags & int(UNUSABLE)) != 0
        strain -= offset[:, None]
        mean = np.where(unusable, np.nan, mean - offset)
        strain[unusable], rate[unusable] = np.nan, np.nan
        swing = np.fmax.reduce(strain, axis=1, initial=0.0)
        swing -= np.fmin.reduce(strain, axis=1, initial=0.0)
        gage_flags[~unusable & (np.abs(moved) > DRIFT_SHARE * swing)] |= int(TurnFlag.DRIFT)
        known = self._samples.conditions(before.middle, contact.middle)
        speed = known["speed"]
        turned = np.abs(known["omega"]) * period / (2.0 * np.pi * self.rate)
        if not flags & TurnFlag.FIRST_TURN and (
            turned > LARGEST_OMEGA_RATIO
            or turned < 1.0 / LARGEST_OMEGA_RATIO
            or known["omega"] * speed < 0.0
        ):
            flags |= TurnFlag.OMEGA_MISMATCH
        camber, friction = (
            self._samples.in_contact(name, contact) for name in ("camber", "friction")
        )
        if not np.isfinite(speed) or speed == 0.0:
            flags |= TurnFlag.NO_SPEED
            speed = np.nan  # a wheel that turns does not stand
        else:
            flags |= TurnFlag.REVERSED if speed < 0.0 else 0
            speed = law.speed if np.isfinite(law.speed) else speed
        slip_std = self._slip_std(
            law, pulse, _pulse(before, law), pull(strain[self._centre]), flags
        )
        axis_shift, once = self._trigger(before.middle, contact.middle, law)
        if not once:
            flags |= TurnFlag.TRIGGER_MISMATCH
        flags |= TurnFlag(int(np.bitwise_or.reduce(gage_flags)))
        if unusable[self._centre] or unusable.sum() > 1:
            flags |= TurnFlag.TOO_FEW_GAGES
        elif unusable.any():
            flags |= TurnFlag.REDUCED_GAGES
        return Turn(
            time=contact.middle / self.rate,
            ready=(stop - 1) / self.rate,
            period=period / self.rate,
            omega=law.step * self.rate,
            angle_std=law.std,
            slip_std=slip_std,
            pulse=pulse,
            axis_shift=axis_shift,
            speed=speed,
            pressure=known["pressure"],
            camber=camber,
            friction=friction,
            tread_depth=known["tread_depth"],
            tread_temperature=known["tread_temperature"],
            offset=offset,
            offset_std=offset_std,
            mean=mean,
            strain=strain,
            rate=rate,
            gage_flags=gage_flags,
            flags=int(flags),
        )

    def _slip_std(
        self, law: AngleLaw, here: float, before: float, pulled: float, flags: TurnFlag
    ) -> float:
        """Return the relative standard deviation of turn rate over speed in the contact."""
        rolled = (law.step / law.speed, pulled)
        unseen = np.hypot(
            unseen_by_load(here, before), unseen_by_traction(rolled, self._rolled, here)
        )
        if np.isfinite(rolled).all() and not flags & TurnFlag.FIRST_TURN:
            self._rolled = rolled
        return float(np.hypot(law.slip_std, law.late * unseen))

    def _window(
        self, law: AngleLaw, sigma: float | None, pulse: float, stop: int
    ) -> tuple[FloatArray, FloatArray, IntArray]:
        """Strain and rate over `PHI`, NaN beyond the end of the window, and the gages' flags."""
        strain = np.full((self._gages, PHI.size), np.nan)
        rate = np.full((self._gages, PHI.size), np.nan)
        if sigma is None or np.isnan(pulse):
            return strain, rate, np.zeros(self._gages, dtype=np.int64)
        seen = pulse + AFTER >= PHI
        first = max(int(law.sample(PHI[0] - half_width(sigma)) - 2.0), self._samples.base)
        mended, gage_flags = inspect(self._samples.strain(first, stop), law.step)
        angle = law.at(np.arange(first, stop))
        strain[:, seen], rate[:, seen] = smooth_to_angle(mended, angle, PHI[seen], sigma)
        gage_flags[without_contact(rate[:, seen])] |= int(TurnFlag.DEAD_GAGE)
        return strain, rate, gage_flags

    def _trigger(self, start: float, stop: float, law: AngleLaw) -> tuple[float, bool]:
        """Wheel angle of the contact's middle from the trigger, and whether it came just once."""
        tops = self._samples.triggers(start, stop)
        if tops is None:
            return np.nan, True
        if tops.size != 1:
            return np.nan, False
        return -np.pi - float(law.at(tops)[0]), True


def _pulse(contact: Contact, law: AngleLaw) -> float:
    """Return half the wheel angle from where the centre gage's pulse rises to where it falls.

    NaN where the law turns the wheel back between them, because it stopped or locked there.
    """
    rise, fall = law.at(np.array([contact.rise, contact.fall]))
    return 0.5 * float(fall - rise) if fall > rise else np.nan


def check_gages(strain: FloatArray, gages: int) -> None:
    """Refuse a frame of another number of gages.

    Raises
    ------
    ShapeError
        Which shape it has, and which is needed.
    """
    if strain.ndim != 2 or strain.shape[0] != gages:
        raise ShapeError(f"strain has shape {strain.shape}; ({gages}, n) is needed")


def cut_turns(
    strain: FloatArray,
    rate: float,
    lateral: Sequence[float],
    *,
    trigger: BoolArray | None = None,
    low_pass: LowPass | None = None,
    **held: Unpack[Held],
) -> Turns:
    """Cut a whole record into turns; parameters as in `TurnCutter` and its `push`.

    The compiled core cuts, where there is one for this machine (`tirelib.core.compiled`).

    Raises
    ------
    ShapeError
        If the strain is not of these gages, or a condition not of its samples.
    ParameterError
        If the rate is not above zero, or the filter would reach beyond the samples.
    """
    core, places = loaded_core(), np.asarray(lateral, dtype=np.float64)
    size = core.cutter_size(places.size, rate) if core else 0
    if core is None or not size:
        turns = TurnCutter(lateral, rate, low_pass).push(strain, trigger=trigger, **held)
        return stack_turns(turns, places, rate)
    check_gages(strain, places.size)
    room = memory(size)
    record = Record(core, room, strain, places, rate, low_pass or LowPass(), held, trigger)
    return cut_by_core(core, record, places, rate)
