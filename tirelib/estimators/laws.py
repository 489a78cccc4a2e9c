r"""What is assumed of conditions that a calibration did not vary.

**Pressure.** At a given contact length the belt is in contact over the area :math:`b\,l`; inflation
carries its share over that area, the structure carries the rest. With the load calibrated at one
pressure :math:`p_0` only,

.. math:: F_z(l, p) = F_z(l, p_0) + (p - p_0)\, b\, l, \qquad l = \varphi_{contact} R

with the belt's width b and its ring radius R. Source: balance of a flat membrane on the road; the
dissertation's regressions hold at one pressure. The width is assumed to be the belt's at every
load, so a tenth of the correction (at least) is doubt: the standard deviation grows with it.

The rolling radius depends on load and pressure through the deflection, which follows their ratio:
:math:`R_{eff}(F_z, p) = R_{eff}(F_z\,p_0/p, p_0)`; half of the change is doubt.

The lateral distortion of the contact is resisted by sidewalls and belt tension, which grow with the
pressure, and by the belt's own bending, which does not, so at a given distortion

.. math:: F_y(p) = F_y(p_0)\,(p / p_0)^{0.8}

with 30 % of the correction as doubt (assumed: between 0.5 and 1; a rig's tire showed 0.73 to 0.96).

A pressure that nobody gives widens the standard deviation by 15 % of itself. An unknown camber is
the subject of `tirelib.estimators.tilt`.

**Speed.** Features are taken over wheel angle, so speed enters only through inertia and damping; no
correction, but the standard deviation grows with the squared speed's departure from the calibrated
ones, below the lowest as above the highest.

Outside a declared envelope no estimate is valid.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray

PRESSURE_ENVELOPE = (0.5, 1.25)
"""Pressure, relative to the calibrated one, for which the pressure law is taken to hold."""
PRESSURE_DOUBT = 0.15
"""Relative standard deviation of the pressure correction."""
FORCE_EXPONENT = 0.8
"""Power of the pressure ratio with which Fy grows at a given distortion of the contact."""
FORCE_DOUBT = 0.3
"""Relative standard deviation of that correction."""
UNKNOWN_PRESSURE = 0.15
"""Relative standard deviation of a pressure that nobody measures."""
FASTEST = 60.0
"""Highest speed for which a calibration at another speed is taken to hold, [m/s]."""
SLOWEST = 2.5
"""Lowest speed for which a calibration at higher speeds is taken to hold, [m/s]."""
SPEED_DOUBT = 0.02
"""Relative standard deviation of any estimate per (40 m/s)^2 of speed squared."""
SPEED_UNIT = 1600.0
RADIUS_SHARE = 0.5
"""Doubt about what the ratio of load and pressure does to the rolling radius, as a share of it."""
RADIUS_DOUBT = 0.003
"""Relative standard deviation of the rolling radius per (40 m/s)^2 of speed squared."""
CALIBRATED_SLACK = 0.05
"""A condition that stays this close (relatively) to its calibrated range needs no law."""


def slip_range(contact_angle: FloatArray) -> tuple[float, FloatArray]:
    r"""Return between which slip ratios a wheel rolls forward, [1], for contacts of an angle [rad].

    At the lower end it is locked, and beyond it would turn backwards. At the upper end the vehicle
    moves in a turn, :math:`2 \pi R_{eff} / (1 + \kappa)`, as far as the contact is long,
    :math:`R_{eff} \varphi`, and beyond the wheel spins on the spot.
    """
    return -1.0, 2.0 * np.pi / contact_angle - 1.0


@dataclass(frozen=True, slots=True)
class ConditionLaws:
    """Calibrated conditions, and whether each was varied.

    Attributes
    ----------
    pressure, speed : (low, high), [Pa], [m/s]
        Range in the calibration data; NaN where it was not measured.
    pressure_fitted, speed_fitted : bool
        True where the condition was varied, so that the regression holds its effect.
    contact_width, radius : float, [m]
        Belt width and ring radius in the pressure law; NaN where the campaign does not give them.
    """

    pressure: tuple[float, float]
    speed: tuple[float, float]
    pressure_fitted: bool
    speed_fitted: bool
    contact_width: float
    radius: float

    @property
    def reference_pressure(self) -> float:
        """Middle of the calibrated pressures, [Pa]."""
        return 0.5 * (self.pressure[0] + self.pressure[1])

    def load_correction(self, values: Mapping[str, FloatArray]) -> tuple[FloatArray, FloatArray]:
        """Return the pressure law's load and its standard deviation, [N], each of shape (n,)."""
        angle, pressure = values["contact_angle"], values["pressure"]
        if self.pressure_fitted or not np.isfinite(self.reference_pressure):
            return np.zeros_like(angle), np.zeros_like(angle)
        width = self.contact_width * self.radius
        if not np.isfinite(width):
            return np.zeros_like(angle), np.zeros_like(angle)
        known = np.isfinite(pressure)
        change = np.where(known, pressure - self.reference_pressure, 0.0)
        correction = change * width * angle
        unknown = UNKNOWN_PRESSURE * self.reference_pressure * width * angle
        return correction, np.where(known, PRESSURE_DOUBT * np.abs(correction), unknown)

    def force_factor(self, values: Mapping[str, FloatArray]) -> tuple[FloatArray, FloatArray]:
        """Return the pressure law's factor of Fy and its standard deviation, shape (n,)."""
        one = np.ones_like(values["pressure"])
        if self.pressure_fitted or not np.isfinite(self.reference_pressure):
            return one, np.zeros_like(one)
        known = np.isfinite(values["pressure"]) & (values["pressure"] > 0.0)
        ratio = np.where(known, values["pressure"] / self.reference_pressure, 1.0)
        low, high = (limit / self.reference_pressure for limit in self.pressure)
        ratio = np.where((ratio > low) & (ratio < high), 1.0, ratio)
        factor = ratio**FORCE_EXPONENT
        doubt = np.where(known, FORCE_DOUBT * np.abs(factor - 1.0), UNKNOWN_PRESSURE)
        return factor, doubt

    def equivalent_load(self, load: FloatArray, values: Mapping[str, FloatArray]) -> FloatArray:
        """Return the load that deflects the tire as much at the calibrated pressure, [N]."""
        if self.pressure_fitted or not np.isfinite(self.reference_pressure):
            return load
        with np.errstate(invalid="ignore", divide="ignore"):
            ratio = self.reference_pressure / values["pressure"]
        return load * np.where(np.isfinite(ratio) & (ratio > 0.0), ratio, 1.0)

    def allowed(self, values: Mapping[str, FloatArray]) -> BoolArray:
        """Tell which turns lie within the envelope of the conditions; unknown ones do."""
        return self.pressure_allowed(values) & self.speed_allowed(values)

    def pressure_allowed(self, values: Mapping[str, FloatArray]) -> BoolArray:
        """Tell which turns have a pressure for which the calibration holds; unknown ones have."""
        low, high = self.pressure_range
        good = ~(values["pressure"] < low) & ~(values["pressure"] > high)
        return np.asarray(good, dtype=np.bool_)

    @property
    def pressure_range(self) -> tuple[float, float]:
        """Lowest and highest pressure for which the calibration holds, [Pa]."""
        low, high = self.pressure
        if not self.pressure_fitted:
            return low * PRESSURE_ENVELOPE[0], high * PRESSURE_ENVELOPE[1]
        slack = CALIBRATED_SLACK * (high - low)
        return low - slack, high + slack

    @property
    def speed_range(self) -> tuple[float, float]:
        """Lowest and highest speed for which the calibration holds, [m/s]."""
        fastest = 1.05 * self.speed[1] if self.speed_fitted else FASTEST
        return float(np.fmin(SLOWEST, 0.95 * self.speed[0])), fastest

    def not_too_fast(self, values: Mapping[str, FloatArray]) -> BoolArray:
        """Tell which turns are no faster than the calibration holds; unknown ones are not."""
        return np.asarray(~(np.abs(values["speed"]) > self.speed_range[1]), dtype=np.bool_)

    def speed_allowed(self, values: Mapping[str, FloatArray]) -> BoolArray:
        """Tell which turns have a speed for which the calibration holds; unknown ones have."""
        slow = np.abs(values["speed"]) < self.speed_range[0]
        good = ~slow & self.not_too_fast(values)
        return np.asarray(good, dtype=np.bool_)

    def spread(self, values: Mapping[str, FloatArray], value: FloatArray) -> FloatArray:
        """Return the standard deviation due to a speed outside the calibrated ones, shape (n,)."""
        doubt = SPEED_DOUBT * self.speed_departure(values)
        return np.asarray(doubt * np.abs(value), dtype=np.float64)

    def speed_departure(self, values: Mapping[str, FloatArray]) -> FloatArray:
        """Return how far the squared speed lies outside its calibrated range, [(40 m/s)^2]."""
        squared = values["speed"] ** 2
        if not np.isfinite(self.speed[1]):
            return np.zeros_like(squared)
        apart = np.maximum(squared - self.speed[1] ** 2, self.speed[0] ** 2 - squared)
        return np.asarray(np.fmax(apart, 0.0) / SPEED_UNIT, dtype=np.float64)

    def pressure_departure(self, values: Mapping[str, FloatArray]) -> tuple[FloatArray, FloatArray]:
        """Return the relative change from the one calibrated pressure, and its own deviation."""
        pressure = values["pressure"]
        if self.pressure_fitted or not np.isfinite(self.reference_pressure):
            return np.zeros_like(pressure), np.zeros_like(pressure)
        apart = pressure / self.reference_pressure - 1.0
        known = np.isfinite(apart)
        return np.where(known, apart, 0.0), np.where(known, 0.0, UNKNOWN_PRESSURE)

    def extrapolated(self, values: Mapping[str, FloatArray]) -> BoolArray:
        """Tell which turns need a law instead of a calibration, shape (n,)."""
        apart = np.zeros(values["pressure"].shape, dtype=np.bool_)
        if not self.pressure_fitted:
            ratio = values["pressure"] / self.reference_pressure
            apart |= (np.abs(ratio - 1.0) > CALIBRATED_SLACK) | np.isnan(ratio)
        speed, slack = np.abs(values["speed"]), 0.05 if self.speed_fitted else 0.1
        apart |= (speed > (1.0 + slack) * self.speed[1]) | (speed < (1.0 - slack) * self.speed[0])
        return apart
