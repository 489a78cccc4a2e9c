"""The rolling ring under a load: Newton's method for all operating points at once."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tirelib.core.arrays import FloatArray
from tirelib.core.errors import ConvergenceError, ParameterError
from tirelib.physics.rolling.assemble import (
    Contact,
    Unknowns,
    by_element,
    contact,
    matrix,
    residual,
)
from tirelib.physics.rolling.band import BORDER, Factors
from tirelib.physics.rolling.constants import Constants
from tirelib.physics.rolling.gage import Gage, strain
from tirelib.physics.rolling.mesh import COARSE, FINE, PATCH, Mesh, mesh, to_grid
from tirelib.physics.rolling.road import pressure, tip

TOLERANCE = 1e-10
"""Last step, [m]."""
SHARES = (0.1, 0.3, 1.0)
"""Shares of the load through which a solution without a start is found."""
TOUCH = 2e-3
"""Deflection to begin with, [m]: so little that the tread does not throw the belt off."""
START_STEP = 1e-3
"""Last step of the frictionless ring from which one with friction starts, [m]."""
LONGEST_STEP = 0.008
TURN = np.array([1.0, 1.0, 0.05])
"""Weights of the displacements in a step, and of a section's rotation, [m/rad]."""
MAX_ITERATIONS = 80
NEAR = 2e-5
"""Last step after which the derivative is kept, [m]."""
FALL = 0.01
"""How much less than the step before it a step with a kept derivative has to be."""
PATIENT = 20
"""Iterations after which steps are halved: sticking and sliding may take turns."""
SMALLEST_ANGLE = 0.02
"""Half contact angle below which the elements do not resolve the contact, [rad]."""


@dataclass(frozen=True, slots=True, eq=False)
class Rolling:
    """The solution, one row per operating point.

    Attributes
    ----------
    constants : Constants
    x : Unknowns
    mesh : Mesh
    z : shape (6, n_points, n_elements, n_gauss)
        Fields of the belt at its points.
    contact : Contact
    iterations : int
    size : (fine, coarse)
        Size of the mesh.
    """

    constants: Constants
    x: Unknowns
    mesh: Mesh
    z: FloatArray
    contact: Contact
    iterations: int
    size: tuple[int, int]

    def __len__(self) -> int:
        return len(self.constants)

    def take(self, index: Any) -> "Rolling":
        """Return the solution at some points."""
        k, x = self.constants.take(index), self.x.take(index)
        _, z, c = residual(x, k, self.mesh)
        return Rolling(k, x, self.mesh, z, c, self.iterations, self.size)

    @property
    def deflection(self) -> FloatArray:
        """d0, free radius less loaded radius, (n_points,), [m]."""
        return self.x.depth

    @property
    def rolling_radius(self) -> FloatArray:
        """V / Omega, (n_points,), [m]; without friction it is undetermined."""
        return np.where(self.constants.grips, self.x.rolling, np.nan)

    @property
    def drag(self) -> FloatArray:
        """Force of the road on the tire along the road's motion, (n_points,), [N].

        In free rolling it is the rolling resistance.
        """
        out: FloatArray = (self._area * self.contact.shear).sum(axis=(1, 2))
        return out

    @property
    def dissipated(self) -> FloatArray:
        """Power that dashpots and sliding turn into heat, (n_points,), [W]."""
        k, c = self.constants, self.contact
        u, v = self.z[3], self.z[4]
        each = 2.0 * k.dashpots * np.sqrt(k.mass) * k.omega**2 * k.radius
        rate = np.sqrt(k.k_u)[:, None, None] * u**2 + np.sqrt(k.k_v)[:, None, None] * v**2
        inside = each * (rate * self.mesh.belt.weight).sum(axis=(1, 2))
        slip = self.x.rolling[:, None, None] - self._tip_slope()
        grip = (self._area * c.shear * slip).sum(axis=(1, 2))
        return np.asarray(inside + k.omega * grip)

    @property
    def _area(self) -> FloatArray:
        return self.constants.radius[:, None, None] * self.mesh.road.weight

    def _tip_slope(self) -> FloatArray:
        """Return dX / dphi of the tread's tip at the road's points, its own turn included."""
        local = by_element(self.x.node)[:, self.mesh.fine, :, :3]
        slope = np.moveaxis(self.mesh.road.slope @ local, -1, 0)
        tip = self.contact.tip
        by: FloatArray = sum(
            (tip.by_along[f] * slope[f] for f in range(3)), start=np.zeros_like(tip.along)
        )
        return by + tip.arm

    def on_turn(self, n: int) -> "OnTurn":
        """Return belt and road over n angles from -pi."""
        grid = to_grid(*self.size, n)
        u, v, psi, bend = (f.reshape(len(self), -1) @ grid.T for f in self.z[[0, 1, 2, 5]])
        phi = -np.pi + 2.0 * np.pi * np.arange(n) / n
        at = tip(u, v, psi, bend, phi, self.constants)
        delta = at.down - (self.constants.free_radius - self.deflection)[:, None]
        push = pressure(delta, self.constants)[0]
        angle, q = self.mesh.node, self.constants.k_s[:, None] * self.x.node[..., 3]
        shear = np.stack([np.interp(phi, angle, row) for row in q])
        touches = delta > 0.0
        return OnTurn(phi, u, v, psi, delta, push, np.where(touches, shear, 0.0))

    def strain(self, gage: Gage, n: int) -> FloatArray:
        """Return the strain at gages over n angles from -pi."""
        return strain(self.z, self.constants, gage, self.size, n)


