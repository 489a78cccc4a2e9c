r"""What nobody measures on the road: friction, tread depth and tread temperature.

Each is *known* (a channel, a column, an input), or it is *unknown* and counts as spread evenly over
the range declared here. What a calibration has varied it knows: only what lies beyond its own range
is a departure. A calibration that says nothing was made with a new tread.

**Tread.** A bristle's stiffness is a modulus over its height, so a worn or a cold tread is stiffer:
with :math:`h` the rubber between belt and road and :math:`T` its temperature,

.. math:: L = \ln\frac{k}{k_0} = \ln\frac{h_0}{h} - \beta (T - T_0)

The belt bends onto the road over a length that the tread's compression d allows,
:math:`e = \sqrt{2 \rho d}` at each end. It shrinks as :math:`e \propto k^{-1/2}`, so the contact
angle read from the strain loses :math:`e L / R` at the same load. The estimated load then loses
the same amount at every load, because load grows in a straight line with the contact angle. The
tread that wears carries the wheel where the belt is still bent, so it takes part in the rolling
radius by the share :math:`b / \varphi` of the contact angle. The lateral stiffness of the tread is
one of the springs behind the cornering stiffness, which grows as :math:`C \propto k^{0.22}`.

**Friction** acts through sliding: `tirelib.estimators.sliding`.

`EDGE`, `BENT` and `CORNERING` were measured on tires of the numerical rig by
``python build/road_constants.py --measure reference`` (``soft``, ``stiff``), `FORCE` was chosen on
runs of one; `UNDER_GROOVES`, `SOFTENING` and `TEMPERATURE` are assumed. ``python
build/road_coverage.py`` holds them against any tire; `docs/theory/estimate_numbers.md` shows half
and double of each.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from statistics import NormalDist

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray

Pair = tuple[float, float]

FRICTION: Pair = (0.3, 1.1)
"""An unknown friction: from packed snow to a dry, rough road."""
DEPTH: Pair = (0.004, 0.008)
"""An unknown tread depth, [m]; the upper end is a new tread."""
TEMPERATURE = 15.0
"""An unknown tread temperature is that of the calibration within so much, [K]."""
UNDER_GROOVES = 0.0035
"""Rubber between the grooves' bottom and the belt, [m]."""
SOFTENING = 0.004
"""Relative loss of the tread's modulus per kelvin, [1/K]."""
EDGE = 0.0114
"""Contact length that a tread of e times the stiffness loses, both ends together, [m]; with L taken
over `UNDER_GROOVES`, whatever rubber the tire has there: 1.5 to 5 mm. Mean of eleven tires: the
rig's three have 0.0105 to 0.0111, eight that were drawn at random 0.0094 to 0.0133."""
BENT = 0.115
"""Contact angle over which the belt is still bent, [rad]; the eleven have 0.097 to 0.127."""
CORNERING = 0.22
"""Power of the tread's stiffness with which the cornering stiffness grows."""
FORCE = 0.08
"""Relative standard deviation of Fy per unit of L."""
LAW_DOUBT = 0.15
"""Relative standard deviation of a correction for a known tread: `EDGE` of eleven
tires differs from that above by 0.12, `BENT` by 0.09 and `CORNERING` by 0.21 (root mean
squares)."""
TIRES = 0.12
"""Relative standard deviation of `EDGE` (0.12) and `BENT` (0.09) from tire to tire: where the tread
is not known, what it does on this tire is not known either."""
TWO_SIGMA = 1.96
_NORMAL = np.array([NormalDist().inv_cdf((i + 0.5) / 41) for i in range(41)])
"""Values of a normal distribution, each as likely as the others."""
PLAUSIBLE: Mapping[str, Pair] = {
    "friction": (0.05, 1.8),
    "tread_depth": (0.0005, 0.004),
    "tread_temperature": (230.0, 400.0),
}
"""What can be given; anything else is a wrong unit or a default of zero. Friction: black ice has
0.1 and less, racing rubber 1.8 (Bosch *Automotive Handbook*, tables of tire friction). Tread depth:
bare grooves, below the wear indicators' 1.6 mm (UN Regulation 30), to that much above the
calibrated depth. Temperature: a winter night to rubber that decays. The ends change nothing
between them; half of the upper ones would refuse dry roads, double of the lower ones ice and treads
of 0.9 mm."""


