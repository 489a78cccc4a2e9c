"""Contact of a tire's ring as the brush needs it: half length and pressure over the road."""

import numpy as np
from scipy.interpolate import RectBivariateSpline

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ParameterError
from tirelib.core.parameters import Tire
from tirelib.inference.identify.force_data import ForceData
from tirelib.physics.contact.profiles import PressureProfile, parabola, sampled
from tirelib.physics.contact.radial import RadialContact, load
from tirelib.physics.contact.tread import Tread
from tirelib.physics.ring.compliance import Compliance, compliance
from tirelib.physics.ring.ring import Ring

N_MODES = 60
SAMPLES = 121
"""Samples of a pressure profile."""
_GRID = (12, 6)
"""Loads and pressures at which the half length is computed for many points."""
_FEW = 100


def ring_contact(
    tire: Tire, vertical_load: FloatArray, pressure: FloatArray, omega: FloatArray | float = 0.0
) -> RadialContact:
    """Return the contact of the rolling ring at loads [N], pressures [Pa] and omega [rad/s].

    Raises
    ------
    ParameterError, ConvergenceError
        From ring and contact; ParameterError also where a pressure is unknown.
    """
    loads, pressures, spin = np.broadcast_arrays(
        np.atleast_1d(np.asarray(vertical_load, dtype=np.float64)), pressure, omega
    )
    if not np.isfinite(pressures).all():
        raise ParameterError(
            "ring contact: the inflation pressure is unknown at "
            f"{int((~np.isfinite(pressures)).sum())} of {pressures.size} points; the ring needs "
            "it; record it or give it as a set point"
        )
    spin = np.where(np.isfinite(spin), spin, 0.0)

    def at(deflection: FloatArray) -> Compliance:
        return compliance(Ring.of(tire, pressures, deflection), spin, N_MODES)

    if tire.radial_deflection_rate == 0.0:
        return load(at(np.zeros_like(loads)), Tread.of(tire), loads)
    return load(at, Tread.of(tire), loads)


def half_lengths(tire: Tire, vertical_load: FloatArray, pressure: FloatArray) -> FloatArray:
    """Return half the contact length R (phi_trail - phi_lead) / 2, [m], without rotation.

    Up to a hundred points are solved one by one; more are read from a cubic surface over a grid of
    the loads and pressures present.
    """
    loads, pressures = (np.asarray(x, dtype=np.float64) for x in (vertical_load, pressure))
    if loads.size <= _FEW or not np.isfinite(pressures).all():
        return _half(tire, ring_contact(tire, loads, pressures))
    low, high = float(pressures.min()), float(pressures.max())
    if high - low < 1e-3 * high:
        low, high = 0.999 * high, 1.001 * high
    side = np.linspace(loads.min(), loads.max() * (1.0 + 1e-9) + 1e-3, _GRID[0])
    across = np.linspace(low, high, _GRID[1])
    contact = ring_contact(tire, np.repeat(side, _GRID[1]), np.tile(across, _GRID[0]))
    surface = RectBivariateSpline(side, across, _half(tire, contact).reshape(_GRID))
    return np.asarray(surface.ev(loads, np.clip(pressures, low, high)), dtype=np.float64)


def ring_half(tire: Tire | None, data: ForceData) -> FloatArray | None:
    """Return the half contact lengths of a tire's ring at points, [m]; None without a ring."""
    return None if tire is None else half_lengths(tire, data.load, data.pressure)


def profiles(
    tire: Tire, vertical_load: FloatArray, pressure: FloatArray, omega: FloatArray | float
) -> tuple[PressureProfile, PressureProfile]:
    """Return the ring's pressure and the parabola with the same load and edges, one per point.

    The belt's length is laid out flat: x = -R phi, forward from below the axle; the pressure is
    scaled to the load.
    """
    contact = ring_contact(tire, vertical_load, pressure, omega)
    lead, trail = contact.edges.T
    # crowded at the edges, where the pressure rises steeply
    share = 0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, SAMPLES)))
    phi = trail[:, None] + (lead - trail)[:, None] * share
    value = np.maximum(contact.pressure_at(phi), 0.0)
    value[:, [0, -1]] = 0.0
    loads = np.asarray(vertical_load, dtype=np.float64)
    ring = sampled(-tire.ring_radius * phi, value, load=loads)
    return ring, parabola(loads, ring.trailing, ring.leading)


def _half(tire: Tire, contact: RadialContact) -> FloatArray:
    return np.asarray(0.5 * tire.ring_radius * (contact.edges[:, 1] - contact.edges[:, 0]))
