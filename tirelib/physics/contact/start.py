"""A first closed-form estimate of the patch, for `tirelib.physics.contact.free_boundary`.

Near the edge the ring is taken as a straight, tensioned beam on a foundation and the patch as long,

    A u'''' - B u'' + C u + k_t (u - g) [in the patch] = 0,    g = R0 phi^2 / 2 - d0,

with A n^4 + B n^2 + C through three harmonics of the ring's inverse compliance. Both sides decay
away from the edge; u to u''' are continuous and u = g there, which leaves one quadratic equation
for the edge. In its lowest harmonics the closed ring gives way less than such a beam; that adds to
the deflection in proportion to the load. Only the start of an iteration depends on all this.
"""

from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.physics.contact.tread import Tread
from tirelib.physics.ring.compliance import Compliance

_HARMONICS = (4, 10, 20)
_STEPS = 3
_LOAD_POWER = 0.75
"""About the inverse of the load's growth with deflection, d0^1.2 to d0^1.5."""


@dataclass(frozen=True)
class EdgeEstimate:
    """The edge as the root of square * a^2 + linear * a + (constant - slope * d0) = 0."""

    square: FloatArray
    linear: FloatArray
    constant: FloatArray
    slope: FloatArray
    tilt: tuple[FloatArray, FloatArray, FloatArray]
    decay: tuple[FloatArray, FloatArray]
    free_radius: FloatArray
    foundation: FloatArray
    bulge: FloatArray
    lag: FloatArray
    """Angle by which the damped belt answers late; the patch moves toward the entry by as much."""

    @classmethod
    def of(cls, compliance: Compliance, tread: Tread) -> "EdgeEstimate | None":
        """Return the estimate, or None when the ring has too few harmonics for it."""
        if compliance.n_modes < _HARMONICS[-1]:
            return None
        r0 = np.asarray(tread.free_radius, dtype=float)
        x, y, z = (float(n) ** 2 for n in _HARMONICS)
        ky, kz, k0 = (1.0 / compliance.radial[:, n].real for n in (*_HARMONICS[1:], _HARMONICS[0]))
        first = (ky - k0) / (y - x)
        a = ((kz - ky) / (z - y) - first) / (z - x)
        b = first - a * (x + y)
        c = k0 - x * (b + a * x)
        soft, stiff = c / a, (c + tread.normal_stiffness) / a
        p, p2 = np.sqrt(soft), np.sqrt(stiff)  # product of the two decay rates
        s, s2 = np.sqrt(b / a + 2.0 * p), np.sqrt(b / a + 2.0 * p2)  # their sum
        follow = 1.0 - soft / stiff
        rest = b / a * follow * r0 / stiff
        both = s + s2
        by_gap, by_angle = soft / p2 - p, s2 * follow * r0
        fixed = -follow * r0 - p2 * rest
        gain = (s * both - p + p2) / both
        slope = gain * by_gap + both * p
        return cls(
            0.5 * r0 * slope,
            gain * by_angle - p2 * follow * r0,
            gain * fixed + s2 * follow * r0,
            slope,
            (by_gap / both, by_angle / both, fixed / both),
            (s, p),
            r0,
            c * compliance.radius,
            _bulge(compliance, a, b, c),
            -np.angle(compliance.radial[:, _HARMONICS[1]]) / _HARMONICS[1],
        )

    def half_angle(self, d0: FloatArray) -> FloatArray:
        """Return the half contact angle for deflections, [rad]; NaN where there is no root."""
        beam = d0
        for _ in range(_STEPS):
            beam = d0 + self.bulge * self._load(beam)
        return self._half_angle(beam)

    def for_load(self, vertical_load: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return deflection [m] and half contact angle [rad]; NaN where the estimate fails."""
        beam = np.full(vertical_load.shape, 0.02)
        for _ in range(_STEPS):
            ratio = vertical_load / self._load(beam)
            beam = beam * np.clip(ratio, 0.02, 50.0) ** _LOAD_POWER
        return beam - self.bulge * vertical_load, self._half_angle(beam)

    def _half_angle(self, beam: FloatArray) -> FloatArray:
        inner = self.linear**2 - 4.0 * self.square * (self.constant - self.slope * beam)
        out: FloatArray = 0.5 * (np.sqrt(inner) - self.linear) / self.square
        return out

    def _load(self, beam: FloatArray) -> FloatArray:
        """Return the load that the beam's foundation carries, [N]."""
        a = self._half_angle(beam)
        gap = 0.5 * self.free_radius * a**2 - beam
        tilt = self.tilt[0] * gap + self.tilt[1] * a + self.tilt[2]
        inside = a * (self.free_radius * a**2 / 6.0 - beam)
        outside = (tilt + self.decay[0] * gap) / self.decay[1]
        out: FloatArray = -2.0 * self.foundation * (inside + outside)
        return out


def _bulge(compliance: Compliance, a: FloatArray, b: FloatArray, c: FloatArray) -> FloatArray:
    """Return how much less the ring gives way than the beam, per load, in the lowest harmonics."""
    n2 = np.arange(_HARMONICS[0]) ** 2.0
    beam = 1.0 / (a[:, None] * n2**2 + b[:, None] * n2 + c[:, None])
    less = beam - compliance.radial[:, : _HARMONICS[0]].real
    out: FloatArray = (less.sum(axis=1) - 0.5 * less[:, 0]) / (np.pi * compliance.radius)
    return out
