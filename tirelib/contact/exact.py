"""The static ring without small-displacement assumptions, pressed on the road.

The linear ring of the dissertation turns its cross-sections by up to 0.3 rad in the contact and yet
keeps the undeformed circle as reference; at usual loads that costs 5 to 10 % in deflection and in
the compressive peaks. Here the belt is a geometrically exact, extensible Bernoulli-Euler beam: with
a = R + u + v' and c = u' - v (along the circle's tangent and normal) its measures are

    stretch             eps = sqrt(a^2 + c^2) / R - 1,
    change of curvature k / R = (a c' - c a') / (a^2 + c^2) / R.

The energy per angle is R (p b R eps + EA eps^2 / 2) + EI k^2 / (2 R) of the belt,
R (k_u u^2 + k_v v^2) / 2 of the sidewall, -p b dA of the enclosed area, and R k_t delta^2 / 2 of
the tread, whose tip h below the belt's normal overlaps the road by delta > 0. The load is vertical,
without friction. Harmonics of u (even) and v (odd) and the deflection are found by Newton on the
energy, from the linear ring's solution.

Steady rolling leaves the shape of an inextensible belt as it is (the centrifugal tension balances
the inertia exactly), so the static solution serves at every speed; damping is not in it.
"""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from tirelib.arrays import FloatArray
from tirelib.contact import radial
from tirelib.contact.checks import check_radii, check_tread, column, range_text
from tirelib.contact.free_boundary import Constant
from tirelib.contact.tread import Tread
from tirelib.errors import ConvergenceError, ParameterError
from tirelib.ring.compliance import compliance
from tirelib.ring.ring import Ring, columns

N_MODES = 48
PATCH = 0.6
"""Half-angle with dense integration nodes; the contact has to end within, [rad]."""
N_PATCH, N_REST = 64, 56
SMALLEST_ANGLE = 0.015
"""Half contact angle below which nodes and modes do not resolve the contact, [rad]."""
INEXTENSIBLE = 1e8
"""EA that stands for an inextensible belt, [N]: it stretches by less than 1e-4."""
LONGEST_STEP = 0.01
MAX_ITERATIONS = 40
TOLERANCE = 1e-9
CHUNK = 16
_WHERE = "exact contact"


@dataclass(frozen=True, slots=True)
class ExactContact:
    """The symmetric solution, one row per operating point.

    Attributes
    ----------
    radius : shape (n_points,), [m]
    even : shape (n_points, N_MODES + 1), [m]
        Cosine coefficients of u.
    odd : shape (n_points, N_MODES + 1), [m]
        Sine coefficients of v (the first is zero).
    deflection : shape (n_points,), [m]
        d0, free radius minus loaded radius.
    half_angle : shape (n_points,), [rad]
        Of the contact, as material angle on the belt.
    load : shape (n_points,), [N]
    iterations : int
    tread : Tread
    """

    radius: FloatArray
    even: FloatArray
    odd: FloatArray
    deflection: FloatArray
    half_angle: FloatArray
    load: FloatArray
    iterations: int
    tread: Tread

    def pressure_at(self, phi: FloatArray) -> FloatArray:
        """Return the road's pressure per length of belt, [N/m], at material angles (n_phi,)."""
        return self.tread.pressure(self.compression(phi))

    def compression(self, phi: FloatArray) -> FloatArray:
        """Return the tread's overlap with the road, [m], (n_points, n_phi); negative: clearance."""
        x = np.concatenate([self.even, self.odd[:, 1:]], axis=1)
        u, v, e, c = np.einsum("pid,nd->inp", _basis(phi), x)[:4]
        r0 = np.asarray(self.tread.free_radius, dtype=float).reshape(-1, 1)
        lean = phi - np.arctan2(c, self.radius[:, None] + e)
        tip = (self.radius[:, None] + u) * np.cos(phi) - v * np.sin(phi)
        depth = r0 - self.radius[:, None]
        delta: FloatArray = tip + depth * np.cos(lean) - (r0 - self.deflection[:, None])
        return delta

    def strain(self, offset: float | FloatArray, phi: FloatArray) -> FloatArray:
        """Return eps - y k / R at gages y < 0 from the neutral line, (n_points, n_phi)."""
        local = np.einsum(
            "pid,nd->npi", _basis(phi), np.concatenate([self.even, self.odd[:, 1:]], axis=1)
        )
        r = self.radius[:, None]
        a, c, da, dc = r + local[..., 2], local[..., 3], local[..., 4], local[..., 5]
        q = a * a + c * c
        y = np.reshape(np.asarray(offset, dtype=float), (-1, 1))
        strain: FloatArray = np.sqrt(q) / r - 1.0 - y * (a * dc - c * da) / q / r
        return strain


