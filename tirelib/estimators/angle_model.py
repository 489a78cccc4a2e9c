"""The slip angle over the lateral utilisation: the inverse of a tire's cornering curve."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.estimators.polynomial import Polynomial

WIDEST = 0.5
"""Largest slip angle and largest standard deviation of one, [rad]: for a flat cornering curve the
latter has no end. Half and double change no validity, which ends at 1 deg."""


@dataclass(frozen=True, slots=True)
class AngleModel:
    """Slip angle from utilisation; less certain where the cornering curve is flat.

    With s the slope d alpha / d utilisation, the variance of a turn is the polynomial's plus
    ``(blur s)^2 + (bend s^2)^2``; blur is the uncertainty of the utilisation over the calibration,
    for which that of the turn itself stands where it is larger.
    """

    polynomial: Polynomial
    blur: float
    bend: float

    def predict(
        self, values: Mapping[str, FloatArray], spread: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return slip angle and standard deviation, [rad]; `spread` is the utilisation's own."""
        value, std = self.polynomial.predict(values)
        slope = self.polynomial.slope(values, "utilisation")
        blur = np.maximum(self.blur, spread)
        return value, np.sqrt(std**2 + (blur * slope) ** 2 + (self.bend * slope**2) ** 2)
