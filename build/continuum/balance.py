"""The rolling tire in balance: three strips of layers, sidewalls, pressure, road.

Unknown are the nodes' displacements, the axle's height H (road force = load) and, with friction,
the rolling radius s = V / omega (no wheel torque). Strips at y = 0, 30 and 60 mm, the last two with
their mirror images, each meet the road with their own height of crown. They are tied by the
crown's bending stiffness, by the tension that the sidewalls put into the ply across it, and by the
belt's in-plane shear.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse.linalg import SuperLU, splu

from continuum.elements import bulk_work, carried_work, fields, line_work, pressure_work
from continuum.grid import Grid
from continuum.polar import Array, radial, tangential
from continuum.road import Road, columns, road, road_work, rows, scalars
from continuum.sidewall import SidewallLaw, at
from continuum.tire import SHARE, STRIPS, Condition, Tire


@dataclass(frozen=True)
class Balance:
    """The residual of a guess, and what Newton's method needs of it.

    Attributes
    ----------
    u : shape (n, 2)
    height, rolling : float
        Height of the axle over the road, and V / omega [m].
    omega : float
        [rad/s]
    residual : shape (2 n,)
    road : Road
    """

    tire: Tire
    law: SidewallLaw
    cond: Condition
    mesh: Grid
    u: Array
    height: float
    rolling: float
    omega: float
    residual: Array
    stiffness: tuple[Array, ...]
    road: Road

    @cached_property
    def factor(self) -> SuperLU:
        """Factors of the stiffness at constant height and rolling radius."""
        matrix = self.mesh.add.matrix(list(self.stiffness))
        return splu(
            matrix,
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )

    def surface_vector(self, part: Array) -> Array:
        """Add up something of the surface's elements, shape (E, 6)."""
        rows_ = self.mesh.add.rows[3].ravel()
        return np.asarray(np.bincount(rows_, part.ravel(), self.mesh.add.size), dtype=np.float64)


def balance(
    tire: Tire,
    law: SidewallLaw,
    cond: Condition,
    mesh: Grid,
    u: Array,
    height: float,
    rolling: float,
    omega: float,
) -> Balance:
    """Set up the balance of a guess."""
    table = np.array([[m.shear, m.lame, m.cords] for m in tire.layers])
    density = np.array([m.density for m in tire.layers])
    width = SHARE * tire.belt_width
    inner = mesh.gage
    contact = road(tire, mesh, u, height, rolling)
    work = (
        bulk_work(mesh.bulk, table[mesh.layer], density[mesh.layer], width[mesh.strip], u, omega),
        pressure_work(inner, cond.pressure * mesh.of_strip(width, inner), u),
        _sidewalls(tire, law, cond, mesh, u, omega),
        road_work(mesh, contact),
        tie_part(tire, law, cond, mesh, u),
        carried_part(tire, mesh, u, omega),
    )
    force, stiff = zip(*work, strict=True)
    return Balance(
        tire,
        law,
        cond,
        mesh,
        u,
        height,
        rolling,
        omega,
        mesh.add.vector(list(force)),
        stiff,
        contact,
    )


def sidewall_force(
    tire: Tire, law: SidewallLaw, cond: Condition, mesh: Grid, u: Array, omega: float
) -> tuple[Array, Array, Array]:
    """Return the sidewalls' force on the belt [N/m], (E, Q, 2), and its two derivatives.

    In the directions e_r and e_t of the material, which turn with the rim, for the whole width;
    derivatives with displacement and its slope.
    """
    line, p = mesh.carcass, cond.pressure
    own, slope = fields(line, u)
    out, along = radial(line.phi), tangential(line.phi)
    w, v = np.sum(own * out, axis=-1), np.sum(own * along, axis=-1)
    w_phi, v_phi = np.sum(slope * out, axis=-1) + v, np.sum(slope * along, axis=-1) - w
    push, by_w = law.force(w, p, tire.softening)
    k_u, k_v = at(law.radial, p), at(law.tangential, p)
    lag = tire.damping * omega
    push = (push - lag * k_u * w_phi)[..., None] * out
    force = push - (k_v * (v + lag * v_phi))[..., None] * along

    def outer(a: Array, b: Array) -> Array:
        return a[..., :, None] * b[..., None, :]

    rr, tt = outer(out, out), outer(along, along)
    by_value = by_w[..., None, None] * rr - k_v * tt
    by_value += lag * (k_v * outer(along, out) - k_u * outer(out, along))
    return force, by_value, -lag * (k_u * rr + k_v * tt)


