r"""Features of each turn and gage, in the angle domain.

Strain over wheel angle shows, in the order of time, a compressive peak CP1 before the contact, a
steep rise at the leading edge, tension TP inside the contact, a steep fall at the trailing edge and
a second compressive peak CP2 (dissertation, Fig. 3-7, 3-8, 4-10). Edges are read at the extremes of
the strain rate, which lie a little inside or outside the true edges: the reading has a bias.

Rates are per radian, so a calibration made at one speed holds at another.

Integrals (Eq. 11, 12), over the contact angle :math:`l` read from the edges, with :math:`\xi` from
its middle:

.. math:: E_{vertical} = \int_{-l/2}^{l/2} \varepsilon\,d\xi, \qquad
          \varepsilon_{fri}(\xi) = \tfrac12[\varepsilon(\xi) - \varepsilon(-\xi)], \qquad
          E_{friction} = l \int_0^{l/2} |\varepsilon_{fri}|\,d\xi
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray, IntArray
from tirelib.core.compiled import GAGES, loaded_core
from tirelib.core.flags import TurnFlag
from tirelib.core.traces import TraceConditions
from tirelib.measured.features.compiled import read_by_core
from tirelib.measured.features.peaks import peak
from tirelib.measured.signal.turn import PHI, Turns, TurnValues
from tirelib.measured.signal.turns import AFTER

EDGE_REACH = 0.35
"""How far outside the centre gage's pulse a leading edge is looked for, [rad]."""
COMPRESSION_REACH = 0.6
"""How far before the leading edge the first compressive peak is looked for, [rad]."""
INTEGRAL_POINTS = 65
"""Points of the trapezoidal rule over the contact angle (odd: the middle is one of them)."""


@dataclass(frozen=True, slots=True)
class Features(TurnValues):
    """Features of several turns; arrays over gages have shape (n, n_gages), the rest (n,).

    Angles are from the middle of the centre gage's pulse, [rad]; strains are above the offset,
    dimensionless; rates are per radian. NaN where a gage or a turn says nothing.

    Attributes
    ----------
    lead, trail
        Angles of the largest and the smallest strain rate: the edges.
    contact_angle
        ``trail - lead``.
    rate_lead, rate_trail
        Peak strain rates.
    cp1, cp2, tp
        Compressive peaks before and after, largest tension within the contact.
    cp1_angle, cp2_angle, tp_angle
        Where they are.
    e_vertical, e_friction
        Integrals of Eq. (11), (12), [rad], [rad2].
    skew
        First moment of the strain about the middle of the contact over e_vertical, [rad]: zero for
        a symmetric contact.
    omega, speed, pressure, camber
        Conditions of the turn, SI; all but the pressure are those at its contact.
    axis_shift
        Wheel angle of the pulse's middle, from a trigger, [rad].
    lateral : shape (n_gages,), [m]
        Gage positions, ISO.
    """

    lead: FloatArray
    trail: FloatArray
    rate_lead: FloatArray
    rate_trail: FloatArray
    cp1: FloatArray
    cp2: FloatArray
    tp: FloatArray
    cp1_angle: FloatArray
    cp2_angle: FloatArray
    tp_angle: FloatArray
    e_vertical: FloatArray
    e_friction: FloatArray
    skew: FloatArray
    omega: FloatArray
    speed: FloatArray
    pressure: FloatArray
    camber: FloatArray
    axis_shift: FloatArray
    lateral: FloatArray

    @property
    def contact_angle(self) -> FloatArray:
        """Angle between the edges, shape (n, n_gages), [rad]."""
        return self.trail - self.lead

    @property
    def centre_gage(self) -> int:
        """Index of the gage nearest to the equator."""
        return int(np.argmin(np.abs(self.lateral)))


def extract_features(turns: Turns) -> Features:
    """Read the features of all turns and gages, by the compiled core where there is one.

    The core knows the wheel angles `PHI` only; turns over others are read by the reference.

    Source: dissertation, sections 3.4 and 4.1; Eq. (11), (12).
    """
    core = loaded_core()
    trace = turns.trace
    if core is None or trace.lateral.size > GAGES or not np.array_equal(trace.phi, PHI):
        return reference_features(turns)
    read, gage_flags, flags = read_by_core(core, turns)
    return features_of(turns, read, gage_flags, flags)


