"""Three families of tires that share no code with the library's brush, nor with each other.

- `Magic`: a Magic Formula with random shape, curvature, shifts and trail (Pacejka, Tire and Vehicle
  Dynamics, 3rd ed., sections 4.3.2 and 13.1, and the ranges of published parameter files).
- `String`: bristles on a stretched string, solved node by node (the same, section 5.3).
- `Strips`: strips of bristles across the width under their own share of the load, with a friction
  that falls once a bristle slides (the same, section 3.3). The carcass turns only where that is
  hidden: it is an effect of the catalogue, and a tire that has it is not plain.

Signs are those of ISO 8855. A hidden effect comes in as `Changes`: factors of friction and
stiffness, a shift of the slip angle and a force beside the contact's, each of shape (n,).
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from tirelib.core.arrays import FloatArray


@dataclass(frozen=True)
class Setting:
    """Conditions of samples, arrays of shape (n,), SI."""

    load: FloatArray
    pressure: FloatArray
    slip_angle: FloatArray
    slip_ratio: FloatArray
    camber: FloatArray
    speed: FloatArray
    temperature: FloatArray
    slip_rate: FloatArray
    order: FloatArray


@dataclass(frozen=True)
class Changes:
    """What a hidden effect does at each sample."""

    friction: FloatArray
    stiffness: FloatArray
    angle: FloatArray
    side: FloatArray
    flatter: FloatArray
    turn: FloatArray


class Tire(Protocol):
    """A tire; `nominal` is its usual load [N]."""

    nominal: float

    def forces(self, at: Setting, by: Changes) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return Fx, Fy [N] and Mz [N m], shape (n,)."""


class Magic:
    """A Magic Formula tire."""

    name = "magic"

    def __init__(self, random: np.random.Generator) -> None:
        u = random.uniform
        self.nominal = float(u(1500.0, 5500.0))
        self.mu, self.mu_x = u(0.9, 1.3), u(0.9, 1.3)
        self.slope, self.power = u(10.0, 18.0), u(0.55, 1.0)
        self.slope_x, self.bend = u(14.0, 26.0), random.normal(0.0, 0.02)
        self.shape, self.curve, self.skew = u(1.15, 1.45), u(-1.0, 0.4), u(-0.1, 0.1)
        self.shape_x, self.curve_x = u(1.3, 1.65), u(-0.8, 0.5)
        self.shift, self.cone = random.normal(0.0, 0.003), random.normal(0.0, 0.004)
        self.trail, self.trail_b, self.trail_c = u(0.02, 0.045), u(5.0, 12.0), u(1.0, 1.25)

    def forces(self, at: Setting, by: Changes) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the forces; combined slip by the size of the slip, as in the similarity method."""
        share = at.load / self.nominal
        bend = 1.0 + self.bend * np.log(share) ** 2
        slope = self.slope * self.nominal * share**self.power * bend * by.stiffness
        slope_x = self.slope_x * at.load * share ** (self.power - 1.0) * by.stiffness
        across = np.tan(at.slip_angle + by.angle + self.shift)
        along = at.slip_ratio
        peak, peak_x = self.mu * by.friction * at.load, self.mu_x * by.friction * at.load
        x, y = along * slope_x / peak_x, across * slope / peak
        size = np.hypot(x, y)
        unit = np.where(size > 0.0, size, 1.0)
        curve = self.curve * (1.0 + self.skew * np.sign(y)) - 0.6 * by.flatter
        side = peak * _magic(size, self.shape - 0.1 * by.flatter, curve)
        drive = peak_x * _magic(size, self.shape_x - 0.1 * by.flatter, self.curve_x)
        Fy = -side * y / unit
        arm = self.trail * np.sqrt(share) * (1.0 - 0.5 * by.turn)
        arm = arm * np.cos(self.trail_c * np.arctan(self.trail_b * across))
        Mz = -arm * Fy * np.cos(at.slip_angle)
        return drive * x / unit, Fy + self.cone * at.load + by.side, Mz


def _magic(x: FloatArray, c: FloatArray | float, e: FloatArray | float) -> FloatArray:
    """Return the Magic Formula of slope and peak one."""
    b = x / c
    out: FloatArray = np.sin(c * np.arctan(b - e * (b - np.arctan(b))))
    return out


class String:
    """Bristles on a stretched string."""

    name = "string"
    nodes, steps = 40, 150

    def __init__(self, random: np.random.Generator) -> None:
        u = random.uniform
        self.nominal = float(u(1500.0, 5500.0))
        self.mu, self.sliding = u(0.9, 1.3), u(0.85, 1.0)
        self.half, self.power = u(0.045, 0.08), u(0.35, 0.6)
        self.order, self.tilt = u(1.6, 6.0), random.normal(0.0, 0.1)
        self.slope, self.slope_x = u(10.0, 18.0), u(14.0, 26.0)
        self.relax, self.soft = u(1.0, 2.5), u(0.3, 1.2)
        self.shift, self.cone = random.normal(0.0, 0.003), random.normal(0.0, 0.004)

    def forces(self, at: Setting, by: Changes) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the forces: what each node carries is found by relaxed steps."""
        half = self.half * (at.load / self.nominal) ** self.power
        place = (np.arange(self.nodes) + 0.5) / self.nodes  # from the leading edge
        x = 1.0 - 2.0 * place
        order = (self.order + 2.0 * by.flatter)[:, None]
        shape = (1.0 - np.abs(x) ** order) * (1.0 + self.tilt * x)
        width = 2.0 * half / self.nodes
        limit = shape / shape.sum(axis=1, keepdims=True) * at.load[:, None]
        limit = limit * (self.mu * by.friction)[:, None]
        # force of a node [N] per deflection, so that a stiff belt would have this slope
        c = self.slope * self.nominal / (2.0 * self.half**2) * by.stiffness * width
        c_x = self.slope_x * self.nominal / (2.0 * self.half**2) * by.stiffness * width
        s = place * 2.0 * half[:, None]
        apart = np.abs(place[:, None] - place) * 2.0
        # string: each node moves those near it; `soft` is how far over the bristles' deflection
        green = np.exp(-apart / self.relax) / self.nodes * self.soft
        rolling = np.maximum(1.0 + at.slip_ratio, 0.05)
        across = -np.tan(at.slip_angle + by.angle + self.shift)[:, None] * s / rolling[:, None]
        along = (at.slip_ratio / rolling)[:, None] * s
        q = np.zeros_like(limit)
        q_x = c_x[:, None] * along
        for _ in range(self.steps):
            belt = (q @ green) / c[:, None]
            lead = (q @ np.exp(-2.0 * place / self.relax))[:, None] / self.nodes * self.soft
            wanted = c[:, None] * (across - belt + lead / c[:, None])
            size = np.hypot(wanted, q_x)
            slid = np.maximum.accumulate(size > limit, axis=1)
            held = np.where(slid, self.sliding * limit, limit) / np.maximum(size, 1e-9)
            factor = np.where(slid, held, 1.0)
            new = wanted * factor
            change = float(np.abs(new - q).max())
            q = q + 0.4 * (new - q)
            if change < 1e-4 * float(limit.max()):
                break
        drive = (q_x * factor).sum(axis=1)
        side = q.sum(axis=1)
        arm = half[:, None] * x
        Mz = (q * arm).sum(axis=1) * (1.0 - 0.5 * by.turn)
        return drive, side + self.cone * at.load + by.side, Mz