@dataclass(frozen=True, slots=True, eq=False)
class OnTurn:
    """Belt and road over even angles; arrays (n_points, n) but phi.

    Attributes
    ----------
    phi : shape (n,), [rad]
    u, v, psi : [m], [m], [rad]
        Displacement outward and along +phi, turn of the section.
    delta : [m]
        Overlap of tread and road; negative is clearance.
    pressure, shear : [N/m]
        Force of the road per length of belt: upward, and along its own motion.
    """

    phi: FloatArray
    u: FloatArray
    v: FloatArray
    psi: FloatArray
    delta: FloatArray
    pressure: FloatArray
    shear: FloatArray

    @property
    def edges(self) -> FloatArray:
        """Where the contact begins and ends, between the angles, (n_points, 2), [rad]."""
        out = np.empty((len(self.delta), 2))
        for row, d in enumerate(self.delta):
            inside = np.flatnonzero(d > 0.0)
            for side, (first, second) in enumerate(
                ((inside[0] - 1, inside[0]), (inside[-1] + 1, inside[-1]))
            ):
                share = d[second] / (d[second] - d[first])
                out[row, side] = self.phi[second] + share * (self.phi[first] - self.phi[second])
        return out


Start = Rolling | Unknowns
"""Start of a solution: another solution, or unknowns."""


def solve(
    k: Constants, *, start: Start | None = None, fine: int = FINE, coarse: int = COARSE
) -> Rolling:
    """Return the rolling ring under its loads.

    Parameters
    ----------
    k : Constants
    start : Rolling or Unknowns, optional
        A solution nearby, on the same mesh; saves time, the result is the same.
    fine, coarse : int
        Elements where the road can touch, and on each side of the rest.

    Raises
    ------
    ParameterError
        If a constant is no tire's, a load is too small for the elements (`SMALLEST_ANGLE`), or the
        tread is pressed through.
    ConvergenceError
        If Newton does not settle, or the contact outgrows the fine elements.
    """
    k.check()
    grid = mesh(fine, coarse)
    before = 0
    if start is None:
        start, before = _cold(k, grid)
    x = start.x if isinstance(start, Rolling) else start
    x, iterations = _newton(k, x, grid, TOLERANCE)
    _, z, c = residual(x, k, grid)
    found = Rolling(k, x, grid, z, c, before + iterations, (fine, coarse))
    _check(found)
    return found


def slopes(found: Rolling, by: Sequence[Unknowns]) -> list[Unknowns]:
    """Return how the solution moves for slopes of the residual, by the implicit function."""
    derivative = matrix(found.x, found.z, found.contact, found.constants, found.mesh)
    step = Factors.of(derivative).solve(np.concatenate([_column(each) for each in by], axis=2))
    return [_unknowns(-step[..., j]) for j in range(step.shape[2])]


