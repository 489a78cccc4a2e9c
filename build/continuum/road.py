"""The road under the tread: unilateral pressure, Coulomb friction, and their derivatives.

The road presses where the surface is below it, in proportion to the depth: asperities some twenty
times stiffer than the tread. The surface slips by g = x_phi + s per radian, s the rolling radius
V / omega. Friction is Coulomb's, regularised: tau = -mu q g / sqrt(g^2 + (c s)^2), c the tire's
`creep`, so that full sliding has mu q and sticking creeps a little.
"""

from dataclasses import dataclass

import numpy as np

from continuum.elements import fields, line_work
from continuum.grid import Grid
from continuum.polar import Array
from continuum.tire import SHARE, Tire


@dataclass(frozen=True)
class Road:
    """What the road does at the Gauss points of the surface, shapes (E, Q), SI.

    Attributes
    ----------
    x, z : position from the axle, forward and up
    depth : below the road
    area : reference area with its width
    q, q_z : pressure, and its derivative with z
    tau, tau_q, tau_g : friction forward on the tire, derivatives with q and slip
    slip : per radian
    """

    x: Array
    z: Array
    depth: Array
    area: Array
    q: Array
    q_z: Array
    tau: Array
    tau_q: Array
    tau_g: Array
    slip: Array

    @property
    def load(self) -> float:
        """Upward force [N]."""
        return float(np.sum(self.q * self.area))

    @property
    def forward(self) -> float:
        """Forward force on the tire [N]."""
        return float(np.sum(self.tau * self.area))

    @property
    def torque(self) -> float:
        """Moment about the axle in the direction in which the wheel turns [N m]."""
        return float(np.sum((self.x * self.q - self.z * self.tau) * self.area)) * -1.0

    @property
    def dissipated(self) -> float:
        """Friction work per radian of turn [J]."""
        return -float(np.sum(self.tau * self.slip * self.area))


def road(tire: Tire, mesh: Grid, u: Array, height: float, rolling: float) -> Road:
    """Return the contact for displacements u, axle height and rolling radius [m]."""
    line = mesh.surface
    own, slope = fields(line, u)
    cos, sin = np.cos(line.phi), np.sin(line.phi)
    x, z = -line.radius * sin + own[..., 0], -line.radius * cos + own[..., 1]
    depth = -(z + height)
    q, q_z = tire.contact(depth)
    if tire.water:
        wedge, by_gap = tire.wedge(-depth)
        q, q_z = q + wedge * (x > 0.0), q_z - by_gap * (x > 0.0)
    slip = -line.radius * cos + slope[..., 0] + rolling
    limit = tire.creep * rolling
    root = np.sqrt(slip**2 + limit**2)
    mu = tire.friction
    return Road(
        x=x,
        z=z,
        depth=depth,
        area=line.weight * line.radius * mesh.of_strip(SHARE, line) * tire.belt_width,
        q=q,
        q_z=-q_z,
        tau=-mu * q * slip / root,
        tau_q=-mu * slip / root,
        tau_g=-mu * q * limit**2 / root**3,
        slip=slip,
    )


def road_work(mesh: Grid, at: Road) -> tuple[Array, Array]:
    """Return the road's residual (E, 6) and stiffness (E, 6, 6)."""
    by_value, by_slope = (np.zeros((*at.q.shape, 2, 2)) for _ in range(2))
    by_value[..., 1, 1] = at.q_z
    by_value[..., 0, 1] = at.tau_q * at.q_z
    by_slope[..., 0, 0] = at.tau_g
    force = np.stack([at.tau, at.q], axis=-1)
    return line_work(mesh.surface, at.area, force, by_value, by_slope)


def columns(mesh: Grid, at: Road) -> tuple[Array, Array]:
    """Return the residual's derivatives with axle height and rolling radius, shape (2, E, 6).

    Height acts as a rise of all z, the rolling radius as a slip of all points (its own effect on
    the width of the regularisation is left out, which costs Newton's method nothing to speak of).
    """
    line = mesh.surface
    rise = np.stack([at.tau_q * at.q_z, at.q_z], axis=-1)
    turn = np.stack([at.tau_g, 0.0 * at.tau_g], axis=-1)
    return line_work(line, at.area, rise)[0], line_work(line, at.area, turn)[0]


def rows(mesh: Grid, at: Road) -> tuple[Array, Array]:
    """Return the derivatives of load and torque with the unknowns of the elements, (2, E, 6)."""
    line, zero = mesh.surface, np.zeros_like(at.q)
    load = line_work(line, -at.area, np.stack([zero, at.q_z], axis=-1))[0]
    by_x = at.q
    by_z = at.x * at.q_z - at.tau - at.z * at.tau_q * at.q_z
    torque = line_work(line, at.area, np.stack([by_x, by_z], axis=-1))[0]
    slope = -at.z * at.tau_g * at.area
    along = np.zeros((len(line.dofs), 3, 2))
    along[..., 0] = np.einsum("eqn,eq->en", line.slope, slope)
    return load, torque - along.reshape(len(line.dofs), 6)


def scalars(at: Road) -> Array:
    """Return the derivatives of load and torque with height and rolling radius, shape (2, 2)."""
    by_z = at.x * at.q_z - at.tau - at.z * at.tau_q * at.q_z
    return np.array(
        [
            [np.sum(at.q_z * at.area), 0.0],
            [-np.sum((by_z + at.tau) * at.area), np.sum(at.z * at.tau_g * at.area)],
        ]
    )
