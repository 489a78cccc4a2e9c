r"""Slip angle where the friction of the road is not known: what moment and traction tell.

In the rear of the contact the tread slides, more of it the larger the slip and the lower the
friction. With the lateral slip :math:`s_y = \sin\alpha / (1 + \kappa)`, the longitudinal one
:math:`s_x = \cos\alpha / (1 + \kappa) - 1`, the sliding share t, the friction mu and the
utilisations :math:`u_x, u_y` (forces over Fz, in the direction of the slip),

.. math:: \sigma = \sqrt{(r s_x)^2 + s_y^2}, \quad \sigma = \frac{n\,\mu\,t}{c}, \quad
          u = \mu\,[1 - (1 - t)^n], \quad \frac{u_x}{r s_x} = \frac{u_y}{s_y}
          = \frac{u}{\sigma}, \quad q = q_0 (1 - t)^m

with c the cornering stiffness over the load, r the stiffness along over that across, and q the
pneumatic trail -Mz / Fy of a wheel that rolls freely. A brush with a parabola of pressure has n = 3
and nearly m = 2 (Pacejka, Tire and Vehicle Dynamics, 3.2); all are fitted to the calibration's own
runs. Friction enters by similarity: u, mu and sigma grow together, at the same t and q.

So :math:`u_y` alone leaves the slip angle open: any friction above it will do. Two more readings of
the strain close it. The trail falls with t whatever the friction. And a wheel that is braked or
driven is pulled against its slip: where :math:`s_x` is known, the direction of the force is that of
the slip. For given :math:`u_y`, a friction and a lateral slip that are evenly spread over their
ranges give t the density :math:`\propto (\sigma / s_y) [1 - (1 - t)^n]^{-2}`; beyond t = 1 the
tread slides as a whole, and the slip is any larger one. This density, times the likelihood of the
readings, has the mean and the standard deviation that are reported. Where they say nothing, the
angle stays that of the calibrated road, and how far the mean lies from it is doubt.
"""

from dataclasses import dataclass, fields

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.estimators.polynomial import Polynomial

LOAD = 4000.0
"""Unit of the load in c and q0, [N]."""
MOMENT_DOUBT = 0.03
"""Standard deviation of Mz / (Fz q0) on roads that were not calibrated."""
CURVE_DOUBT = 0.3
"""Relative standard deviation of what another friction changes in the slip angle."""
LOAD_DOUBT, FORCE_DOUBT = 0.025, 0.1
"""Relative standard deviation of Fz and Fy per unit of sliding share that was not calibrated."""
USUAL_FRICTION = (1.0, 0.1)
"""Friction of a calibration that does not say, and its standard deviation."""
BRUSH = (3.0, 2.0)
"""Sharpness and fading of a brush with a parabola of pressure."""
LEAST_SLOPE = 0.01
"""Floor of d alpha / d u of an earlier calibration, [rad]."""
FREE = 0.02
"""Slip ratio up to which a wheel counts as freely rolling: there the trail is that of the curve."""
NEWTON = 10
"""Steps of Newton's method in which a sliding share is found, to rounding."""
LEAST_ROLLING = 0.1
"""Floor of 1 + slip ratio: a wheel that hardly turns."""
TINY = 1e-12
STEEPEST = 0.1
"""Least 1 - t at which the slope d alpha / d u is taken."""


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
        return Told(
            *(
                np.where(rows, getattr(self, field.name), getattr(other, field.name))
                for field in fields(self)
            )
        )