@dataclass(frozen=True, slots=True)
class _Constants:
    """Columns (n_points, 1) of ring and tread."""

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

    def take(self, rows: slice) -> "_Constants":
        return _Constants(*[getattr(self, name)[rows] for name in self.__slots__])


def load_exact(ring: Ring, tread: Tread, vertical_load: float | FloatArray) -> ExactContact:
    """Return the exact static contact at vertical loads Fz, [N].

    Parameters
    ----------
    ring : Ring
        Without shear flexibility; its damping and inertia play no part.
    tread : Tread
    vertical_load : float or shape (n_points,), [N]

    Raises
    ------
    ParameterError
        If a load is not positive, too small for the nodes (`SMALLEST_ANGLE`) or more than the tire
        carries, the tread is pressed through, or the belt is shear-flexible.
    ConvergenceError
        If Newton does not settle, or the contact outgrows the dense nodes; carries deflections.
    """
    if not ring.unshearable:
        raise ParameterError(
            "exact contact: the belt has a finite shear stiffness; give an infinite one, the exact "
            "ring is Bernoulli-Euler"
        )
    n_points = max(np.size(vertical_load), np.size(ring.radius), len(tread))
    loads = column(_WHERE, vertical_load, n_points, "load", "N", positive=True)
    constants, loads = _constants(ring, tread, loads)
    check_radii(_WHERE, tread, constants.r[:, 0])
    still = replace(ring, damping=0.0)
    linear = radial.load(compliance(still, 0.0, N_MODES), tread, loads)
    shape = linear.displacement
    start = np.concatenate([shape[..., 0].real, -shape[:, 1:, 1].imag], axis=1)
    parts = []
    for first in range(0, loads.size, CHUNK):
        rows = slice(first, first + CHUNK)
        parts.append(
            _newton(constants.take(rows), loads[rows], start[rows], linear.deflection[rows])
        )
    x = np.concatenate([part[0] for part in parts])
    d0 = np.concatenate([part[1] for part in parts])
    half = np.concatenate([part[2] for part in parts])
    even, odd = x[:, : N_MODES + 1], np.pad(x[:, N_MODES + 1 :], ((0, 0), (1, 0)))
    _check_half_angle(half, loads, linear)
    solved = ExactContact(
        constants.r[:, 0], even, odd, d0, half, loads, max(part[3] for part in parts), linear.tread
    )
    check_tread(
        _WHERE, solved.compression(_quadrature()[0][:N_PATCH]), linear.tread.thickness, loads, d0
    )
    return solved


def _check_half_angle(half: FloatArray, loads: FloatArray, linear: radial.RadialContact) -> None:
    """Refuse what the nodes and modes do not resolve, or the dense nodes do not hold."""
    small = half < SMALLEST_ANGLE
    if small.any():
        point = int(np.flatnonzero(small)[0])
        raise ParameterError(
            f"exact contact: point {point} at {loads[point]:.4g} N touches the road over a half "
            f"angle of {half[point]:.2g} rad; from {SMALLEST_ANGLE} rad on {N_MODES} modes resolve "
            "it; take the linear contact for so small a load, or raise the load"
        )
    large = ~(half < PATCH)
    if large.any():
        point = int(np.flatnonzero(large)[0])
        carries = range_text(Constant(linear.compliance), linear.tread, point, PATCH)
        raise ConvergenceError(
            f"exact contact: point {point} at {loads[point]:.0f} N: the contact reaches beyond "
            f"{PATCH} rad; by the linear ring {carries}; use a smaller load",
            half,
            float(PATCH),
        )


def _constants(ring: Ring, tread: Tread, loads: FloatArray) -> tuple[_Constants, FloatArray]:
    r, ea, ei, pb, ku, kv, kt, r0, hard, thick, load = columns(
        ring.radius,
        np.minimum(ring.extension_stiffness, INEXTENSIBLE),
        ring.bending_stiffness,
        ring.inflation,
        ring.radial_stiffness,
        ring.tangential_stiffness,
        tread.normal_stiffness,
        tread.free_radius,
        tread.hardening,
        tread.thickness,
        loads,
    )
    return _Constants(r, ea, ei, pb, ku, kv, kt, r0, hard / thick, r0 - r), load[:, 0]


