"""The tread: bristles between belt and road, with Coulomb friction and convected shear.

A bristle of strip i stands on the belt along the section's director; its free tip is at
x_s = x + h n(phi + psi). Compression d = -Z_s below the road gives
q = k d (1 + c d / H + c_3 (d / H)^2). A sticking tip is carried by the road, so that between two
points of the same strip

    e_j = e_{j-1} - (V_x / Omega) dphi - (X_j - X_{j-1})                       (along)
    e_j = e_{j-1} - (V_x / Omega) tan(alpha) dphi - (Y_j - Y_{j-1})            (across)

holds exactly (the integral of e' Omega = -V - x_s' Omega), from e = 0 at the leading edge, whose
place between two points is interpolated. Where |k e| > mu q the deflection is brought back
radially to the friction circle. X, Y, Z are the road's axes: the wheel plane is turned about
X by the camber.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tirelib.rig.belt import LATERAL, PSI, U, V
from tirelib.rig.tire import N_STRIPS, Array, Condition, RigTire


@dataclass(frozen=True)
class Kinematics:
    """Free bristle tips at contact points, road axes from under the axle; shapes (n, 5[, 4]).

    Gradients are with respect to (u, v, psi, w) of the point; x and zeta are the wheel plane's.
    """

    x: Array
    zeta: Array
    y: Array
    depth: Array
    x_grad: Array
    y_grad: Array
    z_grad: Array
    zeta_grad: Array
    x_bend: Array
    zeta_bend: Array


@dataclass(frozen=True)
class Shear:
    """Bristle shear marched through the contact; P, c and entry terms of its derivative.

    e_j = P (carry e_{j-1} + part Delta_j) + c d_j, plus the interpolated leading edge.
    """

    e: Array
    project: Array
    from_depth: Array
    carry: Array
    part: Array
    delta: Array
    part_own: Array
    part_before: Array
    sliding: NDArray[np.bool_]


def kinematics(tire: RigTire, cond: Condition, height: float, phi: Array, z: Array) -> Kinematics:
    """Return the bristle tips for fields z, shape (n, >= 16), at angles phi, shape (n,)."""
    h, lateral = tire.surface, tire.lateral
    r, v, psi = tire.ring_radius + z[:, U], z[:, V], z[:, PSI]
    cos, sin = np.cos(phi)[:, None], np.sin(phi)[:, None]
    turn_cos, turn_sin = np.cos(phi[:, None] + psi), np.sin(phi[:, None] + psi)
    x = -r * sin - v * cos - h * turn_sin
    zeta = -r * cos + v * sin - h * turn_cos
    cg, sg = np.cos(cond.camber), np.sin(cond.camber)
    across = lateral + z[:, LATERAL, None]
    zero, one = np.zeros_like(x), np.ones_like(x)
    x_grad = np.stack([-sin * one, -cos * one, -h * turn_cos, zero], axis=-1)
    zeta_grad = np.stack([-cos * one, sin * one, h * turn_sin, zero], axis=-1)
    w_grad = np.array([0.0, 0.0, 0.0, 1.0])
    depth = -(height + across * sg + zeta * cg)
    z_grad = sg * w_grad + cg * zeta_grad
    if tire.road_curvature:
        depth = depth - 0.5 * tire.road_curvature * x**2
        z_grad = z_grad + (tire.road_curvature * x)[..., None] * x_grad
    return Kinematics(
        x=x,
        zeta=zeta,
        y=across * cg - zeta * sg,
        depth=depth,
        x_grad=x_grad,
        y_grad=cg * w_grad - sg * zeta_grad,
        z_grad=z_grad,
        zeta_grad=zeta_grad,
        x_bend=h * turn_sin,
        zeta_bend=h * turn_cos,
    )


def pressure(tire: RigTire, depth: Array) -> tuple[Array, Array]:
    """Contact pressure and its derivative with compression; no tension [Pa], [Pa/m]."""
    d, touched = np.maximum(depth, 0.0), (depth > 0.0).astype(np.float64)
    if tire.tread_roughness:
        half = tire.tread_roughness
        shallow = np.abs(depth) < half
        d = np.where(shallow, (depth + half) ** 2 / (4.0 * half), d)
        touched = np.where(shallow, (depth + half) / (2.0 * half), touched)
    harder = tire.tread_hardening / tire.tread_thickness
    q = tire.tread_normal * d * (1.0 + harder * d)
    slope = tire.tread_normal * (1.0 + 2.0 * harder * d) * touched
    if tire.tread_cubic:
        cubic = tire.tread_normal * tire.tread_cubic / tire.tread_thickness**2
        q, slope = q + cubic * d**3, slope + 3.0 * cubic * d**2 * touched
    return q, slope


def march(
    tire: RigTire, cond: Condition, rolling_radius: float, phi: Array, kin: Kinematics
) -> Shear:
    """March the bristles' shear deflection from the leading to the trailing edge.

    Parameters
    ----------
    rolling_radius : float
        V_x / Omega [m].
    """
    n = len(phi)
    k = np.array([tire.tread_shear_x, tire.tread_shear_y])
    q, stiff = pressure(tire, kin.depth)
    limit = tire.friction * q
    flow = rolling_radius * np.diff(phi)[:, None]
    delta = np.zeros((n, N_STRIPS, 2))
    delta[1:, :, 0] = -flow - np.diff(kin.x, axis=0)
    delta[1:, :, 1] = -flow * np.tan(cond.slip_angle) - np.diff(kin.y, axis=0)
    inside = kin.depth > 0.0
    carry = np.zeros((n, N_STRIPS))
    carry[1:] = inside[:-1] & inside[1:]
    part, own, before = _entry(kin.depth, inside)
    e, project = np.zeros((n, N_STRIPS, 2)), np.zeros((n, N_STRIPS, 2, 2))
    sliding = np.zeros((n, N_STRIPS), dtype=bool)
    from_depth = np.zeros((n, N_STRIPS, 2))
    previous, eye = np.zeros((N_STRIPS, 2)), np.eye(2)
    if tire.friction == 0.0:
        return Shear(e, project, from_depth, carry, part, delta, own, before, inside)
    for j in np.flatnonzero(inside.any(axis=1)):
        touch = inside[j]
        trial = carry[j][:, None] * previous + part[j][:, None] * delta[j]
        traction = k * trial
        size = np.hypot(traction[:, 0], traction[:, 1])
        slip = size > limit[j]
        safe = np.where(slip, size, 1.0)
        ratio = np.where(slip, limit[j] / safe, 1.0)
        direction = traction / safe[:, None]
        previous = np.where(touch[:, None], ratio[:, None] * trial, 0.0)
        e[j] = previous
        sliding[j] = slip & touch
        turn = ratio[:, None, None] * (
            eye - direction[:, :, None] * direction[:, None, :] * k / k[:, None]
        )
        project[j] = np.where(slip[:, None, None], turn, eye) * touch[:, None, None]
        rise = tire.friction * stiff[j][:, None] * direction / k
        from_depth[j] = np.where((slip & touch)[:, None], rise, 0.0)
    return Shear(e, project, from_depth, carry, part, delta, own, before, sliding)


def _entry(depth: Array, inside: NDArray[np.bool_]) -> tuple[Array, Array, Array]:
    """Part of the step to each point that lies in contact, and its derivatives with depth."""
    before = np.vstack([depth[:1], depth[:-1]])
    enters = inside & (before <= 0.0)
    width = np.where(enters, depth - before, 1.0)
    part = np.where(enters, depth / width, 1.0) * inside
    own = np.where(enters, -before / width**2, 0.0)
    return part, own, np.where(enters, depth / width**2, 0.0)