@dataclass(frozen=True, slots=True)
class SlidingCurve:
    """The calibration's own cornering curve in the form above.

    Attributes
    ----------
    friction, friction_std : float
        Friction of the road of the calibration: given (and certain), or fitted.
    grip : float
        Largest utilisation over the friction.
    sharpness, fading : float
        n and m.
    stiffness, trail, ratio : tuples of up to three floats
        Logarithms of c [1], q0 [m] and r [1] as polynomials of ln(load / 4 kN).
    camber : (float, float), [1/rad]
        Parts of u_y and of Mz / (Fz q0) that a camber adds.
    misfit : float
        Standard deviation of Mz / (Fz q0) about the curve.
    slant : float
        Relative standard deviation of u_x about the curve; infinite where it was not measured.
    """

    friction: float
    friction_std: float
    grip: float
    sharpness: float
    fading: float
    stiffness: tuple[float, ...]
    trail: tuple[float, ...]
    ratio: tuple[float, ...]
    camber: tuple[float, float]
    misfit: float
    slant: float

    def cornering(self, load: FloatArray) -> FloatArray:
        """Return c, the cornering stiffness over the load."""
        return _power_series(self.stiffness, load)

    def load_power(self, load: FloatArray) -> FloatArray:
        """Return d ln c / d ln load."""
        x = np.log(load / LOAD)
        slope = np.polynomial.polynomial.polyder(np.array(self.stiffness))
        return np.asarray(np.polynomial.polynomial.polyval(x, slope) if slope.size else 0.0 * x)

    def longest(self, load: FloatArray) -> FloatArray:
        """Return q0, the trail without sliding, [m]."""
        return _power_series(self.trail, load)

    def stiffer(self, load: FloatArray) -> FloatArray:
        """Return r, the stiffness along over that across."""
        return _power_series(self.ratio, load)

    def along(self, angle: FloatArray, slip_ratio: FloatArray, load: FloatArray) -> FloatArray:
        """Return r s_x at a slip angle [rad], positive under brake; 0 where no slip ratio is."""
        slip = np.cos(angle) / np.maximum(1.0 + slip_ratio, LEAST_ROLLING) - 1.0
        return np.asarray(self.stiffer(load) * np.nan_to_num(slip))

    def share(
        self,
        used: FloatArray,
        friction: FloatArray | float,
        load: FloatArray,
        along: FloatArray | float = 0.0,
    ) -> FloatArray:
        """Return t at a lateral utilisation; 1 where the tread slides as a whole.

        The slip along and the force across each ask for a share at least; from the larger of both,
        Newton's method climbs to where they are met together: what is left falls, convexly. Without
        slip along, the force's share is the answer.
        """
        n, effective = self.sharpness, self.grip * np.asarray(friction)
        across = used / effective
        pull = np.abs(self.cornering(load) * along) / (n * effective)
        alone = 1.0 - np.maximum(1.0 - across, 0.0) ** (1.0 / n)
        t = np.asarray(np.maximum(alone, np.minimum(pull, 1.0)), dtype=np.float64)
        if not np.any(pull):
            return alone
        for _ in range(NEWTON):
            at = np.maximum(t, TINY)
            rest = (1.0 - at) ** (n - 1.0)
            filled = np.maximum(1.0 - rest * (1.0 - at), TINY)
            a, b = (pull / at) ** 2, (across / filled) ** 2
            fall = 2.0 * (a / at + b * n * rest / filled)
            before = t
            t = np.minimum(t + np.maximum(a + b - 1.0, 0.0) / np.maximum(fall, TINY), 1.0)
            if (t == before).all():  # every further step would say the same
                break
        return np.where(pull > 0.0, t, alone)

    def across(self, used: FloatArray, t: FloatArray, load: FloatArray) -> FloatArray:
        """Return s_y at a lateral utilisation and a sliding share, below full sliding."""
        n = self.sharpness
        filled = np.maximum(1.0 - (1.0 - t) ** n, TINY)
        return np.asarray(used / self.cornering(load) * np.where(t > 0.0, n * t / filled, 1.0))

    def lateral(
        self,
        used: FloatArray,
        friction: FloatArray | float,
        load: FloatArray,
        along: FloatArray | float = 0.0,
    ) -> tuple[FloatArray, FloatArray]:
        """Return s_y and t at a lateral utilisation; where all slides, by the force's direction.

        A utilisation above the friction has the slip of the begin of full sliding.
        """
        t = self.share(used, friction, load, along)
        return self.lateral_at(t, used, friction, load, along), t

    def lateral_at(
        self,
        t: FloatArray,
        used: FloatArray,
        friction: FloatArray | float,
        load: FloatArray,
        along: FloatArray | float,
    ) -> FloatArray:
        """Return s_y where the sliding share t of `share` is known."""
        within = self.across(used, t, load)
        lost = lost_slip(used, self.grip * np.asarray(friction), np.abs(along))
        return np.where(np.isfinite(lost), np.maximum(within, lost), within)

    def forward(
        self,
        angle: FloatArray,
        load: FloatArray,
        friction: FloatArray | float,
        slip_ratio: FloatArray | None = None,
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return u_y, u_x, Mz / (Fz q0) and t, sizes but of u_x, at slip angles [rad]."""
        size = np.abs(angle)
        rolls = np.cos(size) - 1.0 if slip_ratio is None else slip_ratio
        x, y = self.along(size, rolls, load), np.sin(size) / np.maximum(1.0 + rolls, LEAST_ROLLING)
        slip, effective = np.maximum(np.hypot(x, y), TINY), self.grip * np.asarray(friction)
        t = np.minimum(slip * self.cornering(load) / (self.sharpness * effective), 1.0)
        used = effective * (1.0 - (1.0 - t) ** self.sharpness) / slip
        return used * y, used * x, used * y * (1.0 - t) ** self.fading, t

    def at(
        self,
        used: FloatArray,
        load: FloatArray,
        friction: FloatArray,
        slip_ratio: FloatArray | None = None,
    ) -> Told:
        """Return what a utilisation tells on a road of known friction."""
        rolls = np.full_like(used, np.nan) if slip_ratio is None else slip_ratio
        free = np.arctan(self.lateral(used, self.friction, load)[0])
        along = self.along(free, rolls, load)

        def slid(mu: FloatArray | float) -> tuple[FloatArray, FloatArray]:
            return self.lateral(used, mu, load, along)

        (across, here), (usual, there) = slid(friction), slid(self.friction)
        angle, more = angle_of(across, rolls), self.friction_std / self.friction
        apart = friction != self.friction
        moved = 0.0 * angle
        if more > 0.0 and apart.any():
            moved = angle_of(slid(friction * (1.0 - more))[0], rolls) - angle
        change = np.where(apart, angle - angle_of(usual, rolls), 0.0)
        doubt = np.where(apart, np.hypot(CURVE_DOUBT * change, moved), 0.0)
        std = np.where(used < self.grip * friction, doubt, np.inf)
        slope = self.slope_at(used, here, across, load, along)
        return Told(angle, std, change, slope, np.abs(here - there))

    def slope_at(
        self,
        used: FloatArray,
        t: FloatArray,
        across: FloatArray,
        load: FloatArray,
        along: FloatArray | float,
    ) -> FloatArray:
        """Return d s_y / d u_y on one road, at a lateral utilisation, sliding share and slip."""
        square = np.maximum(across**2 + along**2, TINY)
        rest = np.maximum(1.0 - t, STEEPEST) ** (self.sharpness - 1.0)
        pulled = used / np.maximum(across, TINY) * along**2
        return np.asarray(square / (pulled + self.cornering(load) * rest * across**2 + TINY))


def _power_series(logs: tuple[float, ...], load: FloatArray) -> FloatArray:
    return np.asarray(np.exp(np.polynomial.polynomial.polyval(np.log(load / LOAD), logs)))


def angle_of(across: FloatArray, slip_ratio: FloatArray) -> FloatArray:
    """Return the slip angle [rad] at s_y; of a wheel that rolls freely where no slip ratio is."""
    sine = np.minimum(across * np.maximum(1.0 + slip_ratio, LEAST_ROLLING), 1.0)
    return np.where(np.isnan(slip_ratio), np.arctan(across), np.arcsin(np.nan_to_num(sine)))


def lost_slip(used: FloatArray, most: FloatArray | float, along: FloatArray | float) -> FloatArray:
    """Return s_y at which a tread that slides as a whole has this lateral utilisation.

    `most` is the utilisation there in all; infinite where it is not enough.
    """
    room = np.sqrt(np.maximum((most / used) ** 2 - 1.0, TINY))
    return np.asarray(np.where(most > used, along / room, np.inf))


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
            friction,
            USUAL_FRICTION[1],
            1.0,
            *BRUSH,
            tuple(stiffness.tolist()),
            (0.0,),
            (0.0,),
            (0.0, 0.0),
            np.inf,
            np.inf,
        )

    tried = np.linspace(max(0.7, 1.05 * utilisation), 1.3, 25)
    reached = [brush(mu).at(used[:1], middle, np.array([mu])).angle[0] for mu in tried.tolist()]
    return brush(float(tried[int(np.argmin(np.abs(np.array(reached) - angle)))]))