@cache
def _quadrature() -> tuple[FloatArray, FloatArray]:
    """Return angles in (0, pi) and weights that count both halves."""
    x1, w1 = np.polynomial.legendre.leggauss(N_PATCH)
    x2, w2 = np.polynomial.legendre.leggauss(N_REST)
    rest = np.pi - PATCH
    angle = np.concatenate([(x1 + 1) / 2 * PATCH, PATCH + (x2 + 1) / 2 * rest])
    return angle, np.concatenate([w1 * PATCH, w2 * rest])


def _basis(phi: FloatArray) -> FloatArray:
    """Return (u, v, u + v', u' - v, u' + v'', u'' - v') per coefficient, (n_phi, 6, n_dof)."""
    n = np.arange(N_MODES + 1.0)
    cos, sin = np.cos(np.outer(phi, n)), np.sin(np.outer(phi, n))
    none, m = np.zeros_like(cos), n[1:]
    u = [np.hstack([f, none[:, 1:]]) for f in (cos, -n * sin, -(n**2) * cos)]
    v = [np.hstack([none, f]) for f in (sin[:, 1:], m * cos[:, 1:], -(m**2) * sin[:, 1:])]
    return np.stack([u[0], v[0], u[0] + v[1], u[1] - v[0], u[1] + v[2], u[2] - v[1]], axis=1)


@cache
def _basis_at_nodes() -> FloatArray:
    return _basis(_quadrature()[0])


def _newton(
    k: _Constants, loads: FloatArray, x: FloatArray, d0: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, int]:
    """Return coefficients, deflection, half contact angle and iterations."""
    angle, weight = _quadrature()
    basis = _basis_at_nodes()
    flat = basis.reshape(-1, basis.shape[2])
    n, size = loads.size, basis.shape[2]
    x, d0 = x.copy(), d0.copy()
    iterations, moving = 0, True
    while moving and iterations < MAX_ITERATIONS:
        iterations += 1
        local = (x @ flat.T).reshape(n, -1, 6)
        slope, curve, force, by_local, by_depth = _energy(local, d0[:, None], k, angle)
        matrix = np.empty((n, size + 1, size + 1))
        weighted = (curve * weight[None, :, None, None]) @ basis
        matrix[:, :size, :size] = flat.T @ weighted.reshape(n, -1, size)
        cross = (by_local * weight[None, :, None]).reshape(n, -1) @ flat
        matrix[:, :size, size] = matrix[:, size, :size] = cross
        matrix[:, size, size] = (by_depth * weight).sum(axis=1)
        right = np.empty((n, size + 1))
        right[:, :size] = -(slope * weight[None, :, None]).reshape(n, -1) @ flat
        right[:, size] = loads - (force * weight).sum(axis=1)
        step = np.linalg.solve(matrix, right[..., None])[..., 0]
        reach = np.maximum(
            np.abs(step[:, :size] @ basis[:, 0].T).max(axis=1), np.abs(step[:, size])
        )
        scale = np.minimum(1.0, LONGEST_STEP / np.maximum(reach, 1e-300))
        x += scale[:, None] * step[:, :size]
        d0 += scale * step[:, size]
        moving = bool(reach.max() >= TOLERANCE)
    if moving:
        raise ConvergenceError(
            f"exact contact: Newton still moves by {reach.max():.1e} m after {MAX_ITERATIONS} "
            f"steps, most at {loads[int(np.argmax(reach))]:.0f} N; use a smaller load or a stiffer "
            "belt",
            d0,
            float(reach.max()),
        )
    return x, d0, _half_angle(x, d0, k), iterations


def _half_angle(x: FloatArray, d0: FloatArray, k: _Constants) -> FloatArray:
    """Return where the tread leaves the road; NaN where it does not before the last dense node."""
    fine = np.linspace(0.0, PATCH, 601)
    local = (x @ _basis(fine).reshape(-1, x.shape[1]).T).reshape(len(d0), -1, 6)
    delta = _overlap(local, d0[:, None], k, fine)[0]
    last = delta.shape[1] - 1 - np.argmax(delta[:, ::-1] > 0, axis=1)
    beyond = last >= fine.size - 1
    rows, last = np.arange(len(d0)), np.minimum(last, fine.size - 2)
    left, right = delta[rows, last], delta[rows, last + 1]
    angle: FloatArray = fine[last] + (fine[1] - fine[0]) * left / (left - right)
    return np.where(beyond, np.nan, angle)


