"""The sidewall's force law from finite elements of its own section.

A sidewall is an arc in the section plane: a ply that carries the pressure and rubber outside it,
clamped at the bead and at the belt's edge. The edge is moved by w along the wheel's radius at
several pressures; the reaction of two sidewalls per length of circumference is the law

    S(w, p) = S_0(p) - k_u(p) w + (what is left: the arch's own nonlinearity)

Along the circumference a sidewall resists as a shear membrane under the tension N of its ply,
k_v = 2 / int ds / (G t + N). Hoop strain of the sidewall is left out, and that its circumference
goes with the radius.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.sparse.linalg import spsolve

from continuum.elements import Pattern, bulk_work, pattern, pressure_work, unknowns
from continuum.material import Rubber, rubber, stress
from continuum.polar import Array, Sector, sector

PRESSURES = (0.4e5, 1.2e5, 2.0e5, 2.8e5, 3.6e5)
EDGE = (-0.03, -0.02, -0.01, -0.004, 0.0, 0.004)
"""Displacements of the belt's edge at which the section is solved [m]."""
REFERENCE = 2e5
"""Pressure that scales the fit [Pa]."""
ELEMENTS = 24


@dataclass(frozen=True)
class Arch:
    """A sidewall's section, SI.

    Attributes
    ----------
    height : float
        From the bead to the belt's edge along the wheel's radius.
    lower, upper : float
        Angles from the widest point to the bead and to the belt's edge [rad]; at pi/2 the ply
        leaves the edge level, and pulls it neither in nor out.
    ply, ply_thickness : float
        Tensile stiffness per circumference [N/m], and thickness.
    thickness, along, shear : float
        Rubber outside the ply: thickness, modulus along the meridian, shear modulus [Pa].
    """

    height: float = 0.105
    lower: float = 1.3
    upper: float = 1.5
    ply: float = 8.0e5
    ply_thickness: float = 1.2e-3
    thickness: float = 6.0e-3
    along: float = 1.0e7
    shear: float = 1.2e6

    @property
    def radius(self) -> float:
        """Radius of the arc [m]."""
        return self.height / float(np.sin(self.lower) + np.sin(self.upper))

    @property
    def length(self) -> float:
        """Length of the arc [m]."""
        return self.radius * (self.lower + self.upper)

    @property
    def layers(self) -> tuple[Rubber, Rubber]:
        """Ply and rubber; without mass, as the belt's sidewalls are springs."""
        ply = self.ply / self.ply_thickness
        return (
            rubber(0.1 * ply, 0.03 * ply, ply, 0.0),
            rubber(self.along, 0.3 * self.along, self.along, 0.0),
        )


@dataclass(frozen=True)
class SidewallLaw:
    """Forces of two sidewalls on the belt per length of circumference, outward positive [N/m].

    Polynomials in the pressure, lowest power first; SI. `bend` holds those of w^2 and w^3.

    Attributes
    ----------
    pull : shape (3,)
        S_0, nothing without pressure.
    radial, tangential, tension : shape (2,)
        k_u, k_v, and the meridional tension of the ply at the belt's edge [N/m].
    bend : shape (2, 2)
        Coefficients of w^2 and w^3 in S.
    misfit : float
        Largest departure of the section's solutions from the law, relative to the range of S.
    """

    pull: Array
    radial: Array
    tangential: Array
    tension: Array
    bend: Array
    misfit: float

    def force(self, w: Array, p: float, arch: float) -> tuple[Array, Array]:
        """Return S and its derivative with w; `arch` is the share of the nonlinear part."""
        c2, c3 = (arch * at(c, p) for c in self.bend)
        k = at(self.radial, p)
        value = at(self.pull, p) - k * w + c2 * w**2 + c3 * w**3
        return value, -k + 2.0 * c2 * w + 3.0 * c3 * w**2


def at(powers: Array, p: float) -> float:
    """Return a polynomial's value at the pressure p [Pa]."""
    return float(np.polynomial.polynomial.polyval(p, powers))


def solve_arch(arch: Arch) -> tuple[Array, Array, Array]:
    """Solve the section at `PRESSURES` and `EDGE`.

    Returns
    -------
    force : shape (pressures, edges)
        Outward force of two sidewalls on the belt, per circumference [N/m].
    tension, tangential : shape (pressures,)
        Tension of the meridian at the belt's edge [N/m], and k_v [N/m^2], both at w = 0.
    """
    phi = np.linspace(-np.pi / 2.0 - arch.upper, -np.pi / 2.0 + arch.lower, ELEMENTS + 1)
    inner = arch.radius
    r = inner + np.array([0.0, arch.ply_thickness, arch.ply_thickness + arch.thickness])
    grid = sector(phi, r, closed=False)
    top = np.flatnonzero(grid.nodes[:, 0] < phi[0] + 1e-9)
    add = pattern(2 * grid.n, [unknowns(grid.bulk.dofs), unknowns(grid.lines[0].dofs)])
    force = np.empty((len(PRESSURES), len(EDGE)))
    tension, tangential = np.empty(len(PRESSURES)), np.empty(len(PRESSURES))
    flat = np.zeros((grid.n, 2))
    for i, p in enumerate(PRESSURES):
        flat = _section(arch, grid, add, p, 0.0, flat)[0]
        tension[i], tangential[i] = _tension(arch, grid, flat)
        for side in (-1.0, 1.0):
            u = flat
            for j in sorted(range(len(EDGE)), key=lambda k: abs(EDGE[k])):
                if EDGE[j] * side < 0.0:
                    continue
                u, residual = _section(arch, grid, add, p, EDGE[j], u)
                force[i, j] = -2.0 * residual.reshape(-1, 2)[top, 1].sum()
    return force, tension, tangential


