r"""Possible change of the slip ratio within a turn when only whole turns are measured.

Turn rate over speed is known of whole turns; in the contact at the turn's end it may differ, by
what acts differently there. Two things are seen in the contact itself:

- **Load.** A wheel that is pressed onto the road rolls on a smaller radius, which lies between the
  free and the loaded one: with the contact's half angle h, the belt a chord there,

  .. math:: 1 \ge \frac{R_{eff}}{R} \ge \cos h \approx 1 - \frac{h^2}{2}.

  So a change of h^2 from one contact to the next leaves a slip between none and half of it; evenly
  spread, that has the root mean square of `RADIUS_SHARE` of it.

- **Traction.** Under braking the compressive peak behind the contact deepens, under driving the one
  before it (section 4.1.5). Their difference over the tension, the **pull** p, grows with the slip
  ratio while little of the contact slides, the more the longer the contact is:
  :math:`-d\kappa / dp = s\,h^{-3/2}` with s of `PULL_SLIP`. Between two contacts the slip ratio has
  changed by what the pull says; a ratio of turn rate and speed that has not, has missed the rest.
"""

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.measured.signal.turn import PHI

RADIUS_SHARE = 0.5 / np.sqrt(3.0)
"""Root mean square of what is spread evenly from none to a half."""
PULL_SLIP = 0.0066
"""Slip ratio per unit of pull where the contact's half angle is 1 rad: 0.0064 to 0.0068 on three
tires of the rig at 3 to 6.6 kN, to slip ratios of 0.03. ``python build/pull_slip.py`` measures it,
``python build/ramp_error.py`` shows half and double."""

Rolled = tuple[float, float]
"""Turn rate over speed in a contact, in any unit, and the pull there."""
NOTHING: Rolled = (np.nan, np.nan)


def unseen_by_load(here: float, before: float) -> float:
    """Return by how much the slip ratio may differ from the turn's for a change of load, [1].

    Parameters
    ----------
    here, before : float, [rad]
        Half the angle of this contact and of the one before; where that is unknown, all of this
        one's is unseen.
    """
    return float(RADIUS_SHARE * abs(here**2 - np.nan_to_num(before) ** 2))


def pull(strain: FloatArray) -> float:
    """Return the mark of traction in the strain of one gage over `PHI`; NaN where it is unknown.

    Positive under braking: strain of the dip before the contact less that of the dip behind it,
    over the tension.
    """
    known = np.isfinite(strain)
    if not known.any():
        return np.nan
    low = np.where(known, strain, np.inf)
    highest = float(np.where(known, strain, -np.inf).max())
    before, behind = float(low[PHI < 0.0].min()), float(low[PHI >= 0.0].min())
    return (before - behind) / highest if highest > 0.0 else np.nan


def unseen_by_traction(here: Rolled, before: Rolled, half: float) -> float:
    """Return by how much the slip ratio may differ from the turn's for a change of traction, [1].

    Parameters
    ----------
    here, before : Rolled
        This contact and the one before; where one is unknown, nothing is said.
    half : float, [rad]
        Half the angle of this contact.
    """
    changed = here[0] / before[0] - 1.0
    pulled = PULL_SLIP / (half * np.sqrt(half)) * (here[1] - before[1])
    unseen = float(abs(changed + pulled))
    return unseen if np.isfinite(unseen) else 0.0
