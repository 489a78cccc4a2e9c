"""Newton's method for the contact with shear; the equations are in `shear_system`.

Friction makes the equations piecewise smooth, so this is a semismooth Newton method: each element's
derivative is that of the branch (sticking, sliding) that it is on. A step that makes the residual
grow is taken back and halved. Convergence is quadratic once no element changes its branch.
"""

import numpy as np

from tirelib.core.arrays import FloatArray, IntArray
from tirelib.physics.contact.checks import LARGEST_ANGLE
from tirelib.physics.contact.fourier import evaluate_fields, load_harmonics
from tirelib.physics.contact.free_boundary import Constant
from tirelib.physics.contact.radial import RadialContact
from tirelib.physics.contact.shear_system import (
    HEIGHT,
    LEAD,
    ROLL,
    TRAIL,
    Mesh,
    Patch,
    ShearProblem,
    System,
    assemble,
)
from tirelib.physics.ring.compliance import Compliance
from tirelib.physics.ring.ring import ComplexArray

CHUNK = 4
"""Points that are solved together: their matrices fit into the processor's cache."""

COARSE_NODES = 20
COARSE_TOLERANCE = 1e-3

TOLERANCE = 1e-9
"""Largest last full step of any unknown, [m] or [rad]; Newton's next would be its square."""

MAX_ITERATIONS = 60
SMALLEST_STEP = 2.0**-10
SOFTENING_STEP = 1e-6
"""Change of R_l for the derivative of a ring that depends on the deflection, [m]."""


def start(contact: RadialContact, mesh: Mesh) -> FloatArray:
    """Return the unknowns of a radial contact, with R_e of Eq. (103)."""
    x = np.zeros((len(contact), 3 * mesh.xi.size + 5))
    x[:, [LEAD, TRAIL]] = contact.edges
    x[:, HEIGHT] = np.asarray(contact.tread.free_radius, dtype=float) - contact.deflection
    move(x, contact.displacement, mesh)
    lead, (u, v, beta) = x[:, LEAD], x[:, :3].T
    radius = contact.compliance.radius
    depth = np.asarray(contact.tread.free_radius, dtype=float) - radius
    x[:, ROLL] = depth * np.sin(lead + beta) + (radius + u) * np.sin(lead) + v * np.cos(lead)
    x[:, ROLL] /= lead
    return x


def move(x: FloatArray, displacement: ComplexArray, mesh: Mesh) -> None:
    """Write the belt's displacement at the mesh's nodes into the unknowns."""
    phi, _ = mesh.place(x)
    x[:, :LEAD] = evaluate_fields(displacement, phi).reshape(len(x), -1)


class Newton:
    """All points on their way to the solution."""

    def __init__(self, problem: ShearProblem, mesh: Mesh, x: FloatArray) -> None:
        self.problem, self.mesh, self.x = problem, mesh, x
        n_points = len(x)
        self.base = x.copy()
        self.step = np.zeros_like(x)
        self.share = np.ones(n_points)
        self.rest = np.full(n_points, np.inf)
        self.change = np.full(n_points, np.inf)

    def run(self, tolerance: float) -> int:
        """Iterate until the last full step is below the tolerance; return the iterations."""
        todo = np.arange(len(self.x))
        iterations = 0
        while todo.size and iterations < MAX_ITERATIONS:
            iterations += 1
            softening = self._softening()
            ring = self.ring
            for first in range(0, todo.size, CHUNK):
                part = todo[first : first + CHUNK]
                soft = None if softening is None else softening[part]
                patch = Patch.of(self.problem.take(part), ring.take(part), self.mesh, self.x[part])
                self._advance(part, assemble(patch, soft))
            stuck = self.share < SMALLEST_STEP
            todo = np.flatnonzero(~(self.change < tolerance) & ~stuck)
        return iterations

    @property
    def deflection(self) -> FloatArray:
        """d0 of the present state, [m]."""
        out: FloatArray = np.asarray(self.problem.tread.free_radius) - self.x[:, HEIGHT]
        return out

    @property
    def ring(self) -> Compliance:
        """The ring at the present deflections."""
        return self.problem.at(self.deflection).spread(len(self.x))

    def _softening(self) -> ComplexArray | None:
        """Return d compliance / d R_l."""
        if isinstance(self.problem.at, Constant) or self.problem.deflection is not None:
            return None
        softer = self.problem.at(self.deflection - SOFTENING_STEP).matrix
        out: ComplexArray = (softer - self.ring.matrix) / SOFTENING_STEP
        return out

    def _advance(self, part: IntArray, system: System) -> None:
        """Accept the last step and take the next one, or halve it."""
        rest = np.abs(system.residual).max(axis=1)
        edges = self.x[part][:, [LEAD, TRAIL]]
        valid = (edges[:, 0] < edges[:, 1]) & (np.abs(edges).max(axis=1) < 1.5 * LARGEST_ANGLE)
        good = (rest <= np.maximum(self.rest[part], 1e-12)) & valid
        bad = part[~good]
        self.share[bad] *= 0.5
        ok = part[good]
        self.rest[ok], self.base[ok], self.share[ok] = rest[good], self.x[ok], 1.0
        step = np.linalg.solve(system.jacobian[good], -system.residual[good][..., None])[..., 0]
        self.step[ok] = step
        self.change[ok] = np.abs(step).max(axis=1)
        # an edge moves by a third of the half patch at most
        reach = (self.x[ok, TRAIL] - self.x[ok, LEAD]) / 6.0
        longest = np.abs(step[:, [LEAD, TRAIL]]).max(axis=1)
        self.share[ok] = np.minimum(1.0, reach / np.maximum(longest, 1e-300))
        self.x[part] = self.base[part] + self.share[part, None] * self.step[part]

    def refined(self, mesh: Mesh) -> FloatArray:
        """Return the present unknowns on another mesh."""
        ring = self.ring
        patch = Patch.of(self.problem, ring, self.mesh, self.x)
        weighted = patch.weights[..., None] * patch.tread.loads
        total = load_harmonics(patch.phi, weighted, ring.n_modes)
        if self.problem.extra is not None:
            total = total + self.problem.extra
        x = np.zeros((len(self.x), 3 * mesh.xi.size + 5))
        x[:, LEAD:] = self.x[:, LEAD:]
        move(x, (ring.matrix @ total[..., None])[..., 0], mesh)
        return x


def solve(problem: ShearProblem, first: RadialContact, n_nodes: int) -> tuple[Newton, int]:
    """Return the last state from a radial contact on, and the iterations."""
    mesh = Mesh.of(min(COARSE_NODES, n_nodes))
    coarse = Newton(problem, mesh, start(first, mesh))
    iterations = coarse.run(COARSE_TOLERANCE)
    fine_mesh = Mesh.of(n_nodes)
    lost = ~(coarse.change < COARSE_TOLERANCE)
    x = coarse.refined(fine_mesh)
    if lost.any():
        x[lost] = start(first, fine_mesh)[lost]
    fine = Newton(problem, fine_mesh, x)
    return fine, iterations + fine.run(TOLERANCE)