def _overlap(
    local: FloatArray, d0: FloatArray, k: _Constants, angle: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return tread overlap with the road, and sine and cosine parts of the tread's lean."""
    u, v = local[..., 0], local[..., 1]
    a, c = k.r + local[..., 2], local[..., 3]
    lean = angle - np.arctan2(c, a)
    delta = (k.r + u) * np.cos(angle) - v * np.sin(angle) + k.h * np.cos(lean) - (k.r0 - d0)
    return delta, k.h * np.sin(lean), k.h * np.cos(lean)


def _energy(
    local: FloatArray, d0: FloatArray, k: _Constants, angle: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return derivatives of the energy per angle at the nodes.

    Returns
    -------
    slope : shape (n_points, n_nodes, 6)
        By (u, v, a, c, a', c').
    curve : shape (n_points, n_nodes, 6, 6)
    force : shape (n_points, n_nodes), [N/rad]
        Of the tread, by the deflection.
    by_local, by_depth : shape (n_points, n_nodes, 6) and (n_points, n_nodes)
        Its derivatives by the displacements and by the deflection.
    """
    u, v, e, c, da, dc = np.moveaxis(local, -1, 0)
    a = k.r + e
    q = a * a + c * c
    slope = np.zeros_like(local)
    curve = np.zeros((*local.shape, 6))
    _belt(slope, curve, (a, c, da, dc), q, k)

    slope[..., 0] += k.ku * u * k.r - 0.5 * k.pb * a
    slope[..., 1] += k.kv * v * k.r + 0.5 * k.pb * c
    slope[..., 2] -= 0.5 * k.pb * (k.r + u)
    slope[..., 3] += 0.5 * k.pb * v
    curve[..., 0, 0] += k.ku * k.r
    curve[..., 1, 1] += k.kv * k.r
    for i, j, sign in ((0, 2, -0.5), (1, 3, 0.5)):
        curve[..., i, j] += sign * k.pb
        curve[..., j, i] += sign * k.pb

    # tread: delta by u, v and by the section's turn omega = atan2(c, a)
    delta, lean_sin, lean_cos = _overlap(local, d0, k, angle)
    pressed = np.maximum(delta, 0.0)
    force = k.r * k.kt * pressed * (1.0 + k.s * pressed)
    by_depth = np.where(delta > 0, k.r * k.kt * (1.0 + 2.0 * k.s * pressed), 0.0)
    turn_a, turn_c = -c / q, a / q
    ones = np.ones_like(u)
    grad = np.stack(
        [np.cos(angle) * ones, -np.sin(angle) * ones, lean_sin * turn_a, lean_sin * turn_c], -1
    )
    slope[..., :4] += force[..., None] * grad
    curve[..., :4, :4] += by_depth[..., None, None] * grad[..., :, None] * grad[..., None, :]
    twist = np.stack([2.0 * a * c, c * c - a * a, -2.0 * a * c]) / q**2
    curve[..., 2, 2] += force * (-lean_cos * turn_a**2 + lean_sin * twist[0])
    curve[..., 3, 3] += force * (-lean_cos * turn_c**2 + lean_sin * twist[2])
    mixed = force * (-lean_cos * turn_a * turn_c + lean_sin * twist[1])
    curve[..., 2, 3] += mixed
    curve[..., 3, 2] += mixed
    by_local = np.zeros_like(local)
    by_local[..., :4] = by_depth[..., None] * grad
    return slope, curve, force, by_local, by_depth


def _belt(
    slope: FloatArray,
    curve: FloatArray,
    tangent: tuple[FloatArray, FloatArray, FloatArray, FloatArray],
    q: FloatArray,
    k: _Constants,
) -> None:
    """Add stretching and bending of the belt, by a, c, a', c' (columns 2 to 5)."""
    a, c, da, dc = tangent
    length = np.sqrt(q)
    tension = k.pb * k.r + k.ea * (length / k.r - 1.0)
    bend = (a * dc - c * da) / q
    moment = k.ei * bend / k.r
    unit = np.stack([a, c], -1) / length[..., None]
    slope[..., 2:4] += tension[..., None] * unit
    curve[..., 2:4, 2:4] += (k.ea / k.r)[..., None, None] * unit[..., :, None] * unit[..., None, :]
    across = np.stack([-c, a], -1) / length[..., None]
    curve[..., 2:4, 2:4] += (tension / length)[..., None, None] * (
        across[..., :, None] * across[..., None, :]
    )
    b_a, b_c = (dc - 2.0 * a * bend) / q, (-da - 2.0 * c * bend) / q
    grad = np.stack([b_a, b_c, -c / q, a / q], -1)
    slope[..., 2:] += moment[..., None] * grad
    stiffness = (k.ei / k.r)[..., None, None]
    curve[..., 2:, 2:] += stiffness * grad[..., :, None] * grad[..., None, :]
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
    curve[..., 2:, 2:] += moment[..., None, None] * second