class Strips:
    """Strips of bristles across the width."""

    name = "strips"
    nodes, count, steps = 60, 5, 60

    def __init__(self, random: np.random.Generator) -> None:
        u = random.uniform
        self.nominal = float(u(1500.0, 5500.0))
        self.mu, self.kinetic, self.settle = u(0.95, 1.35), u(0.8, 1.0), u(0.3, 3.0)
        self.half, self.power, self.crown = u(0.045, 0.08), u(0.4, 0.6), u(0.0, 0.35)
        self.slope, self.slope_x = u(10.0, 18.0), u(14.0, 26.0)
        self.flat = u(-0.3, 1.0)
        self.shift, self.cone = random.normal(0.0, 0.003), random.normal(0.0, 0.004)

    def forces(self, at: Setting, by: Changes) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the forces, in balance with the turn of the contact."""
        turn = np.zeros_like(at.load)
        yaw = 1e-4 * by.turn * 4000.0 / self.nominal
        out = self._at(at, by, turn)
        for _ in range(self.steps):
            new = turn + 0.6 * (yaw * out[2] - turn)
            if float(np.abs(new - turn).max()) < 1e-7:
                break
            turn = new
            out = self._at(at, by, turn)
        Fx, Fy, Mz = out
        return Fx, Fy + self.cone * at.load + by.side, Mz

    def _at(
        self, at: Setting, by: Changes, turn: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        length = self.half * (at.load / self.nominal) ** self.power
        total = [np.zeros_like(at.load) for _ in range(3)]
        edge = np.linspace(-1.0, 1.0, self.count)
        share = 1.0 - self.crown * edge**2
        share = share / share.sum()
        x = 1.0 - 2.0 * (np.arange(self.nodes) + 0.5) / self.nodes
        flat = (self.flat + by.flatter)[:, None]
        pressure = (1.0 - x**2) * (1.0 + flat * x**2) / (1.0 + flat / 5.0)
        pressure = pressure / pressure.sum(axis=1, keepdims=True)
        across = turn - np.tan(at.slip_angle + by.angle + self.shift)
        rolling = np.maximum(1.0 + at.slip_ratio, 0.05)
        sliding = np.abs(at.speed) * np.hypot(at.slip_ratio, across)
        falls = self.kinetic + (1.0 - self.kinetic) * np.exp(-sliding / self.settle)
        for part, place in zip(share, edge, strict=True):
            half = length * np.sqrt(1.0 - 0.5 * self.crown * place**2)
            scale = self.nominal / (2.0 * self.half**2) / self.count * by.stiffness
            s = half[:, None] * (1.0 - x)
            width = 2.0 * half[:, None] / self.nodes
            q_y = (self.slope * scale * across / rolling)[:, None] * s * width
            q_x = (self.slope_x * scale * at.slip_ratio / rolling)[:, None] * s * width
            limit = pressure * (part * self.mu * by.friction * at.load)[:, None]
            size = np.hypot(q_x, q_y)
            slid = np.maximum.accumulate(size > limit, axis=1)
            factor = np.where(slid, falls[:, None] * limit / np.maximum(size, 1e-9), 1.0)
            total[0] += (q_x * factor).sum(axis=1)
            total[1] += (q_y * factor).sum(axis=1)
            total[2] += (q_y * factor * half[:, None] * x).sum(axis=1)
        return total[0], total[1], total[2]


FAMILIES: dict[str, type[Magic] | type[String] | type[Strips]] = {
    each.name: each for each in (Magic, String, Strips)
}
