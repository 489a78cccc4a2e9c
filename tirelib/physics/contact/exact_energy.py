"""Energy of the exact ring on the road and its derivatives, at integration nodes over the angle.

Local measures of the belt are (u, v, a - R, c, a', c') with a = R + u + v' and c = u' - v; the
unknowns are the cosine coefficients of u and the sine coefficients of v
(`tirelib.physics.contact.exact`).
"""

from dataclasses import dataclass, fields
from functools import cache

import numpy as np

from tirelib.core.arrays import FloatArray

N_MODES = 64
"""Enough for the belt's bend at the contact's ends: with 48 a misfit of some microstrain rings at
harmonic 49 all round the turn."""
PATCH = 0.6
"""Half-angle with dense integration nodes; the contact has to end within, [rad]."""
N_PATCH, N_REST = 96, 94
"""Nodes in the patch and in the rest of half a turn: products of the highest modes have to be
integrated, `N_MODES (pi - PATCH) / 2` nodes and a dozen more."""
LINEAR = ("ea", "ei", "pb", "ku", "kv", "kt")
"""Constants in which the energy is linear, in the order of `parts`."""
Belt = tuple[FloatArray, FloatArray, FloatArray, FloatArray]


@dataclass(frozen=True, slots=True)
class Constants:
    """Columns (n_points, 1) of ring and tread.

    Attributes
    ----------
    r, r0, h : [m]
        Ring radius, free radius, depth of the tread's tip below the belt.
    ea : [N]; ei : [N m^2]; pb : [N/m]; ku, kv, kt : [N/m^2]
    s : [1/m]
        Hardening of the tread over its thickness.
    """

    r: FloatArray
    ea: FloatArray
    ei: FloatArray
    pb: FloatArray
    ku: FloatArray
    kv: FloatArray
    kt: FloatArray
    r0: FloatArray
    s: FloatArray
    h: FloatArray

    def take(self, rows: slice) -> "Constants":
        """Return the constants of some points."""
        return Constants(*[getattr(self, field.name)[rows] for field in fields(self)])


@cache
def quadrature() -> tuple[FloatArray, FloatArray]:
    """Return angles in (0, pi) and weights that count both halves."""
    x1, w1 = np.polynomial.legendre.leggauss(N_PATCH)
    x2, w2 = np.polynomial.legendre.leggauss(N_REST)
    rest = np.pi - PATCH
    angle = np.concatenate([(x1 + 1) / 2 * PATCH, PATCH + (x2 + 1) / 2 * rest])
    return angle, np.concatenate([w1 * PATCH, w2 * rest])


def basis(phi: FloatArray) -> FloatArray:
    """Return (u, v, u + v', u' - v, u' + v'', u'' - v') per coefficient, (n_phi, 6, n_dof)."""
    n = np.arange(N_MODES + 1.0)
    cos, sin = np.cos(np.outer(phi, n)), np.sin(np.outer(phi, n))
    none, m = np.zeros_like(cos), n[1:]
    u = [np.hstack([f, none[:, 1:]]) for f in (cos, -n * sin, -(n**2) * cos)]
    v = [np.hstack([none, f]) for f in (sin[:, 1:], m * cos[:, 1:], -(m**2) * sin[:, 1:])]
    return np.stack([u[0], v[0], u[0] + v[1], u[1] - v[0], u[1] + v[2], u[2] - v[1]], axis=1)


@cache
def basis_at_nodes() -> FloatArray:
    """Return `basis` at the nodes of `quadrature`."""
    return basis(quadrature()[0])


@cache
def fine() -> tuple[FloatArray, FloatArray]:
    """Return angles over the dense part, and `basis` there."""
    angle = np.linspace(0.0, PATCH, 601)
    return angle, basis(angle)


def measures(x: FloatArray, at: FloatArray) -> FloatArray:
    """Return local measures (n_points, n_phi, 6) of coefficients x at a basis (n_phi, 6, n_dof)."""
    out: FloatArray = (x @ at.reshape(-1, at.shape[2]).T).reshape(len(x), -1, 6)
    return out


