"""What differs from run to run unintentionally, as a covariance of each run's waveform.

    C_i = N + T_i S T_i' + rho^2 a_i a_i' * K_i

N is the noise of a mean waveform: white before the low-pass, so that its power falls with the
filter's gain. T_i are the slopes by load, pressure, gain and angle zero, S the rig's tolerances.
The last part is a misfit of this run alone, in proportion to the run's strain and correlated over
the place along the turn (Matern's function of order 3/2, whose spectrum
falls slowly: the ends of a contact are sharp): what no two runs share cannot be learned from
them, and without it thousands of samples would be certain of some tens of numbers.

Rows are taken to the harmonics of the turn up to where the filter leaves nothing, and whitened by
the Cholesky factor there.
"""

from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.effects.state import Operating
from tirelib.inference.identify.discrepancy import along_turn
from tirelib.measured.signal import LowPass
from tirelib.measured.waveforms import GRID

GAIN = 0.1
"""Gain of the low-pass, in power, below which a harmonic holds nothing."""
LENGTH = 0.25
"""Length over which a run's own misfit is correlated, in arcsinh of the place along the turn."""
INSIDE = 1.5
"""Place along the turn up to which tread and road have to do with the misfit."""
OUTSIDE = 0.15
"""Its size away from the contact, over that within."""
FLOOR = 1e-3
"""Least power of the noise at a harmonic, over the largest: rounding of counts, angle steps."""


@dataclass(frozen=True, slots=True)
class Whitener:
    """Turns waveforms (..., n_runs, n_phi) into rows (..., n) of unit covariance.

    Attributes
    ----------
    harmonics : shape (n_phi, n_harmonics)
        Orthonormal cosines and sines.
    lower, inverse : shape (n_runs, n_harmonics, n_harmonics)
        Cholesky factors and their inverses.
    log_volume : float
        Logarithm of the determinant of all of them together.
    """

    harmonics: FloatArray
    lower: FloatArray
    inverse: FloatArray
    log_volume: float

    @classmethod
    def of(
        cls,
        waveform: FloatArray,
        tangent: FloatArray,
        scale: FloatArray,
        half_angle: FloatArray,
        points: Operating,
        low_pass: LowPass,
        *,
        noise: float | FloatArray,
        own: float,
    ) -> "Whitener":
        """Return the whitening about a model.

        Parameters
        ----------
        waveform : shape (n_runs, n_phi), [-]
        tangent : shape (n_runs, n_phi, 4)
            Slopes by relative load, relative pressure, gain and angle.
        scale : shape (n_runs, 4)
            Their standard deviations.
        half_angle : shape (n_runs,), [rad]
            Half of the contact's angle.
        points : Operating
        low_pass : LowPass
        noise : float or shape (n_runs,), [-]
            Standard deviation of a sample of a run's mean waveform.
        own : float, [-]
            rho, relative to the run's rms strain.
        """
        rates = points.omega / (2.0 * np.pi)
        sigma = np.array([low_pass.sigma(float(rate)) for rate in rates])
        last = int(np.sqrt(-np.log(GAIN)) / float(sigma.min()))
        order = np.arange(1, min(last, GRID.size // 2 - 1) + 1)
        turn = np.outer(GRID, order)
        harmonics = np.concatenate([np.cos(turn), np.sin(turn)], axis=1) * np.sqrt(2.0 / GRID.size)
        gain = np.exp(-((sigma[:, None] * order) ** 2))
        power = gain / np.sum(gain, axis=1, keepdims=True) * 0.5 * GRID.size
        power *= np.broadcast_to(noise, len(points))[:, None] ** 2
        power = np.maximum(power, FLOOR * power.max(axis=1, keepdims=True))
        along = along_turn(GRID, half_angle)
        scaled = np.arcsinh(along)
        size = np.sqrt(np.mean(waveform**2, axis=1))
        share = OUTSIDE + (1.0 - OUTSIDE) * np.exp(-((along / INSIDE) ** 4))
        amount = own * size[:, None] * share
        covariance = np.zeros((len(points), 2 * order.size, 2 * order.size))
        for run, (place, much) in enumerate(zip(scaled, amount, strict=True)):
            near = np.sqrt(3.0) * np.abs(place[:, None] - place) / LENGTH
            half = much[:, None] * harmonics
            covariance[run] = half.T @ ((1.0 + near) * np.exp(-near)) @ half
        moved = harmonics.T @ (tangent * scale[:, None, :])
        covariance += moved @ moved.swapaxes(1, 2)
        diagonal = np.arange(2 * order.size)
        covariance[:, diagonal, diagonal] += np.tile(power, 2)
        lower = np.asarray(np.linalg.cholesky(covariance), dtype=float)
        volume = -float(np.sum(np.log(lower[:, diagonal, diagonal])))
        return cls(harmonics, lower, np.linalg.inv(lower), volume)

    def __call__(self, rows: FloatArray) -> FloatArray:
        """Return whitened rows (..., n)."""
        return self.white(self.reduced(rows))

    def reduced(self, rows: FloatArray) -> FloatArray:
        """Return the harmonics of rows (..., n_runs, n_phi), which no size of the misfit changes.

        Returns
        -------
        shape (n_runs, n_harmonics, ...)
        """
        found = np.asarray(rows @ self.harmonics)
        return np.ascontiguousarray(np.moveaxis(found, (-2, -1), (0, 1)))

    def white(self, reduced: FloatArray) -> FloatArray:
        """Return whitened rows (..., n) of what `reduced` gave."""
        n_runs, n_harmonics, *rows = reduced.shape
        white = self.inverse @ reduced.reshape(n_runs, n_harmonics, -1)
        return np.moveaxis(white, 2, 0).reshape(*rows, -1)

    def take(self, index: slice) -> "Whitener":
        """Return the whitening of some runs."""
        lower = self.lower[index]
        diagonal = np.diagonal(lower, axis1=1, axis2=2)
        return Whitener(self.harmonics, lower, self.inverse[index], -float(np.log(diagonal).sum()))

    def coloured(self, white: FloatArray) -> FloatArray:
        """Return waveforms (k, n_runs, n_phi) whose whitened rows are these, (k, n)."""
        by_run = np.moveaxis(white.reshape(len(white), *self.lower.shape[:2]), 0, 2)
        return np.asarray(np.moveaxis(self.lower @ by_run, 2, 0) @ self.harmonics.T)
