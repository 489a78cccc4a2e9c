"""How a gage shows its strain: laws of measurement by which a hidden effect is planted.

Each takes what the rig solved and a strength, and returns the changed trace. `place` is the run's
place in the campaign from 0 to 1, `angle` an angle that belongs to the tire.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from tirelib.rig.observe import Trace
from tirelib.rig.tire import Array, Condition, RigTire


@dataclass(frozen=True)
class Shown:
    """A trace and what belongs to it.

    Attributes
    ----------
    edges : array, shape (5, 2)
        Contact edges as wheel angles of the gages [rad].
    stiffness : float
        Vertical stiffness [N/m].
    """

    tire: RigTire
    condition: Condition
    omega: float
    trace: Trace
    edges: Array
    stiffness: float
    place: float
    angle: float


def fixed_angle(tire: RigTire) -> float:
    """Return an angle that belongs to a tire: where its stiff sector or flat spot is [rad]."""
    rng = np.random.default_rng([crc32(tire.name.encode()), 2])
    return float(rng.uniform(-np.pi, np.pi))


ShownLaw = Callable[[Shown, float], Trace]

STRAIN = 5000e-6
"""Strain by which nonlinear gages are scaled."""


def _filtered(trace: Trace, gain: NDArray[Any]) -> Trace:
    n = len(trace.phi)

    def turned(values: Array) -> Array:
        out = np.fft.irfft(np.fft.rfft(values, axis=0) * gain[:, None], n, axis=0)
        return np.asarray(out)

    return Trace(trace.phi, turned(trace.strain), turned(trace.slope), turned(trace.by_load))


def _orders(trace: Trace) -> Array:
    return np.arange(len(trace.phi) // 2 + 1, dtype=np.float64)


def _added(trace: Trace, wave: Array) -> Trace:
    """Add a wave over the angle, the same at all gages or one each."""
    columns = wave if wave.ndim == 2 else wave[:, None]
    step = trace.phi[1] - trace.phi[0]
    slope = (np.roll(columns, -1, axis=0) - np.roll(columns, 1, axis=0)) / (2.0 * step)
    return replace(trace, strain=trace.strain + columns, slope=trace.slope + slope)


def _scaled(trace: Trace, gain: float) -> Trace:
    return Trace(trace.phi, gain * trace.strain, gain * trace.slope, gain * trace.by_load)


def _shifted(trace: Trace, by: Array) -> Trace:
    """Read the trace at other angles, phi + by."""
    step = trace.phi[1] - trace.phi[0]

    def moved(values: Array) -> Array:
        periodic = np.vstack([values, values[:1]])
        angle = np.append(trace.phi, trace.phi[-1] + step)
        at = np.mod(trace.phi + by + np.pi, 2.0 * np.pi) - np.pi
        return np.stack([np.interp(at, angle, column) for column in periodic.T], axis=1)

    return Trace(trace.phi, moved(trace.strain), moved(trace.slope), moved(trace.by_load))


def bonded_window(shown: Shown, strength: float) -> Trace:
    """Gage whose bond carries less towards its ends: a parabolic window of length `strength` [m].

    Its transform is 3 (sin x - x cos x) / x^3 with x = n L / (2 R).
    """
    x = 0.5 * _orders(shown.trace) * strength / shown.tire.ring_radius
    small = x < 1e-3
    safe = np.where(small, 1.0, x)
    gain = np.where(small, 1.0 - x**2 / 10.0, 3.0 * (np.sin(safe) - safe * np.cos(safe)) / safe**3)
    return _filtered(shown.trace, gain.astype(np.complex128))


def third_order_filter(shown: Shown, strength: float) -> Trace:
    """Amplifier of third order, flat as Butterworth's; `strength` is 1 / omega_0 [s]."""
    s = 1j * _orders(shown.trace) * shown.omega * strength
    gain = 1.0 / ((1.0 + s) * (1.0 + s + s**2))
    return _filtered(shown.trace, gain)


def soft_clip(shown: Shown, strength: float) -> Trace:
    """Glue that yields: eps - a eps |eps|^1.5 / eps_0^1.5, more in compression than in tension."""
    eps = shown.trace.strain
    share = (np.abs(eps) / STRAIN) ** 1.5 * np.where(eps < 0.0, 1.25, 0.75)
    clipped = eps / (1.0 + strength * share)
    rate = (1.0 - 0.5 * strength * share) / (1.0 + strength * share) ** 2
    return Trace(shown.trace.phi, clipped, shown.trace.slope * rate, shown.trace.by_load * rate)


