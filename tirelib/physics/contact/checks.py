"""Checks common to the contact models: given numbers, the tire's range, one patch, the tread."""

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ConvergenceError, ParameterError
from tirelib.physics.contact.patch import Nodes, PatchEquation
from tirelib.physics.contact.tread import Tread, numbers
from tirelib.physics.ring.compliance import Compliance

LARGEST_ANGLE = 0.75
"""Half contact angle beyond which the linear ring has no meaning, [rad]."""

LARGEST_PULL = 1e-3
"""Tension in the patch, as a share of the peak pressure, that is the nodes' and no lift-off: short
contacts leave 2.5e-5 at their ends (``python build/contact_constants.py``: 27 wheels of cars, karts
and bicycles, treads to ten times harder), peaks are given to 5e-3. Half and double refuse none of
them either."""
_RANGE_ANGLES = np.linspace(0.05, 1.0, 20)
"""Half angles that are looked at for the load a tire carries, in the largest."""
_RANGE_NODES, _RANGE_STEPS = 20, 8

ComplianceAt = Callable[[FloatArray], Compliance]


class Pressed(Protocol):
    """Results of a contact that are checked, one row per operating point."""

    @property
    def edges(self) -> FloatArray: ...  # noqa: D102
    @property
    def deflection(self) -> FloatArray: ...  # noqa: D102
    @property
    def pressure(self) -> FloatArray: ...  # noqa: D102
    @property
    def load(self) -> FloatArray: ...  # noqa: D102


def column(
    where: str, value: Any, n_points: int, name: str, unit: str, *, positive: bool = False
) -> FloatArray:
    """Return (n_points,) finite numbers, > 0 if asked for."""
    array = numbers(where, value, name)
    if array.ndim > 1 or array.size not in (1, n_points):
        raise ParameterError(
            f"{where}: {name} has shape {array.shape} for {n_points} points; one value or one a "
            "point is needed"
        )
    flat = array.reshape(-1)
    good = np.isfinite(flat) & ((flat > 0) | (not positive))
    if not good.all():
        point = int(np.argmin(good))
        raise ParameterError(
            f"{where}: {name} = {flat[point]:.6g} {unit} at point {point}; a finite "
            f"number{' > 0' if positive else ''} is needed; check sign and unit",
            point=point,
        )
    return np.broadcast_to(flat, (n_points,)).copy()


def one_or_each(where: str, given: int, n_points: int, name: str) -> None:
    """Refuse a number of points that is neither one nor all."""
    if given not in (1, n_points):
        raise ParameterError(
            f"{where}: the {name} has {given} points for {n_points} points; one value or one a "
            "point is needed"
        )


def carried(
    at: ComplianceAt, tread: Tread, point: int, largest_angle: float = LARGEST_ANGLE
) -> tuple[float, float]:
    """Return the largest load [N] in the ring's range, and its deflection [m], of one point.

    By the radial contact with both edges at the same angle, up to the largest half angle or until
    the tread is pressed through. Without friction; damping moves the edges, this hardly.
    """
    n_points, nodes, row = len(tread), Nodes.of(_RANGE_NODES), np.array([point])
    rubber = tread.take(row)
    thickness = float(np.asarray(rubber.thickness)[0])
    most, deflection, d0 = 0.0, 0.0, 1e-3
    for half in largest_angle * _RANGE_ANGLES:
        edges = np.array([[-half, half]])
        delta = np.zeros((1, _RANGE_NODES))
        for _ in range(_RANGE_STEPS):
            ring = at(np.full(n_points, d0)).spread(n_points).take(row)
            step = PatchEquation.of(ring, rubber, nodes, edges, delta, None)
            lift, rest = step.lift @ nodes.ends.T, step.rest @ nodes.ends.T
            d0 = max(-float(np.sum(lift * rest) / np.sum(lift**2)), 1e-6)
            delta = step.compression(np.array([d0]))
        if delta.max() >= thickness:
            break
        q = rubber.force(delta)
        load = float(ring.radius[0] * np.sum(step.weights * q * np.cos(step.phi)))
        if load > most:
            most, deflection = load, d0
    return most, deflection


