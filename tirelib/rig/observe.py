"""Observables of a solved state: forces, contact edges, and strain over the wheel angle."""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from tirelib.rig.belt import innerliner_strain
from tirelib.rig.road import Road, road, wheel_torque
from tirelib.rig.solve import RigState
from tirelib.rig.system import fields_at_points
from tirelib.rig.tire import Array
from tirelib.rig.tread import kinematics


@dataclass(frozen=True)
class Forces:
    """Road on tire, ISO 8855 axes at the point under the axle [N], [N m].

    `torque` is the drive torque that the hub supplies, `overturning` and `aligning` are Mx, Mz.
    """

    fx: float
    fy: float
    fz: float
    overturning: float
    aligning: float
    torque: float


@dataclass(frozen=True)
class Trace:
    """Strain at the five gages over the wheel angle.

    Attributes
    ----------
    phi : array, shape (n,)
        Wheel angle of the gages: 0 under the axle, pi at the top, growing with time [rad].
    strain, slope, by_load : array, shape (n, 5)
        Strain [1], its derivative with the angle [1/rad] and with the load [1/N].
    """

    phi: Array
    strain: Array
    slope: Array
    by_load: Array


def contact(state: RigState) -> Road:
    """Contact at the Gauss points."""
    z = fields_at_points(state.grid, state.control)
    return road(state.tire, state.condition, state.grid, z, state.height, state.rolling_radius)


def forces(state: RigState) -> Forces:
    """Integrate the contact."""
    c = contact(state)
    x, y = c.kin.x, c.kin.y
    return Forces(
        fx=float(np.sum(c.area * c.fx)),
        fy=float(np.sum(c.area * c.fy)),
        fz=float(np.sum(c.area * c.q)),
        overturning=float(np.sum(c.area * y * c.q)),
        aligning=float(np.sum(c.area * (x * c.fy - y * c.fx))),
        torque=wheel_torque(state.condition, c),
    )


def edges(state: RigState, points: int = 4001) -> tuple[Array, Array]:
    """Contact edges of the strips under the gages.

    Returns
    -------
    angle : array, shape (5, 2)
        Leading and trailing edge as wheel angle of the gage [rad]; NaN without contact.
    length : array, shape (5,)
        Distance between them along the road [m]; 0 without contact.
    """
    zone = state.grid.phi[state.grid.contact]
    phi = np.linspace(zone[0], zone[-1], points)
    values, _ = state.grid.field(state.control, phi)
    kin = kinematics(state.tire, state.condition, state.height, phi, values)
    angle, length = np.full((5, 2), np.nan), np.zeros(5)
    for i, depth in enumerate(kin.depth.T):
        inside = np.flatnonzero(depth > 0.0)
        if len(inside) == 0:
            continue
        first, last = inside[0], inside[-1]
        lead = np.interp(0.0, depth[first - 1 : first + 1], phi[first - 1 : first + 1])
        trail = np.interp(0.0, -depth[last : last + 2], phi[last : last + 2])
        x = np.interp([lead, trail], phi, kin.x[:, i])
        angle[i] = lead, trail
        length[i] = x[0] - x[1]
    return angle + winding(state), length


def winding(state: RigState) -> float:
    """Angle by which the belt runs ahead of the rim at the wheel's top [rad].

    The rig's trigger marks the gages at the top, so their angle counts from there.
    """
    top, _ = state.grid.field(state.control, np.array([np.pi]))
    v, u = float(top[0, 7]), float(top[0, 6])
    return v / (state.tire.ring_radius + u)


def trace(state: RigState, points: int = 7200) -> Trace:
    """Evaluate strain, slope and load sensitivity on an even grid of gage angles.

    Strain is taken at the Gauss points, where it is most accurate, and joined by a periodic cubic
    spline: its slope is smooth, without the corners of the mesh.
    """
    step = 2.0 * np.pi / points
    phi = np.asarray(-np.pi + step * np.arange(points), dtype=np.float64)
    at = phi - winding(state)
    nudge = 10.0
    base = _strain_spline(state, state.control)
    more = _strain_spline(state, state.control + nudge * state.by_load)
    strain = np.asarray(base(at))
    return Trace(phi, strain, np.asarray(base(at, 1)), (more(at) - strain) / nudge)


def _strain_spline(state: RigState, control: Array) -> CubicSpline:
    strain = innerliner_strain(state.tire, fields_at_points(state.grid, control))
    phi = state.grid.phi
    turn = np.append(phi, phi[0] + 2.0 * np.pi)
    return CubicSpline(turn, np.vstack([strain, strain[:1]]), bc_type="periodic")
