"""Further laws of sidewall, belt and road, by which a hidden effect is planted in the rig.

A law adds to the balance that `tirelib.rig.system` solves. Its derivative is left out of the
Jacobian: Newton's method then converges linearly, to the same tolerance. Laws that depend on the
history of a material point act in the frequency domain: rolling at Omega, harmonic n of the fixed
fields is a vibration with n Omega at the material point.
"""

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tirelib.rig.belt import FIELDS, PSI, SIZE, U, V
from tirelib.rig.mesh import Mesh
from tirelib.rig.road import Road
from tirelib.rig.tire import Array, Condition, RigTire

Gain = NDArray[Any]
"""Factors of harmonics 1 .. HARMONICS, real or complex."""

HARMONICS = 40
"""Highest harmonic with memory; fields above are too small to matter."""
REFERENCE_TURN = 60.0
"""Turn rate at which the strength of a law with memory counts [rad/s]."""


@lru_cache(maxsize=8)
def _basis(grid: Mesh) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """Matrices from values at Gauss points to harmonics 1 .. HARMONICS, and back."""
    n = np.arange(1, HARMONICS + 1)
    wave = np.exp(1j * np.outer(grid.phi, n))
    return (wave.conj() * grid.weight[:, None]).T / (2.0 * np.pi), 2.0 * wave


def _with_memory(grid: Mesh, field: Array, gain: Gain) -> Array:
    into, back = _basis(grid)
    return np.asarray(np.real(back @ (gain[:, None] * (into @ field))))


@dataclass(frozen=True)
class LossModulus:
    """Sidewall damping with a loss modulus that grows with a power of frequency.

    Force k_u i a (n Omega / Omega_0)^m u_n, and likewise for v; m = 1 would be viscous, 0 rate
    independent.
    """

    strength: float
    power: float = 0.5

    def __call__(self, tire: RigTire, cond: Condition, omega: float, grid: Mesh, z: Array) -> Array:
        """Return the residual density."""
        n = np.arange(1, HARMONICS + 1)
        gain = 1j * self.strength * (n * omega / REFERENCE_TURN) ** self.power
        return _sidewall(tire, cond, grid, z, gain)


@dataclass(frozen=True)
class StorageModulus:
    """Sidewall that stiffens with a power of frequency: k_u (1 + a (n Omega / Omega_0)^m)."""

    strength: float
    power: float = 0.4

    def __call__(self, tire: RigTire, cond: Condition, omega: float, grid: Mesh, z: Array) -> Array:
        """Return the residual density."""
        n = np.arange(1, HARMONICS + 1)
        gain = self.strength * (n * omega / REFERENCE_TURN) ** self.power
        return _sidewall(tire, cond, grid, z, gain)


def _sidewall(
    tire: RigTire,
    cond: Condition,
    grid: Mesh,
    z: Array,
    gain: Gain,
) -> Array:
    out, share = np.zeros((len(z), SIZE)), np.array(tire.sidewall_share) * tire.ring_radius
    for field, k in (
        (U, tire.radial_stiffness(cond.pressure)),
        (V, tire.tangential_stiffness(cond.pressure)),
    ):
        out[:, field] = k * share * _with_memory(grid, z[:, field], gain)
    return out


@dataclass(frozen=True)
class SidewallPull:
    """Sidewalls that are flung outward and pull at the belt, mostly at its edges.

    Dead radial load a rho A R Omega^2 per length: mass that does not travel through the contact,
    so that its tension meets no inertia.
    """

    strength: float

    def __call__(self, tire: RigTire, cond: Condition, omega: float, grid: Mesh, z: Array) -> Array:
        """Return the residual density."""
        out = np.zeros((len(z), SIZE))
        force = self.strength * tire.mass * tire.ring_radius**2 * omega**2
        out[:, U] = -force * np.array(tire.sidewall_share)
        return out