@dataclass(frozen=True, slots=True)
class Road:
    """Friction [1], tread depth [m] and tread temperature [K] of a calibration.

    Each is the range that its data cover; NaN where nobody wrote it down.
    """

    friction: Pair = (np.nan, np.nan)
    tread_depth: Pair = (np.nan, np.nan)
    tread_temperature: Pair = (np.nan, np.nan)

    @property
    def depth(self) -> Pair:
        """Calibrated tread depth, [m]; that of a new tread where it is not known."""
        return (DEPTH[1], DEPTH[1]) if np.isnan(self.tread_depth[0]) else self.tread_depth

    @property
    def ends(self) -> dict[str, Pair]:
        """Lowest and highest value that can be of each of the three."""
        low, above = PLAUSIBLE["tread_depth"]
        return {**PLAUSIBLE, "tread_depth": (low, self.depth[1] + above)}

    def plausible(self, values: Mapping[str, FloatArray]) -> dict[str, BoolArray]:
        """Tell for each of the three which turns have a value that can be; unknown ones have."""
        return {
            name: np.asarray(~(values[name] < low) & ~(values[name] > high), dtype=np.bool_)
            for name, (low, high) in self.ends.items()
        }

    def said(self, values: Mapping[str, FloatArray], name: str) -> FloatArray:
        """Return friction, depth or temperature; NaN where it is unknown or cannot be."""
        low, high = self.ends[name]
        return np.where((values[name] < low) | (values[name] > high), np.nan, values[name])

    def unseen_friction(self, reference: float) -> float:
        """Return which share of the way down to the lowest friction no data cover, 0 to 1."""
        lowest = reference if np.isnan(self.friction[0]) else self.friction[0]
        share = np.log(lowest / FRICTION[0]) / np.log(
            max(reference, 2.0 * FRICTION[0]) / FRICTION[0]
        )
        return float(np.clip(share, 0.0, 1.0))

    def worn(self, values: Mapping[str, FloatArray]) -> tuple[FloatArray, FloatArray]:
        """Return the tread lost beyond what was calibrated and its standard deviation, [m]."""
        depth = self.said(values, "tread_depth")
        lost = -beyond(depth, self.depth)
        known = np.isfinite(lost)
        unknown = _unknown_wear(self.depth, DEPTH)
        return np.where(known, lost, 0.0), np.where(known, 0.0, unknown)

    def hardened(self, values: Mapping[str, FloatArray]) -> tuple[FloatArray, FloatArray]:
        """Return L, how much stiffer the tread is than calibrated, and its standard deviation."""
        depth, low_high = self.said(values, "tread_depth"), self.depth
        wear = -_log_height(depth, low_high, UNDER_GROOVES)
        known = np.isfinite(wear)
        std = np.where(known, 0.0, _unknown_height(low_high, DEPTH, UNDER_GROOVES))
        warmer = beyond(self.said(values, "tread_temperature"), self.tread_temperature)
        given = np.isfinite(warmer)
        unknown = SOFTENING * _unknown_warmth(TEMPERATURE)
        value = np.where(known, wear, 0.0) - np.where(given, SOFTENING * warmer, 0.0)
        return value, np.hypot(std, np.where(given, 0.0, unknown))


def beyond(x: FloatArray, low_high: Pair) -> FloatArray:
    """Return how far values lie below (negative) or above a range; NaN where unknown."""
    return np.asarray(x - np.clip(x, *low_high), dtype=np.float64)


def spread(departure: FloatArray, tires: float = 0.0) -> float:
    """Return the standard deviation whose 95 % interval holds 95 % of the departures.

    Parameters
    ----------
    departure : array, shape (n,)
    tires : float, [1]
        Relative standard deviation of what a departure does, from tire to tire.
    """
    every = np.outer(departure, 1.0 + tires * _NORMAL)
    return float(np.quantile(np.abs(every), 0.95)) / TWO_SIGMA


def _log_height(depth: FloatArray, low_high: Pair, under: float) -> FloatArray:
    return np.asarray(np.log((depth + under) / (np.clip(depth, *low_high) + under)))


@lru_cache(maxsize=64)
def _unknown_wear(calibrated: Pair, depth: Pair) -> float:
    return spread(beyond(np.linspace(*depth, 81), calibrated), TIRES)


@lru_cache(maxsize=64)
def _unknown_height(calibrated: Pair, depth: Pair, under: float) -> float:
    return spread(_log_height(np.linspace(*depth, 81), calibrated, under), TIRES)


@lru_cache(maxsize=64)
def _unknown_warmth(within: float) -> float:
    return spread(np.linspace(-within, within, 81))