def logarithmic_creep(shown: Shown, strength: float) -> Trace:
    """Gain that creeps with the logarithm of time: 1 - a ln(1 + 9 place) / ln 10."""
    return _scaled(shown.trace, 1.0 - strength * float(np.log1p(9.0 * shown.place) / np.log(10.0)))


def eccentric_encoder(shown: Shown, strength: float) -> Trace:
    """Set the encoder off its mark, and off the axle by a third of that: a (1 + cos(..) / 3)."""
    by = strength * (1.0 + np.cos(shown.trace.phi - shown.angle) / 3.0)
    return _shifted(shown.trace, by)


def stiff_sector(shown: Shown, strength: float) -> Trace:
    """Stiff sector of the tire: a smooth pulse once per turn, and the load that it takes.

    a exp(cos(phi - phi_s) - 1), a in strain; the load swings by 0.2 mm of run-out per 100
    microstrain in the same way.
    """
    pulse = np.exp(np.cos(shown.trace.phi - shown.angle) - 1.0)
    swing = shown.stiffness * 2.0 * strength * pulse
    wave = strength * pulse[:, None] + shown.trace.by_load * swing[:, None]
    return _added(shown.trace, wave)


def twice_per_turn(shown: Shown, strength: float) -> Trace:
    """Oval tire: a cos(2 (phi - phi_o))."""
    return _added(shown.trace, strength * np.cos(2.0 * (shown.trace.phi - shown.angle)))


def debonded(shown: Shown, strength: float) -> Trace:
    """Gages that come loose under load: the gain falls with the load squared."""
    return _scaled(shown.trace, 1.0 - strength * (shown.condition.load / 5000.0) ** 2)


def pressure_sensitive(shown: Shown, strength: float) -> Trace:
    """Gages whose gain changes with the root of the inflation pressure round them."""
    return _scaled(
        shown.trace, 1.0 + strength * 2.0 * (np.sqrt(shown.condition.pressure / 2e5) - 1)
    )


def heated(shown: Shown, strength: float) -> Trace:
    """Gages that grow warm with the speed squared, and lose gain."""
    return _scaled(shown.trace, 1.0 - strength * (shown.condition.speed / 30.0) ** 2)


def feels_acceleration(shown: Shown, strength: float) -> Trace:
    """Gages that feel the belt's acceleration, which grows with bending and with speed squared."""
    eps = shown.trace.strain
    bend = np.abs(eps - eps.mean(axis=0)) - eps.mean(axis=0)
    return _added(shown.trace, strength * (shown.omega / 60.0) ** 2 * bend)


def standing_wave(shown: Shown, strength: float) -> Trace:
    """Wave behind the contact that dies out, growing with the fourth power of the turn rate."""
    behind = np.mod(shown.trace.phi[:, None] - shown.edges[:, 1], 2.0 * np.pi)
    wave = np.sin(14.0 * behind) * np.exp(-behind / 0.7)
    return _added(shown.trace, strength * (shown.omega / 100.0) ** 4 * wave)


def flat_spot(shown: Shown, strength: float) -> Trace:
    """Flat spot near the gages: where it passes the road the gages are pressed less.

    The load's slope of the strain times a narrow pulse about the spot's place.
    """
    spot = 0.3 * np.sin(shown.angle)
    pulse = np.exp(-0.5 * ((shown.trace.phi - spot) / 0.12) ** 2)
    return _added(shown.trace, -strength * shown.trace.by_load * pulse[:, None])


def edge_bump(shown: Shown, strength: float) -> Trace:
    """Belt's edge that kinks on both sides of the contact: bumps that go with the load."""
    size = strength * shown.condition.load / 5000.0
    wave = np.zeros_like(shown.trace.strain)
    for side, share in ((0, 1.0), (1, 0.7)):
        away = 1.5 * shown.edges[:, side]
        wave += share * np.exp(-0.5 * ((shown.trace.phi[:, None] - away) / 0.07) ** 2)
    return _added(shown.trace, size * wave)
