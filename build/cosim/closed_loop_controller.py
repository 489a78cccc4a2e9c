"""A controller of four brakes that aims at a slip ratio, by what it knows of each wheel."""

import math
from dataclasses import dataclass

import numpy as np

from cosim.closed_loop_sources import TIME_STEP, Known
from tirelib.core.arrays import FloatArray


@dataclass(frozen=True)
class SlipController:
    """Brake torque T = r Fz (u + P e), with e = kappa - target and du = I e per way.

    u is the traction that is asked for; it is integrated over the way and not over time, so that
    the loop is as stable at low speed as at high, where knowledge comes once per turn. It rises
    from zero at `rise` after the brakes are put on. A wheel whose speed sensor shows a rim
    deceleration above `guard` gives up traction, whatever is known of its slip; and so does one of
    which no slip is known any more, since slip beyond the calibrated range is the likeliest reason:
    held at the last torque it would lock and never be seen again. Slip angles take
    their share: the target is kappa_0 sqrt(1 - (alpha / alpha_0)^2), a tenth of kappa_0 at least,
    so that wheels keep what they need to hold the vehicle in a turn.

    Attributes
    ----------
    target : float
        kappa_0, < 0.
    widest : float, [rad]
        alpha_0.
    first : float
        Traction that is asked for at first.
    proportional, integral : float, [1], [1/m]
    rise : float, [1/s]
    guard : float, [m/s^2]
    yield_ : float, [s/m]
        Traction given up per excess of rim speed, and so of time.
    release : float, [1/s]
        Rate at which traction is given up where the slip is not known any more.
    most : float
        Highest traction that may be asked for.
    """

    target: float = -0.06
    widest: float = math.radians(6.0)
    first: float = 0.8
    proportional: float = 1.0
    integral: float = 0.7
    rise: float = 5.0
    guard: float = 14.0
    yield_: float = 0.25
    release: float = 2.5
    most: float = 1.3
    radius: float = 0.31

    def step(
        self, asked: FloatArray, known: Known, slowing: FloatArray, speed: float, since: float
    ) -> tuple[FloatArray, FloatArray]:
        """Return traction asked for from now on, and brake torques [N m], both of shape (4,).

        Parameters
        ----------
        asked : array, shape (4,)
            As returned before.
        known : Known
        slowing : array, shape (4,), [m/s^2]
            Deceleration of the rims.
        speed : float, [m/s]
        since : float, [s]
            Since the brakes were put on.
        """
        limit = self.rise * since
        share = 1.0 - (np.where(np.isnan(known.alpha), 0.0, known.alpha) / self.widest) ** 2
        target = self.target * np.sqrt(np.maximum(share, 0.01))
        blind = np.isnan(known.kappa) | ~known.sure
        error = np.where(blind, 0.0, known.kappa - target)
        excess = np.maximum(slowing - self.guard, 0.0)
        moving = limit > asked  # the integral waits for the brakes to rise
        change = self.integral * speed * error * moving - self.yield_ * excess
        change -= self.release * (~known.sure & np.isfinite(known.kappa))
        asked = np.minimum(np.maximum(asked + change * TIME_STEP, 0.05), self.most)
        wanted = np.minimum(asked + self.proportional * error, limit)
        torque = self.radius * known.load * np.maximum(wanted, 0.0)
        return asked, np.where(np.isnan(torque), 0.0, torque)
