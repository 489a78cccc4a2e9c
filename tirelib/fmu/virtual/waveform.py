"""Strain over the wheel angle: a mean and components, as splines, moved to a contact."""

import math
from functools import cached_property

import numpy as np
from scipy.ndimage import spline_filter1d

from tirelib.core.arrays import FloatArray
from tirelib.fmu.virtual.coordinates import half_angle, spline_weights, warped


class Waveforms:
    """Mean and components over an even grid of angles that starts at -pi, of every gage.

    Parameters
    ----------
    mean : array, shape (m, g)
    basis : array, shape (k, m, g)
    """

    def __init__(self, mean: FloatArray, basis: FloatArray) -> None:
        self._count, self._gages = len(basis), mean.shape[1]
        self._grid = len(mean)
        self._scale = self._grid / (2.0 * math.pi)
        both = np.concatenate((basis, mean[None]))
        found = spline_filter1d(np.moveaxis(both, 0, 2), axis=0, mode="grid-wrap")
        self.spline: FloatArray = np.ascontiguousarray(found)
        """Coefficients of cubic B-splines, the mean last, shape (m, g, k + 1)."""
        self._every = np.arange(self._gages)
        self._own = np.ones(self._count + 1)
        """Room for the scores of one condition, with a 1 behind."""

    @cached_property
    def _windows(self) -> FloatArray:
        """Four neighbours from every place on, shape (g, m, 4, k + 1); a view of the spline."""
        wrapped = np.concatenate((self.spline[-1:], self.spline, self.spline[:2]))
        own = np.ascontiguousarray(np.swapaxes(wrapped, 0, 1))
        four = np.lib.stride_tricks.sliding_window_view(own, 4, axis=1)
        return np.swapaxes(four, 2, 3)

    def mixed(self, scores: FloatArray) -> FloatArray:
        """Return spline coefficients of one condition, shape (m, g), for `many` at many angles."""
        return np.asarray(self.spline[:, :, :-1] @ scores + self.spline[:, :, -1])

    def many(
        self,
        scores: FloatArray,
        squares: FloatArray,
        middles: FloatArray,
        angle: FloatArray,
        mixed: FloatArray | None = None,
    ) -> FloatArray:
        """Return strain, shape (n, g).

        Parameters
        ----------
        scores : array, shape (n, k) or (1, k)
        squares, middles : array, shape (n, g) or (1, g), [rad^2], [rad]
            Squared half contact angle and middle of the contact.
        angle : array, shape (n,), [rad]
        mixed : array, optional
            Result of `mixed`, where there is one row: spares the sum over the components.
        """
        place = (warped(angle[:, None], middles, half_angle(squares)) + np.pi) * self._scale
        first = np.floor(place)
        rows = (first.astype(np.intp)[..., None] + np.arange(-1, 3)) % self._grid
        weights = np.stack(spline_weights(place - first), axis=-1)
        gage = np.arange(self._gages)[:, None]
        if mixed is not None:
            return np.asarray((mixed[rows, gage] * weights).sum(axis=2))
        own = np.ones((len(scores), 1, self._count + 1))
        own[:, 0, :-1] = scores
        values = np.matmul(weights[..., None, :], self.spline[rows, gage])[..., 0, :]
        return np.asarray((values * own).sum(axis=2))

    def one(
        self, scores: FloatArray, squares: list[float], middles: list[float], angle: float
    ) -> list[float]:
        """Return the strain of every gage at one angle under one condition; as `many` does."""
        self._own[:-1] = scores
        starts, weights = [], []
        for square, middle in zip(squares, middles, strict=True):
            turned = warped(angle, middle, half_angle(square, math), math)
            place = (turned + math.pi) * self._scale
            first = math.floor(place)
            starts.append(first % self._grid)
            weights.append(spline_weights(place - first))
        values = (self._windows[self._every, starts] @ self._own).tolist()
        return [
            a * p + b * q + c * r + d * s
            for (a, b, c, d), (p, q, r, s) in zip(values, weights, strict=True)
        ]
