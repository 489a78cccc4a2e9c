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
energy (`tirelib.physics.contact.exact_energy`), from the linear ring's solution or one nearby.

Steady rolling leaves the shape of an inextensible belt as it is (the centrifugal tension balances
the inertia exactly), so the static solution serves at every speed; damping is not in it.
"""

from dataclasses import dataclass, replace

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ConvergenceError, ParameterError
from tirelib.physics.contact import exact_energy as energy
from tirelib.physics.contact import radial
from tirelib.physics.contact.checks import check_radii, check_tread, column, range_text
from tirelib.physics.contact.free_boundary import Constant
from tirelib.physics.contact.tread import Tread
from tirelib.physics.ring.compliance import compliance
from tirelib.physics.ring.ring import Ring, columns

SMALLEST_ANGLE = 0.015
"""Half contact angle below which nodes and modes do not resolve the contact, [rad]."""
START_MODES = 4 * energy.N_MODES
"""Harmonics of the linear start. A bicycle's hard tread does not settle at 30 and 60 N with a
quarter of them; with half and double it does (``python build/contact_constants.py``)."""
INEXTENSIBLE = 1e8
"""EA that stands for an inextensible belt, [N]: it stretches by less than 1e-4."""
LONGEST_STEP = 0.01
MAX_ITERATIONS = 60
TOLERANCE = 5e-13
"""Last step, [m]: so small that the strain of a point does not depend on which points were solved
beside it; round-off is ten thousand times less."""
MATRIX_KEPT_BELOW = 3e-4
"""Step below which the next one keeps the matrix, [m]."""
SLOW_CONVERGENCE = 0.5
"""Ratio to the preceding step above which the matrix is renewed all the same."""
CHUNK = 8
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
        Half angle of the contact, as material angle on the belt.
    load : shape (n_points,), [N]
    iterations : int
    tread : Tread
    constants : Constants
        Constants of ring and tread at every point.
    inverse : shape (n_points, n_dof + 1, n_dof + 1), or None
        Inverse of the Newton matrix of a solution nearby: as a start it saves making one.
    """

    radius: FloatArray
    even: FloatArray
    odd: FloatArray
    deflection: FloatArray
    half_angle: FloatArray
    load: FloatArray
    iterations: int
    tread: Tread
    constants: energy.Constants
    inverse: FloatArray | None = None

    def __len__(self) -> int:
        return int(self.load.size)

    @property
    def coefficients(self) -> FloatArray:
        """The unknowns of u and v, shape (n_points, 2 N_MODES + 1), [m]."""
        return np.concatenate([self.even, self.odd[:, 1:]], axis=1)

    def pressure_at(self, phi: FloatArray) -> FloatArray:
        """Return the road's pressure per length of belt, [N/m], at material angles (n_phi,)."""
        return self.tread.pressure(self.compression(phi))

    def compression(self, phi: FloatArray) -> FloatArray:
        """Return the tread's overlap with the road, [m], (n_points, n_phi); negative: clearance."""
        local = energy.measures(self.coefficients, energy.basis(phi))
        return energy.overlap(local, self.deflection[:, None], self.constants, phi)[0]

    def strain(self, offset: float | FloatArray, phi: FloatArray) -> FloatArray:
        """Return eps - y k / R at gages y < 0 from the neutral line, (n_points, n_phi)."""
        return ring_strain(self, offset, energy.measures(self.coefficients, energy.basis(phi)))


def ring_strain(solved: ExactContact, offset: float | FloatArray, local: FloatArray) -> FloatArray:
    """Return the strain eps - y k / R of local measures (n_points, n_phi, 6)."""
    r = solved.radius[:, None]
    a, c, da, dc = r + local[..., 2], local[..., 3], local[..., 4], local[..., 5]
    q = a * a + c * c
    y = np.reshape(np.asarray(offset, dtype=float), (-1, 1))
    strain: FloatArray = np.sqrt(q) / r - 1.0 - y * (a * dc - c * da) / q / r
    return strain


def load_exact(
    ring: Ring,
    tread: Tread,
    vertical_load: float | FloatArray,
    *,
    start: ExactContact | None = None,
) -> ExactContact:
    """Return the exact static contact at vertical loads Fz, [N].

    Parameters
    ----------
    ring : Ring
        Without shear flexibility; its damping and inertia play no part.
    tread : Tread
    vertical_load : float or shape (n_points,), [N]
    start : ExactContact, optional
        A solution nearby for as many points; saves time, the result is the same.

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
    spread = tread.spread(loads.size)
    inverse = None
    if start is None:
        x, depth = _linear_start(ring, spread, loads)
    else:
        _check_start(start, loads)
        x, depth, inverse = start.coefficients, start.deflection, start.inverse
    parts = []
    for first in range(0, loads.size, CHUNK):
        rows = slice(first, first + CHUNK)
        near = None if inverse is None else inverse[rows]
        parts.append(_newton(constants.take(rows), loads[rows], x[rows], depth[rows], near))
    x = np.concatenate([part[0] for part in parts])
    d0 = np.concatenate([part[1] for part in parts])
    half = np.concatenate([part[2] for part in parts])
    even, odd = np.split(x, [energy.N_MODES + 1], axis=1)
    _check_half_angle(half, loads, ring, spread)
    solved = ExactContact(
        constants.r[:, 0],
        even,
        np.pad(odd, ((0, 0), (1, 0))),
        d0,
        half,
        loads,
        max(part[3] for part in parts),
        spread,
        constants,
    )
    dense = energy.measures(x, energy.basis_at_nodes()[: energy.N_PATCH])
    angle = energy.quadrature()[0][: energy.N_PATCH]
    pressed = energy.overlap(dense, d0[:, None], constants, angle)[0]
    check_tread(_WHERE, pressed, spread.thickness, loads, d0)
    return solved


def _linear_start(ring: Ring, tread: Tread, loads: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return coefficients and deflections of the linear ring."""
    still = compliance(replace(ring, damping=0.0), 0.0, START_MODES)
    linear = radial.load(still, tread, loads)
    shape = linear.displacement[:, : energy.N_MODES + 1]
    x = np.concatenate([shape[..., 0].real, -shape[:, 1:, 1].imag], axis=1)
    return x, linear.deflection


