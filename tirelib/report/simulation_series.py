"""How many harmonics a simulated tire needs, and its belt from long series on a fine grid.

The belt follows the tread within a bending length. Between the springs of the tread that length is
(4 EI / k_t)^(1/4), under the belt's tension N it is sqrt(EI / N); the shorter one rules. Where the
tread begins to slide, f_t has a kink, and so has the strain rate, EI u''' being a shear force: a
series of n harmonics rounds it off by its bend over pi n. The contact itself does not need these
harmonics. So it is solved with few, and its loads, taken between the nodes as well, give the belt
with many.
"""

from dataclasses import dataclass

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.parameters import Tire
from tirelib.measured.features.peaks import peak
from tirelib.physics.contact.shear import ShearContact
from tirelib.physics.ring.compliance import Compliance
from tirelib.physics.ring.ring import ComplexArray

LEAST_MODES = 200
MOST_MODES = 1000
"""Beyond this a simulation is too slow; the belt then bends within 3 mm or less."""
MODES_A_BEND = 8.0
"""Harmonics times bending length over radius from which the strain rate has converged to 0.5 %."""
NODES_A_MODE = 0.6
"""More than half the contact angle, or the highest harmonics alias in the patch."""
N_SERIES = 6000
"""Harmonics of the belt under a tread that slides."""
FINE_ANGLES_PER_ANGLE = 48
"""Angles of the fine grid for each one of the curves."""


def bending_length(tire: Tire, inflation: FloatArray) -> float:
    """Return the shortest length within which the belt bends, [m].

    Parameters
    ----------
    inflation : shape (n_points,), [Pa]
    """
    bending = tire.bending_stiffness
    tension = float(np.max(inflation)) * tire.belt_width * tire.ring_radius
    under_tread = (4.0 * bending / tire.tread_stiffness) ** 0.25
    under_tension = np.sqrt(bending / tension) if tension > 0.0 else np.inf
    return float(min(under_tread, under_tension))


def wanted_modes(tire: Tire, inflation: FloatArray) -> int:
    """Return how many harmonics the tire needs, however many that are."""
    return int(np.ceil(MODES_A_BEND * tire.ring_radius / bending_length(tire, inflation)))


def modes(tire: Tire, inflation: FloatArray) -> int:
    """Return how many harmonics a simulation of the tire has."""
    return int(np.clip(wanted_modes(tire, inflation), LEAST_MODES, MOST_MODES))


def nodes(n_modes: int) -> int:
    """Return the number of nodes in the patch that suits as many harmonics, even."""
    return 2 * int(np.ceil(0.5 * NODES_A_MODE * n_modes))


def fine_grid(n_angles: int) -> FloatArray:
    """Return the fine grid of angles from -pi to pi that refines a grid of n_angles, [rad]."""
    return np.linspace(-np.pi, np.pi, FINE_ANGLES_PER_ANGLE * (n_angles - 1) + 1)


def on_grid(harmonics: ComplexArray, n_steps: int) -> FloatArray:
    """Return Re sum F_n exp(i n phi) at phi = -pi ... pi, shape (n_points, n_steps + 1).

    Parameters
    ----------
    harmonics : shape (n_points, n_modes + 1)
    n_steps : int
        Even, more than twice the harmonics.

    Examples
    --------
    >>> sine = np.array([[0.5, -1j, 0.0]])
    >>> on_grid(sine, 8).round(3).tolist()[0][4:8]
    [0.5, 1.207, 1.5, 1.207]
    """
    spectrum = harmonics * _half_turn(harmonics.shape[-1]) * (0.5 * n_steps)
    spectrum[..., 0] *= 2.0
    values = np.fft.irfft(spectrum, n_steps, axis=-1)
    out: FloatArray = np.concatenate([values, values[..., :1]], axis=-1)
    return out


def of_grid(values: FloatArray, n_modes: int) -> ComplexArray:
    """Return the harmonics of values at phi = -pi ... pi, the last as the first; see `on_grid`."""
    steps = values.shape[-1] - 1
    out: ComplexArray = np.fft.rfft(values[..., :-1], axis=-1)[..., : n_modes + 1]
    out *= _half_turn(n_modes + 1) * (2.0 / steps)
    out[..., 0] *= 0.5
    return out


def _half_turn(count: int) -> FloatArray:
    """Return exp(i n pi)."""
    signs: FloatArray = np.where(np.arange(count) % 2 == 1, -1.0, 1.0)
    return signs


def long_series(found: ShearContact, ring: Compliance, n_angles: int) -> ComplexArray:
    """Return the belt's harmonics (u, v, beta) under the loads of a contact with shear.

    Parameters
    ----------
    ring : Compliance
        The ring of the contact, with as many harmonics as are wanted.
    n_angles : int
        Number of angles of the curves; the loads are taken on their fine grid.

    Returns
    -------
    shape (n_points, n_modes + 1, 3), [m], [m], [rad]
    """
    phi = fine_grid(n_angles)
    inside = np.flatnonzero(np.abs(phi) <= np.abs(found.edges).max())
    near = found.elements_at(phi[inside]).loads
    loads = np.zeros((len(found), 3, phi.size))
    loads[..., inside] = np.where(found.inside(phi[inside])[:, None], near.swapaxes(1, 2), 0.0)
    harmonics = of_grid(loads, ring.n_modes).swapaxes(1, 2)
    out: ComplexArray = (ring.matrix @ harmonics[..., None])[..., 0]
    return out


@dataclass(frozen=True, slots=True)
class Peaks:
    """Extremes of strain and strain rate, each of shape (n_points,).

    Attributes
    ----------
    cp1, tp, cp2 : strain of the compressive peaks before and after, and of the largest tension
    rate_lead, rate_trail : [1/rad]
        Largest and smallest strain rate.
    cp1_angle, tp_angle, cp2_angle, rate_lead_angle, rate_trail_angle : [rad]
    """

    cp1: FloatArray
    tp: FloatArray
    cp2: FloatArray
    rate_lead: FloatArray
    rate_trail: FloatArray
    cp1_angle: FloatArray
    tp_angle: FloatArray
    cp2_angle: FloatArray
    rate_lead_angle: FloatArray
    rate_trail_angle: FloatArray


def find_peaks(phi: FloatArray, strain: FloatArray, rate: FloatArray, edges: FloatArray) -> Peaks:
    """Return the extremes of strain and strain rate, (n_points, n_phi), on a uniform grid."""
    middle, turn = edges.mean(axis=1)[:, None], np.ones(phi.size, dtype=np.bool_)
    found = [
        peak(curve, inside, float(phi[0]), float(np.ptp(phi)) / (phi.size - 1))
        for curve, inside in (
            (-strain, phi <= middle),
            (strain, turn),
            (-strain, phi >= middle),
            (rate, turn),
            (-rate, turn),
        )
    ]
    (a, b, c, d, e), values = [each[0] for each in found], [each[1] for each in found]
    return Peaks(-values[0], values[1], -values[2], values[3], -values[4], a, b, c, d, e)
