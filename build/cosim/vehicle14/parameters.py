"""Masses, geometry, springs and dampers of the vehicle; a mid-size front-wheel driven car."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from tirelib.core.arrays import FloatArray

WHEELS = ("FL", "FR", "RL", "RR")
"""Order of the wheels in every array."""
GRAVITY = 9.81
_FRONT = np.array([1.0, 1.0, 0.0, 0.0])
_LEFT = np.array([1.0, -1.0, 1.0, -1.0])
_OPPOSITE = np.array([1, 0, 3, 2])


@dataclass(frozen=True)
class VehicleParameters:
    """A vehicle; pairs are (front, rear).

    Attributes
    ----------
    sprung_mass : float, [kg]
    unsprung_mass : pair of float, [kg]
        Mass of one wheel.
    inertia : tuple of 3 floats, [kg m^2]
        Inertia of the sprung mass in roll, pitch and yaw.
    spin_inertia : float, [kg m^2]
        Inertia of one wheel about its axle.
    front, rear : float, [m]
        From the sprung mass's centre of gravity to the axles.
    track : pair of float, [m]
    height : float, [m]
        Centre of gravity of the sprung mass above the road, at rest.
    spring, damper, stabilizer : pair of float, [N/m], [N s/m], [N/m]
        At the wheel; the stabilizer's force is its rate times the difference of the travels.
    tire_spring, tire_damper : float, [N/m], [N s/m]
        Vertical.
    tire_radius : float, [m]
        Unloaded.
    rolling_radius : pair of float, [m], [m/N]
        R_e at no load, and its change with the load.
    relaxation : pair of float, [m]
        Relaxation length of slip angle and slip ratio.
    drag : float, [N s^2/m^2]
        Air drag over squared speed, at the centre of gravity.
    brake_band : float, [rad/s]
        Turn rate at which a brake has 76 % of its torque: it fades towards standstill.
    """

    sprung_mass: float = 1380.0
    unsprung_mass: tuple[float, float] = (42.0, 38.0)
    inertia: tuple[float, float, float] = (520.0, 2150.0, 2400.0)
    spin_inertia: float = 1.1
    front: float = 1.15
    rear: float = 1.55
    track: tuple[float, float] = (1.55, 1.54)
    height: float = 0.57
    spring: tuple[float, float] = (27e3, 25e3)
    damper: tuple[float, float] = (2400.0, 2200.0)
    stabilizer: tuple[float, float] = (16e3, 8e3)
    tire_spring: float = 2.2e5
    tire_damper: float = 150.0
    tire_radius: float = 0.3145
    rolling_radius: tuple[float, float] = (0.3115, -7e-7)
    relaxation: tuple[float, float] = (0.3, 0.1)
    drag: float = 0.4
    brake_band: float = 1.0

    def problems(self) -> list[str]:
        """Return what is wrong with the numbers: name, what was given, what is allowed."""
        may_be_zero = {"damper", "tire_damper", "stabilizer", "drag"}
        found = []
        for field in fields(self):
            values = np.atleast_1d(np.asarray(getattr(self, field.name), dtype=np.float64))
            if field.name == "rolling_radius":
                values = values[:1]
            low = values >= 0.0 if field.name in may_be_zero else values > 0.0
            if not np.all(low & np.isfinite(values)):
                least = ">= 0" if field.name in may_be_zero else "> 0"
                found.append(f"{field.name} = {getattr(self, field.name)}; it must be {least}")
        return found

    @cached_property
    def mass(self) -> float:
        """All of it [kg]."""
        return self.sprung_mass + 2.0 * sum(self.unsprung_mass)

    @cached_property
    def x(self) -> FloatArray:
        """Places of the wheels before the sprung mass's centre of gravity, shape (4,), [m]."""
        return np.where(_FRONT > 0.0, self.front, -self.rear)

    @cached_property
    def y(self) -> FloatArray:
        """Places of the wheels to the left of the middle, shape (4,), [m]."""
        return 0.5 * _LEFT * self.per_wheel(self.track)

    @cached_property
    def preload(self) -> FloatArray:
        """Force of the struts at rest, shape (4,), [N]."""
        share = self.per_wheel((self.rear, self.front)) / (self.front + self.rear)
        return 0.5 * self.sprung_mass * GRAVITY * share

    @cached_property
    def static_load(self) -> FloatArray:
        """Load of the tires at rest, shape (4,), [N]."""
        return self.preload + GRAVITY * self.per_wheel(self.unsprung_mass)

    @cached_property
    def z(self) -> FloatArray:
        """Places of the wheel centres above the centre of gravity at rest, shape (4,), [m]."""
        return self.tire_radius - self.static_load / self.tire_spring - self.height

    @cached_property
    def whole_height(self) -> float:
        """Centre of gravity of the whole vehicle above the road, at rest [m]."""
        wheel = self.z + self.height
        total = self.sprung_mass * self.height + self.per_wheel(self.unsprung_mass) @ wheel
        return float(total / self.mass)

    @staticmethod
    def per_wheel(pair: tuple[float, float]) -> FloatArray:
        """Return a pair (front, rear) as an array, shape (4,)."""
        return np.where(_FRONT > 0.0, pair[0], pair[1])

    @staticmethod
    def opposite(values: FloatArray) -> FloatArray:
        """Return the values of the other wheels of the axles, shape (..., 4)."""
        return values[..., _OPPOSITE]
