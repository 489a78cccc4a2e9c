"""What noise and set points do to the waveforms and deflections of runs, as a whitening.

A run's strain and deflection share the load and the pressure that it really had. The deflections
are therefore taken less what the strain already tells of those, and are then independent of it.

It is taken about one solution of the model: its tangents by the set points.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy import linalg

from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.inference.identify.campaign_data import Data
from tirelib.inference.identify.random_effects import Whitening, scales, tangents, whitening_of

ZERO = 5e-4
"""Common error of the measured deflections: free radius, [m]. This size and the two below are
assumed; what half and double of them do has not been measured."""
DEPTH_SHARE = 0.03
"""Structural part of them, in proportion to the deflection."""
GROWTH = 5e-4
"""Growth of the free radius with speed squared, at 30 m/s, [m]."""


@dataclass(frozen=True, slots=True)
class RunWhitening:
    """Turns rows of all that is measured into rows of unit covariance.

    A row holds the strain of all runs, then the deflections that take part. Errors of these are a
    random part, the load and the pressure that the run really had, a common zero, a structural
    part in proportion to the deflection, and growth of the free radius with speed.

    Attributes
    ----------
    strain : Whitening
    known : shape (n_runs,)
        Whether the deflection of a run is measured and counts.
    gain : shape (n_runs, n_phi), [m]
        What a strain residual tells of the deflection's, through load and pressure.
    inverse : shape (n_known, n_known), [1/m]
        Inverse Cholesky factor of what is left.
    """

    strain: Whitening
    known: BoolArray
    gain: FloatArray
    inverse: FloatArray

    @classmethod
    def about(
        cls,
        data: Data,
        waveform: FloatArray,
        by_set_point: FloatArray,
        depth: FloatArray,
        depth_by_set_point: FloatArray,
    ) -> Self:
        """Return the whitening about a solution of the model.

        Parameters
        ----------
        waveform : shape (n_runs, n_phi), [-]
        by_set_point : shape (2, n_runs, n_phi), [-]
            Slopes of the waveform by relative load and pressure.
        depth : shape (n_runs,), [m]
            Deflections.
        depth_by_set_point : shape (2, n_runs), [m]
        """
        scale = scales(data.tolerance, data.angle_std)
        tangent = tangents(waveform, *by_set_point)
        whiten = whitening_of(tangent, scale, data.noise)
        known = np.isfinite(data.deflection) & data.with_deflection
        # b: load, pressure, gain, angle in units of their deviations; strain A b, deflection d b
        moved = np.pad(depth_by_set_point.T, ((0, 0), (0, 2))) * scale
        inside = whiten.basis.swapaxes(1, 2) @ (tangent * scale[:, None, :])
        half = whiten.inverse @ inside
        gain = np.einsum(
            "rni,rji,rjk,rk->rn", whiten.basis, whiten.inverse, half, moved, optimize=True
        )
        told = np.einsum("rjk,rk->rj", half, moved)
        random = data.deflection_std**2 + np.sum(moved**2, axis=1) - np.sum(told**2, axis=1)
        speed = np.nan_to_num(data.points.speed[known]) / 30.0
        common = np.stack(
            [np.full(speed.size, ZERO), DEPTH_SHARE * depth[known], GROWTH * speed**2]
        )
        covariance = np.diag(random[known]) + common.T @ common
        lower = linalg.cholesky(covariance, lower=True)
        inverse = linalg.solve_triangular(lower, np.eye(len(lower)), lower=True)
        return cls(whiten, known, gain, np.asarray(inverse))

    def __call__(self, rows: FloatArray) -> FloatArray:
        """Return whitened rows of rows (..., n_runs * n_phi + n_known)."""
        runs, angles = self.strain.basis.shape[:2]
        flat = rows.reshape(-1, rows.shape[-1])
        strain = flat[:, : runs * angles].reshape(len(flat), runs, angles)
        told = np.einsum("rn,krn->kr", self.gain[self.known], strain[:, self.known])
        deep = (flat[:, runs * angles :] - told) @ self.inverse.T
        white = self.strain(strain).reshape(len(flat), runs * angles)
        return np.asarray(np.concatenate([white, deep], axis=1).reshape(rows.shape))
