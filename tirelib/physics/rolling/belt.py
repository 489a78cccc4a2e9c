r"""Belt and sidewall: forces and stiffness per radian of wheel angle.

The belt is a geometrically exact beam that stretches, shears and bends (Reissner 1972, Simo 1985).
Over the wheel angle phi, in the frame of the undeformed circle (n outward, t along +phi), u and v
are its displacement and psi the turn of its cross-section. With a = R + u + v' and c = u' - v

.. math:: R(1 + \Gamma_1) = a\cos\psi + c\sin\psi,\quad R\,\Gamma_2 = c\cos\psi - a\sin\psi,
          \quad \kappa = \psi' / R,

N = p b R + T + EA Gamma_1 along the section's normal, Q = GA Gamma_2 across it and M = EI kappa.
What the tension T has beside p b R is held by a radial force T / R of the sidewalls, which keeps
its direction: where plies pull inward, T is negative.
Material streams through the steady shape with Omega; its acceleration is Omega^2 r'', which holds
centrifugal and Coriolis terms. The pressure follows the deformed belt. The sidewall's springs and
dashpots act between belt and rim, both in the turning frame. Where the belt is pressed in, the
sidewall may soften: its radial force is k_u (exp(c u) - 1) / c, whose tangent is k_u exp(c u).
"""

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.physics.rolling.constants import Constants

Fields = tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]
U, V, PSI, DU, DV, DPSI = range(6)
CONSTANTS = (
    *("radius", "EA", "GA", "EI", "mass", "rotary_inertia", "inflation", "tension"),
    *("k_u", "k_v", "softening", "dashpots", "omega"),
)
"""Constants that belt and sidewall are made of."""


def forces(z: FloatArray, k: Constants) -> FloatArray:
    """Return the work of belt and sidewall on virtual (u, v, psi, u', v', psi').

    Parameters
    ----------
    z : shape (6, n_points, ...)
    k : Constants

    Returns
    -------
    shape (6, n_points, ...), per radian: internal less pressure, with inertia.
    """
    c = _columns(k, z.ndim - 2)
    belt = _Belt(z, c)
    out = np.empty_like(z)
    spin = c["mass"] * c["omega"] ** 2 * c["radius"]
    by_a = belt.N * belt.cos - belt.Q * belt.sin - spin * belt.a
    by_c = belt.N * belt.sin + belt.Q * belt.cos - spin * belt.c
    radius, omega = c["radius"], c["omega"]
    damp_u, damp_v = _dashpots(c)
    push = c["inflation"] * belt.a + c["tension"]
    out[U] = by_a - push + radius * (c["k_u"] * _pressed(c, z[U]) + damp_u * z[DU])
    out[V] = -by_c + c["inflation"] * belt.c + radius * (c["k_v"] * z[V] + damp_v * z[DV])
    out[DU], out[DV] = by_c, by_a
    out[PSI] = belt.N * belt.across - belt.Q * belt.along
    out[DPSI] = (c["EI"] / radius - c["rotary_inertia"] * omega**2 * radius) * z[DPSI]
    return out


def stiffness(z: FloatArray, k: Constants) -> FloatArray:
    """Return the derivatives of `forces`, shape (6, 6, n_points, ...)."""
    c = _columns(k, z.ndim - 2)
    belt = _Belt(z, c)
    radius, sin, cos = c["radius"], belt.sin, belt.cos
    spin = c["mass"] * c["omega"] ** 2 * radius
    ea, ga = c["EA"], c["GA"]
    aa = (ea * cos**2 + ga * sin**2) / radius - spin
    cc = (ea * sin**2 + ga * cos**2) / radius - spin
    ac = (ea - ga) / radius * sin * cos
    # turning the section turns its forces and changes its stretch and shear
    more_n, more_q = ea * belt.across / radius - belt.Q, ga * belt.along / radius - belt.N
    a_psi = more_n * cos + more_q * sin
    c_psi = more_n * sin - more_q * cos
    out = np.zeros((6, *z.shape))
    out[PSI, PSI] = more_n * belt.across + more_q * belt.along
    out[DPSI, DPSI] = c["EI"] / radius - c["rotary_inertia"] * c["omega"] ** 2 * radius
    a, b = ((U, 1.0), (DV, 1.0)), ((DU, 1.0), (V, -1.0))
    for rows, columns, value in ((a, a, aa), (b, b, cc), (a, b, ac), (b, a, ac)):
        for i, s in rows:
            for j, t in columns:
                out[i, j] += s * t * value
    for rows, value in ((a, a_psi), (b, c_psi)):
        for i, s in rows:
            out[i, PSI] += s * value
            out[PSI, i] += s * value
    for j, t in a:
        out[U, j] -= t * c["inflation"]
    for j, t in b:
        out[V, j] += t * c["inflation"]
    damp_u, damp_v = _dashpots(c)
    out[U, U] += radius * c["k_u"] * np.exp(c["softening"] * z[U])
    out[V, V] += radius * c["k_v"]
    out[U, DU] += radius * damp_u
    out[V, DV] += radius * damp_v
    return out