def _sidewalls(
    tire: Tire, law: SidewallLaw, cond: Condition, mesh: Grid, u: Array, omega: float
) -> tuple[Array, Array]:
    line = mesh.carcass
    weight = line.weight * tire.ring_radius * mesh.of_strip(tire.sidewall_share, line)
    return line_work(line, weight, *sidewall_force(tire, law, cond, mesh, u, omega))


def carried_part(tire: Tire, mesh: Grid, u: Array, omega: float) -> tuple[Array, Array]:
    """Return residual (E, 12) and stiffness of the tread's and liner's mass on the belt."""
    mass, height = (np.array(part) for part in zip(*map(tire.carried, range(3)), strict=True))
    line = mesh.back
    lever = mesh.of_strip(height / tire.belt_thickness, line)
    per_radian = mesh.of_strip(mass * SHARE, line) * tire.ring_radius
    return carried_work(line, mesh.carcass, lever, per_radian, u, omega)


def tie_part(
    tire: Tire, law: SidewallLaw, cond: Condition, mesh: Grid, u: Array
) -> tuple[Array, Array]:
    """Return residual (E, 18) and stiffness of the crown between the strips, of the whole width."""
    line, step = mesh.carcass, STRIPS[1] - STRIPS[0]
    count = len(mesh.tied)
    value, phi = line.value[:count], line.phi[:count]
    weight = line.weight[:count] * tire.ring_radius
    out, along = radial(phi), tangential(phi)
    tension = max(at(law.tension, cond.pressure), 0.0)
    bend = tire.crown_bending / step**3
    terms = (
        (out, 2.0 * tension / step, ((-1.0, 1.0, 0.0), (0.0, -1.0, 1.0))),
        (out, bend, ((-2.0, 2.0, 0.0),)),
        (out, 2.0 * bend, ((1.0, -2.0, 1.0),)),
        (along, 2.0 * tire.crown_shear / step, ((-1.0, 1.0, 0.0), (0.0, -1.0, 1.0))),
    )
    stiff = np.zeros((count, 18, 18))
    for way, k, differences in terms:
        for difference in differences:
            b = np.einsum("s,eqn,eqi->eqsni", np.array(difference), value, way).reshape(
                count, -1, 18
            )
            stiff += k * (np.swapaxes(b, 1, 2) * weight[:, None, :]) @ b
    own = u[mesh.tied].reshape(count, 18, 1)
    return (stiff @ own)[..., 0], stiff


def step(
    now: Balance, target: float | None, factor: SuperLU | None = None
) -> tuple[Array, float, float]:
    """Return Newton's step of displacements, height and rolling radius.

    Parameters
    ----------
    factor : SuperLU, optional
        Factors of a state near by, instead of this one's own.
    target : float or None
        Height to go to; None asks for the load.
    """
    rise, turn = columns(now.mesh, now.road)
    load, torque = rows(now.mesh, now.road)
    sides = np.stack([now.residual, now.surface_vector(rise), now.surface_vector(turn)], axis=1)
    free = now.tire.friction > 0.0
    solved = (factor or now.factor).solve(sides if free else sides[:, :2])
    inner = scalars(now.road)
    miss = np.array([now.road.load - now.cond.load, now.road.torque])
    left = np.stack([now.surface_vector(load), now.surface_vector(torque)])
    if target is not None:
        left[0], inner[0], miss[0] = 0.0, (1.0, 0.0), now.height - target
    count = 2 if free else 1
    reduced = inner[:count, :count] - left[:count] @ solved[:, 1 : 1 + count]
    change = np.linalg.solve(reduced, -(miss[:count] - left[:count] @ solved[:, 0]))
    moved = -(solved[:, 0] + solved[:, 1 : 1 + count] @ change)
    return moved.reshape(-1, 2), float(change[0]), float(change[1]) if free else 0.0
