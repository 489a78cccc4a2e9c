"""The least squares of `tirelib.inference.identify.brush_fit`: residuals, slopes, covariance."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from tirelib.core.arrays import FloatArray, IntArray
from tirelib.core.parameters import Tire
from tirelib.inference.identify.brush_law import SPECS, Reference, Spec, predict
from tirelib.inference.identify.force_data import ForceData
from tirelib.physics.brush.predict import PointForces

ASSUMED_HALF_LENGTH = 0.06
"""Where nothing tells it, [m]; c_py is then not identifiable, c_py a^2 is."""
MOMENT_SCALE = 10.0
"""By which Mz counts less than its misfit says, beside Fx or Fy."""
ROBUST = 3.0
"""Misfit, in robust standard deviations, from which a point counts less (Huber)."""
_STEP = 1e-6
_RANK = 1e-9
_QUANTILE, _NORMAL_QUANTILE = 0.9, 1.6449
"""Quantile of the size of a misfit, and that of a standard normal one."""


@dataclass(frozen=True, slots=True, eq=False)
class BrushProblem:
    """The least squares problem in z: logarithms, or numbers over their size."""

    data: ForceData
    forces: tuple[str, ...]
    names: tuple[str, ...]
    fixed: Mapping[str, tuple[float, str]]
    reference: Reference
    tire: Tire | None  # its ring gives the half length of the contact, if any
    half: FloatArray | None
    scale: FloatArray | None = None  # of each force

    def take(self, index: IntArray) -> "BrushProblem":
        """Return the problem of some points."""
        half = None if self.half is None else self.half[index]
        return replace(self, data=self.data.take(index), half=half)

    def start(self) -> FloatArray:
        """Return a start: C from the steepest quarter of Fy over slip, mu from the largest."""
        d = self.data
        a = self.fixed.get("half_length", (ASSUMED_HALF_LENGTH, ""))[0]
        size = a if self.half is None else float(np.median(self.half))
        used = np.hypot(np.nan_to_num(d.Fx), np.nan_to_num(d.Fy)) / d.load
        friction = float(np.clip(np.quantile(used, 0.995), 0.2, 2.0)) * 1.05
        slip = np.hypot(np.tan(d.slip_angle), d.slip_ratio / np.maximum(1.0 + d.slip_ratio, 0.1))
        small = (slip > 0.003) & (slip < 0.05)
        if not small.any():
            small = slip > 0.0
        stiffness = float(np.median(used[small] * d.load[small] / slip[small]))
        c = max(1.3 * stiffness, 100.0) / (2.0 * size**2)
        start = {
            "lateral_stiffness": c,
            "longitudinal_stiffness": c,
            "friction": friction,
            "half_length": size,
            "yaw_compliance": 2e-5,
            "lateral_compliance": 2e-6,
        }
        value = np.array([start.get(name, 0.0) for name in self.names])
        low, high = self.bounds
        return np.clip(self.z_of(value), low + 1e-6, high - 1e-6)

    def at(self, z: FloatArray) -> dict[str, float]:
        """Return every parameter by name, SI."""
        values = {name: value for name, (value, _) in self.fixed.items()}
        return values | dict(zip(self.names, self.values_of(z).tolist(), strict=True))

    def predicted(self, z: FloatArray) -> PointForces:
        """Return the forces at z."""
        return predict(self.at(z), self.data, self.reference, self.half)

    def residual(self, z: FloatArray) -> FloatArray:
        """Return misfit over scale, one row per force, zero where not measured."""
        found = self.predicted(z)
        rows = [np.nan_to_num(getattr(found, n) - getattr(self.data, n)) for n in self.forces]
        scale = self._start_scale() if self.scale is None else self.scale
        return np.asarray(np.stack(rows) / scale[:, None])

    def jacobian(self, z: FloatArray) -> FloatArray:
        """Return its derivative, shape (n_forces * n, p), by differences into the range."""
        here = self.residual(z)
        _, high = self.bounds
        columns = []
        for k in range(z.size):
            step = np.zeros_like(z)
            step[k] = _STEP if z[k] + _STEP < high[k] else -_STEP
            columns.append((self.residual(z + step) - here).ravel() / step[k])
        return np.stack(columns, axis=1)

    def solve(self, z: FloatArray, robust: float | None) -> FloatArray:
        """Return the best z from a start; `robust` is the misfit from which points count less."""

        def residual(x: FloatArray) -> FloatArray:
            return self.residual(x).ravel()

        found = least_squares(
            residual,
            z,
            self.jacobian,
            bounds=self.bounds,
            loss="linear" if robust is None else "huber",
            f_scale=1.0 if robust is None else robust,
            xtol=1e-10,
            ftol=1e-10,
            gtol=1e-10,
            max_nfev=200,
        )
        return np.asarray(found.x, dtype=np.float64)

    def misfit(self, z: FloatArray) -> FloatArray:
        """Return the scale of each force: the size of its misfit, a tenth of outliers aside.

        The median would not do: forces that are zero at half of the points (Fy of straight braking)
        fit there whatever the brush, and their small misfit would outweigh all others.
        """
        found = self.predicted(z)
        floor = 1e-6 * self._start_scale()
        out = []
        for name in self.forces:
            error = getattr(found, name) - getattr(self.data, name)
            out.append(np.nanquantile(np.abs(error), _QUANTILE) / _NORMAL_QUANTILE)
        scale = np.maximum(np.array(out), floor)
        moment = np.array([name == "Mz" for name in self.forces])
        if not moment.all():
            scale[~moment] = np.sqrt(np.mean(scale[~moment] ** 2))
            scale[moment] *= MOMENT_SCALE
        return np.asarray(scale, dtype=np.float64)

    def covariance(self, z: FloatArray, robust: float | None) -> FloatArray:
        """Return the covariance of z, by blocks; infinite variance where nothing is known."""
        r, J = self.residual(z).ravel(), self.jacobian(z)
        weight = np.ones_like(r) if robust is None else robust / np.maximum(np.abs(r), robust)
        J, r = J * np.sqrt(weight)[:, None], r * np.sqrt(weight)
        norm = np.linalg.norm(J, axis=0)
        norm = np.where(norm > 0.0, norm, 1.0)
        _, s, right = np.linalg.svd(J / norm, full_matrices=False)
        good = s > _RANK * s[0]
        inverse = (right[good].T / s[good] ** 2) @ right[good] / np.outer(norm, norm)
        block = np.tile(self.data.block, len(self.forces))
        n, p = r.size, z.size
        blocks = int(block.max()) + 1
        if blocks > 2 * p:
            scores = np.stack([np.bincount(block, J[:, k] * r) for k in range(p)], axis=1)
            inside = scores.T @ scores * blocks / (blocks - 1) * (n - 1) / max(n - p, 1)
            out = np.asarray(inverse @ inside @ inverse, dtype=np.float64)
        else:
            out = np.asarray(inverse * float(r @ r) / max(n - p, 1), dtype=np.float64)
        lost = (right[~good] ** 2).sum(axis=0) > 1e-6
        out[lost, lost] = np.inf
        return out

    def values_of(self, z: FloatArray) -> FloatArray:
        """Return the parameters in SI."""
        return np.array([float(s.value(at)) for s, at in zip(self._specs, z, strict=True)])

    def slope_of(self, z: FloatArray) -> FloatArray:
        """Return their derivative by z."""
        return np.array([s.slope(v) for s, v in zip(self._specs, self.values_of(z), strict=True)])

    def z_of(self, value: FloatArray) -> FloatArray:
        """Return z of parameters in SI."""
        return np.array([s.z(v) for s, v in zip(self._specs, value, strict=True)])

    @property
    def _specs(self) -> list[Spec]:
        return [SPECS[name] for name in self.names]

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """The ends of z."""
        low, high = np.array([(spec.low, spec.high) for spec in self._specs]).T
        return self.z_of(low), self.z_of(high)

    def _start_scale(self) -> FloatArray:
        rms = [np.sqrt(np.nanmean(getattr(self.data, name) ** 2)) for name in self.forces]
        return np.asarray(0.05 * np.maximum(np.array(rms), 1e-3), dtype=np.float64)