def _newton(k: Constants, start: Unknowns, grid: Mesh, tolerance: float) -> tuple[Unknowns, int]:
    """Return the solution to a tolerance [m], and the iterations that it took.

    Near the solution the factored derivative serves for further steps, as long as they fall fast.
    """
    x = Unknowns(start.node.copy(), start.depth.copy(), start.rolling.copy())
    open_ = np.arange(len(k))
    factors, before = None, np.inf
    for iteration in range(MAX_ITERATIONS):
        part, here = k.take(open_), x.take(open_)
        rest, z, c = residual(here, part, grid)
        fresh = factors is None
        if factors is None:
            factors = Factors.of(matrix(here, z, c, part, grid))
        move = _unknowns(factors.solve(_column(rest))[..., 0])
        reach = np.abs(move.node[..., :3] * TURN).max(axis=(1, 2))
        reach = np.maximum(reach, np.maximum(np.abs(move.depth), np.abs(move.rolling)))
        if not np.isfinite(reach).all():
            break
        share = np.minimum(1.0, LONGEST_STEP / np.maximum(reach, 1e-300))
        if iteration > PATIENT:
            share = np.minimum(share, 0.5)
        after = here.plus(move, -share)
        x.node[open_], x.depth[open_], x.rolling[open_] = after.node, after.depth, after.rolling
        longest = float(reach.max())
        # a step with a kept derivative leaves as much less than itself as it is less than the last
        left = reach if fresh else reach * (longest / before / FALL)
        still = ~(left < tolerance)
        open_ = open_[still]
        if not open_.size:
            return x, iteration + 1
        near = longest < NEAR if fresh else longest < FALL * before
        factors, before = factors.take(still) if near else None, longest
    worst = int(open_[np.argmax(reach)])
    raise ConvergenceError(
        f"rolling ring: point {worst} at {k.load[worst]:.0f} N still moves by "
        f"{float(reach.max()):.1e} m after {iteration + 1} steps; use a smaller load, a stiffer "
        "belt or less friction",
        x.depth,
        float(reach.max()),
        point=worst,
    )


def _cold(k: Constants, grid: Mesh) -> tuple[Unknowns, int]:
    """Return a first start, and its iterations: frictionless, under a growing load."""
    n, total = len(k), 0
    x = Unknowns(np.zeros((n, grid.node.size, 4)), np.full(n, TOUCH), 0.98 * k.free_radius)
    for share in SHARES:
        smooth = k.but(k_s=np.zeros(n), load=share * k.load)
        x, iterations = _newton(smooth, x, grid, START_STEP)
        total += iterations
    return _gripped(k, x, grid), total


def _gripped(k: Constants, x: Unknowns, grid: Mesh) -> Unknowns:
    """Return a frictionless solution on a road that runs as fast as the tread's tip on average."""
    c = contact(x, by_element(x.node), k, grid)
    run = (np.diff(c.node.along) * c.touches).sum(axis=(1, 2))
    angle = (np.diff(grid.node_angles) * c.touches).sum(axis=(1, 2))
    speed = np.divide(run, angle, out=x.rolling.copy(), where=angle > 0.0)
    return Unknowns(x.node, x.depth, np.where(k.grips, speed, x.rolling))


def _check(found: Rolling) -> None:
    """Refuse a contact that the elements do not hold or resolve, and a tread pressed through."""
    k, delta = found.constants, found.contact.delta.reshape(len(found), -1)
    phi = np.broadcast_to(found.mesh.road.phi.ravel(), delta.shape)
    wide = np.maximum(delta[:, 0], delta[:, -1]) > 0.0
    if wide.any():
        point = int(np.flatnonzero(wide)[0])
        raise ConvergenceError(
            f"rolling ring: point {point} at {k.load[point]:.0f} N touches the road beyond "
            f"{PATCH} rad on a side; use a smaller load or check the stiffness",
            found.deflection,
            PATCH,
            point=point,
        )
    half = 0.5 * np.ptp(np.where(delta > 0.0, phi, 0.0), axis=1)
    small = half < SMALLEST_ANGLE
    if small.any():
        point = int(np.flatnonzero(small)[0])
        raise ParameterError(
            f"rolling ring: point {point} at {k.load[point]:.4g} N touches the road over a half "
            f"angle of {half[point]:.2g} rad; the elements resolve {SMALLEST_ANGLE} rad and more; "
            "use a larger load or a softer tread",
            point=point,
        )
    deepest = delta.max(axis=1)
    through = deepest >= k.thickness
    if through.any():
        point = int(np.flatnonzero(through)[0])
        raise ParameterError(
            f"rolling ring: point {point} at Fz = {k.load[point]:.0f} N, d0 = "
            f"{1e3 * found.deflection[point]:.2f} mm: tread pressed by {1e3 * deepest[point]:.3g} "
            f"mm; must stay below its thickness {1e3 * k.thickness[point]:.3g} mm (52); lower the "
            "load or check the tread's stiffness",
            point=point,
        )


def _column(x: Unknowns) -> FloatArray:
    """Return unknowns as (n_points, n_inner + BORDER, 1): inner nodes, first node, d, rho."""
    n = len(x.depth)
    return np.concatenate(
        [x.node[:, 1:].reshape(n, -1), x.node[:, 0], x.depth[:, None], x.rolling[:, None]], axis=1
    )[..., None]


def _unknowns(flat: FloatArray) -> Unknowns:
    n, inner = flat.shape[0], flat.shape[1] - BORDER
    node = np.concatenate([flat[:, inner : inner + 4], flat[:, :inner]], axis=1)
    return Unknowns(node.reshape(n, -1, 4), flat[:, -2].copy(), flat[:, -1].copy())