def range_text(at: ComplianceAt, tread: Tread, point: int, angle: float = LARGEST_ANGLE) -> str:
    """Return a sentence on the loads that a tire carries."""
    most, deflection = carried(at, tread, point, angle)
    return (
        f"this tire carries 0 to about {most:.0f} N, at {1e3 * deflection:.3g} mm (half contact "
        f"angle up to {angle} rad, tread not pressed through)"
    )


def check_angle(where: str, contact: Pressed, at: ComplianceAt, tread: Tread) -> None:
    """Refuse a patch that is larger than the ring allows."""
    half = np.abs(contact.edges).max(axis=1)
    if (half > LARGEST_ANGLE).any():
        point = int(np.argmax(half))
        raise ParameterError(
            f"{where}: point {point} at d0 = {1e3 * contact.deflection[point]:.1f} mm, "
            f"Fz = {contact.load[point]:.0f} N has a half contact angle of {half[point]:.2f} rad; "
            f"the ring holds up to {LARGEST_ANGLE} rad: {range_text(at, tread, point)}; lower the "
            "load or check the stiffness",
            point=point,
        )


def check_one_patch(where: str, contact: Pressed, overlap: FloatArray) -> None:
    """Refuse a patch that pulls inside or is pressed outside.

    Parameters
    ----------
    where : str
    contact : Pressed
    overlap : shape (n_points, n_angles), [m]
        Compression of the tread at angles outside the patch; negative is clearance.
    """
    pull = -contact.pressure.min(axis=1) / contact.pressure.max(axis=1)
    press = overlap.max(axis=1) / contact.deflection
    wrong = (pull > LARGEST_PULL) | (press > 1e-6)
    if wrong.any():
        point = int(np.flatnonzero(wrong)[0])
        raise ConvergenceError(
            f"{where}: point {point} at d0 = {1e3 * contact.deflection[point]:.2f} mm is not one "
            f"patch: tension inside {pull[point]:.1e} of the peak, overlap outside "
            f"{press[point]:.1e} of d0; the belt lifts off or buckles: a stiffer belt or a smaller "
            "load is needed",
            contact,
            float(max(pull[point], press[point])),
            point=point,
        )


def check_tread(
    where: str, compression: FloatArray, thickness: Any, load: FloatArray, deflection: FloatArray
) -> None:
    """Refuse a tread that is pressed through, Eq. (52).

    Parameters
    ----------
    compression : shape (n_points, n_nodes), [m]
    thickness : one number or shape (n_points,), [m]
    load, deflection : shape (n_points,), [N], [m]
    """
    deepest = compression.max(axis=1)
    rubber = np.broadcast_to(np.asarray(thickness, dtype=float), deepest.shape)
    through = deepest >= rubber
    if through.any():
        point = int(np.flatnonzero(through)[0])
        raise ParameterError(
            f"{where}: point {point} at Fz = {load[point]:.0f} N, d0 = "
            f"{1e3 * deflection[point]:.2f} mm: tread pressed by {1e3 * deepest[point]:.3g} mm; "
            f"must stay below its thickness {1e3 * rubber[point]:.3g} mm (52); lower the load or "
            "check the tread's stiffness",
            point=point,
        )


def check_radii(where: str, tread: Tread, radius: FloatArray) -> None:
    """Refuse a tread whose surface does not lie outside the belt."""
    outer, inner = np.broadcast_arrays(np.asarray(tread.free_radius, dtype=float), radius)
    depth = np.atleast_1d(outer - inner)
    if (depth <= 0).any():
        point = int(np.argmin(depth))
        raise ParameterError(
            f"{where}: point {point} has h_0 = free radius - ring radius = "
            f"{1e3 * depth[point]:.2f} mm; the tread must stand outside the belt; check both radii",
            point=point,
        )