def overlap(
    local: FloatArray, d0: FloatArray, k: Constants, angle: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return tread overlap with the road, and sine and cosine parts of the tread's lean."""
    u, v = local[..., 0], local[..., 1]
    a, c = k.r + local[..., 2], local[..., 3]
    lean = angle - np.arctan2(c, a)
    delta = (k.r + u) * np.cos(angle) - v * np.sin(angle) + k.h * np.cos(lean) - (k.r0 - d0)
    return delta, k.h * np.sin(lean), k.h * np.cos(lean)


def parts(
    local: FloatArray, d0: FloatArray, k: Constants, angle: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return first derivatives of the energy per angle, for one of each of `LINEAR`.

    Parameters
    ----------
    local : shape (n_points, n_nodes, 6)
    d0 : shape (n_points, 1), [m]
    k : Constants
    angle : shape (n_nodes,), [rad]

    Returns
    -------
    slope : shape (6, n_points, n_nodes, 6)
        By (u, v, a, c, a', c').
    force : shape (n_points, n_nodes)
        Derivative of the tread's force by the deflection, for k_t = 1.
    """
    (a, c, da, dc), q = belt = _belt(local, k)
    u, v = local[..., 0], local[..., 1]
    unit, stretch = _stretch(*belt, k)
    bend, turn = _bend(*belt)
    delta, lean_sin, _ = overlap(local, d0, k, angle)
    pressed = np.maximum(delta, 0.0)
    force: FloatArray = k.r * pressed * (1.0 + k.s * pressed)
    slope = np.zeros((len(LINEAR), *local.shape))
    slope[0, ..., 2:4] = stretch[..., None] * unit
    slope[1, ..., 2:] = (bend / k.r)[..., None] * turn
    slope[2] = 0.5 * np.stack([-a, c, -(k.r + u), v, 0.0 * a, 0.0 * a], -1)
    slope[2, ..., 2:4] += k.r[..., None] * unit
    slope[3, ..., 0] = u * k.r
    slope[4, ..., 1] = v * k.r
    slope[5, ..., :4] = force[..., None] * _tip((a, c, da, dc), q, lean_sin, angle)
    return slope, force


def curvature(
    local: FloatArray, d0: FloatArray, k: Constants, angle: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return second derivatives of the energy per angle, arguments as for `parts`.

    Returns
    -------
    curve : shape (n_points, n_nodes, 6, 6)
        By the local measures, twice.
    by_local, by_depth : shape (n_points, n_nodes, 6) and (n_points, n_nodes)
        Derivatives of the tread's force by measures and by the deflection.
    """
    belt, q = _belt(local, k)
    a, c, _, _ = belt
    curve = np.zeros((*local.shape, 6))
    _belt_curvature(curve, belt, q, k)
    curve[..., 0, 0] += k.ku * k.r
    curve[..., 1, 1] += k.kv * k.r
    for i, j, sign in ((0, 2, -0.5), (1, 3, 0.5)):
        curve[..., i, j] += sign * k.pb
        curve[..., j, i] += sign * k.pb
    # tread: delta by u, v and by the section's turn omega = atan2(c, a)
    delta, lean_sin, lean_cos = overlap(local, d0, k, angle)
    pressed = np.maximum(delta, 0.0)
    force = k.r * k.kt * pressed * (1.0 + k.s * pressed)
    by_depth = np.where(delta > 0, k.r * k.kt * (1.0 + 2.0 * k.s * pressed), 0.0)
    turn_a, turn_c = -c / q, a / q
    tip = _tip(belt, q, lean_sin, angle)
    curve[..., :4, :4] += by_depth[..., None, None] * tip[..., :, None] * tip[..., None, :]
    twist = np.stack([2.0 * a * c, c * c - a * a, -2.0 * a * c]) / q**2
    curve[..., 2, 2] += force * (-lean_cos * turn_a**2 + lean_sin * twist[0])
    curve[..., 3, 3] += force * (-lean_cos * turn_c**2 + lean_sin * twist[2])
    mixed = force * (-lean_cos * turn_a * turn_c + lean_sin * twist[1])
    curve[..., 2, 3] += mixed
    curve[..., 3, 2] += mixed
    by_local = np.zeros_like(local)
    by_local[..., :4] = by_depth[..., None] * tip
    return curve, by_local, by_depth


def residuals(x: FloatArray, d0: FloatArray, k: Constants) -> FloatArray:
    """Return the energy's slope by coefficients and the tread's force, per one of `LINEAR`.

    Returns
    -------
    shape (6, n_points, n_dof + 1)
    """
    angle, weight = quadrature()
    at = basis_at_nodes()
    slope, force = parts(measures(x, at), d0[:, None], k, angle)
    by_x = (slope * weight[:, None]).reshape(6 * len(x), -1) @ at.reshape(-1, at.shape[2])
    out = np.zeros((6, len(x), x.shape[1] + 1))
    out[..., :-1] = by_x.reshape(6, len(x), -1)
    out[5, :, -1] = force @ weight
    return out


def residual(x: FloatArray, d0: FloatArray, k: Constants) -> FloatArray:
    """Return the energy's slope by coefficients and the tread's force, (n_points, n_dof + 1)."""
    each = np.stack([getattr(k, name) for name in LINEAR])
    return np.asarray((each * residuals(x, d0, k)).sum(axis=0))


def jacobian(x: FloatArray, d0: FloatArray, k: Constants) -> FloatArray:
    """Return the derivative of `residual` by coefficients and deflection.

    Returns
    -------
    shape (n_points, n_dof + 1, n_dof + 1)
        Symmetric.
    """
    angle, weight = quadrature()
    at = basis_at_nodes()
    flat = at.reshape(-1, at.shape[2])
    n, size = x.shape
    curve, by_local, by_depth = curvature(measures(x, at), d0[:, None], k, angle)
    matrix = np.empty((n, size + 1, size + 1))
    weighted = (curve * weight[None, :, None, None]) @ at
    matrix[:, :size, :size] = flat.T @ weighted.reshape(n, -1, size)
    cross = (by_local * weight[None, :, None]).reshape(n, -1) @ flat
    matrix[:, :size, size] = matrix[:, size, :size] = cross
    matrix[:, size, size] = (by_depth * weight).sum(axis=1)
    return matrix


def _belt(local: FloatArray, k: Constants) -> tuple[Belt, FloatArray]:
    """Return (a, c, a', c') and a^2 + c^2."""
    a, c = k.r + local[..., 2], local[..., 3]
    return (a, c, local[..., 4], local[..., 5]), a * a + c * c


def _tip(belt: Belt, q: FloatArray, lean_sin: FloatArray, angle: FloatArray) -> FloatArray:
    """Return the overlap's slope by (u, v, a, c)."""
    a, c, _, _ = belt
    ones = np.ones_like(a)
    return np.stack(
        [np.cos(angle) * ones, -np.sin(angle) * ones, -lean_sin * c / q, lean_sin * a / q], -1
    )


def _stretch(belt: Belt, q: FloatArray, k: Constants) -> tuple[FloatArray, FloatArray]:
    """Return the stretch's direction by (a, c) and the stretch."""
    length = np.sqrt(q)
    return np.stack([belt[0], belt[1]], -1) / length[..., None], length / k.r - 1.0


def _bend(belt: Belt, q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the change of curvature, times R, and its slope by (a, c, a', c')."""
    a, c, da, dc = belt
    bend = (a * dc - c * da) / q
    b_a, b_c = (dc - 2.0 * a * bend) / q, (-da - 2.0 * c * bend) / q
    return bend, np.stack([b_a, b_c, -c / q, a / q], -1)


def _belt_curvature(curve: FloatArray, belt: Belt, q: FloatArray, k: Constants) -> None:
    """Add second derivatives of stretching and bending, by a, c, a', c' (columns 2 to 5)."""
    a, c, _, _ = belt
    length = np.sqrt(q)
    unit, stretch = _stretch(belt, q, k)
    tension = k.pb * k.r + k.ea * stretch
    curve[..., 2:4, 2:4] += (k.ea / k.r)[..., None, None] * unit[..., :, None] * unit[..., None, :]
    across = np.stack([-c, a], -1) / length[..., None]
    curve[..., 2:4, 2:4] += (tension / length)[..., None, None] * (
        across[..., :, None] * across[..., None, :]
    )
    bend, turn = _bend(belt, q)
    b_a, b_c = turn[..., 0], turn[..., 1]
    curve[..., 2:, 2:] += (k.ei / k.r)[..., None, None] * turn[..., :, None] * turn[..., None, :]
    second = np.zeros((*q.shape, 4, 4))
    second[..., 0, 0] = -(2.0 * bend + 4.0 * a * b_a) / q
    second[..., 1, 1] = -(2.0 * bend + 4.0 * c * b_c) / q
    second[..., 0, 1] = -2.0 * (a * b_c + c * b_a) / q
    second[..., 0, 2] = 2.0 * a * c / q**2
    second[..., 0, 3] = 1.0 / q - 2.0 * a * a / q**2
    second[..., 1, 2] = -1.0 / q + 2.0 * c * c / q**2
    second[..., 1, 3] = -2.0 * a * c / q**2
    for i in range(2):
        for j in range(i + 1, 4):
            second[..., j, i] = second[..., i, j]
    curve[..., 2:, 2:] += (k.ei * bend / k.r)[..., None, None] * second
