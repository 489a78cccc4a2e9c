"""Law of one tread element: kinematics, springs and friction, Eq. (79)-(81).

The element stands on the belt at wheel angle phi, along the normal of the deformed belt, which is
declined by eta = phi + beta from the plumb line. With x along +phi at the road (rearward) and z
down, from the axle,

    n_r = (sin phi, cos phi),   n = (sin eta, cos eta),   root P = (R + u) n_r + v n_phi,
    n_phi = (cos phi, -sin phi), t = (cos eta, -sin eta), tip  Q = (R_e phi + x_0, R_l),

    h       = n . (Q - P) = R_l cos eta + (R_e phi + x_0) sin eta - (R + u) cos beta - v sin beta
    gamma h = t . (Q - P) = -R_l sin eta + (R_e phi + x_0) cos eta + (R + u) sin beta - v cos beta.

(The print has + v sin(phi - eta) at the end of gamma h, which is wrong.) The tip sticks to the
road, that is, it goes by at the speed R_e Omega; x_0 is zero in the dissertation. The springs pull
the root toward the tip: f_n = -q(h_0 - h), f_t = K_Gt gamma h; where |f_t| would exceed mu |f_n|
it keeps its direction and slides with mu |f_n|. Along the ring this is Eq. (81),

    q_u = f_n cos beta - f_t sin beta,   q_v = f_n sin beta + f_t cos beta,   q_beta = h f_t.
"""

from dataclasses import dataclass, fields

import numpy as np

from tirelib.core.arrays import BoolArray, FloatArray, IntArray
from tirelib.core.errors import ParameterError
from tirelib.core.parameters import Tire
from tirelib.physics.contact.tread import Tread, numbers

N_ARGUMENTS = 7
"""An element depends on u, v, beta, phi, R_e, R_l, x_0; derivatives stand in this order."""


@dataclass(frozen=True, slots=True)
class Shear:
    """Shear and friction of the tread, one value per operating point (or one for all).

    Attributes
    ----------
    stiffness : [N/m^2]
        K_Gt per length of circumference; 0 is allowed.
    friction : [-]
        mu between tread and road; 0 and infinity are allowed.
    """

    stiffness: float | FloatArray
    friction: float | FloatArray = np.inf

    def __post_init__(self) -> None:
        for field in fields(self):
            value = np.atleast_1d(numbers("tread shear", getattr(self, field.name), field.name))
            good = (value >= 0) & (np.isfinite(value) | (field.name == "friction"))
            if value.ndim > 1 or not good.all():
                shown = f"{value[~good].flat[0]:.6g}" if not good.all() else f"{value.shape}"
                raise ParameterError(
                    f"tread shear: {field.name} = {shown}; one number >= 0 for all points or one a "
                    "point is needed; check sign and unit"
                )

    @classmethod
    def of(cls, tire: Tire) -> "Shear":
        """Return the shear of a tire's tread."""
        return cls(tire.tread_shear_stiffness, tire.friction)

    def __len__(self) -> int:
        return max(np.size(self.stiffness), np.size(self.friction))

    def spread(self, n_points: int) -> "Shear":
        """Return one value per point in both fields."""
        return Shear(*[np.broadcast_to(getattr(self, f.name), (n_points,)) for f in fields(self)])

    def take(self, index: IntArray) -> "Shear":
        """Return the shear of some points (of one with a value per point)."""
        return Shear(*[np.asarray(getattr(self, f.name))[index] for f in fields(self)])


@dataclass(frozen=True, slots=True)
class Elements:
    """Tread elements in one state, shape (n_points, n_nodes); derivatives (..., N_ARGUMENTS).

    Attributes
    ----------
    height, offset : [m]
        h and gamma h of Eq. (79), tip and road moving together.
    normal, tangential : [N/m]
        f_n (negative in compression) and f_t on the belt.
    sliding : bool
    loads : shape (n_points, n_nodes, 3)
        q_u outward, q_v along +phi, [N/m], and q_beta, [N].
    d_height, d_offset : shape (n_points, n_nodes, N_ARGUMENTS)
    d_loads : shape (n_points, n_nodes, 3, N_ARGUMENTS)
    """

    height: FloatArray
    offset: FloatArray
    normal: FloatArray
    tangential: FloatArray
    sliding: BoolArray
    loads: FloatArray
    d_height: FloatArray
    d_offset: FloatArray
    d_loads: FloatArray