def reference_features(turns: Turns) -> Features:
    """Read the features of all turns and gages at once: the reference of the compiled core."""
    trace = turns.trace
    phi, spacing = trace.phi, trace.spacing
    pulse = trace.pulse[:, None, None]
    axis = phi[None, None, :]

    def largest(
        curves: tuple[FloatArray, ...], allowed: tuple[BoolArray, ...]
    ) -> tuple[FloatArray, FloatArray, BoolArray]:
        return peak(np.stack(curves), np.stack(allowed), float(phi[0]), spacing)

    shape = trace.rate.shape
    rising = np.broadcast_to((axis >= -pulse - EDGE_REACH) & (axis <= 0.0), shape)
    falling = np.broadcast_to((axis >= 0.0) & (axis <= pulse + AFTER), shape)
    edges, rates, weak_edges = largest((trace.rate, -trace.rate), (rising, falling))
    lead, trail = edges
    before = (axis <= lead[..., None]) & (axis >= lead[..., None] - COMPRESSION_REACH)
    inside = (axis >= lead[..., None]) & (axis <= trail[..., None])
    after = axis >= trail[..., None]
    low = -trace.strain
    angles, sizes, _ = largest((low, low, trace.strain), (before, after, inside))
    e_vertical, e_friction, skew = _integrals(trace.strain, phi, lead, trail)
    weak = np.where(weak_edges.any(axis=0), int(TurnFlag.WEAK_EDGE), 0)
    read = {
        "lead": lead,
        "trail": trail,
        "rate_lead": rates[0],
        "rate_trail": -rates[1],
        "cp1": -sizes[0],
        "cp2": -sizes[1],
        "tp": sizes[2],
        "cp1_angle": angles[0],
        "cp2_angle": angles[1],
        "tp_angle": angles[2],
        "e_vertical": e_vertical,
        "e_friction": e_friction,
        "skew": skew,
    }
    flags = turns.flags | weak.max(axis=1, initial=0)
    return features_of(turns, read, turns.gage_flags | weak, flags)


def features_of(
    turns: Turns, read: Mapping[str, FloatArray], gage_flags: IntArray, flags: IntArray
) -> Features:
    """Return features: those that were read from the curves, and what the turns bring."""
    trace, conditions = turns.trace, turns.trace.conditions
    brought = {field.name: getattr(turns, field.name) for field in fields(TurnValues)}
    brought |= {field.name: getattr(conditions, field.name) for field in fields(TraceConditions)}
    brought |= {"flags": flags, "gage_flags": gage_flags}
    brought |= read
    return Features(**brought, axis_shift=trace.axis_shift, lateral=trace.lateral)


def _integrals(
    strain: FloatArray, phi: FloatArray, lead: FloatArray, trail: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Integrals over the contact angle of each turn and gage, by the trapezoidal rule."""
    share = np.linspace(-0.5, 0.5, INTEGRAL_POINTS)
    length = trail - lead
    where = 0.5 * (lead + trail)[..., None] + length[..., None] * share
    position = (where - phi[0]) / (phi[1] - phi[0])
    known = np.isfinite(position)
    index = np.clip(np.where(known, position, 0.0).astype(np.int64), 0, phi.size - 2)
    left = np.take_along_axis(strain, index, axis=-1)
    right = np.take_along_axis(strain, index + 1, axis=-1)
    values = left + (right - left) * (position - index)
    step = length[..., None] * (share[1] - share[0])
    weight = np.full(INTEGRAL_POINTS, 1.0)
    weight[[0, -1]] = 0.5
    vertical = (values * weight * step).sum(axis=-1)
    odd = 0.5 * np.abs(values - values[..., ::-1])
    friction = length * 0.5 * (odd * weight * step).sum(axis=-1)
    moment = (values * weight * step * (length[..., None] * share)).sum(axis=-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        return vertical, friction, moment / vertical
