r"""Slip angle where the friction of the road is not known: what the pneumatic trail tells.

In the rear of the contact the tread slides, more of it the larger the slip angle and the lower the
friction. With the sliding share t, the lateral utilisation u = Fy / Fz, the friction mu and the
pneumatic trail q = -Mz / Fy,

.. math:: u = \mu\,[1 - (1 - t)^n], \qquad q = q_0 (1 - t)^m, \qquad
          \tan\alpha = \frac{n\,\mu\,t}{c}

with c the cornering stiffness over the load. A brush with a parabola of pressure has n = 3 and
nearly m = 2 (Pacejka, Tire and Vehicle Dynamics, 3.2); n and m, c and :math:`q_0` over the load are
fitted to the calibration's own cornering curve. Friction enters by similarity: u, mu and tan alpha
grow together, at the same t and q.

So u alone leaves the slip angle open: any friction above u will do. The trail closes it: it falls
with t whatever the friction. For given u, a friction and a slip angle that are evenly spread over
their ranges give t the density :math:`\propto [1 - (1 - t)^n]^{-2}`; beyond t = 1 the tread slides
as a whole, u is the friction and the slip angle any larger one. This density, times the
likelihood of the moment that was read from the strain, has the mean and the standard deviation
that are told. Where the moment says nothing, the angle stays that of the calibrated road, and how
far the mean lies from it is doubt. So it is under brake and drive, whose force turns the contact
too: the trail is that of a wheel that rolls freely.
"""

from dataclasses import dataclass, fields

import numpy as np

from tirelib.arrays import BoolArray, FloatArray
from tirelib.estimators.polynomial import Polynomial
from tirelib.estimators.unknowns import FRICTION

LOAD = 4000.0
"""Unit of the load in c and q0, [N]."""
MOMENT_DOUBT = 0.06
"""Standard deviation of the moment on roads that were not calibrated, over the largest Mz / Fz."""
CURVE_DOUBT = 0.3
"""Relative standard deviation of what another friction changes in the slip angle."""
LOAD_DOUBT, FORCE_DOUBT = 0.02, 0.25
"""Relative standard deviation of Fz and Fy per unit of sliding share that was not calibrated."""
BRUSH = (3.0, 2.0)
"""Sharpness and fading of a brush with a parabola of pressure."""
LEAST_SLOPE = 0.01
"""Floor of d alpha / d u of an earlier calibration, [rad]."""
ROUGHER = 1.15
"""The roughest road has this friction at least, over that of the calibration."""
NODES = 64
WHOLE = 6
"""Slip angles that stand for those beyond full sliding."""
FREE = 0.02
"""Slip ratio up to which a wheel counts as freely rolling: the curve is fitted to such runs."""
LEAST_UTILISATION = 1e-3
STEEPEST = 0.1
"""Least 1 - t at which the slope d alpha / d u is taken."""
_X, _W = np.polynomial.legendre.leggauss(NODES)


@dataclass(frozen=True, slots=True)
class Told:
    """What is known of n turns: signs are left out, all of shape (n,).

    Attributes
    ----------
    angle, std : [rad]
        Size of the slip angle and its standard deviation.
    change : [rad]
        What the angle has more than it would have at the calibrated friction.
    slope : [rad]
        d alpha / d u at that angle.
    sliding : [1]
        How far the sliding share may be from that at the calibrated friction.
    """

    angle: FloatArray
    std: FloatArray
    change: FloatArray
    slope: FloatArray
    sliding: FloatArray

    def where(self, rows: BoolArray, other: "Told") -> "Told":
        """Return this in the chosen rows, the other elsewhere."""
        return Told(*(
            np.where(rows, getattr(self, field.name), getattr(other, field.name))
            for field in fields(self)
        ))  # fmt: skip


