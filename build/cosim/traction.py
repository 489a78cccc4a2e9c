"""A brake controller that believes a friction for each wheel, and learns it as the wheel slides."""

import math
from dataclasses import dataclass

import numpy as np

from cosim.closed_loop_sources import TIME_STEP, Known
from tirelib.core.arrays import FloatArray


@dataclass(frozen=True)
class TractionController:
    """Brake torque T = r Fz (u + P e), with e = kappa - target and du = (I v e + rise) dt.

    u is the traction that a wheel is believed to have. A wheel that slips far beyond its target
    has no more than it shows, so u falls at once to what the road gives: Fx = (T - I_w a / r) / r
    with a the deceleration of the rim, over the known load. A wheel that slips little gains u by
    `rise`.

    The target is the slip at which a wheel with this traction is about to slide, as the brush has
    it (it slides at 3 mu Fz / C), within bounds; slip angles take their share of it,
    sqrt(1 - (alpha / widest)^2) with `widest` as the same multiple of u.

    Attributes
    ----------
    slides : float
        Target per traction.
    least, most_slip : float
        Bounds of the target.
    widest : float, [rad]
        Slip angle at which a wheel with a traction of 1 slides.
    proportional, integral : float, [1], [1/m]
    rise : float, [1/s]
    first, most : float
        Traction that is believed at first, and largest that is.
    apply : float, [1/s]
        How fast traction may be asked for after the brakes are put on.
    radius, spin_inertia : float, [m], [kg m^2]
    """

    slides: float = 0.12
    least: float = 0.035
    most_slip: float = 0.07
    widest: float = math.radians(8.0)
    proportional: float = 1.5
    integral: float = 1.2
    rise: float = 1.2
    first: float = 0.8
    most: float = 1.3
    apply: float = 5.0
    radius: float = 0.31
    spin_inertia: float = 1.1

    def target(self, believed: FloatArray, alpha: FloatArray) -> FloatArray:
        """Return the slip ratio to aim at, shape (4,)."""
        base = np.minimum(np.maximum(self.slides * believed, self.least), self.most_slip)
        widest = self.widest * np.maximum(believed, self.least / self.slides)
        share = 1.0 - (np.where(np.isnan(alpha), 0.0, alpha) / widest) ** 2
        return -base * np.sqrt(np.maximum(share, 0.04))

    def step(
        self,
        believed: FloatArray,
        known: Known,
        shown: tuple[FloatArray, FloatArray],
        speed: float,
        since: float,
    ) -> tuple[FloatArray, FloatArray]:
        """Return the traction believed from now on, and brake torques [N m], both of shape (4,).

        Parameters
        ----------
        believed : array, shape (4,)
            As returned before.
        known : Known
            A wheel whose slip or load is not known is not braked.
        shown : pair of arrays, shape (4,), [N m], [m/s^2]
            Torques of the brakes, decelerations of the rims.
        speed : float, [m/s]
        since : float, [s]
            Since the brakes were put on.
        """
        torque, slowing = shown
        target = self.target(believed, known.alpha)
        error = known.kappa - target
        force = (torque - self.spin_inertia * slowing / self.radius) / self.radius
        sliding = known.kappa < 1.5 * target
        gives = np.maximum(force / known.load, 0.05)
        change = self.integral * speed * error + self.rise * (known.kappa > 0.5 * target)
        grown = np.minimum(np.maximum(believed + change * TIME_STEP, 0.05), self.most)
        found = np.where(sliding, np.minimum(grown, gives), grown)
        limit = self.apply * since
        found = np.where(limit > found, found, believed)  # waits for the brakes to rise
        asked = np.minimum(found + self.proportional * error, limit)
        wanted = self.radius * known.load * np.maximum(asked, 0.0)
        unknown = np.isnan(wanted)
        return np.where(unknown, believed, found), np.where(unknown, 0.0, wanted)