@dataclass(frozen=True, slots=True)
class Rolling:
    """Where the road and the tips are: R_e, R_l and x_0, each (n_points,), [m]."""

    effective_radius: FloatArray
    loaded_radius: FloatArray
    tip_offset: FloatArray


def kinematics(
    belt: FloatArray, phi: FloatArray, rolling: Rolling, radius: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return h, gamma h of Eq. (79) and their derivatives.

    Parameters
    ----------
    belt : shape (n_points, n_nodes, 3)
        u [m], v [m], beta [rad].
    phi : shape (n_points, n_nodes), [rad]
    rolling : Rolling
    radius : shape (n_points,), [m]
        R of the belt.
    """
    u, v, beta = belt[..., 0], belt[..., 1], belt[..., 2]
    r_e, r_l = rolling.effective_radius[:, None], rolling.loaded_radius[:, None]
    root = radius[:, None] + u
    x = r_e * phi + rolling.tip_offset[:, None]
    sin, cos = np.sin(phi + beta), np.cos(phi + beta)
    s, c = np.sin(beta), np.cos(beta)
    height = r_l * cos + x * sin - root * c - v * s
    offset = -r_l * sin + x * cos + root * s - v * c
    # n and t turn into each other with eta; phi also carries root and tip along
    d_height = [-c, -s, offset, offset + r_e * sin - root * s + v * c, phi * sin, cos, sin]
    d_offset = [s, -c, -height, -height + r_e * cos - root * c - v * s, phi * cos, -sin, cos]
    return height, offset, np.stack(d_height, axis=-1), np.stack(d_offset, axis=-1)


def elements(
    belt: FloatArray,
    phi: FloatArray,
    rolling: Rolling,
    radius: FloatArray,
    tread: Tread,
    shear: Shear,
) -> Elements:
    """Return the tread's forces on the belt, Eq. (79)-(81), with friction.

    Parameters
    ----------
    belt, phi, rolling, radius
        As for `kinematics`.
    tread, shear : Tread, Shear
        With one value per point in every field.
    """
    height, offset, d_height, d_offset = kinematics(belt, phi, rolling, radius)
    depth = np.asarray(tread.free_radius, dtype=float)[:, None] - radius[:, None] - height
    pressure, tangent = tread.force(depth), tread.tangent(depth)
    normal, d_normal = -pressure, tangent[..., None] * d_height

    stiffness = np.asarray(shear.stiffness, dtype=float)[:, None]
    sticking = stiffness * offset
    limit, d_limit = _limit(shear, pressure, d_normal)
    sliding = np.abs(sticking) > limit
    sign = np.sign(sticking)
    tangential = np.copysign(np.minimum(np.abs(sticking), limit), sticking)
    d_tangential = np.where(
        sliding[..., None], sign[..., None] * d_limit, stiffness[..., None] * d_offset
    )

    s, c = np.sin(belt[..., 2]), np.cos(belt[..., 2])
    q_u, q_v = normal * c - tangential * s, normal * s + tangential * c
    s, c = s[..., None], c[..., None]
    d_u, d_v = d_normal * c - d_tangential * s, d_normal * s + d_tangential * c
    d_u[..., 2] -= q_v
    d_v[..., 2] += q_u
    d_moment = d_height * tangential[..., None] + height[..., None] * d_tangential
    loads = np.stack([q_u, q_v, height * tangential], axis=-1)
    d_loads = np.stack([d_u, d_v, d_moment], axis=-2)
    return Elements(height, offset, normal, tangential, sliding, loads, d_height, d_offset, d_loads)


def _limit(
    shear: Shear, pressure: FloatArray, d_normal: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return mu |f_n| and its derivatives; without a limit infinity and zero."""
    mu = np.asarray(shear.friction, dtype=float)[:, None]
    bounded = np.isfinite(mu)
    finite = np.where(bounded, mu, 0.0)
    limit = np.where(bounded, finite * np.maximum(pressure, 0.0), np.inf)
    return limit, -(finite * (pressure > 0))[..., None] * d_normal
