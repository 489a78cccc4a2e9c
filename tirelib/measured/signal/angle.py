r"""Wheel angle over time within a turn, from the sources of the wheel's turn rate.

Between the middles of two contacts the wheel turns once, so the mean rate of the turn before a
contact is exact. How the rate runs within that turn, up to the contact and a little beyond, is

.. math:: \omega(t) = g\, s(t)\, \bigl(1 + r\,(t - t_0)\bigr),
          \qquad \int_{m_{k-1}}^{m_k} \omega\, dt = 2\pi

- s(t), the course of a **source**: the measured turn rate where there is one, else the travel
  speed, else one (`tirelib.measured.signal.course`).
- r, the **change from turn to turn** of what the source leaves: of q = mean rate / mean of s, which
  is the slip ratio's if the source is the speed, the rate's own without a source, and noise if the
  source is the turn rate. The smaller of the last two slopes of q over time is followed, and none
  where their signs differ: the limiter *minmod* (P. L. Roe, Annu. Rev. Fluid Mech. 18, 1986). So a
  lasting change is followed exactly; noise and a single jump are not. A rate falls for many turns
  while a vehicle brakes, but the slip ratio of a tire stays within some hundredths, so what changes
  it by a hundredth a turn soon ends or turns round: the doubt `ENDS`.

What the fit of the source leaves, and what the last slopes differ by, is the uncertainty.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from numpy.polynomial.polynomial import polyval

from tirelib.core.arrays import FloatArray
from tirelib.measured.signal.course import Course

SOURCES = ("omega", "speed")
"""Conditions whose course within a turn gives that of the turn rate, best first."""
REMEMBERED = 4
"""Turns whose q is kept: two slopes to be followed or not, and one before them."""
NEWTON = 8
"""Steps of Newton's method: with a rate that doubles within the turn six reach rounding."""
LARGEST_RATIO = 2.0
"""A rate beyond this ratio to the turn's mean, either way, is not followed: the wheel stops,
starts or locks, and polynomials say nothing of that."""

ENDS = float(np.sqrt(17.0 / 240.0))
"""Error of q at the contact over the slope that is followed, where the slope ended within the turn:
``d - 3/4 d^2`` with d the share of the turn that remained, root mean square over all d. Where the
slope turns round the error is twice as large, at most 2/3 of the slope: 2.5 of this.
``python build/ramp_error.py`` shows half and double."""

Past = tuple[tuple[float, ...], ...]
"""For each of the last turns: its middle in time [samples], and q for each source and without."""


@dataclass(frozen=True, slots=True)
class AngleLaw:
    """Wheel angle over sample numbers about one contact.

    Attributes
    ----------
    middle : float, [samples since the start]
        Where the angle is zero.
    turn : float, [samples]
        Length of the preceding turn.
    angle : tuple of float
        Coefficients of the angle [rad] by the powers of turns from the middle.
    step : float, [rad]
        Angle of a sample, at the middle.
    std : float, [1]
        Relative standard deviation of `step`, hence of angles about the contact.
    speed : float, [m/s]
        Travel speed at the contact, to which `step` is in the proportion of the slip ratio there.
    slip_std : float, [1]
        Relative standard deviation of ``step / speed``, without `late`.
    late : float, [1]
        Share of a change of slip within the turn that the law does not describe.
    past : Past
        What the law of the next turn needs.
    """

    middle: float
    turn: float
    angle: tuple[float, ...]
    step: float
    std: float
    speed: float
    slip_std: float
    late: float
    past: Past

    def at(self, sample: npt.NDArray[np.number]) -> FloatArray:
        """Return the wheel angle, [rad], at sample numbers."""
        return np.asarray(polyval((sample - self.middle) / self.turn, self.angle))

    def sample(self, phi: float) -> float:
        """Return the sample number, not necessarily whole, at a wheel angle [rad]."""
        x = phi / (2.0 * np.pi)
        for _ in range(NEWTON):
            angle = rate = 0.0
            for coefficient in reversed(self.angle):
                angle, rate = angle * x + coefficient, rate * x + angle
            x -= (angle - phi) / rate
        return self.middle + x * self.turn


