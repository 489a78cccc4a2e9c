r"""Possible change of the slip ratio within a turn when only whole turns are measured.

Turn rate over speed is known of whole turns; in the contact at the turn's end it may differ, by
what acts differently there. Two things are seen at once:

- **Load.** A wheel that is pressed onto the road rolls on a smaller radius, which lies between the
  free and the loaded one: with the contact's half angle h, the belt a chord there,

  .. math:: 1 \ge \frac{R_{eff}}{R} \ge \cos h \approx 1 - \frac{h^2}{2}.

  So a change of h^2 from one contact to the next leaves a slip between none and half of it; evenly
  spread, that has the root mean square of `RADIUS_SHARE` of it.

- **Acceleration.** A vehicle brakes and accelerates by the slip of its tires: a/g is the slip ratio
  times `SLIP_STIFFNESS`. As the acceleration at the contact differs from the turn's mean, so does
  the slip ratio.
"""

import numpy as np

from tirelib.signal.course import Course

GRAVITY = 9.81
"""[m/s2]"""
RADIUS_SHARE = 0.5 / np.sqrt(3.0)
"""Root mean square of what is spread evenly from none to a half."""
SLIP_STIFFNESS = 11.0
"""Slip stiffness over the load of the vehicle's wheels, [1]: 22.3 where all brake (`p_kx1` of the
tire of CommonRoad's vehicles, package vehiclemodels), half of it where one axle does.
``python build/ramp_error.py`` shows what half and double of it do."""


def unseen_change(speed: Course | None, seconds: float, here: float, before: float) -> float:
    """Return by how much the slip ratio at the contact may differ from the turn's, [1].

    Parameters
    ----------
    speed : Course or None
        Travel speed over the turn, [m/s].
    seconds : float, [s]
        Length of the turn.
    here, before : float, [rad]
        Half the angle of this contact and of the one before.
    """
    load = RADIUS_SHARE * (here**2 - before**2)
    surge = 0.0 if speed is None else speed.surge
    return float(np.hypot(load, surge / seconds / (GRAVITY * SLIP_STIFFNESS)))