@dataclass(frozen=True)
class SectionInertia:
    """Rotary inertia a [kg m] of the belt's sections, which turn by psi."""

    strength: float

    def __call__(self, tire: RigTire, cond: Condition, omega: float, grid: Mesh, z: Array) -> Array:
        """Return the residual density."""
        out = np.zeros((len(z), SIZE))
        share = self.strength / len(U) * omega**2 * tire.ring_radius
        out[:, FIELDS + PSI] = -share * (1.0 + z[:, FIELDS + PSI])
        return out


def _edges(values: Array, depth: Array) -> tuple[Array, Array]:
    """Return the values (n, 5) at leading and trailing edge of each strip, between its points."""
    first, last = np.zeros(depth.shape[1]), np.zeros(depth.shape[1])
    for strip, (value, deep) in enumerate(zip(values.T, depth.T, strict=True)):
        inside = np.flatnonzero(deep > 0.0)
        if inside.size == 0 or inside[0] == 0 or inside[-1] == len(deep) - 1:
            continue
        i, j = inside[0], inside[-1]
        share = deep[i - 1] / (deep[i - 1] - deep[i])
        first[strip] = value[i - 1] + share * (value[i] - value[i - 1])
        share = deep[j] / (deep[j] - deep[j + 1])
        last[strip] = value[j] + share * (value[j + 1] - value[j])
    return first, last


@dataclass(frozen=True)
class RearSliding:
    """Traction a q against the tread where it slides: a step at a place in the contact.

    The step is a ramp over a tenth of half a contact. What it pulls is made up for evenly by the
    sticking part, so that no torque is left.
    """

    strength: float
    start: float = 0.55

    def __call__(self, tire: RigTire, cond: Condition, phi: Array, contact: Road) -> Road:
        """Return the contact with the law's tractions."""
        angle = np.repeat(phi[:, None], contact.q.shape[1], axis=1)
        first, last = _edges(angle, contact.kin.depth)
        half = np.maximum(0.5 * (last - first), 1e-6)
        place = (angle - 0.5 * (first + last)) / half
        slides = np.clip((place - self.start) / 0.1 + 0.5, 0.0, 1.0)
        pull, hold = self.strength * contact.q * slides, contact.q * (1.0 - slides)
        rest = float(np.sum(contact.area * pull)) / float(np.sum(contact.area * hold) + 1e-9)
        return replace(contact, fx=contact.fx + pull - rest * hold)


@dataclass(frozen=True)
class RegularCoulomb:
    """Outward shear of the tread that the road holds: Coulomb friction, regularised at the middle.

    Traction a q tanh(x / x_0) on the tire, x from the middle of the contact, without resultant.
    """

    strength: float
    length: float = 0.02

    def __call__(self, tire: RigTire, cond: Condition, phi: Array, contact: Road) -> Road:
        """Return the contact with the law's tractions."""
        weight = contact.area * contact.q
        whole = weight.sum(axis=0)
        safe = np.where(whole > 0.0, whole, 1.0)
        middle = (weight * contact.kin.x).sum(axis=0) / safe
        pull = self.strength * contact.q * np.tanh((contact.kin.x - middle) / self.length)
        rest = float(np.sum(contact.area * pull)) / max(float(whole.sum()), 1.0)
        return replace(contact, fx=contact.fx + pull - rest * contact.q)


@dataclass(frozen=True)
class WaterWedge:
    """Water ahead of the contact presses on the tread: a rho v^2 / 2, falling off as a wedge.

    Into the contact it fades within `fade`.
    """

    strength: float
    length: float = 0.03
    fade: float = 0.01

    def __call__(self, tire: RigTire, cond: Condition, phi: Array, contact: Road) -> Road:
        """Return the contact with the law's tractions."""
        leading, trailing = _edges(contact.kin.x, contact.kin.depth)
        ahead = contact.kin.x - leading
        wedge = np.clip(np.minimum(1.0 - ahead / self.length, 1.0 + ahead / self.fade), 0.0, 1.0)
        touches = leading > trailing
        dynamic = 0.5 * 1000.0 * cond.speed**2
        return replace(contact, q=contact.q + self.strength * dynamic * wedge * touches)