def angle_law(
    middle: float,
    turn: float,
    ahead: float,
    courses: Mapping[str, Course | None],
    past: Past,
    *,
    unknown: float = 0.0,
) -> AngleLaw:
    """Return the law of one turn.

    Parameters
    ----------
    middle, turn : float, [samples]
        Middle of the contact; samples since the one before.
    ahead : float, [samples]
        How far beyond the middle the courses reach.
    courses : mapping of name to Course
        Courses of `SOURCES`, as far as they are known.
    past : Past
        From the law of the preceding turn; empty if there is none.
    unknown : float, [1]
        Relative standard deviation of the rate at the contact over the turn's mean where nothing
        gives it: no source, and no preceding turn.
    """
    known = [courses.get(name) for name in SOURCES]
    means = [np.nan if course is None else course.mean for course in known]
    now = (middle - 0.5 * turn, *(1.0 / (turn * mean) for mean in (*means, 1.0)))
    past = (*past, now)[-REMEMBERED:]
    shape, fit_std, row = np.ones(1), 0.0, len(SOURCES)
    for index, course in enumerate(known):
        if course is not None and course.known:
            shape, fit_std, row = course.shape, course.std, index
            break
    slip_slope, slip_slope_std = _followed(past, _SPEED, turn)
    slip_slope_std = float(np.hypot(slip_slope_std, ENDS * slip_slope))
    slope, slope_std = _followed(past, 1 + row, turn)
    if 1 + row == _SPEED:
        slope_std = slip_slope_std
    if len(past) == 1 and all(course is None for course in known):
        slope_std = unknown
    rate = np.convolve(shape, (1.0 + 0.5 * slope, slope))
    rate /= rate @ _means(rate.size)
    if not _steady_enough(rate, ahead / turn):
        rate, fit_std = np.ones(1), 1.0
    contact_rate = float(rate[0]) / turn
    slip, slip_std, late = _slip(known, slip_slope, slip_slope_std, slope_std)
    if not 1.0 / LARGEST_RATIO < slip < LARGEST_RATIO:
        slip, slip_std, fit_std = 1.0, 1.0, 1.0
    whole = 2.0 * np.pi * rate / np.arange(1, rate.size + 1)
    return AngleLaw(
        middle=middle,
        turn=turn,
        angle=(0.0, *whole.tolist()),
        step=2.0 * np.pi * contact_rate,
        std=float(np.hypot(fit_std, slope_std)),
        speed=contact_rate / (now[_SPEED] * slip),
        slip_std=slip_std,
        late=late,
        past=past,
    )


def _slip(
    known: Sequence[Course | None], slope: float, slope_std: float, rate_std: float
) -> tuple[float, float, float]:
    """Return q, the speed at the contact over the turn's mean, its uncertainty and its lag.

    From turn to turn it is known precisely, but late; where turn rate and speed both have a course,
    these show it at once, but with their noise. Their difference from the former is shrunk as their
    own coefficients are. Where the speed was hardly renewed, a turn rate that moves within the turn
    is slip as likely as not. What a measured turn rate and the contacts differ by from turn to turn
    (`rate_std` is half of it) is how far a change of traction moves the pulse's middle.
    """
    slip = 1.0 + 0.5 * slope
    turn_rate, speed = (_at_contact(course) for course in known)
    if turn_rate is None or known[1] is None:
        return slip, slope_std, 1.0
    at_once = speed is not None
    speed = speed or (1.0, 0.0)
    apart, variance = turn_rate[0] / speed[0] - slip, turn_rate[1] ** 2 + speed[1] ** 2
    share = 1.0 - variance / apart**2 if at_once and apart**2 > variance else 0.0
    left = np.hypot(slope_std, apart) * (1.0 - share)
    direct = share * np.hypot(np.sqrt(variance), 2.0 * rate_std)
    return slip + share * apart, float(np.hypot(left, direct)), 1.0 - share


def _at_contact(course: Course | None) -> tuple[float, float] | None:
    """Return a source at the contact over its mean of the turn, and its standard deviation."""
    if course is None or not course.known:
        return None
    return float(course.shape[0] / (course.shape @ _means(course.shape.size))), course.std


_SPEED = 1 + SOURCES.index("speed")


def _means(size: int) -> FloatArray:
    """Return the means of the powers over the turn, from -1 to 0."""
    k = np.arange(size)
    return np.asarray((-1.0) ** k / (k + 1.0))


def _steady_enough(rate: FloatArray, ahead: float) -> bool:
    """Tell whether a rate, over its mean, can be followed from one contact to beyond the next."""
    seen = polyval(np.linspace(-1.0, ahead, 33), rate)
    return bool(seen.min() > 1.0 / LARGEST_RATIO and seen.max() < LARGEST_RATIO)


def minmod(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the smaller of two numbers of one sign, and zero for others."""
    return np.where(a * b > 0.0, np.sign(a) * np.minimum(np.abs(a), np.abs(b)), 0.0)


def _followed(past: Past, column: int, turn: float) -> tuple[float, float]:
    """Return the slope of q that is followed, and the doubt of q at the contact.

    Both are relative to the last q; the slope is a turn's.
    """
    time = [row[0] for row in past]
    q = [row[column] for row in past]
    slopes = [
        (q[i] - q[i - 1]) / (time[i] - time[i - 1]) * turn / q[-1]
        for i in range(len(past) - 1, 0, -1)
    ]
    first, second, third = (*slopes, np.nan, np.nan, np.nan)[:3]
    slope = float(minmod(np.array(first), np.array(second)))
    apart = (first - slope, first - second, second - third)
    doubt = 0.5 * max((abs(x) for x in apart if x == x), default=0.0)
    return slope, doubt
