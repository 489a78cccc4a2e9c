"""The road: contact forces on the belt and the wheel, and their derivatives.

Blocks of the Jacobian are dense per contact point, in the order of `tirelib.rig.system.pattern`.
Local coefficients of a point are those of its strip's u, v, psi and of w, four splines each.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tirelib.rig.belt import LATERAL, PSI, U, V
from tirelib.rig.mesh import Mesh
from tirelib.rig.tire import N_STRIPS, Array, Condition, RigTire
from tirelib.rig.tread import Kinematics, Shear, kinematics, march, pressure

LOCAL = 16
"""Coefficients that move one strip's contact point: 4 fields x 4 splines."""
OWN: NDArray[np.intp] = np.stack([U, V, PSI, np.full(N_STRIPS, LATERAL)], axis=1)
"""The fields of each strip's contact points, shape (5, 4)."""


@dataclass(frozen=True)
class Road:
    """Contact at the points that may touch, shapes (n_contact, 5): what the road does.

    `area` is the tread area of a point [m^2]; fx, fy, q are tractions on the tire [Pa] in road
    axes.
    """

    kin: Kinematics
    shear: Shear
    area: Array
    fx: Array
    fy: Array
    q: Array
    stiff: Array


def road(
    tire: RigTire, cond: Condition, grid: Mesh, z: Array, height: float, rolling: float
) -> Road:
    """Contact state for fields at all Gauss points."""
    at = grid.contact
    phi = grid.phi[at]
    kin = kinematics(tire, cond, height, phi, z[at])
    shear = march(tire, cond, rolling, phi, kin)
    q, stiff = pressure(tire, kin.depth)
    width = tire.free_radius * tire.belt_width / N_STRIPS
    area = np.repeat(width * grid.weight[at][:, None], N_STRIPS, axis=1)
    found = Road(
        kin,
        shear,
        area,
        fx=tire.tread_shear_x * shear.e[:, :, 0],
        fy=tire.tread_shear_y * shear.e[:, :, 1],
        q=q,
        stiff=stiff,
    )
    for law in tire.road_laws:
        found = law(tire, cond, phi, found)
    return found


def wheel_torque(cond: Condition, contact: Road) -> float:
    """Moment of the road's forces about the axle, positive where the wheel is driven [N m].

    In steady rolling this is the torque that the hub must supply with opposite sign.
    """
    k, up = contact.kin, _upward(cond, contact)
    return -float(np.sum(contact.area * (k.zeta * contact.fx - k.x * up)))


def _upward(cond: Condition, c: Road) -> Array:
    """Traction in the wheel plane, away from the road [Pa]."""
    return np.asarray(c.q * np.cos(cond.camber) - c.fy * np.sin(cond.camber))


def _spread(grid: Mesh, gradient: Array) -> Array:
    """Gradients with (u, v, psi, w) of contact points to their 16 coefficients."""
    value = grid.value[grid.contact]
    out = gradient[..., :, None] * value[:, None, None, :]
    return np.asarray(out.reshape(*gradient.shape[:2], LOCAL))


def add_forces(grid: Mesh, c: Road, inner: Array) -> None:
    """Add the road's virtual work to the density of the residual."""
    k, at = c.kin, grid.contact
    per_phi = c.area / grid.weight[at][:, None]
    force = -per_phi[..., None] * (
        c.fx[..., None] * k.x_grad + c.fy[..., None] * k.y_grad + c.q[..., None] * k.z_grad
    )
    for own, push in zip(OWN, force.swapaxes(0, 1), strict=True):
        inner[at[:, None], own] += push


def add_stiffness(cond: Condition, grid: Mesh, c: Road, tangent: Array) -> None:
    """Add the derivative of the road's virtual work, at constant shear, to its density."""
    k, at = c.kin, grid.contact
    per_phi = c.area / grid.weight[at][:, None]
    stiff = (per_phi * c.stiff)[..., None, None]
    square = stiff * k.z_grad[..., :, None] * k.z_grad[..., None, :]
    square[..., 2, 2] -= per_phi * (c.fx * k.x_bend + _upward(cond, c) * k.zeta_bend)
    for own, stiffness in zip(OWN, square.swapaxes(0, 1), strict=True):
        tangent[at[:, None, None], own[:, None], own] += stiffness


def force_blocks(tire: RigTire, grid: Mesh, c: Road) -> tuple[Array, Array]:
    """Return derivatives of the coefficients' residual with shear and axle height."""
    shear = np.array([tire.tread_shear_x, tire.tread_shear_y])
    ways = np.stack([_spread(grid, c.kin.x_grad), _spread(grid, c.kin.y_grad)], axis=-1)
    return -c.area[..., None, None] * ways * shear, _lift(grid, c)


def _lift(grid: Mesh, c: Road) -> Array:
    return np.asarray((c.area * c.stiff)[..., None] * _spread(grid, c.kin.z_grad))


def bristle_blocks(cond: Condition, grid: Mesh, c: Road) -> tuple[Array, ...]:
    """Differentiate e - P (carry e_before + part Delta) - c d, see `tirelib.rig.tread.Shear`.

    With the own shear, the one before, the own coefficients, those before, the axle height and
    the rolling radius.
    """
    s, n = c.shear, len(grid.contact)
    ways = np.stack([_spread(grid, c.kin.x_grad), _spread(grid, c.kin.y_grad)], axis=-2)
    deep = _spread(grid, c.kin.z_grad)[..., None, :]
    before = np.concatenate([np.zeros(1, dtype=np.intp), np.arange(n - 1)])
    moved = s.project * s.part[..., None, None]
    start = np.einsum("njab,njb->nja", s.project, s.delta)
    own_depth = s.from_depth + start * s.part_own[..., None]
    before_depth = start * s.part_before[..., None]
    step = np.zeros((n, N_STRIPS, 2))
    angle = np.diff(grid.phi[grid.contact])[:, None, None]
    step[1:] = angle * np.array([1.0, np.tan(cond.slip_angle)])
    return (
        np.broadcast_to(np.eye(2), (n, N_STRIPS, 2, 2)),
        -s.project * s.carry[..., None, None],
        moved @ ways + own_depth[..., None] * deep,
        -moved @ ways[before] + before_depth[..., None] * deep[before],
        own_depth + before_depth,
        np.einsum("njab,njb->nja", moved, step),
    )


def wheel_blocks(tire: RigTire, cond: Condition, grid: Mesh, c: Road) -> tuple[Array, ...]:
    """Return derivatives of Fz and of the wheel torque.

    Fz with coefficients and axle height; torque with coefficients, shear, axle height and
    rolling radius.
    """
    k, cg, sg = c.kin, np.cos(cond.camber), np.sin(cond.camber)
    lift = _lift(grid, c)
    turning = c.fx[..., None] * _spread(grid, k.zeta_grad)
    turning -= _upward(cond, c)[..., None] * _spread(grid, k.x_grad)
    return (
        -lift,
        np.array([-np.sum(c.area * c.stiff)]),
        -c.area[..., None] * turning - cg * k.x[..., None] * lift,
        -c.area[..., None]
        * np.stack([k.zeta * tire.tread_shear_x, k.x * sg * tire.tread_shear_y], axis=-1),
        np.array([-np.sum(c.area * k.x * c.stiff * cg)]),
        np.zeros(1),
    )