@lru_cache(maxsize=32)
def law(arch: Arch) -> SidewallLaw:
    """Return the force law of an arch: polynomials through the section's solutions."""
    force, tension, tangential = solve_arch(arch)
    p, w = np.array(PRESSURES), np.array(EDGE)
    x, y = p[:, None] / REFERENCE, w / EDGE[0]
    powers = [(0, 1), (0, 2), *((k, m) for k in (1, 2, 3) for m in (0, 1))]
    left = np.stack([(y**k * x**m).ravel() for k, m in powers], axis=1)
    found = np.linalg.lstsq(left, force.ravel(), rcond=None)[0]
    misfit = float(np.abs(left @ found - force.ravel()).max() / np.ptp(force))
    c = np.zeros((4, 3))
    for (k, m), value in zip(powers, found, strict=True):
        c[k, m] = value / (EDGE[0] ** k * REFERENCE**m)

    def straight(values: Array) -> Array:
        return np.asarray(np.polynomial.polynomial.polyfit(p, values, 1))

    return SidewallLaw(c[0], -c[1, :2], straight(tangential), straight(tension), c[2:, :2], misfit)


def _moduli(arch: Arch, grid: Sector) -> Array:
    table = np.array([[m.shear, m.lame, m.cords] for m in arch.layers])
    return np.asarray(table[grid.layer])


def _section(
    arch: Arch, grid: Sector, add: Pattern, p: float, edge: float, u: Array
) -> tuple[Array, Array]:
    """Return displacement and residual (reactions at the clamps) of a section, by Newton."""
    ends = (grid.nodes[:, 0].min(), grid.nodes[:, 0].max())
    top, bead = (np.abs(grid.nodes[:, 0] - e) < 1e-9 for e in ends)
    free = np.repeat(~(top | bead), 2)
    moduli, one = _moduli(arch, grid), np.ones(len(grid.layer))
    share = (grid.nodes[:, 0] - ends[1]) / (ends[0] - ends[1])
    moved = u.copy()
    moved[:, 1] += (edge - u[top, 1][0]) * share
    push = np.full((len(grid.lines[0].dofs), 1), p)
    for _ in range(40):
        f, k = bulk_work(grid.bulk, moduli, 0.0 * one, one, moved, 0.0)
        g, h = pressure_work(grid.lines[0], push, moved)
        residual = add.vector([f, g])
        step = np.zeros(2 * grid.n)
        step[free] = spsolve(add.matrix([k, h])[free][:, free], -residual[free])
        size = np.abs(step).max()
        if not np.isfinite(size):
            break
        moved = moved + min(1.0, 3e-3 / size) * step.reshape(-1, 2)
        if size < 1e-9:
            return moved, residual
    raise ArithmeticError(
        f"sidewall section: no balance at {p:.3g} Pa and an edge moved by {1e3 * edge:.3g} mm; "
        "give a thicker or stiffer arch"
    )


def _tension(arch: Arch, grid: Sector, u: Array) -> tuple[float, float]:
    """Return the meridional tension at the belt's edge and k_v."""
    bulk = grid.bulk
    grad = np.einsum("eni,eqna->eqia", u[bulk.dofs], bulk.grad, optimize=True)
    moduli = np.broadcast_to(_moduli(arch, grid)[:, None, :], (*bulk.volume.shape, 3))
    p, _ = stress(moduli, bulk.frame, grad)
    t = (bulk.frame + grad)[..., 0]
    along = np.sum(p[..., 0] * t, axis=-1) / np.linalg.norm(t, axis=-1) * bulk.volume
    column = np.repeat(np.arange(ELEMENTS)[:, None], 2, axis=1)
    order = np.argsort(grid.nodes[bulk.dofs, 0].mean(axis=1), kind="stable")
    angle = (arch.lower + arch.upper) / ELEMENTS
    tension = along[order].sum(axis=1).reshape(column.shape).sum(axis=1) / (angle * arch.radius)
    carried = arch.shear * (arch.thickness + arch.ply_thickness) + tension
    return float(tension[0]), 2.0 / float(np.mean(arch.length / carried))
