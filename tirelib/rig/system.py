"""The discrete balance: residual and sparse Jacobian of belt, road and wheel.

Unknowns: spline coefficients of the 16 belt fields; the bristles' shear deflections at the
contact points (which the march gives exactly, so that they enter only the linear solve); the
axle height H; the rolling radius s = V_x / Omega. The last two belong to the equations
Fz = load, and either no wheel torque (free rolling) or s = R_e / (1 + kappa).
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu

from tirelib.rig.belt import FIELDS, internal, internal_force
from tirelib.rig.mesh import Mesh
from tirelib.rig.road import (
    LOCAL,
    OWN,
    Road,
    add_forces,
    add_stiffness,
    bristle_blocks,
    force_blocks,
    road,
    wheel_blocks,
    wheel_torque,
)
from tirelib.rig.tire import N_STRIPS, Array, Condition, RigTire

Index = NDArray[np.intp]


@dataclass(frozen=True)
class Balance:
    """A balance: residual of the belt's coefficients and of the two wheel equations.

    Coefficients, bristles, height and rolling radius stand in this order in `residual`.

    Attributes
    ----------
    z : array, shape (n_gauss, 32)
        Fields and derivatives at the Gauss points.
    omega : float, [rad/s]
    target, fixed_height
        See `balance`.
    """

    tire: RigTire
    cond: Condition
    grid: Mesh
    z: Array
    omega: float
    target: float | None
    fixed_height: float | None
    residual: Array
    road: Road

    @property
    def order(self) -> Index:
        """Unknowns in the order of the rows and columns of `matrix`."""
        return pattern(self.grid).order

    @cached_property
    def matrix(self) -> csc_matrix:
        """Derivative of the residual, without that of laws of the belt that have none."""
        lay, tire, cond, grid, contact = (
            pattern(self.grid),
            self.tire,
            self.cond,
            self.grid,
            self.road,
        )
        _, tangent = internal(tire, cond, self.omega, self.z)
        add_stiffness(cond, grid, contact, tangent)
        data = [
            _belt_blocks(lay, tangent),
            *force_blocks(tire, grid, contact),
            *bristle_blocks(cond, grid, contact),
            *wheel_blocks(tire, cond, grid, contact),
        ]
        if self.fixed_height is not None:
            data[9], data[10] = 0.0 * data[9], np.array([1e6])
        if self.target is not None:
            data[11:15] = [0.0 * b for b in data[11:14]] + [np.array([1e6])]
        values = np.bincount(lay.place, np.concatenate([d.ravel() for d in data]), lay.count)
        return csc_matrix((values, lay.rows, lay.starts), shape=(lay.size, lay.size))

    def times(self, x: Array) -> Array:
        """Return matrix @ x, both in the plain order."""
        out = np.zeros_like(x)
        out[self.order] = self.matrix @ x[self.order]
        return out

    def factor(self) -> Callable[[Array], Array]:
        """Return the solver of matrix @ x = b, for b and x in the plain order.

        Bristles that the road does not hold are left out, half of them all: b alone says what they
        do, which is nothing in Newton's steps.
        """
        shear = self.road.shear
        held = shear.project.any(axis=(-1, -2)) | shear.from_depth.any(axis=-1)
        taken = np.ones(len(self.order), dtype=bool)
        taken[-2 - shear.e.size : -2] = np.repeat(held.ravel(), shear.e.shape[-1])
        kept = np.flatnonzero(taken[self.order])
        order, matrix = self.order[kept], self.matrix[:, kept][kept]
        lu = splu(matrix, permc_spec="NATURAL", diag_pivot_thresh=0.0)

        def apply(right: Array) -> Array:
            out = np.where(taken, 0.0, right)
            if out.any():
                right = right - self.times(out)
            out[order] = lu.solve(right[order])
            return out

        return apply


@dataclass(frozen=True)
class Pattern:
    """Where the dense blocks of the Jacobian go in its sparse columns."""

    rows: Index
    starts: Index
    place: Index
    count: int
    size: int
    order: Index
    weights: Array
    shape: Array


@lru_cache(maxsize=8)
def pattern(grid: Mesh) -> Pattern:
    """Sparsity of the Jacobian on a mesh."""
    n_points, n_contact, n_belt = len(grid.phi), len(grid.contact), grid.n * FIELDS
    n_shear = n_contact * N_STRIPS * 2
    height, rolling = n_belt + n_shear, n_belt + n_shear + 1
    elements = np.arange(0, n_points, 2)
    fields = np.arange(FIELDS)
    belt = (grid.control[elements][:, :, None] * FIELDS + fields).reshape(len(elements), -1)
    local = (grid.control[grid.contact][:, None, None, :] * FIELDS + OWN[None, :, :, None]).reshape(
        n_contact, N_STRIPS, LOCAL
    )
    bristle = n_belt + np.arange(n_shear).reshape(n_contact, N_STRIPS, 2)
    before = np.concatenate([bristle[:1], bristle[:-1]])
    local_before = np.concatenate([local[:1], local[:-1]])
    h, s = np.full((1, 1), height), np.full((1, 1), rolling)
    flat = local.reshape(1, -1)
    blocks = (
        (belt, belt),
        (local, bristle),
        (flat.T, h),
        (bristle, bristle),
        (bristle, before),
        (bristle, local),
        (bristle, local_before),
        (bristle.reshape(-1, 1), h),
        (bristle.reshape(-1, 1), s),
        (h, flat),
        (h, h),
        (s, flat),
        (s, bristle.reshape(1, -1)),
        (s, h),
        (s, s),
    )
    size = n_belt + n_shear + 2
    order = _order_by_angle(grid)
    rank = np.argsort(order)
    keys = np.concatenate(
        [(rank[c][..., None, :] * size + rank[r][..., :, None]).ravel() for r, c in blocks]
    )
    unique, place = np.unique(keys, return_inverse=True)
    columns, rows = np.divmod(unique, size)
    rank = _least_fill(rows, columns, size)
    order = order[np.argsort(rank)]
    keys = rank[columns] * size + rank[rows]
    sorting = np.argsort(keys)
    columns, rows = np.divmod(keys[sorting], size)
    shape = np.stack([grid.value, grid.slope], axis=1)
    return Pattern(
        rows=rows,
        starts=np.searchsorted(columns, np.arange(size + 1)),
        place=np.argsort(sorting)[place.ravel()],
        count=len(unique),
        size=size,
        order=order,
        weights=grid.weight,
        shape=shape,
    )


def _least_fill(rows: Index, columns: Index, size: int) -> Index:
    """Return the places of unknowns in an order whose factors have few entries.

    It is COLAMD's, with three quarters of the fill, and of the time, of the order by angle alone.
    """
    values = np.where(rows == columns, float(size), 1.0)
    matrix = csc_matrix((values, (rows, columns)), shape=(size, size))
    return np.asarray(
        splu(matrix, permc_spec="COLAMD", diag_pivot_thresh=0.0).perm_c, dtype=np.intp
    )


def _order_by_angle(grid: Mesh) -> Index:
    """Unknowns in order of angle, the last control points and the wheel at the end."""
    index = np.arange(grid.n)
    centre = np.where(index < 3, 10.0 + index, grid.knots[np.maximum(index - 1, 0)])
    behind = grid.phi[grid.contact] + 2.0 * float(np.min(np.diff(grid.knots)))
    key = np.concatenate([np.repeat(centre, FIELDS), np.repeat(behind, 2 * N_STRIPS), [99, 100]])
    return np.argsort(key, kind="stable")


def fields_at_points(grid: Mesh, control: Array) -> Array:
    """Fields and derivatives at the Gauss points, shape (n_gauss, 32)."""
    around = control[grid.control]
    values = np.einsum("pa,paf->pf", grid.value, around)
    slopes = np.einsum("pa,paf->pf", grid.slope, around)
    return np.hstack([values, slopes])


def balance(
    tire: RigTire,
    cond: Condition,
    grid: Mesh,
    control: Array,
    height: float,
    rolling: float,
    target: float | None,
    fixed_height: float | None = None,
) -> Balance:
    """Residual of a state, and what its derivative is made of.

    Parameters
    ----------
    target : float or None
        Rolling radius to be kept [m]; None for no torque.
    fixed_height : float or None
        Axle height to be kept instead of the load [m].
    """
    lay = pattern(grid)
    omega = cond.speed * float(np.cos(cond.slip_angle)) / rolling
    z = fields_at_points(grid, control)
    inner = internal_force(tire, cond, omega, z)
    for law in tire.belt_laws:
        inner += law(tire, cond, omega, grid, z)
    contact = road(tire, cond, grid, z, height, rolling)
    add_forces(grid, contact, inner)
    residual = np.zeros(lay.size)
    spread = np.einsum("p,ptf,pta->paf", lay.weights, inner.reshape(-1, 2, FIELDS), lay.shape)
    np.add.at(residual[: grid.n * FIELDS].reshape(grid.n, FIELDS), grid.control, spread)
    load = float(np.sum(contact.area * contact.q))
    residual[-2] = load - cond.load if fixed_height is None else 1e6 * (height - fixed_height)
    residual[-1] = wheel_torque(cond, contact) if target is None else 1e6 * (rolling - target)
    return Balance(tire, cond, grid, z, omega, target, fixed_height, residual, contact)


def _belt_blocks(lay: Pattern, tangent: Array) -> Array:
    """Element matrices, (n_el, 64, 64) with rows last-but-one, from densities at Gauss points."""
    n = len(tangent)
    j = tangent.reshape(n, 2, FIELDS, 2, FIELDS)
    weighted = lay.shape * lay.weights[:, None, None]
    rows = np.einsum("pta,ptfsg->pafsg", weighted, j, optimize=True)
    whole = np.einsum("pafsg,psb->pafbg", rows, lay.shape, optimize=True)
    pairs = whole.reshape(n // 2, 2, 4 * FIELDS, 4 * FIELDS)
    return np.asarray(pairs[:, 0] + pairs[:, 1])
