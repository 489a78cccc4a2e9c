"""The cost of a fit: whitened residuals, with delay and structural misfit eliminated, and priors.

A run's strain and deflection share the load and the pressure that it really had. The deflections
are therefore taken less what the strain already tells of those, and are then independent of it.

It is taken about one solution of the model: its tangents by the set points give the whitening, its
strain the shapes of delay and misfit. Their coefficients have a normal prior and enter linearly, so
they are eliminated exactly.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from scipy import linalg

from tirelib.arrays import BoolArray, FloatArray
from tirelib.campaign import Tolerance
from tirelib.identify.delay import STD, UNIT, by_delay
from tirelib.identify.discrepancy import Discrepancy
from tirelib.identify.random_effects import Whitening, scales, tangents, whitening_of
from tirelib.model.slopes import SolutionSlopes
from tirelib.model.solution import Solution
from tirelib.model.state import Operating
from tirelib.signal import LowPass
from tirelib.waveforms import GRID

LEAST_DEFLECTIONS = 3
ZERO = 5e-4
"""Common error of the measured deflections: free radius, [m]."""
DEPTH_SHARE = 0.03
"""Structural part of them, in proportion to the deflection."""
GROWTH = 5e-4
"""Growth of the free radius with speed squared, at 30 m/s, [m]."""


@dataclass(frozen=True, slots=True)
class Data:
    """What is fitted: the waveforms of one gage and, where measured, the deflections.

    Attributes
    ----------
    strain : shape (n_runs, n_phi), [-]
    points : Operating
    angle_std : shape (n_runs,), [rad]
    tolerance : Tolerance
    noise : float, [-]
    low_pass : LowPass
    deflection : shape (n_runs,), [m]
        Free radius less measured loaded radius; NaN where not measured.
    deflection_std : float, [m]
        Random part of it.
    """

    strain: FloatArray
    points: Operating
    angle_std: FloatArray
    tolerance: Tolerance
    noise: float
    low_pass: LowPass
    deflection: FloatArray
    deflection_std: float = 1e-4

    @property
    def with_deflection(self) -> bool:
        """Whether enough deflections are known."""
        return int(np.isfinite(self.deflection).sum()) >= LEAST_DEFLECTIONS


@dataclass(frozen=True, slots=True)
class Depth:
    """Whitens the deflections that were measured.

    Their errors: a random part, the load and the pressure that the run really had, a common zero,
    a structural part in proportion to the deflection, and growth of the free radius with speed.

    Attributes
    ----------
    known : shape (n_runs,)
        Where they were measured.
    gain : shape (n_runs, n_phi), [m]
        What a strain residual tells of the deflection's, through load and pressure.
    inverse : shape (n_known, n_known), [1/m]
        Inverse Cholesky factor of what is left.
    """

    known: BoolArray
    gain: FloatArray
    inverse: FloatArray

    @classmethod
    def about(
        cls,
        data: Data,
        depth: FloatArray,
        by_set_point: FloatArray,
        whiten: Whitening,
        tangent: FloatArray,
        scale: FloatArray,
    ) -> Self:
        """Return the whitening about a solution with deflections `depth`, (n_runs,).

        Parameters
        ----------
        by_set_point : shape (n_runs, 2), [m]
            Slopes of the deflection by relative load and pressure.
        whiten, tangent, scale
            Of the strain.
        """
        known = np.isfinite(data.deflection)
        # b: load, pressure, gain, angle in units of their deviations; strain A b, deflection d b
        moved = np.pad(by_set_point, ((0, 0), (0, 2))) * scale
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
        lower = linalg.cholesky(np.diag(random[known]) + common.T @ common, lower=True)
        inverse = linalg.solve_triangular(lower, np.eye(len(lower)), lower=True)
        return cls(known, gain, np.asarray(inverse))

    def __call__(self, strain: FloatArray, deflection: FloatArray) -> FloatArray:
        """Return whitened rows (n, n_known) of strain (n, n_runs, n_phi) and deflection."""
        left = deflection - np.einsum("rn,krn->kr", self.gain, strain)
        return np.asarray(left[:, self.known] @ self.inverse.T)


@dataclass(frozen=True, slots=True)
class Cost:
    """Cost about a solution.

    Attributes
    ----------
    data : Data
    prior_std : shape (n_free,)
    whiten : Whitening
    shapes : shape (n_shapes, n_runs, n_phi), [-]
        Rows of the delay, then of the structural misfit, each for one standard deviation.
    white_shapes : shape (n_shapes, n_rows)
        Whitened as `rows` does.
    inner : shape (n_shapes, n_shapes)
        Upper Cholesky factor of their normal matrix, prior included.
    depth : Depth or None
        None when deflections are not used.
    """

    data: Data
    prior_std: FloatArray
    whiten: Whitening
    shapes: FloatArray
    white_shapes: FloatArray
    inner: FloatArray
    depth: Depth | None

    @classmethod
    def about(
        cls,
        data: Data,
        prior_std: FloatArray,
        discrepancy: Discrepancy | None,
        free_radius: float,
        model: Solution,
        slopes: SolutionSlopes,
    ) -> Self:
        """Return the cost about a solution of the model and its slopes."""
        scale = scales(data.tolerance, data.angle_std)
        tangent = tangents(model.waveform, slopes.waveform[-2], slopes.waveform[-1])
        whiten = whitening_of(tangent, scale, data.noise)
        shapes = nuisance_shapes(discrepancy, model, data.points, free_radius)
        depth = None
        if data.with_deflection:
            depth = Depth.about(
                data, model.deflection, slopes.deflection[-2:].T, whiten, tangent, scale
            )
        empty = np.zeros((0, 0))
        bare = cls(data, prior_std, whiten, shapes, empty, empty, depth)
        flat = bare.rows(shapes, np.zeros(shapes.shape[:2]))
        return replace(
            bare, white_shapes=flat, inner=linalg.cholesky(flat @ flat.T + np.eye(len(flat)))
        )

    def rows(self, strain: FloatArray, deflection: FloatArray) -> FloatArray:
        """Return whitened rows of all that is measured.

        Parameters
        ----------
        strain : shape (n, n_runs, n_phi), [-]
        deflection : shape (n, n_runs), [m]

        Returns
        -------
        shape (n, n_runs * n_phi + n_known)
        """
        white = self.whiten(strain).reshape(len(strain), -1)
        if self.depth is None:
            return white
        return np.concatenate([white, self.depth(strain, deflection)], axis=1)

    def normal(
        self, model: Solution, slopes: SolutionSlopes, z: FloatArray
    ) -> tuple[FloatArray, FloatArray, float]:
        """Return normal matrix and gradient by the free coordinates, and the cost, at z."""
        k = self.prior_std.size
        rest = self.rows(*self._rest(model))
        every = np.concatenate([self.rows(slopes.waveform[:k], slopes.deflection[:k]), rest])
        half = self._eliminate(every)
        gram = every @ every.T - half.T @ half
        weight = 1.0 / self.prior_std**2
        normal = gram[:-1, :-1] + np.diag(weight)
        return normal, gram[:-1, -1] - weight * z, float(gram[-1, -1] + np.sum(weight * z**2))

    def value(self, model: Solution, z: FloatArray) -> float:
        """Return the cost of a solution at coordinates z."""
        white = self.rows(*self._rest(model))
        taken = np.sum(self._eliminate(white) ** 2)
        return float(np.sum(white**2) + np.sum((z / self.prior_std) ** 2) - taken)

    def misfit(self, model: Solution) -> FloatArray:
        """Return the structural misfit that serves the residual best, (n_runs, n_phi)."""
        return np.asarray(np.tensordot(self._weights(model)[1:], self.shapes[1:], axes=1))

    def delay(self, model: Solution) -> float:
        """Return the delay that the residual has beside what the data were made earlier by, [s]."""
        return STD * float(self._weights(model)[0])

    def error(self, model: Solution) -> float:
        """Return the rms of the whitened residual of the model alone."""
        return float(np.sqrt(np.mean(self.whiten(self.data.strain - model.waveform) ** 2)))

    def _weights(self, model: Solution) -> FloatArray:
        """Return the coefficients of the shapes that serve the residual best."""
        white = self.rows(*self._rest(model))
        return np.asarray(linalg.solve_triangular(self.inner, self._eliminate(white)[:, 0]))

    def _rest(self, model: Solution) -> tuple[FloatArray, FloatArray]:
        """Return measured less model of strain and deflection, as one row each."""
        rest = self.data.strain - model.waveform
        return rest[None], (self.data.deflection - model.deflection)[None]

    def _eliminate(self, white: FloatArray) -> FloatArray:
        """Return the part of whitened rows that delay and misfit take, as (n_shapes, n_rows)."""
        found: FloatArray = linalg.solve_triangular(
            self.inner, self.white_shapes @ white.T, trans="T"
        )
        return found


def nuisance_shapes(
    discrepancy: Discrepancy | None, model: Solution, points: Operating, free_radius: float
) -> FloatArray:
    """Return the shapes of delay and misfit about a solution, (n_shapes, n_runs, n_phi).

    Without a discrepancy the delay stands alone.
    """
    late = STD / UNIT * by_delay(model.waveform, np.asarray(points.omega))[None]
    if discrepancy is None:
        return late
    half = 0.6 * np.sqrt(2.0 * model.deflection / free_radius)
    return np.concatenate([late, discrepancy.columns(model.waveform, half, points, GRID)])
