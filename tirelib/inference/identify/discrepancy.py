"""What the model's structure cannot show, as a smooth function with a prior.

The ring is not the tire. Its misfit repeats from run to run, so more runs do not average it out,
and a fit that ignores it gives intervals that are far too narrow. It is therefore part of the fit:
a smooth function of the place along the turn, in proportion to the run's strain, constant, or
changing with load and with pressure. Its size has a prior; what the parameters can explain as well
as it can widens their intervals.
"""

from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.effects.state import Operating

REFERENCE_LOAD = 4000.0
REFERENCE_PRESSURE = 2.0e5
REFERENCE_OMEGA = 80.0
"""Angular speed of a car's tire at 25 m/s, [rad/s]."""
TOP = 20.0
"""Place of the top of the turn, where the edges of the contact are at 1: half contact angles of a
tire whose contact is 18 deg long."""


@dataclass(frozen=True, slots=True)
class Discrepancy:
    """Prior of the structural misfit.

    Attributes
    ----------
    inside, outside : float, [-]
        Standard deviation of the misfit relative to the run's rms strain, in the contact and away
        from it: tread and road are modelled worse than the free belt.
    knots : int
        Smooth bumps over the angle.
    reach : float, [-]
        Place along the turn up to which they reach.
    by_load, by_pressure, by_speed : float, [-]
        Standard deviation of the part that goes with ln(load), with relative pressure and with the
        square of speed (1 at 25 m/s), relative to the constant part. Without a part by speed there
        are no columns for it.
    """

    inside: float = 0.04
    outside: float = 0.006
    knots: int = 24
    reach: float = 5.0
    by_load: float = 0.5
    by_pressure: float = 0.25
    by_speed: float = 0.0

    def columns(self, waveform: FloatArray, place: FloatArray, points: Operating) -> FloatArray:
        """Return the misfit's shapes, each for one standard deviation of its coefficient.

        Parameters
        ----------
        waveform : shape (n_runs, n_phi)
        place : shape (n_runs, n_phi), [-]
            Place along the turn, -1 and 1 at the edges of the contact.

        Returns
        -------
        shape (n_columns, n_runs, n_phi)
        """
        knots = bumps(place, self.knots, self.reach)
        share = self.outside + (self.inside - self.outside) * np.exp(-((place / 1.5) ** 4))
        size = share * np.sqrt(np.mean(waveform**2, axis=1))[:, None]
        base = knots * size[None]
        base = base - base.mean(axis=2, keepdims=True)
        load = np.log(points.load / REFERENCE_LOAD)[None, :, None]
        pressure = (points.pressure / REFERENCE_PRESSURE - 1.0)[None, :, None]
        parts = [base, self.by_load * base * load, self.by_pressure * 4.0 * base * pressure]
        if self.by_speed > 0.0:
            square = (points.omega / REFERENCE_OMEGA)[None, :, None] ** 2
            parts.append(self.by_speed * base * square)
        return np.concatenate(parts)


COARSE = Discrepancy(inside=0.08, outside=0.01)
"""Discrepancy of the dissertation's ring, whose belt does not shear."""


def along_turn(phi: FloatArray, half_angle: FloatArray) -> FloatArray:
    """Return the place along the turn, (n_runs, n_phi): -1 and 1 at the edges of the contact.

    What a model leaves in the contact goes with its length, and therefore with the load. What it
    leaves at the top of the tire stays there: the rest of the turn is as long at every load.
    """
    half = half_angle[:, None]
    outside = np.abs(phi) - half
    rest = np.sign(phi) * (1.0 + (TOP - 1.0) * outside / (np.pi - half))
    return np.where(outside > 0.0, rest, phi / half)


def bumps(scaled: FloatArray, knots: int, reach: float) -> FloatArray:
    """Return overlapping Gaussian bumps with unit sum of squares, (knots, n_runs, n_phi)."""
    # denser near the patch: equal steps of arcsinh
    centre = np.sinh(np.linspace(-np.arcsinh(reach), np.arcsinh(reach), knots))
    width = np.gradient(centre)
    peaks = np.exp(-0.5 * ((scaled[None] - centre[:, None, None]) / width[:, None, None]) ** 2)
    total = np.sqrt(np.sum(peaks**2, axis=0, keepdims=True))
    peak: FloatArray = peaks / np.maximum(total, 1.0)
    return peak
