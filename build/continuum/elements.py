"""Internal work of rubber, of material that streams through it, and of pressure on a face.

Each function returns a residual per element (internal minus external virtual work of unit
displacements) and its derivative; `Pattern` adds them up.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_matrix

from continuum.material import stress
from continuum.polar import Array, Bulk, Index, Line, radial, tangential

TURN = np.array([[0.0, -1.0], [1.0, 0.0]])
"""Turns e_t into e_r."""


def unknowns(dofs: Index) -> Index:
    """Return the unknowns (x, z of each node in turn) of elements, shape (E, 2 n)."""
    return np.stack([2 * dofs, 2 * dofs + 1], axis=-1).reshape(len(dofs), -1)


def bulk_work(
    bulk: Bulk, moduli: Array, density: Array, width: Array, u: Array, omega: float
) -> tuple[Array, Array]:
    """Return residual (E, 16) and stiffness (E, 16, 16) of rolling rubber.

    Material passes with omega d/dphi. Its acceleration omega^2 x_phiphi does, by parts round the
    wheel, the work -int rho omega^2 x_phi . delta x_phi, with x_phi = r F e_t: centrifugal and
    Coriolis forces are both inside.

    Parameters
    ----------
    moduli : shape (E, 3)
    density, width : shape (E,)
        [kg/m^3], and the width that each element stands for [m].
    u : shape (n, 2)
    """
    grad = np.einsum("eni,eqna->eqia", u[bulk.dofs], bulk.grad, optimize=True)
    every = np.broadcast_to(moduli[:, None, :], (*bulk.volume.shape, 3))
    p, a = stress(every, bulk.frame, grad)
    inertia = density[:, None] * (omega * bulk.radius) ** 2
    p[..., 0] -= inertia[..., None] * (bulk.frame + grad)[..., 0]
    a[..., 0, 0, 0, 0] -= inertia
    a[..., 1, 0, 1, 0] -= inertia
    dv = bulk.volume * width[:, None]
    count, points, nodes, _ = bulk.grad.shape
    flat = np.swapaxes(bulk.grad, 2, 3).reshape(count, 2 * points, nodes)  # (E, Q a, n)
    weighted = (p * dv[..., None, None]).transpose(0, 1, 3, 2).reshape(count, 2 * points, 2)
    force = np.swapaxes(flat, 1, 2) @ weighted
    stiff = np.empty((count, nodes, 2, nodes, 2))
    a *= dv[..., None, None, None, None]
    for i in range(2):
        for j in range(i, 2):
            moved = (a[..., i, :, j, :] @ flat.reshape(count, points, 2, nodes)).reshape(
                count, 2 * points, nodes
            )
            block = np.swapaxes(flat, 1, 2) @ moved
            stiff[:, :, i, :, j] = block
            if i != j:
                stiff[:, :, j, :, i] = np.swapaxes(block, 1, 2)
    return force.reshape(count, -1), stiff.reshape(count, 2 * nodes, 2 * nodes)


def fields(line: Line, u: Array) -> tuple[Array, Array]:
    """Return displacement and its derivative with phi on a line, shapes (E, Q, 2)."""
    own = u[line.dofs]
    return np.asarray(line.value @ own), np.asarray(line.slope @ own)


def line_work(
    line: Line,
    weight: Array,
    force: Array,
    by_value: Array | None = None,
    by_slope: Array | None = None,
) -> tuple[Array, Array]:
    """Return residual (E, 6) and stiffness (E, 6, 6) of a force that acts on a line.

    Parameters
    ----------
    weight : shape (E, Q)
        Weights of the Gauss points.
    force : shape (E, Q, 2)
        On the tire, per weight.
    by_value, by_slope : shape (E, Q, 2, 2)
        Derivative of the force with displacement and with its slope.
    """
    count = len(line.dofs)
    test = line.value * weight[..., None]
    residual = -np.einsum("eqn,eqi->eni", test, force)
    stiff = np.zeros((count, 3, 2, 3, 2))
    if by_value is not None:
        stiff -= np.einsum("eqn,eqij,eqm->enimj", test, by_value, line.value, optimize=True)
    if by_slope is not None:
        stiff -= np.einsum("eqn,eqij,eqm->enimj", test, by_slope, line.slope, optimize=True)
    return residual.reshape(count, 6), stiff.reshape(count, 6, 6)


def pressure_work(line: Line, push: Array, u: Array) -> tuple[Array, Array]:
    """Work of a pressure that follows the face and pushes it outward; `push` [N/m], (E, 1)."""
    x_phi = line.radius[..., None] * tangential(line.phi) + fields(line, u)[1]
    turned = x_phi @ TURN.T
    by_slope = np.broadcast_to(push[..., None, None] * TURN, (*line.phi.shape, 2, 2))
    return line_work(line, line.weight, push[..., None] * turned, by_slope=by_slope)


def carried_work(
    outer: Line, inner: Line, lever: Array, mass: Array, u: Array, omega: float
) -> tuple[Array, Array]:
    """Work of mass that a layer carries: its inertia, of points that lie on its section.

    They follow the middle of the layer and swing along the circumference as the section turns. (A
    lever on the layer's stretch as well would make short waves of the thickness unstable.)

    Parameters
    ----------
    outer, inner : Line
        Faces of the layer.
    lever : shape (E, 1)
        Distance of the mass from the layer's middle, over the layer's thickness [1].
    mass : shape (E, 1)
        Per radian [kg].
    """
    dofs = np.concatenate([outer.dofs, inner.dofs], axis=1)
    out, along = radial(outer.phi), tangential(outer.phi)
    middle = 0.5 * np.concatenate([outer.slope, inner.slope], axis=2)
    across = np.concatenate([outer.value, -inner.value], axis=2)[..., None]
    across_slope = np.concatenate([outer.slope, -inner.slope], axis=2)[..., None]
    swing = lever[..., None, None] * across * along[:, :, None, :]  # (E, Q, node, component)
    swing_slope = lever[..., None, None] * (
        across_slope * along[:, :, None, :] - across * out[:, :, None, :]
    )
    # x_phi = middle' + swing' e_t - swing e_r, components first
    b = np.einsum("eqi,eqnj->eqinj", along, swing_slope)
    b -= np.einsum("eqi,eqnj->eqinj", out, swing)
    b += np.einsum("eqn,ij->eqinj", middle, np.eye(2))
    b = b.reshape(*b.shape[:3], -1)
    thickness = outer.radius - inner.radius
    radius = 0.5 * (outer.radius + inner.radius) + lever * thickness
    own = u[dofs].reshape(len(dofs), -1)
    x_phi = radius[..., None] * along + np.einsum("eqik,ek->eqi", b, own)
    weight = (omega**2 * mass * outer.weight)[..., None, None]
    force = -np.einsum("eqik,eqi->ek", b * weight, x_phi)
    return force, -np.einsum("eqik,eqil->ekl", b * weight, b, optimize=True)


@dataclass(frozen=True)
class Pattern:
    """Where element matrices go in the sparse matrix; the same groups in the same order."""

    size: int
    rows: tuple[Index, ...]
    place: Index
    indices: Index
    starts: Index

    def vector(self, parts: list[Array]) -> Array:
        """Add up the residuals of the groups."""
        rows = np.concatenate([r.ravel() for r in self.rows])
        values = np.concatenate([p.ravel() for p in parts])
        return np.asarray(np.bincount(rows, values, self.size), dtype=np.float64)

    def matrix(self, parts: list[Array]) -> csc_matrix:
        """Add up the stiffnesses of the groups."""
        data = np.bincount(
            self.place, np.concatenate([p.ravel() for p in parts]), len(self.indices)
        )
        return csc_matrix((data, self.indices, self.starts), shape=(self.size, self.size))


def pattern(size: int, groups: list[Index]) -> Pattern:
    """Prepare the sums of groups of elements with these unknowns, each of shape (E, m)."""
    row = np.concatenate([np.repeat(g, g.shape[1], axis=1).ravel() for g in groups])
    column = np.concatenate([np.tile(g, (1, g.shape[1])).ravel() for g in groups])
    unique, place = np.unique(column * size + row, return_inverse=True)
    starts = np.searchsorted(unique // size, np.arange(size + 1))
    return Pattern(size, tuple(groups), place, unique % size, starts)