def strain(z: FloatArray, k: Constants, offset: FloatArray) -> FloatArray:
    """Return the circumferential strain at gages y < 0 from the neutral line, (n_points, ...).

    The fibre of length R + y: eps = (R Gamma_1 - y psi') / (R + y).
    """
    c = _columns(k, z.ndim - 2)
    y = np.reshape(np.asarray(offset, dtype=float), (-1, *[1] * (z.ndim - 2)))
    out: FloatArray = (_Belt(z, c).along - c["radius"] - y * z[DPSI]) / (c["radius"] + y)
    return out


def shear_angle(z: FloatArray, k: Constants) -> FloatArray:
    """Return by how much the belt's line is turned against its sections, (n_points, ...), [rad]."""
    belt = _Belt(z, _columns(k, z.ndim - 2))
    out: FloatArray = np.arctan2(belt.across, belt.along)
    return out


def gage_slopes(
    z: FloatArray, dz: FloatArray, k: Constants, offset: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return how `strain` and `shear_angle` move as the fields (6, n_points, ...) move by dz.

    Shapes (n_directions, n_points, ...), with dz of shape (n_directions, 6, n_points, ...).
    """
    c = _columns(k, z.ndim - 2)
    belt, y = _Belt(z, c), np.reshape(np.asarray(offset, dtype=float), (-1, *[1] * (z.ndim - 2)))
    da, dc, turn = dz[:, U] + dz[:, DV], dz[:, DU] - dz[:, V], dz[:, PSI]
    along = da * belt.cos + dc * belt.sin + turn * belt.across
    across = dc * belt.cos - da * belt.sin - turn * belt.along
    shear = (belt.along * across - belt.across * along) / (belt.along**2 + belt.across**2)
    return (along - y * dz[:, DPSI]) / (c["radius"] + y), shear


class _Belt:
    """Measures and section forces; `along` = R (1 + Gamma_1), `across` = R Gamma_2."""

    def __init__(self, z: FloatArray, c: dict[str, FloatArray]) -> None:
        radius = c["radius"]
        self.a = radius + z[U] + z[DV]
        self.c = z[DU] - z[V]
        self.cos, self.sin = np.cos(z[PSI]), np.sin(z[PSI])
        self.along = self.a * self.cos + self.c * self.sin
        self.across = self.c * self.cos - self.a * self.sin
        blown = c["inflation"] * radius + c["tension"]
        self.N = blown + c["EA"] * (self.along / radius - 1.0)
        self.Q = c["GA"] * self.across / radius


def _pressed(c: dict[str, FloatArray], u: FloatArray) -> FloatArray:
    """Return the sidewall's radial force over k_u, [m]: u where it does not soften."""
    soft = np.broadcast_to(c["softening"], u.shape)
    return np.divide(np.expm1(soft * u), soft, out=u.copy(), where=soft != 0.0)


def _dashpots(c: dict[str, FloatArray]) -> tuple[FloatArray, FloatArray]:
    """Return c Omega of radial and tangential dashpots."""
    each = 2.0 * c["dashpots"] * c["omega"]
    return each * np.sqrt(c["k_u"] * c["mass"]), each * np.sqrt(c["k_v"] * c["mass"])


def _columns(k: Constants, more: int) -> dict[str, FloatArray]:
    return {name: getattr(k, name).reshape(-1, *[1] * more) for name in CONSTANTS}