def _check_start(start: ExactContact, loads: FloatArray) -> None:
    if len(start) != loads.size:
        raise ParameterError(
            f"exact contact: the start has {len(start)} points for {loads.size} loads; give a "
            "solution with one row a load, or none"
        )


def _check_half_angle(half: FloatArray, loads: FloatArray, ring: Ring, tread: Tread) -> None:
    """Refuse what the nodes and modes do not resolve, or the dense nodes do not hold."""
    small = half < SMALLEST_ANGLE
    if small.any():
        point = int(np.flatnonzero(small)[0])
        raise ParameterError(
            f"exact contact: point {point} at {loads[point]:.4g} N touches the road over a half "
            f"angle of {half[point]:.2g} rad; {energy.N_MODES} harmonics resolve "
            f"{SMALLEST_ANGLE} rad and more; the load is too small for a tread of "
            f"{np.broadcast_to(tread.normal_stiffness, half.shape)[point]:.3g} N/m^2: use the "
            "linear contact, which agrees there, a larger load or a softer tread",
            point=point,
        )
    large = ~(half < energy.PATCH)
    if large.any():
        point = int(np.flatnonzero(large)[0])
        still = compliance(replace(ring, damping=0.0), 0.0, energy.N_MODES).spread(loads.size)
        carries = range_text(Constant(still), tread, point, energy.PATCH)
        raise ConvergenceError(
            f"exact contact: point {point} at {loads[point]:.0f} N: the contact reaches beyond "
            f"{energy.PATCH} rad; by the linear ring {carries}; use a smaller load",
            half,
            float(energy.PATCH),
            point=point,
        )


def _constants(ring: Ring, tread: Tread, loads: FloatArray) -> tuple[energy.Constants, FloatArray]:
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
    return energy.Constants(r, ea, ei, pb, ku, kv, kt, r0, hard / thick, r0 - r), load[:, 0]


def _newton(
    k: energy.Constants,
    loads: FloatArray,
    x: FloatArray,
    d0: FloatArray,
    matrix: FloatArray | None,
) -> tuple[FloatArray, FloatArray, FloatArray, int]:
    """Return coefficients, deflection, half contact angle and iterations.

    `matrix` is the inverse of Newton's; it is kept once the steps are short and shrink.
    """
    radial_part = energy.basis_at_nodes()[:, 0].T
    size = x.shape[1]
    x, d0 = x.copy(), d0.copy()
    iterations, before = 0, np.inf
    reach = np.full(loads.size, np.inf)
    while reach.max() >= TOLERANCE and iterations < MAX_ITERATIONS:
        short = iterations == 0 or bool(
            reach.max() < min(MATRIX_KEPT_BELOW, SLOW_CONVERGENCE * before)
        )
        if matrix is None or not short:
            matrix = np.asarray(np.linalg.inv(energy.jacobian(x, d0, k)), dtype=np.float64)
        iterations, before = iterations + 1, float(reach.max())
        right = -energy.residual(x, d0, k)
        right[:, size] += loads
        step = (matrix @ right[..., None])[..., 0]
        reach = np.maximum(np.abs(step[:, :size] @ radial_part).max(axis=1), np.abs(step[:, size]))
        scale = np.minimum(1.0, LONGEST_STEP / np.maximum(reach, 1e-300))
        x += scale[:, None] * step[:, :size]
        d0 += scale * step[:, size]
    if not reach.max() < TOLERANCE:
        raise ConvergenceError(
            f"exact contact: Newton still moves by {reach.max():.1e} m after {iterations} steps, "
            f"most at {loads[int(np.argmax(reach))]:.0f} N; use a smaller load or a stiffer belt",
            d0,
            float(reach.max()),
        )
    return x, d0, _half_angle(x, d0, k), iterations


def _half_angle(x: FloatArray, d0: FloatArray, k: energy.Constants) -> FloatArray:
    """Return where the tread leaves the road; NaN where it does not before the last dense node."""
    fine, at = energy.fine()
    delta = energy.overlap(energy.measures(x, at), d0[:, None], k, fine)[0]
    last = delta.shape[1] - 1 - np.argmax(delta[:, ::-1] > 0, axis=1)
    beyond = last >= fine.size - 1
    rows, last = np.arange(len(d0)), np.minimum(last, fine.size - 2)
    left, right = delta[rows, last], delta[rows, last + 1]
    angle: FloatArray = fine[last] + (fine[1] - fine[0]) * left / (left - right)
    return np.where(beyond, np.nan, angle)
