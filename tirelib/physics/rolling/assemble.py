"""Residual and matrix of the rolling ring, element by element, for all operating points at once.

A node has four unknowns: u, v, psi and the shear q of the tread's bristle there. The first node and
two numbers of the whole tire, the deflection d and the rolling radius rho, stand at the border of a
band matrix. The equations are the virtual work of u, v and psi, the bristles' law, the vertical
load and the wheel's torque.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.physics.rolling import belt, road
from tirelib.physics.rolling.band import BORDER, WIDTH, Matrix, banded, gathered
from tirelib.physics.rolling.constants import Constants
from tirelib.physics.rolling.mesh import Mesh, Points

Q = 3
ROAD = tuple(name for name in Constants.__slots__ if name == "radius" or name not in belt.CONSTANTS)
"""Constants that the contact is made of."""


@dataclass(frozen=True, slots=True, eq=False)
class Unknowns:
    """A solution or a step: nodes (n_points, n_nodes, 4), deflection and rolling radius."""

    node: FloatArray
    depth: FloatArray
    rolling: FloatArray

    def plus(self, other: "Unknowns", share: FloatArray) -> "Unknowns":
        """Return the sum with a share (n_points,) of the other."""
        return Unknowns(
            self.node + share[:, None, None] * other.node,
            self.depth + share * other.depth,
            self.rolling + share * other.rolling,
        )

    def per(self, step: float) -> "Unknowns":
        """Return a difference per step."""
        return Unknowns(self.node / step, self.depth / step, self.rolling / step)

    def take(self, index: Any) -> "Unknowns":
        """Return some points."""
        return Unknowns(self.node[index], self.depth[index], self.rolling[index])


@dataclass(frozen=True, slots=True, eq=False)
class Contact:
    """Forces of the road at its integration points (n_points, n_fine, n_road), and at the nodes.

    Attributes
    ----------
    tip : Tip
    delta, pressure, slope : [m], [N/m], [N/m^2]
    shear : [N/m]
        k_s q on the tread along X.
    node : Tip
        At the fine elements' four nodes, (n_points, n_fine, 4).
    touches : shape (n_points, n_fine, 3)
        Whether each element's second to fourth node is below the road.
    q : shape (n_points, n_fine, 3), [m]
        Shear by the bristles' law there.
    by_q, by_step, by_before, by_after, by_rolling : shape (n_points, n_fine, 3)
        Its slopes by the shear at the node before, by the way that road and tip have moved apart
        since, by the overlaps there and here, and by the rolling radius.
    """

    tip: road.Tip
    delta: FloatArray
    pressure: FloatArray
    slope: FloatArray
    shear: FloatArray
    node: road.Tip
    touches: BoolArray
    q: FloatArray
    by_q: FloatArray
    by_step: FloatArray
    by_before: FloatArray
    by_after: FloatArray
    by_rolling: FloatArray


def by_element(node: FloatArray) -> FloatArray:
    """Return nodal values (n_points, n_nodes, ...) as (n_points, n_elements, 4, ...)."""
    n_elements = node.shape[1] // 3
    closed = np.concatenate([node, node[:, :1]], axis=1)
    return closed[:, 3 * np.arange(n_elements)[:, None] + np.arange(4)]


def fields(local: FloatArray, points: Points) -> FloatArray:
    """Return (u, v, psi, u', v', psi') at points, (6, n_points, n_elements, n)."""
    value = np.moveaxis(points.value @ local[..., :3], -1, 0)
    slope = np.moveaxis(points.slope @ local[..., :3], -1, 0)
    return np.concatenate([value, slope])


def slopes_of(psi: FloatArray, mesh: Mesh) -> FloatArray:
    """Return psi' at the road's points for nodal values (n_points, n_fine, 4)."""
    return np.asarray(np.einsum("egi,pei->peg", mesh.road.slope, psi))


def nodal_slopes(psi: FloatArray, mesh: Mesh) -> FloatArray:
    """Return psi' at the fine elements' four nodes."""
    return np.asarray(np.einsum("emi,pei->pem", mesh.at_nodes, psi))


def contact(x: Unknowns, local: FloatArray, k: Constants, mesh: Mesh) -> Contact:
    """Return the state of the contact."""
    fine = local[:, mesh.fine]
    u, v, psi = np.moveaxis(mesh.road.value @ fine[..., :3], -1, 0)
    bend = slopes_of(fine[..., 2], mesh)
    at = road.tip(u, v, psi, bend, mesh.road.phi, k)
    height = (k.free_radius - x.depth)[:, None, None]
    delta = at.down - height
    push, slope = road.pressure(delta, k)
    shear = k.k_s[:, None, None] * (mesh.road.linear @ fine[..., Q, None])[..., 0]
    angle = mesh.node_angles
    bent = nodal_slopes(fine[..., 2], mesh)
    tips = road.tip(fine[..., 0], fine[..., 1], fine[..., 2], bent, angle, k)
    over = tips.down - height
    most, by_overlap = road.pressure(over[..., 1:], k)
    entered, by_before, by_after = road.entered(over[..., :-1], over[..., 1:])
    share = np.divide(k.friction, k.k_s, out=np.zeros(len(k)), where=k.grips)[:, None, None]
    way = np.diff(angle)
    step = x.rolling[:, None, None] * way - np.diff(tips.along, axis=-1)
    slack = (k.creep * x.rolling)[:, None, None] * way
    q, by_q, by_limit, by_creep = road.bristles(
        fine[..., :-1, Q] + entered * step, share * most, entered * slack
    )
    by_entered = by_q * step + by_creep * slack
    return Contact(
        tip=at,
        delta=delta,
        pressure=push,
        slope=slope,
        shear=shear,
        node=tips,
        touches=over[..., 1:] > 0.0,
        q=q,
        by_q=by_q,
        by_step=by_q * entered,
        by_before=by_entered * by_before,
        by_after=by_entered * by_after + by_limit * share * by_overlap,
        by_rolling=entered * way * (by_q + by_creep * k.creep[:, None, None]),
    )


def residual(x: Unknowns, k: Constants, mesh: Mesh) -> tuple[Unknowns, FloatArray, Contact]:
    """Return the equations' residual, the element fields and the contact."""
    local = by_element(x.node)
    z = fields(local, mesh.belt)
    c = contact(x, local, k, mesh)
    out, road = _of_belt(z, k, mesh), _of_road(x, c, k, mesh)
    out[:, mesh.fine] += road.element
    law = local[..., 1:, Q].copy()
    law[:, mesh.fine] -= c.q
    out[..., 1:, Q] = law
    return Unknowns(gathered(out), road.load, road.torque), z, c


def changed(
    x: Unknowns, z: FloatArray, c: Contact, k: Constants, other: Constants, mesh: Mesh
) -> Unknowns:
    """Return the residual with other constants less that with k, whose fields and contact are z, c.

    What is made of the same constants is not computed again.
    """
    out = np.zeros((*z.shape[1:3], 4, WIDTH))
    load = torque = np.zeros(len(k))
    if differ(k, other, belt.CONSTANTS):
        out += _of_belt(z, other, mesh) - _of_belt(z, k, mesh)
    if differ(k, other, ROAD):
        there = contact(x, by_element(x.node), other, mesh)
        old, new = _of_road(x, c, k, mesh), _of_road(x, there, other, mesh)
        out[:, mesh.fine] += new.element - old.element
        out[:, mesh.fine, 1:, Q] -= there.q - c.q
        load, torque = new.load - old.load, new.torque - old.torque
    return Unknowns(gathered(out), load, torque)


def differ(k: Constants, other: Constants, names: Sequence[str]) -> bool:
    """Return whether any of these constants differs."""
    pairs = ((getattr(k, name), getattr(other, name)) for name in names)
    return not all(a is b or np.array_equal(a, b) for a, b in pairs)


def _of_belt(z: FloatArray, k: Constants, mesh: Mesh) -> FloatArray:
    """Return the work of belt and sidewall, (n_points, n_elements, 4, WIDTH)."""
    work = belt.forces(z, k) * mesh.belt.weight
    out = np.zeros((*z.shape[1:3], 4, WIDTH))
    for f in range(3):
        out[..., f] = (
            work[f] @ mesh.belt.value + (work[3 + f][:, :, None] @ mesh.belt.slope)[:, :, 0]
        )
    return out


@dataclass(frozen=True, slots=True, eq=False)
class _Road:
    """The road's work (n_points, n_fine, 4, WIDTH), and what load and torque lack."""

    element: FloatArray
    load: FloatArray
    torque: FloatArray


def _of_road(x: Unknowns, c: Contact, k: Constants, mesh: Mesh) -> _Road:
    area = k.radius[:, None, None] * mesh.road.weight
    out = np.zeros((*c.delta.shape[:2], 4, WIDTH))
    for f in range(3):
        pull = area * (c.pressure * c.tip.by_down[f] - c.shear * c.tip.by_along[f])
        out[..., f] = pull @ mesh.road.value
    pull = area * c.pressure * c.tip.by_down[3]
    out[..., 2] += np.einsum("peg,egi->pei", pull, mesh.road.slope)
    load = (area * c.pressure).sum(axis=(1, 2)) - k.load
    grip = (area * (c.pressure * c.tip.along + c.shear * c.tip.arm)).sum(axis=(1, 2))
    torque = np.where(k.grips, grip + k.torque, x.rolling - k.free_radius)
    return _Road(out, load, torque)


def matrix(x: Unknowns, z: FloatArray, c: Contact, k: Constants, mesh: Mesh) -> Matrix:
    """Return the derivative of `residual` at its fields and contact."""
    n, n_elements = len(k), mesh.n_elements
    element = np.zeros((n, n_elements, 4, WIDTH, 4, WIDTH))
    element[:, :, :, :3, :, :3] = _belt_blocks(z, k, mesh)
    area = k.radius[:, None, None] * mesh.road.weight
    value, linear = mesh.road.value, mesh.road.linear
    pairs = np.einsum("gi,gj->gij", value, value).reshape(len(value), 16)
    with_q = np.einsum("gi,gj->gij", value, linear).reshape(len(value), 16)
    sides = np.zeros((n, n_elements, 4, WIDTH, 2))
    rows = np.zeros((n, 2, n_elements, 4, WIDTH))
    n_fine = area.shape[1]
    fine = mesh.fine
    for i in range(3):
        for j in range(i + 1):  # the pressure's part is symmetric
            each = c.slope * c.tip.by_down[i] * c.tip.by_down[j]
            each = each + _second(c, i, j)
            block = ((area * each) @ pairs).reshape(n, n_fine, 4, 4)
            element[:, fine, :, i, :, j] += block
            if j < i:
                element[:, fine, :, j, :, i] += block
        held = (area * -c.tip.by_along[i]) @ with_q
        stiff = k.k_s[:, None, None, None]
        element[:, fine, :, i, :, Q] += stiff * held.reshape(n, n_fine, 4, 4)
        sides[:, fine, :, i, 0] += (area * c.slope * c.tip.by_down[i]) @ value
        rows[:, 0, fine, :, i] += (area * c.slope * c.tip.by_down[i]) @ value
        turned = c.slope * c.tip.by_down[i] * c.tip.along + c.pressure * c.tip.by_along[i]
        turned = turned + c.shear * c.tip.by_down[i]
        rows[:, 1, fine, :, i] += (area * turned) @ value
    rows[:, 1, fine, :, Q] += k.k_s[:, None, None] * ((area * c.tip.arm) @ linear)
    _thickening(element, sides, rows, area, c, mesh)
    _bristle_rows(element, sides, c, mesh)
    corner = np.zeros((n, BORDER, BORDER))
    corner[:, 4, 4] = (area * c.slope).sum(axis=(1, 2))
    corner[:, 5, 4] = (area * c.slope * c.tip.along).sum(axis=(1, 2))
    rows[:, 1] *= k.grips[:, None, None, None]
    corner[:, 5, 4] *= k.grips
    corner[:, 5, 5] = ~k.grips
    return banded(element, sides, rows, corner)


def _thickening(
    element: FloatArray,
    sides: FloatArray,
    rows: FloatArray,
    area: FloatArray,
    c: Contact,
    mesh: Mesh,
) -> None:
    """Add the derivatives that go through psi', by which the tread grows thicker."""
    slope, fine, by = mesh.road.slope, mesh.fine, c.tip.by_down[3]
    each = area * c.slope * by
    by_slope, by_value = _road_products(mesh)
    element[:, fine, :, 2, :, 2] += _summed(each * by, by_slope)
    for f in range(3):
        cross = _summed(each * c.tip.by_down[f], by_value)
        element[:, fine, :, 2, :, f] += cross
        element[:, fine, :, f, :, 2] += np.swapaxes(cross, 2, 3)
    pushed = np.einsum("peg,egi->pei", each, slope)
    sides[:, fine, :, 2, 0] += pushed
    rows[:, 0, fine, :, 2] += pushed
    turned = each * c.tip.along
    rows[:, 1, fine, :, 2] += np.einsum("peg,egi->pei", turned, slope)


def _second(c: Contact, i: int, j: int) -> FloatArray | float:
    if i == j == 2:
        out: FloatArray = -c.pressure * c.tip.lever_down + c.shear * c.tip.lever_along
        return out
    return 0.0


def _bristle_rows(element: FloatArray, sides: FloatArray, c: Contact, mesh: Mesh) -> None:
    """Add the derivatives of the bristles' law at each element's second to fourth node."""
    element[:, :, [1, 2, 3], Q, [1, 2, 3], Q] = 1.0
    for m in range(3):
        after, on = m + 1, c.by_step[..., m]
        by_before, by_after = c.by_before[..., m], c.by_after[..., m]
        rows = element[:, mesh.fine]
        rows[:, :, after, Q, m, Q] -= c.by_q[..., m]
        for f in range(3):
            down, along = c.node.by_down[f], c.node.by_along[f]
            rows[:, :, after, Q, m, f] -= on * along[..., m] + by_before * down[..., m]
            rows[:, :, after, Q, after, f] += on * along[..., after] - by_after * down[..., after]
        thicker = c.node.by_down[3]
        moved = by_before[..., None] * thicker[..., m, None] * mesh.at_nodes[:, m]
        moved = moved + by_after[..., None] * thicker[..., after, None] * mesh.at_nodes[:, after]
        rows[:, :, after, Q, :, 2] -= moved
        sides[:, mesh.fine, after, Q, 0] -= by_before + by_after
        sides[:, mesh.fine, after, Q, 1] -= c.by_rolling[..., m]


def _belt_blocks(z: FloatArray, k: Constants, mesh: Mesh) -> FloatArray:
    """Return the belt's element matrices, (n_points, n_elements, 4, 3, 4, 3)."""
    h = belt.stiffness(z, k) * mesh.belt.weight
    n, n_elements = z.shape[1:3]
    # (6, 6) = (value/slope, 3) x (value/slope, 3)
    split = h.reshape(2, 3, 2, 3, n, n_elements, -1)
    ordered = np.ascontiguousarray(split.transpose(5, 4, 1, 3, 0, 2, 6))
    blocks = ordered.reshape(n_elements, n * 9, -1) @ _belt_products(mesh)
    out: FloatArray = blocks.reshape(n_elements, n, 3, 3, 4, 4).transpose(1, 0, 4, 2, 5, 3)
    return out


@cache
def _belt_products(mesh: Mesh) -> FloatArray:
    """Return the products of the belt's basis functions and slopes, (n_elements, 4 n_gauss, 16)."""
    value = np.broadcast_to(mesh.belt.value, mesh.belt.slope.shape)
    both = np.stack([value, mesh.belt.slope], axis=1)  # (n_elements, value or slope, n_gauss, 4)
    products = np.einsum("eagi,ebgj->eabgij", both, both)
    return np.asarray(products.reshape(mesh.n_elements, -1, 16))


@cache
def _road_products(mesh: Mesh) -> tuple[FloatArray, FloatArray]:
    """Return products of the road's slopes, with slopes and with basis functions.

    Both have the shape (n_fine, n_gauss, 16).
    """
    slope, value = mesh.road.slope, mesh.road.value
    shape = (*slope.shape[:2], 16)
    by_slope = np.einsum("egi,egj->egij", slope, slope).reshape(shape)
    return by_slope, np.einsum("egi,gj->egij", slope, value).reshape(shape)


def _summed(each: FloatArray, products: FloatArray) -> FloatArray:
    """Return the sums over each element's points (n_points, n_fine, n_gauss), as 4 by 4 blocks."""
    out = each[:, :, None] @ products
    return out.reshape(*each.shape[:2], 4, 4)