@dataclass(frozen=True, slots=True)
class SlidingCurve:
    """The calibration's own cornering curve in the form above.

    Attributes
    ----------
    friction : float
        Of the road on which it was calibrated: given, or fitted where the data tell.
    sharpness, fading : float
        n and m.
    stiffness, trail : tuples of three and two floats
        Logarithms of c [1] and q0 [m] as polynomials of ln(load / 4 kN).
    camber : (float, float), [1/rad], [m/rad]
        Parts of u and of Mz / Fz that a camber adds.
    misfit : float, [m]
        Standard deviation of Mz / Fz about the curve.
    largest : float, [m]
        Largest Mz / Fz that was calibrated.
    """

    friction: float
    sharpness: float
    fading: float
    stiffness: tuple[float, ...]
    trail: tuple[float, ...]
    camber: tuple[float, float]
    misfit: float
    largest: float

    def cornering(self, load: FloatArray) -> FloatArray:
        """Return c, the cornering stiffness over the load."""
        return np.exp(np.polynomial.polynomial.polyval(np.log(load / LOAD), self.stiffness))

    def longest(self, load: FloatArray) -> FloatArray:
        """Return q0, the trail without sliding, [m]."""
        return np.exp(np.polynomial.polynomial.polyval(np.log(load / LOAD), self.trail))

    def share(self, used: FloatArray, friction: FloatArray | float) -> FloatArray:
        """Return t at a utilisation; 1 where the friction is used up."""
        rest = np.maximum(1.0 - used / friction, 0.0)
        return np.asarray(1.0 - rest ** (1.0 / self.sharpness), dtype=np.float64)

    def forward(
        self, angle: FloatArray, load: FloatArray, friction: FloatArray | float
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return u, Mz / Fz and t, sizes, at slip angles [rad]."""
        t = np.tan(np.abs(angle)) * self.cornering(load) / (self.sharpness * friction)
        t = np.minimum(t, 1.0)
        used = friction * (1.0 - (1.0 - t) ** self.sharpness)
        return used, used * self.longest(load) * (1.0 - t) ** self.fading, t

    def at(self, used: FloatArray, load: FloatArray, friction: FloatArray) -> Told:
        """Return what a utilisation tells on a road of known friction."""
        c = self.cornering(load)
        here, there = self.share(used, friction), self.share(used, self.friction)
        angle = np.arctan(self.sharpness * friction * here / c)
        usual = np.arctan(self.sharpness * self.friction * there / c)
        change = np.where(friction == self.friction, 0.0, angle - usual)
        std = np.where(used < friction, CURVE_DOUBT * np.abs(change), np.inf)
        return Told(angle, std, change, self._slope(here, c), np.abs(here - there))

    def told(
        self,
        used: FloatArray,
        moment: FloatArray,
        moment_std: FloatArray,
        load: FloatArray,
        widest: float,
    ) -> Told:
        """Return what utilisation and moment tell where the friction is not known.

        Parameters
        ----------
        used : array, shape (n,)
            Size of Fy / Fz.
        moment, moment_std : arrays, shape (n,), [m]
            Mz / Fz, positive where it aligns, and its standard deviation; infinite: not known.
        load : array, shape (n,), [N]
        widest : float, [rad]
            Largest slip angle that is looked for.
        """
        n = self.sharpness
        used = np.maximum(used, LEAST_UTILISATION)[:, None]
        c, longest = self.cornering(load)[:, None], self.longest(load)[:, None]
        slippery, rough = FRICTION[0], max(FRICTION[1], ROUGHER * self.friction)
        low, high = self.share(used, rough), self.share(used, slippery)
        t = low + 0.5 * (high - low) * (_X + 1.0)
        filled = np.maximum(1.0 - (1.0 - t) ** n, 1e-12)
        angle = np.arctan(n * used * t / (c * filled))
        weight = n * used / (c * filled**2) * 0.5 * (high - low) * _W * (angle <= widest)
        begin = np.arctan(n * used / c)
        room = np.maximum(widest - begin, 0.0)
        possible = (used >= slippery) & (used <= rough)
        beyond = begin + room * (np.arange(WHOLE) + 0.5) / WHOLE
        angle = np.concatenate((angle, beyond), axis=1)
        t = np.concatenate((t, np.ones_like(beyond)), axis=1)
        weight = np.concatenate(
            (weight, np.where(possible, room / WHOLE, 0.0) + 0.0 * beyond), axis=1
        )
        expected = used * longest * (1.0 - t) ** self.fading
        with np.errstate(invalid="ignore"):
            apart = (moment[:, None] - expected) / moment_std[:, None]
        surprise = 0.5 * np.where(np.isfinite(apart), apart, 0.0) ** 2
        likely = np.exp(surprise.min(axis=1, keepdims=True) - surprise)
        middle, variance = _moments(angle, weight * likely)
        usual_t = self.share(used, self.friction)
        usual = np.arctan(n * self.friction * usual_t / c)[:, 0]
        _, open_ = _moments(angle, weight)
        # where the moment tells nothing the angle stays that of the calibrated road
        with np.errstate(invalid="ignore", divide="ignore"):
            learnt = np.nan_to_num(np.clip(1.0 - variance / open_, 0.0, 1.0))
        change = learnt * (middle - usual)
        rest = middle - usual - change
        std = np.sqrt(variance + rest**2 + (CURVE_DOUBT * change) ** 2)
        at, scatter = _moments(t, weight * likely)
        sliding = np.sqrt(scatter + (at - usual_t[:, 0]) ** 2)
        # at a share that is known the angle grows with u in proportion
        slope = learnt * middle / used[:, 0] + (1.0 - learnt) * self._slope(at, c[:, 0])
        return Told(usual + change, std, change, slope, sliding)

    def _slope(self, t: FloatArray, c: FloatArray) -> FloatArray:
        rest = np.maximum(1.0 - t, STEEPEST)
        return np.asarray(rest ** (1.0 - self.sharpness) / c, dtype=np.float64)


def _moments(x: FloatArray, weight: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return mean and variance, shape (n,); NaN where nothing has a weight."""
    with np.errstate(invalid="ignore"):
        share = weight / weight.sum(axis=1, keepdims=True)
    mean = (share * x).sum(axis=1)
    return mean, (share * (x - mean[:, None]) ** 2).sum(axis=1)


def brush_through(model: Polynomial, utilisation: float, load: tuple[float, float]) -> SlidingCurve:
    """Return a brush through a calibrated slip angle, for calibrations that hold no curve.

    Parameters
    ----------
    model : Polynomial
        Slip angle over utilisation and load.
    utilisation : float
        Largest that was calibrated.
    load : (float, float), [N]
        Range that was calibrated.
    """
    at = np.linspace(*load, 5)
    middle = at[2:3]
    zero = {variable.name: np.zeros(at.shape) for variable in model.variables}
    slope = -model.slope({**zero, "load": at}, "utilisation")  # ISO: a positive angle, Fy < 0
    logs = -np.log(np.maximum(slope, LEAST_SLOPE))
    stiffness = np.polynomial.polynomial.polyfit(np.log(at / LOAD), logs, 2)
    used = np.full(at.shape, utilisation)
    angle = float(model.predict({**zero, "load": at, "utilisation": -used})[0][2])

    def brush(friction: float) -> SlidingCurve:
        return SlidingCurve(
            friction, *BRUSH, tuple(stiffness.tolist()), (0.0,), (0.0, 0.0), np.inf, 0.0
        )

    tried = np.linspace(max(0.7, 1.05 * utilisation), 1.3, 25)
    reached = [brush(mu).at(used[:1], middle, np.array([mu])).angle[0] for mu in tried.tolist()]
    return brush(float(tried[int(np.argmin(np.abs(np.array(reached) - angle)))]))
