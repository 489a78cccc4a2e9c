"""How much larger an effect makes the error of the base model, to first order about its fit.

The ratio is that of rms residuals of the fitted base model with the effect and without it: once
plain, once with set points discounted. The base is fitted to the campaign without the effect; what
its numbers and the delay of the gages take of a small change follows from their slopes. The smaller
of the two ratios counts: an effect that looks like a delay or like gains from run to run has to be
visible beyond that.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from structure.family import Array
from tirelib.inference.identify.campaign_data import straight_runs
from tirelib.inference.identify.delay import by_delay
from tirelib.inference.identify.identify import fitted
from tirelib.inference.identify.random_effects import Whitening, scales, tangents, whitening_of
from tirelib.measured.waveforms import Waveforms
from tirelib.model.slopes import slopes_of
from tirelib.model.solution import solved

DELAY_STD = 1.0
"""Standard deviation of the delay, in units of `tirelib.inference.identify.delay`: all but free."""


@dataclass(frozen=True)
class Yard:
    """The base model fitted to a plain campaign.

    Attributes
    ----------
    gages : tuple of int
        In use.
    rest : shape (n_runs, n_phi)
        Measured less model.
    slopes : shape (n_free, n_runs, n_phi)
        By the base's coordinates and the delay, each for one standard deviation of its prior.
    whiten : Whitening
        By set points and by a fit's noise, a share of misfit in it: one run's gain is a few numbers
        of 360, which noise alone would hide among the others.
    """

    gages: tuple[int, ...]
    strain: Array
    rest: Array
    slopes: Array
    whiten: Whitening

    @classmethod
    def of(cls, waves: Waveforms) -> "Yard":
        """Fit the base to a plain campaign."""
        runs = straight_runs(waves)
        _, fit = fitted(runs)
        data = runs.data()
        found = solved(fit.values, data.points, low_pass=data.low_pass)
        by = slopes_of(found, fit.free)
        k, wave = len(fit.free), found.waveform
        tangent = tangents(wave, by.waveform[k], by.waveform[k + 1])
        late = by_delay(wave, data.points.omega)[None] * DELAY_STD
        return cls(
            runs.gages,
            runs.strain,
            runs.strain - wave,
            np.concatenate([by.waveform[:k] * fit.prior_std[:, None, None], late]),
            whitening_of(tangent, scales(runs.tolerance, waves.angle_std), data.noise),
        )

    def change(self, waves: Waveforms) -> Array:
        """Return what an effect adds to the mean over the gages, (n_runs, n_phi)."""
        return np.asarray(waves.strain[:, self.gages].mean(axis=1) - self.strain)

    def left(self, wave: Array) -> Array:
        """Return waves without what the base's numbers and the delay take of them."""
        columns = self.whiten(self.slopes).reshape(len(self.slopes), -1)
        normal = columns @ columns.T + np.eye(len(columns))
        taken = np.linalg.solve(normal, columns @ self.whiten(wave).ravel())
        return np.asarray(wave - np.tensordot(taken, self.slopes, axes=1))

    @property
    def floor(self) -> float:
        """Rms residual without an effect [1]."""
        return _rms(self.left(self.rest))

    def ratios(self, change: Array) -> tuple[float, float]:
        """Return the ratio of the plain residual, and with set points discounted."""
        before, after = self.left(self.rest), self.left(self.rest + change)
        white = _rms(self.whiten(after)) / _rms(self.whiten(before))
        return _rms(after) / _rms(before), white

    def share(self, change: Array, ratio: float) -> float:
        """Return the share of a change at which the smaller ratio reaches a value."""
        rest, own = self.left(self.rest), self.left(change)
        pairs = (rest, own), (self.whiten(rest), self.whiten(own))

        def reached(share: float) -> float:
            return min(_rms(r + share * o) / _rms(r) for r, o in pairs)

        high = 1.0
        while reached(high) < ratio and high < 1e6:
            high *= 2.0
        return float(brentq(lambda x: reached(x) - ratio, 0.0, high, xtol=1e-6 * high))


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
