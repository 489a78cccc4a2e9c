"""The belt: five geometrically exact, extensible, shear-flexible strips on an inflated sidewall.

Each strip is a Reissner (Simo) beam bent in the wheel plane. Fields of the wheel angle phi, in
the frame of the unloaded ring (n outward, t along +phi): displacement (u, v) and section
rotation psi. With x = (R + u) n + v t, x' = a n + b t, a = u' - v, b = R + u + v':

    Gamma_1 = (b cos psi - a sin psi) / R - 1      (extension)
    Gamma_2 = (a cos psi + b sin psi) / R          (shear)
    kappa   = psi' / R                             (change of curvature)

energy per strip: 1/2 int (EA Gamma_1^2 + GA Gamma_2^2 + EI kappa^2) R dphi / 5. Rolling is steady
in the road's frame: material streams through the fixed fields with Omega, its acceleration is
Omega^2 x'', which gives the virtual work int rhoA Omega^2 x' . delta x' R dphi (centrifugal and
Coriolis terms are all inside). Pressure follows the deformed belt: p b J x' per dphi.

The strips share one lateral displacement w (y to the left) and are tied by the belt's in-plane
shear, (t . (x_{i+1} - x_i)) / dy + w' / R, which makes lateral bending a membrane effect of the
strips; by bending across the belt; and by the sidewalls' lateral springs, which act at the
height `roll_lever` and so roll the belt (load transfer).

Sources: Simo and Vu-Quoc, Comput. Methods Appl. Mech. Eng. 58 (1986); Nackenhorst, ibid. 193
(2004), for the mixed Lagrangian-Eulerian description of rolling.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tirelib.rig.tire import N_STRIPS, Array, Condition, RigTire

FIELDS = 3 * N_STRIPS + 1
"""u, v, psi of each strip, then w."""
LATERAL = FIELDS - 1
SIZE = 2 * FIELDS
"""Fields, then their derivatives."""

U: NDArray[np.intp] = 3 * np.arange(N_STRIPS)
V: NDArray[np.intp] = U + 1
PSI: NDArray[np.intp] = U + 2


@dataclass(frozen=True)
class Strains:
    """Strain measures of the strips, each of shape (n, 5), and their ingredients."""

    gamma1: Array
    gamma2: Array
    kappa: Array
    a: Array
    b: Array
    cos: Array
    sin: Array


def strains(tire: RigTire, z: Array) -> Strains:
    """Return the strain measures at points with fields and derivatives z, shape (n, 32)."""
    radius = tire.ring_radius
    u, v, psi = z[:, U], z[:, V], z[:, PSI]
    du, dv, dpsi = z[:, FIELDS + U], z[:, FIELDS + V], z[:, FIELDS + PSI]
    a, b = du - v, radius + u + dv
    cos, sin = np.cos(psi), np.sin(psi)
    gamma1 = (b * cos - a * sin) / radius - 1.0
    gamma2 = (a * cos + b * sin) / radius
    return Strains(gamma1, gamma2, dpsi / radius, a, b, cos, sin)


def innerliner_strain(tire: RigTire, z: Array) -> Array:
    """Circumferential strain at the gages, tension positive, shape (n, 5) [1].

    eps = (R Gamma_1 + y psi') / (R + y), y the gages' offset from the neutral line: the fibre
    at R + y of a ring keeps its own reference length.
    """
    s, y = strains(tire, z), tire.innerliner_offset
    return np.asarray(tire.ring_radius * (s.gamma1 + y * s.kappa) / (tire.ring_radius + y))


def internal(tire: RigTire, cond: Condition, omega: float, z: Array) -> tuple[Array, Array]:
    """Residual density, shape (n, 32), and its derivative, shape (n, 32, 32), without the road.

    Per radian of wheel angle; internal minus external virtual work, so that the belt is in
    balance when the residual and the road's (`tirelib.rig.tread`) cancel.
    """
    jac = np.zeros((len(z), SIZE, SIZE))
    return _internal(tire, cond, omega, z, jac), jac


def internal_force(tire: RigTire, cond: Condition, omega: float, z: Array) -> Array:
    """Residual density of `internal`, without the work for its derivative."""
    return _internal(tire, cond, omega, z, None)


def _internal(tire: RigTire, cond: Condition, omega: float, z: Array, jac: Array | None) -> Array:
    r = np.zeros((len(z), SIZE))
    _beam(tire, cond, omega, z, r, jac)
    _shear_coupling(tire, z, r, jac)
    _softening(tire, cond, z, r, jac)
    linear = linear_part(tire, cond, omega)
    r += z @ linear.T
    if jac is not None:
        jac += linear
    return r


def _beam(
    tire: RigTire, cond: Condition, omega: float, z: Array, r: Array, jac: Array | None
) -> None:
    radius, s = tire.ring_radius, strains(tire, z)
    ea, ga, ei = (k / N_STRIPS for k in (tire.extension, tire.shear, tire.bending))
    inertia = tire.mass / N_STRIPS * omega**2 * radius
    push = cond.pressure * tire.belt_width / N_STRIPS
    normal, shear = ea * s.gamma1, ga * s.gamma2
    cos, sin, stretch = s.cos, s.sin, 1.0 + s.gamma1

    ga_ = -normal * sin + shear * cos - inertia * s.a
    gb = normal * cos + shear * sin - inertia * s.b
    r[:, FIELDS + U] += ga_
    r[:, V] += -ga_ + push * s.a
    r[:, U] += gb - push * s.b
    r[:, FIELDS + V] += gb
    r[:, PSI] += radius * (shear * stretch - normal * s.gamma2)
    r[:, FIELDS + PSI] += ei * s.kappa
    if jac is None:
        return

    haa = (ea * sin**2 + ga * cos**2) / radius - inertia
    hbb = (ea * cos**2 + ga * sin**2) / radius - inertia
    hab = (ga - ea) * sin * cos / radius
    hap = (ea * s.gamma2 - shear) * sin + (ga * stretch - normal) * cos
    hbp = (ga * stretch - normal) * sin - (ea * s.gamma2 - shear) * cos
    hpp = radius * (ea * s.gamma2**2 + ga * stretch**2 - normal * stretch - shear * s.gamma2)
    # a = u' - v and b = R + u + v' as (field, sign) lists
    fa = ((FIELDS + U, 1.0), (V, -1.0))
    fb = ((U, 1.0), (FIELDS + V, 1.0))
    for i, si in fa:
        for k, sk in fa:
            jac[:, i, k] += si * sk * haa
        for k, sk in fb:
            jac[:, i, k] += si * sk * hab
            jac[:, k, i] += si * sk * hab
        jac[:, i, PSI] += si * hap
        jac[:, PSI, i] += si * hap
    for i, si in fb:
        for k, sk in fb:
            jac[:, i, k] += si * sk * hbb
        jac[:, i, PSI] += si * hbp
        jac[:, PSI, i] += si * hbp
    jac[:, PSI, PSI] += hpp
    jac[:, FIELDS + PSI, FIELDS + PSI] += ei / radius
    # follower pressure: -p b (b delta u - a delta v)
    for k, sk in fb:
        jac[:, U, k] -= push * sk
    for k, sk in fa:
        jac[:, V, k] += push * sk


def _shear_coupling(tire: RigTire, z: Array, r: Array, jac: Array | None) -> None:
    """In-plane shear of the belt between neighbouring strips, in their mean section's frame."""
    radius, dy = tire.ring_radius, tire.lateral[1] - tire.lateral[0]
    lo, hi = slice(0, N_STRIPS - 1), slice(1, N_STRIPS)
    du, dv = z[:, U[hi]] - z[:, U[lo]], z[:, V[hi]] - z[:, V[lo]]
    psi = 0.5 * (z[:, PSI[hi]] + z[:, PSI[lo]])
    cos, sin = np.cos(psi), np.sin(psi)
    gap, turned = dv * cos - du * sin, -dv * sin - du * cos
    gamma = gap / dy + z[:, FIELDS + LATERAL, None] / radius
    force = tire.belt_shear_coupling * dy * radius * gamma
    grad = (
        (U[hi], -sin / dy),
        (U[lo], sin / dy),
        (V[hi], cos / dy),
        (V[lo], -cos / dy),
        (PSI[hi], 0.5 * turned / dy),
        (PSI[lo], 0.5 * turned / dy),
    )
    slope = np.array([FIELDS + LATERAL])
    for i, gi in grad:
        r[:, i] += force * gi
    r[:, slope[0]] += force.sum(axis=1) / radius
    if jac is None:
        return
    stiff = tire.belt_shear_coupling * dy * radius
    for i, gi in grad:
        for k, gk in grad:
            jac[:, i, k] += stiff * gi * gk
        jac[:, i, slope] += stiff * gi / radius
        jac[:, slope, i] += stiff * gi / radius
    jac[:, slope[0], slope[0]] += (N_STRIPS - 1) * stiff / radius**2
    # second derivatives of the gap: rotation with displacement, and rotation twice
    for i, ci in ((U[hi], -cos), (U[lo], cos), (V[hi], -sin), (V[lo], sin)):
        for k in (PSI[hi], PSI[lo]):
            jac[:, i, k] += 0.5 * force * ci / dy
            jac[:, k, i] += 0.5 * force * ci / dy
    for i in (PSI[hi], PSI[lo]):
        for k in (PSI[hi], PSI[lo]):
            jac[:, i, k] -= 0.25 * force * gap / dy


def _softening(tire: RigTire, cond: Condition, z: Array, r: Array, jac: Array | None) -> None:
    """Radial sidewall stiffness lost with inward deflection, see RigTire.sidewall_softening."""
    if tire.sidewall_softening == 0.0:
        return
    u, length2 = np.minimum(z[:, U], 0.0), tire.softening_length**2
    lost = tire.sidewall_softening * tire.radial_stiffness(cond.pressure) * tire.ring_radius
    stiff = lost * np.array(tire.sidewall_share)
    whole = u**2 + length2
    r[:, U] -= stiff * u**3 / whole
    if jac is not None:
        jac[:, U, U] -= stiff * u**2 * (u**2 + 3.0 * length2) / whole**2


def linear_part(tire: RigTire, cond: Condition, omega: float) -> Array:
    """Matrix of the linear terms: sidewall springs and dampers, bending across, lateral tension.

    Damping of a material point is c Omega d/dphi; the lateral tension is that of the inflated
    belt less its centrifugal part, T - rhoA R^2 Omega^2.
    """
    out, radius = np.zeros((SIZE, SIZE)), tire.ring_radius
    share = np.array(tire.sidewall_share)

    def damper(stiffness: float) -> float:
        return 2.0 * tire.sidewall_damping * float(np.sqrt(stiffness * tire.mass)) * omega

    for field, k in (
        (U, tire.radial_stiffness(cond.pressure)),
        (V, tire.tangential_stiffness(cond.pressure)),
    ):
        out[field, field] += share * k * radius
        out[field, FIELDS + field] += share * damper(k) * radius
    side = tire.lateral_stiffness(cond.pressure)
    lateral = np.zeros(FIELDS)
    lateral[LATERAL] = 1.0
    lateral[U] = tire.roll_lever * tire.lateral / np.sum(tire.lateral**2)
    rolled = np.outer(lateral, lateral)
    out[:FIELDS, :FIELDS] += side * radius * rolled
    out[:FIELDS, FIELDS:] += damper(side) * radius * rolled
    slope = FIELDS + LATERAL
    out[slope, slope] += cond.pressure * tire.belt_width
    step = tire.lateral[1] - tire.lateral[0]
    for i in range(1, N_STRIPS - 1):
        bend = np.zeros(SIZE)
        bend[U[i - 1 : i + 2]] = (1.0, -2.0, 1.0)
        out += tire.transverse_bending / step**3 * radius * np.outer(bend, bend)
    return out
