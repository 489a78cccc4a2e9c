"""Constants of the rolling ring at every operating point."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.core.errors import ParameterError

_POSITIVE = frozenset(
    {"radius", "free_radius", "EA", "GA", "EI", "mass", "k_t", "thickness", "half_width", "load"}
)
_SIGNED = frozenset({"tension", "torque", "hardening", "omega", "poisson", "softening"})
STIFFEST = 1e8
"""EA and GA that stand for infinite ones, [N]: strains below 1e-4."""


@dataclass(frozen=True, slots=True, eq=False)
class Constants:
    """Belt, sidewall, tread and operating point; arrays of shape (n_points,), SI.

    Attributes
    ----------
    radius, free_radius : [m]
        R of the neutral line, R0 of the tread's middle.
    EA, GA, EI : [N], [N], [N m^2]
    mass, rotary_inertia : [kg/m], [kg m]
    inflation : [N/m]
        p b: pressure times the width that carries it.
    tension : [N]
        Tension of the belt beside p b R; a radial force of the sidewalls holds it
        (`tirelib.physics.rolling.belt`).
    k_u, k_v : [N/m^2]
        Sidewall, radial and tangential.
    softening : [1/m]
        c of the sidewall's radial tangent stiffness k_u exp(c u), u outward.
    dashpots : [-]
        lambda of c = 2 lambda sqrt(k rho A), for k_u and k_v.
    k_t : [N/m^2]
        Tread, normal, when the whole width touches.
    hardening, thickness : [-], [m]
        Growth of k_t when the whole thickness of the tread is pressed.
    crown, half_width : [1/m], [m]
        Curvature of the tread across the width; half of the width.
    k_s : [N/m^2]
        Tread, in shear.
    poisson : [-]
        nu / (1 - nu) of the tread: what it grows thicker as the belt compresses it along the
        circumference, and what it pushes along the belt as the road compresses it.
    friction : [-]
    creep : [-]
        Slip, over the road's speed, at which friction has 71 % of its full value; zero sticks.
    omega, load, torque : [rad/s], [N], [N m]
        Values of the wheel; a torque that drives is positive.
    """

    radius: FloatArray
    free_radius: FloatArray
    EA: FloatArray
    GA: FloatArray
    EI: FloatArray
    mass: FloatArray
    rotary_inertia: FloatArray
    inflation: FloatArray
    tension: FloatArray
    k_u: FloatArray
    k_v: FloatArray
    softening: FloatArray
    dashpots: FloatArray
    k_t: FloatArray
    hardening: FloatArray
    thickness: FloatArray
    crown: FloatArray
    half_width: FloatArray
    k_s: FloatArray
    poisson: FloatArray
    friction: FloatArray
    creep: FloatArray
    omega: FloatArray
    load: FloatArray
    torque: FloatArray

    @classmethod
    def of(cls, **values: Any) -> "Constants":
        """Return constants with every field spread over the points; infinite EA, GA are capped."""
        named = {name: np.asarray(values[name], dtype=float) for name in cls.__slots__}
        (n,) = np.broadcast_shapes((1,), *{value.shape for value in named.values()})
        for name, value in named.items():
            if value.shape != (n,):
                named[name] = np.full(n, value)
        for name in ("EA", "GA"):
            named[name] = np.minimum(named[name], STIFFEST)
        return cls(**named)

    def __len__(self) -> int:
        return int(self.load.size)

    def but(self, **values: Any) -> "Constants":
        """Return the constants with some replaced."""
        return replace(self, **values)

    def take(self, index: Any) -> "Constants":
        """Return the constants of some points."""
        return Constants(*[getattr(self, name)[index] for name in self.__slots__])

    def check(self) -> None:
        """Refuse constants that no tire has.

        Raises
        ------
        ParameterError
            Names the constant, the point and what is allowed.
        """
        for name in self.__slots__:
            value = getattr(self, name)
            bad = ~np.isfinite(value)
            if name in _POSITIVE:
                bad |= value <= 0.0
            elif name not in _SIGNED:
                bad |= value < 0.0
            if bad.any():
                point = int(np.flatnonzero(bad)[0])
                sign = "> 0" if name in _POSITIVE else ">= 0"
                sign = "a finite number" if name in _SIGNED else f"a finite number {sign}"
                raise ParameterError(
                    f"rolling ring: {name} = {value[point]:.6g} at point {point}; {sign} is "
                    "needed; check the tire's value and its dependence on pressure and deflection",
                    point=point,
                )
        flat = self.free_radius <= self.radius
        if flat.any():
            point = int(np.flatnonzero(flat)[0])
            raise ParameterError(
                f"rolling ring: point {point} has h_0 = free radius - ring radius = "
                f"{1e3 * (self.free_radius - self.radius)[point]:.2f} mm; the tread must stand "
                "outside the belt; check both radii",
                point=point,
            )

    @property
    def thickening(self) -> FloatArray:
        """Growth of the tread's thickness with the sections' turn psi', (n_points,), [m]."""
        lever = self.free_radius - self.radius - 0.5 * self.thickness
        return self.poisson * self.thickness * lever / (self.radius + lever)

    @property
    def grips(self) -> BoolArray:
        """Points whose tread holds on to the road."""
        return np.asarray((self.k_s > 0.0) & (self.friction > 0.0))
